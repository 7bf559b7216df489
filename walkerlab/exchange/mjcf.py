"""MJCF export: a planar walker in MuJoCo's language, with MuJoCo's soft contact tuned to the ADAMS contact law.

MuJoCo scales a contact by w, the sum of `body_invweight0` (1/kg) of its two bodies. With constant impedance d,
stiffness K and damping B (solref -K, -B), a foot rests at a penetration of (1 - d) w N / K under a load N. So a solref
of (-w k, -w c) makes any foot a spring k and a damper c, whose forces are divided by 1 - d. In friction, the damper is
r b, where -w b is the damping given by `solreffriction` and r is `impratio`.

Two side effects shrink with d and 1 / r. The foot gains a mass of d / ((1 - d) w), and r times as much against
sliding. A sliding foot is pushed off the ground with friction times b times its slip velocity.

w is 1/mass for a free ball. For a link of a walker it is a mean over three directions in the model's zero position, and
differs between equal legs. With the flag `diagexact` (MuJoCo 3.10), MuJoCo uses the exact inverse mass of a contact.

Source: MuJoCo documentation, Computation: constraint model, and Modeling: solver parameters; MuJoCo 4.0.0,
engine_setconst.c, function set0.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from walkerlab.errors import ConfigError
from walkerlab.exchange import engine_scene, exported
from walkerlab.exchange.planar import UPRIGHT, Ball, PlanarModel
from walkerlab.physics.ground import knees, normal_force, terrain
from walkerlab.physics.mechanics.parts import Position
from walkerlab.physics.solvers.system import Floats
from walkerlab.scene.parts import knee_dampings

# kg m^2; twice the minimum that MuJoCo accepts
MIN_INERTIA = 2e-15
# small, so that MuJoCo's soft contact behaves like a plain spring and damper that carry the full load
IMPEDANCE = 1e-3
# large, so that sliding feet are not pushed off the ground
IMPRATIO = 10.0
JOINT_AXES = {"along": ("slide", "1 0 0"), "height": ("slide", "0 0 1"), "turn": ("hinge", "0 -1 0")}
PAD_M = 0.05
STEP_S = 2.5e-5
"""Time step unless a damper requires a shorter one."""
DAMPED_STEP = 0.33
"""Maximum time step as a multiple of the time constant with which a damper stops a foot or a shank."""
HIP = "hip"
COUPLING_SETTINGS = 'solref="0.0005 1" solimp="0.9999 0.9999 0.001 0.5 2"'
"""Settings that make couplings and locks as stiff as MuJoCo allows with time steps of STEP_S."""
TIGHT_SOLVER = 'iterations="100" tolerance="1e-12"'


Slope = Literal["gravity", "geometry"]


@dataclass(frozen=True)
class Foot:
    """Ball of a foot: name, collision group, lateral position (m), and the parts of the leg to draw.

    limbs  lower end (m) of each part of the leg in the frame of its link, by link
    """

    name: str
    group: int = 1
    across_m: float = 0.0
    limbs: Mapping[int, Position] = field(default_factory=dict)


FEET = (Foot("foot 0"), Foot("foot 1"))


Hinge = tuple[str, str]
"""Name and other attributes of a hinge."""
UNNAMED: Mapping[int, Hinge] = {}


def contact_settings(target: engine_scene.EngineContact) -> dict[str, float]:
    """Compute the settings with which MuJoCo's contact reproduces the target, by the formulas at the top of this
    module.

    Exports and engines use the same settings for every foot. `foot_text` and `pair_text` turn them into a solref.
    Raises ConfigError for a target without damping.
    """
    if target.damping_ratio == 0.0:
        raise ConfigError(
            "MuJoCo's contact needs damping: without it, its friction has no damping either.",
            "Set contact.damping above 0.",
        )
    stiffness = (1.0 - IMPEDANCE) * target.mass * target.gravity / target.penetration
    friction_damping = (1.0 - IMPEDANCE) * target.creep_load * target.mass * target.gravity / target.creep_velocity
    return {
        "stiffness_N_m": stiffness,
        "damping_N_s_m": 2.0 * target.damping_ratio * math.sqrt(target.mass * stiffness),
        "friction_damping_N_s_m": friction_damping / IMPRATIO,
        "solimp_d": IMPEDANCE,
        "impratio": IMPRATIO,
        "friction": target.friction,
    }


@dataclass(frozen=True)
class InverseWeights:
    """Inverse masses and inertias by which MuJoCo scales constraints.

    bodies  `body_invweight0` (1/kg) of the translation of each link: trace(J M^-1 J^T) / 3 at its centre of mass in the
            model's zero position, or 1/mass for a single link that cannot turn
    joints  `dof_invweight0` (1/(kg m^2)) of the hinge of each link: the diagonal of M^-1 in the zero position
    """

    bodies: list[float]
    joints: list[float]


def inverse_weights(model: PlanarModel) -> InverseWeights:
    if model.freedoms == UPRIGHT and len(model.links) == 1:
        return InverseWeights([1.0 / model.links[0].mass_kg], [0.0])
    base_rates = np.array([[float(freedom == axis) for freedom in model.freedoms] for axis in JOINT_AXES])
    hinges: list[Floats] = []
    centres: list[Floats] = []
    mass_matrix = np.zeros((model.size, model.size))
    for number, link in enumerate(model.links):
        # for each link, (3, coordinates) velocity of its hinge along and normal to the ground, and its angular velocity
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
    bodies = [float(np.trace(centre[:2] @ inverse @ centre[:2].T)) / 3.0 for centre in centres]
    return InverseWeights(bodies, np.diag(inverse)[len(model.freedoms) - 1 :].tolist())


def rates_at(point: Position, start: Position, rates: Floats) -> Floats:
    """Convert the rates of a link at the point `start` to those at `point`, both in the frame of the upright link."""
    return rates + np.outer((start[1] - point[1], point[0] - start[0], 0.0), rates[2])


def option_text(model: PlanarModel, contact: Mapping[str, float] | None, more: str = "") -> str:
    """Write the element `option`: tilted gravity and, with contact, the friction cone."""
    cone = "" if contact is None else f'cone="elliptic" impratio="{contact["impratio"]!r}" '
    return f'<option {more}gravity="{model.gravity_along!r} 0 {-model.gravity_down!r}" {cone}{TIGHT_SOLVER}/>'


def body_text(
    model: PlanarModel,
    link_number: int,
    contact: Mapping[str, float] | None,
    feet: tuple[Foot, ...] = FEET,
    hinges: Mapping[int, Hinge] = UNNAMED,
) -> str:
    """Write a link with its hinge, feet and child links.

    contact  settings of the foot contacts, or None for a walker without feet
    hinges   hinges that have a name, by the link below the hinge
    """
    link = model.links[link_number]
    (px, pz), (x, z), (cx, cz) = link.parent_point_m, link.point_m, link.centre_m
    inside = "".join(joint_texts(model, link_number, hinges.get(link_number)))
    # Only the moment about the y axis matters to the walk. MuJoCo needs three, and a body with three equal moments can
    # exist.
    i = max(link.inertia_kg_m2, MIN_INERTIA)
    inside += f'<inertial pos="{cx!r} 0 {cz!r}" mass="{link.mass_kg!r}" diaginertia="{i!r} {i!r} {i!r}"/>'
    for ball, foot in zip(model.balls, feet, strict=False):
        if contact is not None and ball.link == link_number:
            inside += foot_text(model, ball, foot, contact)
        if link_number in foot.limbs:
            inside += limb_text(link.point_m, foot.limbs[link_number], foot, ball)
    for child, hung in enumerate(model.links):
        if hung.parent == link_number:
            inside += body_text(model, child, contact, feet, hinges)
    # All frames are parallel in the zero position, so the difference of the two hinge points places the body in its
    # parent.
    return f'<body name="{link.name}" pos="{px - x!r} 0 {pz - z!r}">{inside}</body>'


def joint_texts(model: PlanarModel, link_number: int, hinge: Hinge | None) -> Iterator[str]:
    """Yield the joints of a link: for the base one per degree of freedom, otherwise the hinge to the parent."""
    link = model.links[link_number]
    x, z = link.point_m
    for freedom in model.freedoms if link.parent < 0 else ("turn",):
        kind, axis = JOINT_AXES[freedom]
        name = freedom if link.parent < 0 else f"hinge of {link.name}"
        name, acts = hinge or (name, "")
        yield f'<joint name="{name}" type="{kind}" axis="{axis}" pos="{x!r} 0 {z!r}" {acts}/>'


def foot_text(model: PlanarModel, ball: Ball, foot: Foot, contact: Mapping[str, float]) -> str:
    """Write a foot. Its contact settings are for ground that is added to the file later.

    The contacts with ground in the file itself are set by `pair_text`.
    """
    (x, z), mu = ball.centre_m, contact["friction"]
    # MuJoCo lets two shapes touch if `contype` of one and `conaffinity` of the other share a bit. Pads have only a
    # `conaffinity`.
    return (
        f'<geom name="{foot.name}" type="sphere" size="{ball.radius_m!r}" pos="{x!r} {foot.across_m!r} {z!r}" '
        f'contype="{foot.group}" conaffinity="0" condim="3" friction="{mu!r} 0 0" priority="1" '
        f"{normal_text(model, ball, contact)}/>"
    )


def pair_text(model: PlanarModel, ball: Ball, foot: Foot, ground: str, contact: Mapping[str, float]) -> str:
    """Write the contact pair of a foot and a named piece of ground. Only a pair has a setting for friction damping."""
    mu = contact["friction"]
    creep = inverse_weights(model).bodies[ball.link] * contact["friction_damping_N_s_m"]
    return (
        f'<pair name="{foot.name} on {ground}" geom1="{foot.name}" geom2="{ground}" condim="3" '
        f'friction="{mu!r} {mu!r} 0 0 0" solreffriction="0 {-creep!r}" {normal_text(model, ball, contact)}/>'
    )


def normal_text(model: PlanarModel, ball: Ball, contact: Mapping[str, float]) -> str:
    """Write the spring and damper of a foot: the contact settings times the inverse weight of its link."""
    inverse_weight = inverse_weights(model).bodies[ball.link]
    d = contact["solimp_d"]
    stiffness = inverse_weight * contact["stiffness_N_m"]
    damping = inverse_weight * contact["damping_N_s_m"]
    return f'solref="{-stiffness!r} {-damping!r}" solimp="{d!r} {d!r} 1 0.5 1"'


def walker_text(export: exported.Exported, head: Iterable[str], slope: Slope = "gravity") -> str:
    """Write a model with pads and a keyframe `gait`. From there, a passive compass walks with nothing but `mj_step`.

    head   lines of the header comment
    slope  whether gravity is tilted, or the ground with everything on it

    Raises ConfigError for a walker or ground that MJCF cannot express.
    """
    if (target := engine_scene.contact_target(export.scene)) is None:
        raise ConfigError(
            "MuJoCo's contact cannot be tuned to ground without friction.", "Set contact.friction=coulomb."
        )
    if export.pinned:
        raise ConfigError("MJCF has no pin that opens at the first touch.", "Set contact.stance=free.")
    contact = contact_settings(target)
    links = tuple(replace(link, name=name) for link, name in zip(export.model.links, export.names, strict=True))
    model = replace(export.model, links=links)
    feet = tuple(
        Foot(f"foot_{foot + 1}", 1 << foot, export.lane_across_m(foot), limbs(export, foot)) for foot in range(2)
    )
    q, v = (" ".join(repr(float(value)) for value in values) for values in export.start)
    # The camera is far enough from the plane of the walk to show a whole step.
    distance = -4.0 * export.config.walker.leg_length_m
    scene = "".join(pad_text(export, number, pad) for number, pad in enumerate(export.pads))
    scene += body_text(model, 0, contact, feet, hinge_names(export))
    if slope == "geometry":
        half = 0.5 * export.scene.ours.slope
        model = replace(model, gravity_along=0.0, gravity_down=math.hypot(model.gravity_along, model.gravity_down))
        # Positive turns about the y axis lower the ground ahead.
        scene = f'<body name="slope" quat="{math.cos(half)!r} 0 {math.sin(half)!r} 0">{scene}</body>'
    pairs = "".join(
        pair_text(model, model.balls[pad.foot], feet[pad.foot], f"pad_{number + 1}", contact)
        for number, pad in enumerate(export.pads)
    )
    equalities = "".join((*coupling_texts(export), *lock_texts(export)))
    elements = [
        f'<mujoco model="{export.model_name}">',
        '<compiler angle="radian" autolimits="true" balanceinertia="true"/>',
        option_text(model, contact, f'timestep="{time_step_s(export, contact)!r}" '),
        f"<custom>{''.join(custom_texts(export))}</custom>",
        f'<worldbody><camera name="side" mode="trackcom" pos="0 {distance!r} 0" xyaxes="1 0 0 0 0 1"/>',
        scene,
        "</worldbody>",
        f"<contact>{pairs}</contact>",
        f"<equality>{equalities}</equality>" if equalities else "",
        f'<keyframe><key name="gait" qpos="{q}" qvel="{v}"/></keyframe>',
        "</mujoco>",
    ]
    tree = ElementTree.fromstring("".join(elements))
    ElementTree.indent(tree)
    # An XML comment must not contain two hyphens in a row.
    comment = "\n".join(line.replace("--", "- -") for line in (*head, *tuning_lines(export, target)))
    return f"<!--\n{comment}\n-->\n{ElementTree.tostring(tree, encoding='unicode')}\n"


def time_step_s(export: exported.Exported, contact: Mapping[str, float]) -> float:
    """Return a time step that resolves the damping of the lightest foot and of the knee stops, rounded to one digit."""
    weights = inverse_weights(export.model)
    stop = export.scene.ours.stop
    rates = [contact["damping_N_s_m"] * weights.bodies[ball.link] for ball in export.model.balls]
    if isinstance(stop, normal_force.Impact):
        shanks = [weights.joints[link] for link in export.knee_links]
        rates += [max(stop.damping * weight, math.sqrt(stop.stiffness * weight)) for weight in shanks]
    return min(STEP_S, float(f"{DAMPED_STEP / max(rates):.0e}"))


def hinge_names(export: exported.Exported) -> dict[int, Hinge]:
    """Return the hip and knee hinges with their names, the hip spring, the dampers and the stops of compliant knees."""
    weights = inverse_weights(export.model).joints
    stop = export.scene.ours.stop
    acts = f'stiffness="{export.hip.spring_N_m_per_rad!r}" damping="{export.hip.damping_N_m_s_per_rad!r}"'
    hinges = {export.hip_link: (HIP, acts)}
    for leg, link in enumerate(export.knee_links):
        acts = f'damping="{knee_dampings(export.config.walker)[leg]!r}" '
        d = IMPEDANCE
        if isinstance(stop, normal_force.Impact):
            stiffness, damping = ((1.0 - d) * weights[link] * x for x in (stop.stiffness, stop.damping))
            # Knees bend towards negative angles. Their lower limit is too far away to act.
            acts += f'range="-3.14 0" solreflimit="{-stiffness!r} {-damping!r}" solimplimit="{d!r} {d!r} 1 0.5 1"'
        hinges[link] = (f"knee_{leg + 1}", acts)
    return hinges


def limbs(export: exported.Exported, foot: int) -> dict[int, Position]:
    """Return the lower end (m) of each link of a leg, from its foot up to the hip."""
    ball = export.model.balls[foot]
    link = ball.link
    ends = {link: ball.centre_m}
    while link not in (0, export.hip_link):
        lower = export.model.links[link]
        link = lower.parent
        ends[link] = lower.parent_point_m
    return ends


def limb_text(hinge: Position, end: Position, foot: Foot, ball: Ball) -> str:
    """Draw a part of a leg as a capsule from its hinge to its lower end. It collides with nothing.

    A capsule that ends at the foot is shortened. Otherwise it could reach below the ball in programs that let it
    collide.
    """
    (x, z), (a, c), y = hinge, end, foot.across_m
    width = 0.015 * math.hypot(x - a, z - c)
    short = 2.0 * max(0.0, width - ball.radius_m) / math.hypot(x - a, z - c) if end == ball.centre_m else 0.0
    a, c = a + short * (x - a), c + short * (z - c)
    ends = f"{x!r} {y!r} {z!r} {a!r} {y!r} {c!r}"
    return f'<geom type="capsule" fromto="{ends}" size="{width!r}" contype="0" conaffinity="0" rgba=".4 .5 .7 1"/>'


def pad_text(export: exported.Exported, number: int, pad: exported.Pad) -> str:
    """Write a pad as a box that collides only with the ball of its lane."""
    size = f"{0.5 * pad.length_m!r} {export.half_lane_m!r} {0.5 * PAD_M!r}"
    z = pad.height_m + export.model.balls[pad.foot].ground_m - 0.5 * PAD_M
    place = f"{pad.centre_m!r} {export.lane_across_m(pad.foot)!r} {z!r}"
    group = f'contype="0" conaffinity="{1 << pad.foot}"'
    return f'<geom name="pad_{number + 1}" type="box" size="{size}" pos="{place}" {group} rgba=".6 .6 .55 1"/>'


def custom_texts(export: exported.Exported) -> Iterator[str]:
    """Yield the values that the script reads: drives, rules of the knees, periods and lengths of walkerlab's steps."""
    first, second = export.impulses_N_s
    walk = export.walk
    yield f'<numeric name="push_off" data="{first!r} {second!r} {export.config.push_off.duration_s!r}"/>'
    yield f'<numeric name="hip_torque" data="{export.hip.torque_N_m!r}"/>'
    if export.knee_links:
        yield f'<numeric name="knees" data="{knees.MIN_FLEXION!r} {int(export.scene.ours.whole.release_at_touch)}"/>'
    steps = (walk.periods_s, walk.lengths_m) if walk.steps else ((0.0,), (0.0,))
    values = " ".join(repr(float(value)) for values in steps for value in values)
    yield f'<numeric name="steps_in_walkerlab" data="{values}"/>'


