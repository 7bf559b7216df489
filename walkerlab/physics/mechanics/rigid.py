"""Construction of the rigid model from parts: groups of bodies, followers, and exchange of roles at heel strike."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from walkerlab.physics.mechanics import parts, rigid_model
from walkerlab.physics.mechanics.hinges import SpringDamper
from walkerlab.physics.mechanics.rigid_model import NO_SHANK, STANCE, SWING, RigidModel
from walkerlab.physics.solvers.system import Floats

SYMMETRY_TOLERANCE = 1e-12  # relative difference up to which two legs count as equal


@dataclass(frozen=True)
class BodyGroups:
    """Mapping of an assembly's bodies to those of the rigid model, where the straight stance leg is one body."""

    names: tuple[str, ...]  # names of the angles, without the prefix 'theta_'
    members: Floats  # (bodies, n) 1 where an assembly's body is part of a model's body, otherwise 0
    roles: tuple[int, ...]  # body k after a heel strike is body roles[k] before it
    lower: int  # number of bodies of the swing leg below its uppermost one; for unequal legs, the larger number


def rigid_on_slope(
    assembly: parts.Assembly, gravity: float, slope: float, knee_locked_at_strike: bool = True
) -> RigidModel:
    """Build the rigid model of an assembly on a slope (rad). The other arguments are as in `rigid_on_level_ground`."""
    return rigid_model.change_slope(rigid_on_level_ground(assembly, gravity, knee_locked_at_strike), slope)


def rigid_on_level_ground(
    assembly: parts.Assembly, gravity: float, knee_locked_at_strike: bool, law: type[SpringDamper] = SpringDamper
) -> RigidModel:
    """Build the rigid model of an assembly, which is a pair of models if the legs differ. Gravity in m/s^2.

    The trailing knee is released just after the heel strike if `knee_locked_at_strike`, otherwise just before it.
    Raises ValueError, with a message for the user, if the parts are not a walker with two legs.
    """
    check_legs(assembly)
    first = build_first_leg_model(assembly, gravity, knee_locked_at_strike, law)
    if have_equal_legs(assembly):
        return first
    exchanged = replace(assembly, legs=assembly.legs[::-1], feet=assembly.feet[::-1])
    second = build_first_leg_model(exchanged, gravity, knee_locked_at_strike, law)
    if not knee_locked_at_strike and first.coordinates != second.coordinates:
        raise ValueError(
            "only one leg has a knee, which must be locked during heel strike (knee.at_heel_strike: locked)"
        )
    # Lengths, and the hip height below which a walker has fallen, are scaled by the length of leg 1. In the second
    # model leg 1 is the stance leg.
    return rigid_model.pair(first.changed(leg_length=second.leg_length), second)


def build_first_leg_model(
    assembly: parts.Assembly, gravity: float, knee_locked_at_strike: bool, law: type[SpringDamper]
) -> RigidModel:
    """Build the model for steps in which the first leg swings. The arguments are those of `rigid_on_level_ground`."""
    hip = find_hip(assembly)
    groups = group_bodies(assembly)
    swing_foot, foot = assembly.feet
    swing_root, root = (parts.Anchor(each.body, each.centre_m) for each in assembly.feet)
    to_foot = groups.members.T @ parts.levers(assembly, root, swing_root)
    # for straight legs, measured from the centre of each foot's arc
    to_hip = parts.levers(assembly, root, parts.Anchor(hip.parent, hip.parent_point_m)).sum(axis=0)
    swing_to_hip = parts.levers(assembly, swing_root, parts.Anchor(hip.child, hip.child_point_m)).sum(axis=0)
    soles = np.array([[foot.radius_m, *to_hip], [swing_foot.radius_m, *swing_to_hip]])
    n = len(groups.names)
    members = groups.members
    # Each body belongs to one group: the column of the only 1 in the body's row.
    coupled = {int(np.argmax(members[body])): row @ members for body, row in parts.followers(assembly).items()}
    # a leg has at most one knee, and the shank's group follows those of the legs
    shank, thigh = (2, SWING) if len(assembly.legs[0]) > 1 else (NO_SHANK, NO_SHANK)
    knees = {} if shank == NO_SHANK else {shank: np.eye(n)[thigh]}
    # If only the other leg has a knee, this leg still has an index for a shank, which stays in line with the leg.
    coupled |= {body: np.eye(n)[SWING] for body in range(n) if not members[:, body].any()}
    # If the trailing knee is free in the strike, its rate afterwards does not follow from the others and is a
    # coordinate.
    free = () if knee_locked_at_strike else tuple(knees)
    section_indices = (STANCE, n + SWING, n + STANCE, *(n + shank for shank in free))
    in_line = {**coupled, **knees}
    # in the order BENT, STRAIGHT, AT_STRIKE
    reductions = [parts.reduction(rows, n) for rows in (coupled, in_line, coupled if free else in_line)]
    return rigid_model.new_rigid_model(
        n,
        law,
        **parts.tree_about(assembly, root).merge_bodies(members),
        foot_x=to_foot[:, 0],
        foot_y=to_foot[:, 1],
        E=reductions,
        hinges=[(SWING, STANCE), *((body, SWING) for body in range(2, 2 + groups.lower))],
        roles=groups.roles,
        section=[*section_indices, *[0] * (n + 1 - len(section_indices))],
        coordinates=len(section_indices),
        thigh=thigh,
        shank=shank,
        radius=foot.radius_m,
        swing_radius=swing_foot.radius_m,
        hip_x=to_hip[0],
        hip_y=to_hip[1],
        swing_hip_x=swing_to_hip[0],
        swing_hip_y=swing_to_hip[1],
        alike=are_equal(*soles),
        lean=math.atan2(-to_hip[0], to_hip[1]),
        leg_length=foot.radius_m + to_hip[1],
        gravity=gravity,
        gravity_down=gravity,
    )


