"""MJCF export: a planar walker in MuJoCo's language, with MuJoCo's soft contact tuned to the ADAMS contact law.

MuJoCo scales a contact by w, the sum of `body_invweight0` (1/kg) of its two bodies. With constant impedance d,
stiffness K and damping B (solref -K, -B), a foot rests at a penetration of (1 - d) w N / K under a load N, and creeps
at (1 - d) w T / (impratio B) under a tangential load T. So a solref of (-w k, -w c) makes any foot a spring k and a
damper c, whose forces are divided by 1 - d.

w is 1/mass for a free ball. For a link of a walker it is a mean over three directions in the model's zero position, and
differs between equal legs. With the flag `diagexact` (MuJoCo 3.10), MuJoCo uses a contact's own inverse mass instead.

Source: MuJoCo documentation, Computation: constraint model, and Modeling: solver parameters; MuJoCo 4.0.0,
engine_setconst.c, function set0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from walkerlab.config.drives import Hip
from walkerlab.errors import ConfigError
from walkerlab.exchange.engine_scene import EngineContact, contact_target
from walkerlab.exchange.exported import Exported, Pad
from walkerlab.exchange.planar import UPRIGHT, Ball, PlanarModel
from walkerlab.physics.mechanics.parts import Position
from walkerlab.physics.solvers.system import Floats

MIN_INERTIA = 2e-15  # kg m^2, twice MuJoCo's minimum
IMPEDANCE = 0.1  # small, so that MuJoCo's soft contact behaves like a plain spring and damper that carry the full load
JOINT_AXES = {"along": ("slide", "1 0 0"), "height": ("slide", "0 0 1"), "turn": ("hinge", "0 -1 0")}
STEP_S, PAD_M = 1e-4, 0.05
HIP = "hip"
COUPLING_SETTINGS = 'solref="0.0005 1" solimp="0.9999 0.9999 0.001 0.5 2"'
"""Settings that make couplings as stiff as MuJoCo's constraints can be with time steps of STEP_S."""
CLOSE = 'iterations="100" tolerance="1e-12"'


@dataclass(frozen=True)
class Foot:
    """Ball of a foot: name, collision group, position across the walk (m), and whether its leg is drawn."""

    name: str
    group: int = 1
    across_m: float = 0.0
    drawn: bool = False


FEET = (Foot("foot 0"), Foot("foot 1"))


def contact_settings(target: EngineContact) -> dict[str, float]:
    """Compute settings of MuJoCo's contact for the target, by the formulas at the top of this module.

    Exports and engines use the same settings for every foot; `foot_text` turns them into a solref.
    Raises ConfigError for a target without damping.
    """
    if target.damping_ratio == 0.0:
        raise ConfigError(
            "MuJoCo's contact needs damping: without it, its friction has no damping either.",
            "Set contact.damping above 0.",
        )
    stiffness = (1.0 - IMPEDANCE) * target.mass * target.gravity / target.penetration
    damping = 2.0 * target.damping_ratio * math.sqrt((1.0 - IMPEDANCE) * target.gravity / target.penetration)
    creep = (1.0 - IMPEDANCE) * target.creep_load * target.gravity / damping
    return {
        "stiffness_N_m": stiffness,
        "damping_N_s_m": target.mass * damping,
        "solimp_d": IMPEDANCE,
        "impratio": creep / target.creep_velocity,
        "friction": target.friction,
    }


def inverse_weights(model: PlanarModel) -> list[float]:
    """Compute the `body_invweight0` (1/kg) that MuJoCo gives to the translation of each link.

    It is trace(J M^-1 J^T) / 3 at the link's centre of mass in the model's zero position, or 1/mass for a single link
    that cannot turn.
    """
    if model.freedoms == UPRIGHT and len(model.links) == 1:
        return [1.0 / model.links[0].mass_kg]
    base_rates = np.array([[float(freedom == axis) for freedom in model.freedoms] for axis in JOINT_AXES])
    hinges: list[Floats] = []
    centres: list[Floats] = []
    mass_matrix = np.zeros((model.size, model.size))
    for number, link in enumerate(model.links):
        # rates along the ground, normal to it and of turning (3, coordinates), of the link's material at its hinge
        hinge = np.zeros((3, model.size))
        if link.parent < 0:
            hinge[:, : len(model.freedoms)] = base_rates
        else:
            hinge += rates_at(link.parent_point_m, model.links[link.parent].point_m, hinges[link.parent])
            hinge[2, len(model.freedoms) + number - 1] = 1.0
        centre = rates_at(link.centre_m, link.point_m, hinge)
        inertia = max(link.inertia_kg_m2, MIN_INERTIA)
        mass_matrix += centre.T @ np.diag((link.mass_kg, link.mass_kg, inertia)) @ centre
        hinges.append(hinge)
        centres.append(centre)
    inverse = np.linalg.inv(mass_matrix)
    return [float(np.trace(centre[:2] @ inverse @ centre[:2].T)) / 3.0 for centre in centres]