def lock_texts(export: exported.Exported) -> Iterator[str]:
    """Yield the locks of the knees. At the start, only that of the stance leg is active."""
    for leg in range(len(export.knee_links)):
        active = "true" if leg == terrain.STANCE_FOOT else "false"
        knee = f'joint1="knee_{leg + 1}" polycoef="0 0 0 0 0"'
        yield f'<joint name="lock_{leg + 1}" {knee} active="{active}" {COUPLING_SETTINGS}/>'


def coupling_texts(export: exported.Exported) -> Iterator[str]:
    """Yield the constraints of coupled hinges.

    Raises ConfigError for a coupling of more than two hinges.
    """
    for coupling in export.couplings:
        if len(coupling) > 2:
            raise ConfigError(
                "MJCF can couple no more than two hinges.",
                "Export to ADAMS, or couple fewer bodies in walker.couplings.",
            )
        *before, last = (HIP if link == export.hip_link else f"hinge of {export.names[link]}" for link in coupling)
        weights = list(coupling.values())
        follows = f'joint2="{before[0]}" ' if before else ""
        # MuJoCo's form of the constraint: the weighted sum of both angles is zero.
        weight = -weights[0] / weights[-1] if before else 0.0
        yield f'<joint joint1="{last}" {follows}polycoef="0 {weight!r} 0 0 0" {COUPLING_SETTINGS}/>'


