"""ADAMS export of a walker: a dataset (.adm) with the commands (.acf) that run it, or the commands (.cmd) that build
the same objects in ADAMS View.

Commands are in the order in which View writes them: parts with their markers, joints, contacts and forces. All
functions come last, because a function may refer to any object.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

from walkerlab.exchange.adams_model import GROUND, ORIGIN, REFERENCE, AdamsContact, AdamsModel, values
from walkerlab.exchange.exported import finite

MAX_STEP_S = 1e-3
ERROR = 1e-6


def dataset_text(model: AdamsModel, head: Iterable[str]) -> str:
    return "\n".join([f"walkerlab model of {model.name}", *(f"! {line}" for line in head), *statements(model), ""])


def statements(model: AdamsModel) -> Iterator[str]:
    """Yield the lines of all statements. Objects of each kind are numbered from 1. Part 1 is the ground."""
    ids = model.numbers

    def expression(text: str) -> str:
        return REFERENCE.sub(lambda match: str(ids[match[1]]), text)

    def numbered(kind: str, name: str, *arguments: str) -> Iterator[str]:
        return named_statement(name, f"{kind}/{ids[name]}", *arguments)

    yield from statement("UNITS/", "FORCE = NEWTON", "MASS = KILOGRAM", "LENGTH = MILLIMETER", "TIME = SECOND")
    for number, name in enumerate((GROUND, *model.parts), start=1):
        yield from named_statement(name, f"PART/{number}", *part_arguments(model, name, ids))
        for marker_name, marker in model.markers.items():
            if marker.part == name:
                place = "FLOATING" if marker.floating else f"QP = {values(*marker.place)}"
                short_name = marker_name.rpartition(".")[2]
                yield from named_statement(short_name, f"MARKER/{ids[marker_name]}", f"PART = {number}", place)
    for name, joint in model.joints.items():
        kind = "JPRIM" if joint.kind == "INLINE" else "JOINT"
        yield from numbered(kind, name, joint.kind, f"I = {ids[joint.i]}", f"J = {ids[joint.j]}")
    for name, weights in model.couplers.items():
        coupled = ", ".join(str(ids[joint]) for joint in weights)
        kinds_of_joint = ":".join("R" for _ in weights)
        scales = f"SCALES = {values(*weights.values())}"
        yield from numbered("COUPLER", name, f"JOINTS = {coupled}", f"TYPE = {kinds_of_joint}", scales)
    for name, shape in model.shapes.items():
        box = shape.kind == "BOX"
        where = f"{'CORNER' if box else 'CM'} = {ids[shape.marker]}"
        edges = zip("XYZ", shape.size, strict=True)
        sizes = (f"{axis}{'' if box else 'SCALE'} = {finite(edge)}" for axis, edge in edges)
        yield from numbered("GRAPHICS", name, shape.kind, where, *sizes)
    for name, ends in model.outlines.items():
        yield from numbered("GRAPHICS", name, f"OUTLINE = {', '.join(str(ids[end]) for end in ends)}")
    for name, contact in model.contacts.items():
        yield from numbered("CONTACT", name, *contact_arguments(contact, ids))
    for name, function in model.variables.items():
        yield from numbered("VARIABLE", name, f"FUNCTION = {expression(function)}")
    for name, force in model.forces.items():
        # If a statement has several functions, all but the last must end in a backslash.
        yield from numbered(
            "GFORCE", name, f"I = {ids[force.i]}", f"JFLOAT = {ids[force.reaction]}",
            f"RM = {ids[ORIGIN]}", f"FX = {expression(force.x)}\\", f"FY = {expression(force.y)}\\",
            "FZ = 0\\", "TX = 0\\", "TY = 0\\", f"TZ = {expression(force.torque)}",
        )  # fmt: skip
    for name, torque in model.torques.items():
        ends = f"I = {ids[torque.i]}", f"J = {ids[torque.j]}"
        yield from numbered("SFORCE", name, "ROTATIONAL", *ends, f"FUNCTION = {expression(torque.function)}")
    for name, held in model.motions.items():
        yield from numbered("MOTION", name, f"JOINT = {ids[held]}", "ROTATION", "VELOCITY", "FUNCTION = 0")
    for name, sensor in model.sensors.items():
        yield from numbered(
            "SENSOR", name, "GE", "VALUE = 0", f"ERROR = {finite(sensor.error)}",
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
    # REULER turns about z, then x, then z, so one angle is enough for a turn in the plane. VX and VY are the velocity
    # of the centre of mass along the ground's axes.
    yield from (f"QG = {values(x, y, 0)}", f"REULER = {values(part.angle, 0, 0)}")
    yield from (f"VX = {values(vx)}", f"VY = {values(vy)}", "VZ = 0", "WX = 0", "WY = 0", f"WZ = {values(part.spin)}")
    yield from (f"MASS = {values(part.mass)}", f"CM = {ids[part.centre]}")
    # Only the moment about the normal of the plane matters to the walk. ADAMS needs three, and a body with three equal
    # moments can exist.
    yield f"IP = {values(part.inertia, part.inertia, part.inertia)}"


def named_statement(name: str, head: str, *arguments: str) -> Iterator[str]:
    """Yield a comment that names an object for Adams View, then the statement of the object."""
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
    # ADAMS keeps lines within about 80 columns.
    yield "JGEOM = " + "\n, ".join(", ".join(pads[k : k + 10]) for k in range(0, len(pads), 10))
    yield "IMPACT"
    yield from (f"{name.upper()} = {finite(value)}" for name, value in contact.normal.items())
    yield f"COULOMB_FRICTION = {'ON' if contact.friction else 'OFF'}"
    yield from (f"{name.upper()} = {finite(value)}" for name, value in contact.friction.items())


def command_text(model: AdamsModel, dataset: str, end_s: float, pinned_until_s: float | None) -> str:
    """Write the command file that simulates walkerlab's walk: a header, and the commands of `AdamsModel.commands`."""
    solver = f"integrator/hht, error = {finite(ERROR)}, hmax = {finite(MAX_STEP_S)}"
    commands = model.commands(end_s, pinned_until_s)
    return "\n".join([dataset, dataset.removesuffix(".adm"), solver, *commands, "stop", ""])