def group_bodies(assembly: parts.Assembly) -> BodyGroups:
    """Group the bodies in the model's order: swing leg (or thigh), straight stance leg, swing shank, shared bodies."""
    swinging, stance = assembly.legs
    shared = tuple(body.name for body in assembly.bodies if body.name not in (*swinging, *stance))
    more = max(len(swinging), len(stance)) - 1
    below = [*((name,) for name in swinging[1:]), *[()] * (more + 1 - len(swinging))]
    groups: list[tuple[str, ...]] = [(swinging[0],), stance, *below, *((name,) for name in shared)]
    members = np.zeros((len(assembly.bodies), len(groups)))
    for index, group in enumerate(groups):
        for name in group:
            members[assembly.index(name), index] = 1.0
    longer = max(swinging, stance, key=len)
    return BodyGroups(
        names=("1", "2", *(f"1_{name.split()[0]}" for name in longer[1:]), *(name.split()[0] for name in shared)),
        members=members,
        roles=(STANCE, SWING, *((STANCE,) * more), *range(2 + more, len(groups))),
        lower=more,
    )


def find_hip(assembly: parts.Assembly) -> parts.Revolute:
    """Return the hinge between the legs, with the stance leg as its parent."""
    first, second = (leg[0] for leg in assembly.legs)
    hinge = assembly.hinge(second, first)
    if hinge is None:
        raise ValueError(f"legs {first!r} and {second!r} are not hinged together; add a hip hinge between them")
    return hinge


def knee_positions(assembly: parts.Assembly) -> tuple[parts.Position, ...]:
    """Return the position (m) of each leg's knee in the frame of its thigh, or () for a walker without knees."""
    # The line of a leg without a knee is drawn through the point where the other leg has one.
    hinges = (assembly.hinge(knee.thigh, knee.shank) for knee in assembly.knees)
    positions = tuple(hinge.parent_point_m for hinge in hinges if hinge is not None)
    return (positions * 2)[:2]


def check_legs(assembly: parts.Assembly) -> None:
    first, second = assembly.legs
    if not first or not second:
        raise ValueError("both legs need bodies, listed from the hip down: legs: [[…], […]]")
    if len(first) < len(second):
        raise ValueError("if only one leg has a knee, that leg must be listed first")
    if len(first) > 2:
        raise ValueError("a leg has at most a thigh and a shank, with one knee between them")
    if set(first) & set(second):
        raise ValueError(f"both legs list {', '.join(sorted(set(first) & set(second)))}; a body belongs to one leg")
    feet = tuple(foot.body for foot in assembly.feet)
    if len(feet) != 2 or feet[0] not in first or feet[1] not in second:
        raise ValueError("a walker has two feet: the first on a body of leg 1, the second on a body of leg 2")
    knees = {(knee.thigh, knee.shank) for knee in assembly.knees}
    for leg in assembly.legs:
        for above, below in pairwise(leg):
            if (above, below) not in knees:
                raise ValueError(f"no locking knee joins {above!r} and {below!r}: the stance leg would fold")
    coupled = {coupling.body for coupling in assembly.couplings}
    for body in assembly.bodies:
        if body.name not in (*first, *second) and body.name not in coupled:
            raise ValueError(f"body {body.name!r} is in neither leg and has no coupling")


def have_equal_legs(assembly: parts.Assembly) -> bool:
    """Whether both legs of an assembly have the same dimensions and masses."""
    first, second = assembly.legs
    return len(first) == len(second) and all(map(are_equal, *(leg_measures(assembly, k) for k in range(2))))


def are_equal(one: Floats, other: Floats) -> bool:
    return bool(np.all(np.abs(one - other) <= SYMMETRY_TOLERANCE * (np.abs(one).max() + np.abs(other))))


def leg_measures(assembly: parts.Assembly, k: int) -> tuple[Floats, ...]:
    """Return the sole of a leg, and the constants of its bodies about the hip, which do not depend on the hip mass."""
    leg = assembly.legs[k]
    foot = assembly.feet[k]
    hip = find_hip(assembly)
    at_hip = parts.Anchor(hip.parent, hip.parent_point_m) if k == 1 else parts.Anchor(hip.child, hip.child_point_m)
    bodies = [assembly.index(name) for name in leg]
    sole = [foot.radius_m, *parts.levers(assembly, at_hip, parts.Anchor(foot.body, foot.centre_m))[bodies].ravel()]
    tree = parts.tree_about(assembly, at_hip)
    pairs, arms = (np.stack(each)[..., bodies] for each in ((tree.A, tree.B), (tree.arm_x, tree.arm_y)))
    return np.array(sole), pairs[:, bodies], arms