def tuning_lines(export: exported.Exported, target: engine_scene.EngineContact) -> Iterator[str]:
    """Describe which properties of the contact law MuJoCo's contact reproduces, and which it lacks."""
    yield (
        f"Contact tuned to ADAMS's law under {target.mass:.6g} kg: penetration at rest {target.penetration:.4g} m, "
        f"damping ratio {target.damping_ratio:.4g}, friction coefficient {target.friction:.4g} of a sliding foot, "
        f"creep at {target.creep_velocity:.4g} m/s under a tangential load of {target.creep_load:.4g} times the normal "
        "force. MuJoCo scales a contact by body_invweight0, so each foot's solref is multiplied by that of its body."
    )
    yield (
        f"Not expressed: the exponent {target.exponent:.4g} (the force is linear), damping that grows with the "
        f"penetration, and static friction of {float(export.scene.ours.friction.largest):.4g}."
    )


def parts_of_script(export: exported.Exported) -> list[str]:
    """List the drives and the locks of knees that only the script can simulate."""
    parts = {"push-offs": max(export.impulses_N_s), "hip torque": export.hip.torque_N_m}
    parts |= {"locks of the knees": len(export.knee_links)}
    return [name for name, value in parts.items() if value != 0]


def script_text() -> str:
    return (Path(__file__).parent / "mujoco_script.py").read_text(encoding="utf-8")
