"""Assembly of a walker on compliant ground from its parts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import walkerlab.physics.ground.motion  # noqa: F401 (registers the equations of motion)
from walkerlab.physics.ground.friction import FrictionLaw
from walkerlab.physics.ground.knees import IdealLock
from walkerlab.physics.ground.normal_force import Impact, NormalLaw
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import FIRST_KNEE, FORM_SHAPES, MAX_BODIES, NO_FOOT, ContactWalker, GroundModel
from walkerlab.physics.mechanics import parts, tree
from walkerlab.physics.mechanics.hinges import HIP_ROW, SpringDamper
from walkerlab.physics.solvers.system import Floats


@dataclass(frozen=True)
class KneeRules:
    """Rules for locking and releasing knees on compliant ground."""

    # With a compliant stop, thigh and shank of a locked knee stay separate bodies at the angle at which it latched.

    stop: Impact | IdealLock = IdealLock()  # noqa: RUF009 (immutable); a compliant stop's law is in rad and N m
    # whether to release the trailing knee at the touch, before the other foot has sunk in
    release_at_touch: bool = False


@dataclass(frozen=True)
class ContactDrives:
    """Torques at the hinges, and push-offs. By default there are none."""

    law: type[SpringDamper] = SpringDamper
    fields: Mapping[str, Any] = field(default_factory=dict)  # fields to set in every form, as in `tree.write_fields`


@dataclass(frozen=True)
class Root:
    tree: parts.Tree
    constants: dict[str, Any]  # fields that have the same value in all forms with this root
    rows: dict[str, Floats]  # (..., n) fields whose values are summed if bodies turn together


def contact_walker(
    assembly: parts.Assembly,
    normal: NormalLaw,
    friction: FrictionLaw,
    gravity: float,
    slope: float,
    knee_rules: KneeRules | None = None,
    pinned_foot: int = STANCE_FOOT,
    drives: ContactDrives | None = None,
) -> ContactWalker:
    """Assemble a walker on compliant ground (gravity in m/s^2, slope in rad). Foot k and knee k belong to leg k.

    In the pinned forms, the hinge is the centre of the ball of `pinned_foot`, at position 0 along the slope. Raises
    ValueError, with a message for the user, if the parts cannot walk on compliant ground.
    """
    rules = knee_rules or KneeRules()
    drives = drives or ContactDrives()
    check_walkable(assembly)
    # All forms are assembled beforehand: a walk only picks another record when a knee locks or a foot is released.
    forms = np.zeros((2, 4), tree.record_type(GroundModel, FORM_SHAPES, drives.law))
    forms["gravity_along"], forms["gravity_down"] = gravity * math.sin(slope), gravity * math.cos(slope)
    forms["slope"], forms["kneed"], forms["release_at_touch"] = slope, bool(assembly.knees), rules.release_at_touch
    forms["has_knee"] = [k < len(assembly.knees) for k in range(2)]
    for pinned, root in enumerate((root_at_centre(assembly), root_at_foot(assembly, pinned_foot))):
        for locked in range(4):
            # Bit k of a form's index says that knee k is locked, as in `locked_knees`.
            knees = [k for k in range(len(assembly.knees)) if locked & 1 << k]
            fill(forms[pinned, locked], assembly, root, knees, isinstance(rules.stop, IdealLock))
    legs = parts.leg_bodies(assembly)
    # Merging bodies renumbers them, so the hip's two bodies are looked up in each form.
    forms["hinges"][..., HIP_ROW, :] = np.take_along_axis(forms["onto"], np.broadcast_to(legs[:, 0], (2, 4, 2)), axis=2)
    tree.write_fields(forms, drives.fields)
    return ContactWalker(forms, normal, friction, rules.stop, legs)


def check_walkable(assembly: parts.Assembly) -> None:
    if len(assembly.bodies) > MAX_BODIES:
        raise ValueError(
            f"a walker on compliant ground has at most {MAX_BODIES} bodies; this assembly has {len(assembly.bodies)}"
        )
    if len(assembly.feet) != 2:
        raise ValueError(f"a walker has two feet; this assembly has {len(assembly.feet)}")
    if len(assembly.knees) > 2:
        raise ValueError(f"a walker has at most two knees; this assembly has {len(assembly.knees)}")


def root_at_centre(assembly: parts.Assembly) -> Root:
    about, feet = parts.tree_about_centre(assembly)
    hip = parts.hip_levers(assembly, feet[0])
    return Root(about, {"places": 2, "pinned": NO_FOOT}, levers_by_axis(feet, hip))


def root_at_foot(assembly: parts.Assembly, foot: int) -> Root:
    ball = assembly.feet[foot]
    about = parts.tree_about(assembly, parts.Anchor(ball.body, ball.centre_m))
    _, from_centre = parts.tree_about_centre(assembly)
    # The levers between two points are the difference of their levers from a third, here the centre of mass.
    feet = [d - from_centre[foot] for d in from_centre]
    hip = parts.hip_levers(assembly, from_centre[0]) - from_centre[foot]
    return Root(about, {"places": 0, "pinned": foot, "root_height": ball.radius_m}, levers_by_axis(feet, hip))


def levers_by_axis(feet: Any, hip: Floats) -> dict[str, Floats]:
    """Return the levers (bodies, 2) to feet and hip as the x and y fields of a form."""
    x, y = np.moveaxis(np.array(feet), 2, 0)
    return {"foot_x": x, "foot_y": y, "hip_x": hip[:, 0], "hip_y": hip[:, 1]}


def fill(form: Any, assembly: parts.Assembly, root: Root, locked: list[int], merges: bool) -> None:
    """Fill a form with the constants for a root. If `merges`, thigh and shank of each knee in `locked` are one body."""
    knees = [(assembly.index(knee.thigh), assembly.index(knee.shank)) for knee in assembly.knees]
    straight = {shank: thigh for thigh, shank in (knees[k] for k in locked)}
    # A compliant stop latches at a small angle. Its thigh and shank keep that angle, so they cannot be one body.
    # Instead, a row of E makes the shank turn with its thigh.
    one_with = straight if merges else {}
    separate = [body for body in range(len(assembly.bodies)) if body not in one_with]
    onto = [separate.index(one_with.get(body, body)) for body in range(len(assembly.bodies))]
    S, n = np.eye(len(separate))[onto], len(separate)
    rows = {onto[body]: row @ S for body, row in parts.followers(assembly).items()}
    rows |= {onto[shank]: np.eye(n)[onto[thigh]] for shank, thigh in straight.items() if shank not in one_with}
    rolling = np.zeros((2, len(onto)))
    for k, foot in enumerate(assembly.feet):
        rolling[k, assembly.index(foot.body)] = foot.radius_m
    for name, value in root.constants.items():
        form[name] = value
    merged = root.tree.merge_bodies(S) | {name: value @ S for name, value in (root.rows | {"rolling": rolling}).items()}
    form["mass"] = merged.pop("mass")
    # A form has room for MAX_BODIES bodies. The constants fill the first entries of each axis.
    for name, value in (merged | {"E": parts.reduction(rows, n)[None]}).items():
        form[name][tuple(map(slice, value.shape))] = value
    form["bodies"], form["radius"] = n, [foot.radius_m for foot in assembly.feet]
    form["onto"][: len(onto)], form["first"][:n] = onto, separate
    if knees:
        # For a leg without a knee, thigh and shank are the same body, so its extension is always zero.
        rigid = [onto[body] for body in parts.leg_bodies(assembly)[len(knees) :, 0]]
        form["hinges"][FIRST_KNEE:] = [
            *((onto[shank], onto[thigh]) for thigh, shank in knees),
            *((leg, leg) for leg in rigid),
        ]
