"""ADAMS/Solver export: the dataset (.adm) of a walker, and the commands (.acf) that run it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from walkerlab.exchange.adams_model import GROUND, ORIGIN, REFERENCE, AdamsContact, AdamsModel, values
from walkerlab.exchange.exported import finite

MAX_STEP_S = 1e-3
ERROR = 1e-6


def dataset_text(model: AdamsModel, head: Iterable[str]) -> str:
    return "\n".join([f"walkerlab model of {model.name}", *(f"! {line}" for line in head), *statements(model), ""])


def statements(model: AdamsModel) -> Iterator[str]:
    """Yield the lines of all statements. Objects of each kind are numbered from 1, and part 1 is the ground."""
    ids = model.numbers

    def expression(text: str) -> str:
        return REFERENCE.sub(lambda match: str(ids[match[1]]), text)

    yield from statement("UNITS/", "FORCE = NEWTON", "MASS = KILOGRAM", "LENGTH = MILLIMETER", "TIME = SECOND")
    for number, name in enumerate((GROUND, *model.parts), start=1):
        yield from named_statement(name, f"PART/{number}", *part_arguments(model, name, ids))
        for marker_name, marker in model.markers.items():
            if marker.part == name:
                place = "FLOATING" if marker.floating else f"QP = {values(*marker.place)}"
                short_name = marker_name.rpartition(".")[2]
                yield from named_statement(short_name, f"MARKER/{ids[marker_name]}", f"PART = {number}", place)
    for name, joint in model.joints.items():
        head = f"{'JPRIM' if joint.kind == 'INLINE' else 'JOINT'}/{ids[name]}"
        yield from named_statement(name, head, joint.kind, f"I = {ids[joint.i]}", f"J = {ids[joint.j]}")
    for name, weights in model.couplers.items():
        coupled = ", ".join(str(ids[joint]) for joint in weights)
        kinds_of_joint = ":".join("R" for _ in weights)
        scales = f"SCALES = {values(*weights.values())}"
        yield from named_statement(
            name, f"COUPLER/{ids[name]}", f"JOINTS = {coupled}", f"TYPE = {kinds_of_joint}", scales
        )
    for name, shape in model.shapes.items():
        box = shape.kind == "BOX"
        where = f"{'CORNER' if box else 'CM'} = {ids[shape.marker]}"
        edges = zip("XYZ", shape.size, strict=True)
        sizes = (f"{axis}{'' if box else 'SCALE'} = {finite(edge)}" for axis, edge in edges)
        yield from named_statement(name, f"GRAPHICS/{ids[name]}", shape.kind, where, *sizes)
    for name, ends in model.outlines.items():
        yield from named_statement(
            name, f"GRAPHICS/{ids[name]}", f"OUTLINE = {', '.join(str(ids[end]) for end in ends)}"
        )
    for name, contact in model.contacts.items():
        yield from named_statement(name, f"CONTACT/{ids[name]}", *contact_arguments(contact, ids))
    for name, function in model.variables.items():
        yield from named_statement(name, f"VARIABLE/{ids[name]}", f"FUNCTION = {expression(function)}")
    for name, force in model.forces.items():
        # Of several functions in a statement, all but the last end in a backslash.
        yield from named_statement(
            name, f"GFORCE/{ids[name]}", f"I = {ids[force.i]}", f"JFLOAT = {ids[force.reaction]}",
            f"RM = {ids[ORIGIN]}", f"FX = {expression(force.x)}\\", f"FY = {expression(force.y)}\\",
            "FZ = 0\\", "TX = 0\\", "TY = 0\\", f"TZ = {expression(force.torque)}",
        )  # fmt: skip
    for name, torque in model.torques.items():
        ends = f"I = {ids[torque.i]}", f"J = {ids[torque.j]}"
        yield from named_statement(
            name, f"SFORCE/{ids[name]}", "ROTATIONAL", *ends, f"FUNCTION = {expression(torque.function)}"
        )
    for name, held in model.motions.items():
        how = f"JOINT = {ids[held]}", "ROTATION", "VELOCITY", "FUNCTION = 0"
        yield from named_statement(name, f"MOTION/{ids[name]}", *how)
    for name, sensor in model.sensors.items():
        yield from named_statement(
            name, f"SENSOR/{ids[name]}", "GE", "VALUE = 0", f"ERROR = {finite(sensor.error)}",
            "HALT" if sensor.halts else "RETURN", f"FUNCTION = {expression(sensor.function)}",
        )  # fmt: skip
    along, up = model.gravity
    yield from statement("ACCGRAV/", f"IGRAV = {finite(along)}", f"JGRAV = {finite(up)}", "KGRAV = 0")
    for number, (name, components) in enumerate(model.requests.items(), start=1):
        columns = ", ".join(f'"{component}"' for component in components)
        functions = [f"F{k} = {expression(text)}" for k, text in enumerate(components.values(), start=1)]
        yield from named_statement(
            f"request_{name}", f"REQUEST/{number}", f"RESULTS_NAME = {name}", f"CNAMES = {columns}",
            *(f"{text}\\" for text in functions[:-1]), functions[-1],
        )  # fmt: skip
    yield from statement("OUTPUT/", "REQSAVE", "GRSAVE")
    yield from statement("RESULTS/", "FORMATTED", "XRF")
    yield from statement("INTEGRATOR/", "HHT", f"ERROR = {finite(ERROR)}", f"HMAX = {finite(MAX_STEP_S)}")
    yield "END"


def part_arguments(model: AdamsModel, name: str, ids: Mapping[str, int]) -> Iterator[str]:
    if name == GROUND:
        yield "GROUND"
        return
    part = model.parts[name]
    (x, y), (vx, vy) = part.place, part.velocity
    yield from (f"QG = {values(x, y, 0)}", f"REULER = {values(part.angle, 0, 0)}")
    yield from (f"VX = {values(vx)}", f"VY = {values(vy)}", "VZ = 0", "WX = 0", "WY = 0", f"WZ = {values(part.spin)}")
    yield from (f"MASS = {values(part.mass)}", f"CM = {ids[part.centre]}")
    # Only the moment about the plane's normal matters to the walk. Three equal moments are those of a possible body.
    yield f"IP = {values(part.inertia, part.inertia, part.inertia)}"


def named_statement(name: str, head: str, *arguments: str) -> Iterator[str]:
    """Yield a statement after the comment that names its object in Adams View."""
    yield f"!                adams_view_name='{name}'"
    yield from statement(head, *arguments)


def statement(head: str, *arguments: str) -> Iterator[str]:
    """Yield the lines of a statement, one argument per line."""
    yield head
    yield from (f", {argument}" for argument in arguments)


def contact_arguments(contact: AdamsContact, ids: Mapping[str, int]) -> Iterator[str]:
    pads = [str(ids[pad]) for pad in contact.pads]
    yield "TYPE = SOLID_TO_SOLID"
    yield f"IGEOM = {ids[contact.foot]}"
    yield "JGEOM = " + "\n, ".join(", ".join(pads[k : k + 10]) for k in range(0, len(pads), 10))
    yield "IMPACT"
    yield from (f"{name.upper()} = {finite(value)}" for name, value in contact.normal.items())
    yield f"COULOMB_FRICTION = {'ON' if contact.friction else 'OFF'}"
    yield from (f"{name.upper()} = {finite(value)}" for name, value in contact.friction.items())


def command_text(model: AdamsModel, dataset: str, end_s: float, pinned_until_s: float | None) -> str:
    """Write the commands of `AdamsModel.commands`, which simulate walkerlab's walk, with a header."""
    head = [
        dataset,
        dataset.removesuffix(".adm"),
        f"integrator/hht, error = {finite(ERROR)}, hmax = {finite(MAX_STEP_S)}",
    ]
    return "\n".join([*head, *model.commands(end_s, pinned_until_s), "stop", ""])
