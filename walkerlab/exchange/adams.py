"""ADAMS/Solver export: the dataset (.adm) of a walker, and the commands (.acf) that run it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from walkerlab.exchange.adams_model import GROUND, AdamsContact, AdamsModel
from walkerlab.exchange.exported import Exported, finite

REFERENCE = re.compile(r"\{([\w.]+)\}")
MAX_STEP_S, ERROR, OUTPUT_S = 1e-3, 1e-6, 1e-3
Ids = dict[str, int]


def dataset_text(model: AdamsModel, head: Iterable[str]) -> str:
    return "\n".join([f"walkerlab model of {model.name}", *(f"! {line}" for line in head), *statements(model), ""])


def statements(model: AdamsModel) -> Iterator[str]:
    """Yield the lines of all statements; objects of each kind are numbered from 1, and part 1 is the ground."""
    parts = {name: number for number, name in enumerate((GROUND, *model.parts), start=1)}
    markers, shapes, joints, primitives, contacts, variables = (
        numbered(names)
        for names in (
            model.markers, model.shapes, [name for name, joint in model.joints.items() if joint.kind != "INLINE"],
            [name for name, joint in model.joints.items() if joint.kind == "INLINE"], model.contacts, model.variables,
        )
    )  # fmt: skip
    ids = {**variables, **contacts, **markers}

    def expression(text: str) -> str:
        return REFERENCE.sub(lambda match: str(ids[match[1]]), text)

    yield from statement("UNITS/", "FORCE = NEWTON", "MASS = KILOGRAM", "LENGTH = MILLIMETER", "TIME = SECOND")
    for name, identity in parts.items():
        yield view_name(name)
        if name == GROUND:
            yield from statement(f"PART/{identity}", "GROUND")
        else:
            part = model.parts[name]
            (x, y), (vx, vy) = part.place, part.velocity
            yield from statement(
                f"PART/{identity}", f"QG = {values(x, y, 0)}", f"REULER = {values(part.angle, 0, 0)}",
                f"VX = {values(vx)}", f"VY = {values(vy)}", "VZ = 0", "WX = 0", "WY = 0", f"WZ = {values(part.spin)}",
                f"MASS = {values(part.mass)}", f"CM = {markers[part.centre]}",
                f"IP = {values(part.inertia, part.inertia, part.inertia)}",
            )  # fmt: skip
        for marker_name, marker in model.markers.items():
            if marker.part == name:
                yield view_name(marker_name.rpartition(".")[2])
                place = "FLOATING" if marker.floating else f"QP = {values(*marker.place)}"
                yield from statement(f"MARKER/{markers[marker_name]}", f"PART = {identity}", place)
    for name, joint in model.joints.items():
        head = f"JPRIM/{primitives[name]}" if name in primitives else f"JOINT/{joints[name]}"
        yield view_name(name)
        yield from statement(head, joint.kind, f"I = {markers[joint.i]}", f"J = {markers[joint.j]}")
    for number, (name, weights) in enumerate(model.couplers.items(), start=1):
        yield view_name(name)
        coupled = ", ".join(str(joints[joint]) for joint, _ in weights)
        kinds, scales = ":".join("R" for _ in weights), values(*(weight for _, weight in weights))
        yield from statement(f"COUPLER/{number}", f"JOINTS = {coupled}", f"TYPE = {kinds}", f"SCALES = {scales}")
    for name, shape in model.shapes.items():
        yield view_name(name)
        box = shape.kind == "BOX"
        where = f"{'CORNER' if box else 'CM'} = {markers[shape.marker]}"
        edges = zip("XYZ", shape.size, strict=True)
        sizes = (f"{axis}{'' if box else 'SCALE'} = {finite(edge)}" for axis, edge in edges)
        yield from statement(f"GRAPHICS/{shapes[name]}", shape.kind, where, *sizes)
    for number, (name, ends) in enumerate(model.outlines.items(), start=len(shapes) + 1):
        yield view_name(name)
        yield from statement(f"GRAPHICS/{number}", f"OUTLINE = {', '.join(str(markers[end]) for end in ends)}")
    for name, contact in model.contacts.items():
        yield view_name(name)
        yield from statement(f"CONTACT/{contacts[name]}", *contact_arguments(contact, shapes))
    for name, function in model.variables.items():
        yield view_name(name)
        yield from statement(f"VARIABLE/{variables[name]}", f"FUNCTION = {expression(function)}")
    for number, (name, force) in enumerate(model.forces.items(), start=1):
        yield view_name(name)
        yield from statement(
            f"GFORCE/{number}", f"I = {markers[force.i]}", f"JFLOAT = {markers[force.reaction]}",
            f"RM = {markers['ground.origin']}", f"FX = {expression(force.x)}\\", f"FY = {expression(force.y)}\\",
            "FZ = 0\\", "TX = 0\\", "TY = 0\\", f"TZ = {expression(force.torque)}",
        )  # fmt: skip
    for number, (name, torque) in enumerate(model.torques.items(), start=1):
        yield view_name(name)
        ends = f"I = {markers[torque.i]}", f"J = {markers[torque.j]}"
        yield from statement(f"SFORCE/{number}", "ROTATIONAL", *ends, f"FUNCTION = {expression(torque.function)}")
    along, up = model.gravity
    gravity = f"IGRAV = {finite(along)}", f"JGRAV = {finite(up)}", "KGRAV = 0"
    yield from statement("ACCGRAV/", *gravity)
    for number, (name, components) in enumerate(model.requests.items(), start=1):
        yield view_name(f"request_{name}")
        columns = ", ".join(f'"{component}"' for component in components)
        functions = [f"F{k} = {expression(text)}" for k, text in enumerate(components.values(), start=1)]
        yield from statement(
            f"REQUEST/{number}", f"RESULTS_NAME = {name}", f"CNAMES = {columns}",
            *(f"{text}\\" for text in functions[:-1]), functions[-1],
        )  # fmt: skip
    yield from statement("OUTPUT/", "REQSAVE", "GRSAVE")
    yield from statement("RESULTS/", "FORMATTED", "XRF")
    yield from statement("INTEGRATOR/", "HHT", f"ERROR = {finite(ERROR)}", f"HMAX = {finite(MAX_STEP_S)}")
    yield "END"


def numbered(names: Iterable[str]) -> Ids:
    return {name: number for number, name in enumerate(names, start=1)}


def values(*numbers: float) -> str:
    return ", ".join(finite(number) for number in numbers)


def view_name(name: str) -> str:
    """Return the comment that names the next statement's object in Adams View."""
    return f"!                adams_view_name='{name}'"


