"""Construction of the rigid model from parts: groups of bodies, followers, and exchange of roles at heel strike."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from walkerlab.physics.mechanics.assembly import Anchor, followers, levers, reduction, tree_about
from walkerlab.physics.mechanics.parts import Assembly, Revolute
from walkerlab.physics.mechanics.rigid_model import NO_SHANK, STANCE, SWING, RigidModel, new_rigid_model, on_slope
from walkerlab.physics.solvers.system import Floats

ALIKE = 1e-12  # relative difference up to which two legs count as equal


@dataclass(frozen=True)
class BodyPlaces:
    """Mapping of an assembly's bodies to those of the rigid model, where the straight stance leg is one body."""

    names: tuple[str, ...]  # names of the angles, without the prefix 'theta_'
    members: Floats  # (bodies, n) 1 where an assembly's body is part of a model's body, otherwise 0
    roles: tuple[int, ...]  # body k after a heel strike is body roles[k] before it
    knees: tuple[tuple[int, int], ...]  # indices (shank, thigh) of the swing knee; empty for straight legs


def standing(assembly: Assembly, gravity: float, slope: float, knee_locked_at_strike: bool = True) -> RigidModel:
    """Build the rigid model of an assembly on a slope (rad); other arguments as in `on_level_ground`."""
    return on_slope(on_level_ground(assembly, gravity, knee_locked_at_strike), slope)


def on_level_ground(assembly: Assembly, gravity: float, knee_locked_at_strike: bool) -> RigidModel:
    """Build the rigid model of an assembly; gravity in m/s^2.

    The trailing knee is released just after the heel strike if `knee_locked_at_strike`, otherwise just before it.
    Raises ValueError, with a message for the user, if the parts are not a walker with two equal legs.
    """
    check_equal_legs(assembly)
    hip = find_hip(assembly)
    places = group_bodies(assembly)
    foot = assembly.feet[STANCE]
    root = Anchor(foot.body, foot.centre_m)
    to_foot = places.members.T @ levers(
        assembly, root, Anchor(assembly.feet[SWING].body, assembly.feet[SWING].centre_m)
    )
    to_hip = places.members.T @ levers(assembly, root, Anchor(hip.parent, hip.parent_point_m))
    hanging = -to_hip[STANCE]  # from the hip to the centre of the foot's arc in a straight leg
    n, members = len(places.names), places.members
    torso = {int(np.argmax(members[body])): row @ members for body, row in followers(assembly).items()}
    knees = {shank: np.eye(n)[thigh] for shank, thigh in places.knees}
    free = () if knee_locked_at_strike else tuple(knees)
    section_indices = (STANCE, n + SWING, n + STANCE, *(n + shank for shank in free))
    in_line = {**torso, **knees}
    reductions = [reduction(rows, n) for rows in (torso, in_line, torso if free else in_line)]
    shank, thigh = places.knees[0] if places.knees else (NO_SHANK, NO_SHANK)
    return new_rigid_model(
        n,
        **tree_about(assembly, root).merged(members),
        foot_x=to_foot[:, 0],
        foot_y=to_foot[:, 1],
        E=reductions,
        hinges=[(SWING, STANCE), *places.knees],
        roles=places.roles,
        section=[*section_indices, *[0] * (n + 1 - len(section_indices))],
        coordinates=len(section_indices),
        thigh=thigh,
        shank=shank,
        radius=foot.radius_m,
        hip_x=to_hip[STANCE, 0],
        hip_y=to_hip[STANCE, 1],
        lean=math.atan2(hanging[0], -hanging[1]),
        leg_length=foot.radius_m - hanging[1],
        gravity=gravity,
        gravity_down=gravity,
    )