Naming = Callable[[str], str]


def view_text(model: AdamsModel, head: Iterable[str], end_s: float, pinned_until_s: float | None = None) -> str:
    """Write the commands that build a model, with a header comment and a script that simulates it up to an end time.

    pinned_until_s  time (s) at which to remove the pin at the first stance foot, or None if there is no pin
    """
    lines = ["! CMD Version:2", *(f"! {line}" for line in head)]
    commands = ", ".join(map(quote, model.commands(end_s, pinned_until_s)))
    script = command("simulation script create", sim_script_name=f".{model.name}.walk", solver_commands=commands)
    lines += [line for each in (*build_commands(model), script) for line in each]
    return "\n".join([*lines, ""])


def command(words: str, **arguments: str) -> list[str]:
    """Write a command with one argument per line."""
    lines = [words, *(f"   {key} = {value}" for key, value in arguments.items())]
    return [*(f"{line}  &" for line in lines[:-1]), lines[-1]]


def quote(text: str) -> str:
    return f'"{text}"'


def build_commands(model: AdamsModel) -> Iterator[list[str]]:
    def full(name: str) -> str:
        return f".{model.name}.{name}"

    def function(text: str) -> str:
        return quote(REFERENCE.sub(lambda match: full(match[1]), text))

    yield command("defaults units", length="mm", angle="rad", force="newton", mass="kg", time="sec")
    yield command("defaults units", coordinate_system_type="cartesian", orientation_type="body313")
    yield command("model create", model_name=model.name)
    yield from bodies(model, full)
    for name in model.variables:
        yield command("data_element create variable", variable_name=full(name), function=quote(""))
    for name, joint in model.joints.items():
        kind = "primitive_joint inline" if joint.kind == "INLINE" else f"joint {joint.kind.lower()}"
        named = {"jprim_name": full(name), "adams_id": "1"} if joint.kind == "INLINE" else {"joint_name": full(name)}
        yield command(f"constraint create {kind}", **named, i_marker_name=full(joint.i), j_marker_name=full(joint.j))
    for name, weights in model.couplers.items():
        yield command(
            "constraint create complex_joint coupler", coupler_name=full(name),
            joint_name=", ".join(map(full, weights)), type_of_freedom="_".join("rot" for _ in weights),
            motion_multipliers=values(*weights.values()),
        )  # fmt: skip
    yield from contacts(model, full)
    for name, force in model.forces.items():
        empty = {f"{axis}_{kind}_function": quote("") for kind in ("force", "torque") for axis in "xyz"}
        yield command(
            "force create direct general_force", general_force_name=full(name), i_marker_name=full(force.i),
            j_floating_marker_name=full(force.reaction), ref_marker_name=full(ORIGIN), **empty,
        )  # fmt: skip
    for name, torque in model.torques.items():
        yield command(
            "force create direct single_component_force", single_component_force_name=full(name),
            adams_id=str(model.numbers[name]), type_of_freedom="rotational", i_marker_name=full(torque.i),
            j_marker_name=full(torque.j), action_only="off", function=quote(""),
        )  # fmt: skip
    for name, held in model.motions.items():
        yield command(
            "constraint create motion_generator", motion_name=full(name), adams_id=str(model.numbers[name]),
            type_of_freedom="rotational", joint_name=full(held), time_derivative="velocity", function=quote("0"),
        )  # fmt: skip
    for name, sensor in model.sensors.items():
        ending = {"halt": "on", "return": "off"} if sensor.halts else {"halt": "off", "return": "on"}
        yield command(
            "executive_control create sensor", sensor_name=full(name), adams_id=str(model.numbers[name]), compare="ge",
            value="0", error=finite(sensor.error), **ending, function=quote(""),
        )  # fmt: skip
    along, up = (finite(component) for component in model.gravity)
    gravity = {"x_component_gravity": along, "y_component_gravity": up, "z_component_gravity": "0"}
    yield command("force create body gravitational", gravity_field_name=full("gravity"), **gravity)
    for name, components in model.requests.items():
        functions = {f"f{k}": function(text) for k, text in enumerate(components.values(), start=1)}
        yield command(
            "output_control create request", request_name=full(f"request_{name}"), results_name=quote(name),
            component_names=", ".join(quote(component) for component in components), **functions,
        )  # fmt: skip
    for name, text in model.variables.items():
        yield command("data_element modify variable", variable_name=full(name), function=function(text))
    for name, force in model.forces.items():
        yield command(
            "force modify direct general_force", general_force_name=full(name), x_force_function=function(force.x),
            y_force_function=function(force.y), z_force_function=quote("0"), x_torque_function=quote("0"),
            y_torque_function=quote("0"), z_torque_function=function(force.torque),
        )  # fmt: skip
    for name, torque in model.torques.items():
        yield command(
            "force modify direct single_component_force", single_component_force_name=full(name),
            function=function(torque.function),
        )  # fmt: skip
    for name, sensor in model.sensors.items():
        yield command("executive_control modify sensor", sensor_name=full(name), function=function(sensor.function))