def rates_at(point: Position, start: Position, rates: Floats) -> Floats:
    """Return a link's rates at `point`, from its rates at `start`; both points in the upright link's frame."""
    return rates + np.outer((start[1] - point[1], point[0] - start[0], 0.0), rates[2])


def option_text(model: PlanarModel, contact: Mapping[str, float] | None, more: str = "") -> str:
    """Write the element `option`: tilted gravity and, with contact, the friction cone."""
    cone = "" if contact is None else f'cone="elliptic" impratio="{contact["impratio"]!r}" '
    return f'<option {more}gravity="{model.gravity_along!r} 0 {-model.gravity_down!r}" {cone}{CLOSE}/>'


def body_text(
    model: PlanarModel,
    link_number: int,
    contact: Mapping[str, float] | None,
    feet: tuple[Foot, ...] = FEET,
    hip: tuple[int, Hip] | None = None,
) -> str:
    """Write a link with its hinge, its feet and its child links.

    contact  settings of the foot contacts; None for a walker without feet
    hip      link that hangs from the hip, and the hip's spring and damper
    """
    link = model.links[link_number]
    (px, pz), (x, z), (cx, cz) = link.parent_point_m, link.point_m, link.centre_m
    inside = "".join(joint_texts(model, link_number, hip))
    i = max(link.inertia_kg_m2, MIN_INERTIA)
    inside += f'<inertial pos="{cx!r} 0 {cz!r}" mass="{link.mass_kg!r}" diaginertia="{i!r} {i!r} {i!r}"/>'
    for ball, foot in zip(model.balls, feet, strict=False):
        if contact is not None and ball.link == link_number:
            inside += foot_text(model, ball, foot, contact) + (leg_text(link.point_m, ball, foot) if foot.drawn else "")
    for child, hung in enumerate(model.links):
        if hung.parent == link_number:
            inside += body_text(model, child, contact, feet, hip)
    return f'<body name="{link.name}" pos="{px - x!r} 0 {pz - z!r}">{inside}</body>'


def joint_texts(model: PlanarModel, link_number: int, hip: tuple[int, Hip] | None) -> Iterator[str]:
    """Yield the joints of a link: one for each freedom of the base, or the hinge between a link and its parent."""
    link = model.links[link_number]
    x, z = link.point_m
    for freedom in model.freedoms if link.parent < 0 else ("turn",):
        kind, axis = JOINT_AXES[freedom]
        name, acts = freedom if link.parent < 0 else f"hinge of {link.name}", ""
        if hip is not None and hip[0] == link_number:
            spring, damper = hip[1].spring_N_m_per_rad, hip[1].damping_N_m_s_per_rad
            name, acts = HIP, f' stiffness="{spring!r}" damping="{damper!r}"'
        yield f'<joint name="{name}" type="{kind}" axis="{axis}" pos="{x!r} 0 {z!r}"{acts}/>'


def foot_text(model: PlanarModel, ball: Ball, foot: Foot, contact: Mapping[str, float]) -> str:
    """Write a foot, whose solref follows from the contact settings and the inverse weight of the foot's link."""
    (x, z), d = ball.centre_m, contact["solimp_d"]
    inverse_weight = inverse_weights(model)[ball.link]
    stiffness = inverse_weight * contact["stiffness_N_m"]
    damping = inverse_weight * contact["damping_N_s_m"]
    return (
        f'<geom name="{foot.name}" type="sphere" size="{ball.radius_m!r}" pos="{x!r} {foot.across_m!r} {z!r}" '
        f'contype="{foot.group}" conaffinity="0" condim="3" friction="{contact["friction"]!r} 0 0" priority="1" '
        f'solref="{-stiffness!r} {-damping!r}" solimp="{d!r} {d!r} 1 0.5 1"/>'
    )