def group_bodies(assembly: Assembly) -> BodyPlaces:
    """Group the bodies in the model's order: swing leg (or thigh), straight stance leg, swing shank, shared bodies."""
    swinging, stance = assembly.legs
    shared = tuple(body.name for body in assembly.bodies if body.name not in (*swinging, *stance))
    groups = [(swinging[0],), stance, *((name,) for name in swinging[1:]), *((name,) for name in shared)]
    members = np.zeros((len(assembly.bodies), len(groups)))
    for place, group in enumerate(groups):
        for name in group:
            members[assembly.index(name), place] = 1.0
    more = len(swinging) - 1
    knee_position = {knee.shank: knee.thigh for knee in assembly.knees}
    return BodyPlaces(
        names=("1", "2", *(f"1_{name.split()[0]}" for name in swinging[1:]), *(name.split()[0] for name in shared)),
        members=members,
        roles=(STANCE, SWING, *((STANCE,) * more), *range(2 + more, len(groups))),
        knees=tuple((2 + k, group_index(groups, knee_position[name])) for k, name in enumerate(swinging[1:])),
    )


def group_index(groups: list[tuple[str, ...]], name: str) -> int:
    return next(place for place, group in enumerate(groups) if name in group)


def find_hip(assembly: Assembly) -> Revolute:
    """Return the hinge between the legs, with the stance leg as its parent."""
    first, second = (leg[0] for leg in assembly.legs)
    hinge = assembly.hinge(second, first)
    if hinge is None:
        raise ValueError(f"legs {first!r} and {second!r} are not hinged together; add a hip hinge between them")
    return hinge


def knee_position(assembly: Assembly) -> tuple[float, float] | None:
    """Return the knee's position (m) in the frame of a thigh; None for a walker without knees."""
    hinges = (assembly.hinge(knee.thigh, knee.shank) for knee in assembly.knees)
    return next((hinge.parent_point_m for hinge in hinges if hinge is not None), None)


def check_equal_legs(assembly: Assembly) -> None:
    first, second = assembly.legs
    if not first or len(first) != len(second):
        raise ValueError("both legs need the same number of bodies, listed from the hip down: legs: [[…], […]]")
    if len(first) > 2:
        raise ValueError("a leg has at most a thigh and a shank, with one knee between them")
    if set(first) & set(second):
        raise ValueError(f"both legs list {', '.join(sorted(set(first) & set(second)))}; a body belongs to one leg")
    feet = tuple(foot.body for foot in assembly.feet)
    if len(feet) != 2 or feet[0] not in first or feet[1] not in second:
        raise ValueError("a walker has two feet, the first on a body of the first leg, the second on one of the second")
    knees = {(knee.thigh, knee.shank) for knee in assembly.knees}
    for leg in assembly.legs:
        for above, below in pairwise(leg):
            if (above, below) not in knees:
                raise ValueError(f"no locking knee joins {above!r} and {below!r}: the stance leg would fold")
    coupled = {coupling.body for coupling in assembly.couplings}
    for body in assembly.bodies:
        if body.name not in (*first, *second) and body.name not in coupled:
            raise ValueError(f"body {body.name!r} is in neither leg and has no coupling")
    one, other = (leg_measures(assembly, k) for k in range(2))
    if not np.allclose(one, other, rtol=ALIKE, atol=ALIKE * np.abs(one).max()):
        raise ValueError("the two legs differ; they exchange roles at heel strike, so they must be equal")


def leg_measures(assembly: Assembly, k: int) -> Floats:
    leg, foot = assembly.legs[k], assembly.feet[k]
    hip = find_hip(assembly)
    at_hip = Anchor(hip.parent, hip.parent_point_m) if k == 1 else Anchor(hip.child, hip.child_point_m)
    own = [assembly.index(name) for name in leg]
    measures = [foot.radius_m, *levers(assembly, at_hip, Anchor(foot.body, foot.centre_m))[own].ravel()]
    for name in leg:
        body = assembly.bodies[assembly.index(name)]
        measures += [body.mass_kg, body.inertia_kg_m2]
        measures += [*levers(assembly, at_hip, Anchor(name, body.centre_m))[own].ravel()]
    return np.array(measures)
