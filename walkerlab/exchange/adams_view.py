"""Adams View export: the commands (.cmd) that build a walker from the same objects as the dataset.

Objects are in the order in which View writes them: parts with their markers, joints, contacts, forces, and finally
all functions, because a function may refer to any object.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from walkerlab.exchange.adams_model import GROUND, ORIGIN, REFERENCE, AdamsModel, values
from walkerlab.exchange.exported import finite

Naming = Callable[[str], str]


def view_text(model: AdamsModel, head: Iterable[str], end_s: float, pinned_until_s: float | None = None) -> str:
    """Write the commands that build a model, with a header comment and a script that simulates it up to an end time.

    pinned_until_s  time (s) at which to remove the pin at the first stance foot; None if there is no pin
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
    root = f".{model.name}"

    def full(name: str) -> str:
        return f"{root}.{name}"

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