def statement(head: str, *arguments: str) -> Iterator[str]:
    """Yield the lines of a statement, one argument per line."""
    yield head
    yield from (f", {argument}" for argument in arguments)


def contact_arguments(contact: AdamsContact, shapes: Mapping[str, int]) -> Iterator[str]:
    pads = [str(shapes[pad]) for pad in contact.pads]
    yield "TYPE = SOLID_TO_SOLID"
    yield f"IGEOM = {shapes[contact.foot]}"
    yield "JGEOM = " + "\n, ".join(", ".join(pads[k : k + 10]) for k in range(0, len(pads), 10))
    yield "IMPACT"
    normal, friction = contact.normal, contact.friction
    yield f"STIFFNESS = {finite(normal.stiffness)}"
    yield f"DAMPING = {finite(normal.damping)}"
    yield f"DMAX = {finite(normal.full_damping_penetration)}"
    yield f"EXPONENT = {finite(normal.exponent)}"
    yield f"COULOMB_FRICTION = {'OFF' if friction is None else 'ON'}"
    if friction is not None:
        yield f"MU_STATIC = {finite(friction.static)}"
        yield f"MU_DYNAMIC = {finite(friction.dynamic)}"
        yield f"STICTION_TRANSITION_VELOCITY = {finite(friction.stiction_velocity)}"
        yield f"FRICTION_TRANSITION_VELOCITY = {finite(friction.friction_velocity)}"


def command_text(export: Exported, dataset: str) -> str:
    """Write the commands that simulate walkerlab's walk to its end; a pinned foot is released at the first touch."""
    lines = [dataset, dataset.removesuffix(".adm")]
    lines.append(f"integrator/hht, error = {finite(ERROR)}, hmax = {finite(MAX_STEP_S)}")
    if export.pinned and export.touches_s:
        first = finite(export.touches_s[0])
        lines += [f"simulate/dynamic, end = {first}, dtout = {finite(OUTPUT_S)}", "deactivate/jprim, id = 1"]
    lines += [f"simulate/dynamic, end = {finite(export.end_s)}, dtout = {finite(OUTPUT_S)}", "stop"]
    return "\n".join([*lines, ""])