def walker_text(export: Exported, head: Iterable[str]) -> str:
    """Write a model with pads and a keyframe `gait`, from which a walker without drives walks under plain `mj_step`.

    head  lines of the header comment

    Raises ConfigError for a walker or ground that MJCF cannot express.
    """
    target = contact_target(export.scene)
    if target is None:
        raise ConfigError(
            "MuJoCo's contact cannot be tuned to ground without friction.", "Set contact.friction=coulomb."
        )
    if export.pinned:
        raise ConfigError("MJCF has no pin that opens at the first touch.", "Set contact.stance=free.")
    contact = contact_settings(target)
    links = tuple(replace(link, name=name) for link, name in zip(export.model.links, export.names, strict=True))
    model = replace(export.model, links=links)
    feet = tuple(Foot(f"foot_{foot + 1}", 1 << foot, export.lane_across_m(foot), drawn=True) for foot in range(2))
    q, v = (" ".join(repr(float(value)) for value in values) for values in export.start)
    distance = -4.0 * export.config.walker.leg_length_m
    elements = [
        f'<mujoco model="{export.model_name}">',
        '<compiler angle="radian" autolimits="true" balanceinertia="true"/>',
        option_text(model, contact, f'timestep="{STEP_S!r}" '),
        f"<custom>{''.join(custom_texts(export))}</custom>",
        f'<worldbody><camera name="side" mode="trackcom" pos="0 {distance!r} 0" xyaxes="1 0 0 0 0 1"/>',
        *(pad_text(export, number, pad) for number, pad in enumerate(export.pads)),
        body_text(model, 0, contact, feet, (export.hip_link, export.hip)),
        "</worldbody>",
        f"<equality>{''.join(coupling_texts(export))}</equality>" if export.couplings else "",
        f'<keyframe><key name="gait" qpos="{q}" qvel="{v}"/></keyframe>',
        "</mujoco>",
    ]
    tree = ElementTree.fromstring("".join(elements))
    ElementTree.indent(tree)
    comment = "\n".join(line.replace("--", "- -") for line in (*head, *tuning_lines(export, target)))
    return f"<!--\n{comment}\n-->\n{ElementTree.tostring(tree, encoding='unicode')}\n"


def leg_text(hinge: Position, ball: Ball, foot: Foot) -> str:
    """Draw a leg as a capsule from its hinge to its foot; it collides with nothing."""
    (x, z), (a, c), y = hinge, ball.centre_m, foot.across_m
    ends, width = f"{x!r} {y!r} {z!r} {a!r} {y!r} {c!r}", 0.015 * math.hypot(x - a, z - c)
    return f'<geom type="capsule" fromto="{ends}" size="{width!r}" contype="0" conaffinity="0" rgba=".4 .5 .7 1"/>'


def pad_text(export: Exported, number: int, pad: Pad) -> str:
    """Write a pad as a box that collides only with the ball of its lane."""
    size = f"{0.5 * pad.length_m!r} {export.half_lane_m!r} {0.5 * PAD_M!r}"
    z = pad.height_m + export.model.balls[pad.foot].ground_m - 0.5 * PAD_M
    place = f"{pad.centre_m!r} {export.lane_across_m(pad.foot)!r} {z!r}"
    group = f'contype="0" conaffinity="{1 << pad.foot}"'
    return f'<geom name="pad_{number + 1}" type="box" size="{size}" pos="{place}" {group} rgba=".6 .6 .55 1"/>'


def custom_texts(export: Exported) -> Iterator[str]:
    """Yield the drive parameters that the script reads for push-offs and hip torque."""
    push_off, hip = export.config.push_off, export.hip
    yield f'<numeric name="push_off" data="{push_off.impulse_N_s!r} {push_off.duration_s!r}"/>'
    yield f'<numeric name="hip_torque" data="{hip.torque_N_m!r}"/>'


def coupling_texts(export: Exported) -> Iterator[str]:
    """Yield the constraints of coupled hinges; raises ConfigError for a coupling of more than two hinges."""
    for coupling in export.couplings:
        if len(coupling) > 2:
            raise ConfigError(
                "MJCF can couple no more than two hinges.",
                "Export to ADAMS, or couple fewer bodies in walker.couplings.",
            )
        *before, last = (HIP if link == export.hip_link else f"hinge of {export.names[link]}" for link in coupling)
        weights = list(coupling.values())
        follows = f'joint2="{before[0]}" ' if before else ""
        weight = -weights[0] / weights[-1] if before else 0.0
        yield f'<joint joint1="{last}" {follows}polycoef="0 {weight!r} 0 0 0" {COUPLING_SETTINGS}/>'


def tuning_lines(export: Exported, target: EngineContact) -> Iterator[str]:
    """Describe the properties of the contact law that MuJoCo's contact reproduces, and those that it lacks."""
    static = float(export.scene.ours.friction.largest)
    yield (
        f"Contact tuned to ADAMS's law under {target.mass:.6g} kg: penetration at rest {target.penetration:.4g} m, "
        f"damping ratio {target.damping_ratio:.4g}, friction coefficient {target.friction:.4g} of a sliding foot, "
        f"creep at {target.creep_velocity:.4g} m/s under a tangential load of {target.creep_load:.4g} times the normal "
        "force. MuJoCo scales a contact by body_invweight0, so each foot's solref is multiplied by that of its body."
    )
    yield (
        f"Not expressed: the exponent {target.exponent:.4g} (the force is linear), damping that grows with the "
        f"penetration, and static friction of {static:.4g}."
    )


def needs_script(export: Exported) -> bool:
    """Return whether the walker has drives, which only the script applies."""
    return export.config.push_off.impulse_N_s != 0.0 or export.hip.torque_N_m != 0.0


def script_text() -> str:
    return (Path(__file__).parent / "mujoco_script.py").read_text(encoding="utf-8")