def bodies(model: AdamsModel, full: Naming) -> Iterator[list[str]]:
    """Yield commands for parts, markers, masses, velocities and shapes. Angular velocities include their unit."""
    for number, (name, part) in enumerate([(GROUND, None), *model.parts.items()], start=1):
        if part is not None:
            yield command(
                "part create rigid_body name_and_position", part_name=full(name), adams_id=str(number),
                location=values(*part.place, 0.0), orientation=format_rotation(part.angle),
            )  # fmt: skip
        # Locations of markers are relative to the part that carries them.
        yield command("defaults coordinate_system", default_coordinate_system=full(name))
        for marker_name, marker in model.markers.items():
            if marker.part == name and marker.floating:
                yield command("floating_marker create", floating_marker_name=full(marker_name))
            elif marker.part == name:
                place = {"location": values(*marker.place), "orientation": format_rotation(0.0)}
                yield command("marker create", marker_name=full(marker_name), **place)
        if part is not None:
            moments = dict.fromkeys(("ixx", "iyy", "izz"), finite(part.inertia))
            products = dict.fromkeys(("ixy", "izx", "iyz"), "0")
            yield command(
                "part create rigid_body mass_properties", part_name=full(name), mass=finite(part.mass),
                center_of_mass_marker=full(part.centre), **moments, **products,
            )  # fmt: skip
            vx, vy = (finite(component) for component in part.velocity)
            motion = {"vx": vx, "vy": vy, "vz": "0", "wx": "0", "wy": "0", "wz": f"({finite(part.spin)}(rad/sec))"}
            yield command("part create rigid_body initial_velocity", part_name=full(name), **motion)
    for name, shape in model.shapes.items():
        shape_path = full(model.shape_name(name))
        sizes = [finite(edge) for edge in shape.size]
        if shape.kind == "BOX":
            corner = {"corner_marker": full(shape.marker), "diag_corner_coords": ", ".join(sizes)}
            yield command("geometry create shape block", block_name=shape_path, **corner)
        else:
            scales = {f"{axis}_scale_factor": size for axis, size in zip("xyz", sizes, strict=True)}
            centre = {"center_marker": full(shape.marker)}
            yield command("geometry create shape ellipsoid", ellipsoid_name=shape_path, **centre, **scales)
    for name, ends in model.outlines.items():
        shape_path = full(f"{model.markers[ends[0]].part}.{name}")
        points = ", ".join(full(end) for end in ends)
        yield command("geometry create curve outline", outline_name=shape_path, marker_name=points)


def format_rotation(angle: float) -> str:
    """Write a rotation by `angle` (rad) about the normal of the plane, with its unit."""
    return f"({finite(angle)}(rad)), (0(rad)), (0(rad))"


def contacts(model: AdamsModel, full: Naming) -> Iterator[list[str]]:
    for name, contact in model.contacts.items():
        shapes = [full(model.shape_name(shape)) for shape in (contact.foot, *contact.pads)]
        normal, friction = (
            {name: finite(value) for name, value in law.items()} for law in (contact.normal, contact.friction)
        )
        yield command(
            "contact create", contact_name=full(name), type="solid_to_solid", i_geometry_name=shapes[0],
            j_geometry_name=", ".join(shapes[1:]), **normal, coulomb_friction="on" if friction else "off", **friction,
        )  # fmt: skip
