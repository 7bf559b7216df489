"""The walker on compliant ground assembled from a description by its parts."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from walkerlab.ground.friction import FrictionLaw
from walkerlab.ground.held import Held, IdealLock, Knees, NoKnees, NoneHeld, always_held, no_stops
from walkerlab.ground.merged import Unmerged, with_merged_bodies
from walkerlab.ground.normal_force import NormalLaw
from walkerlab.ground.pinned import Pinned
from walkerlab.ground.walker import ContactWalker, Foot
from walkerlab.mechanics.assembly import Anchor, levers, tree_about, tree_about_centre
from walkerlab.mechanics.parts import Assembly

SWING_FOOT, STANCE_FOOT = 0, 1  # of the first step; body k carries foot k


@dataclass(frozen=True)
class KneeRules:
    """How knees lock and are released on compliant ground."""

    stop: NormalLaw | IdealLock = IdealLock()  # noqa: RUF009 (immutable)
    release_at_touch: bool = False  # else when the leading foot stops sinking in


def contact_walker(
    assembly: Assembly,
    normal: NormalLaw,
    friction: FrictionLaw,
    gravity: float,
    slope: float,
    knee_rules: KneeRules | None = None,
) -> ContactWalker:
    """The assembly on compliant ground; gravity in m/s^2, slope in rad. Foot k, and knee k, are those of leg k."""
    tree, foot_levers = tree_about_centre(assembly)
    bodies = len(assembly.bodies)
    feet = tuple(
        Foot(
            lever_x=tuple(float(x) for x in d[:, 0]),
            lever_y=tuple(float(x) for x in d[:, 1]),
            rolling=tuple(foot.radius_m if body == assembly.index(foot.body) else 0.0 for body in range(bodies)),
            radius=foot.radius_m,
        )
        for foot, d in zip(assembly.feet, foot_levers, strict=True)
    )
    if len(feet) != 2:
        raise ValueError(f"a walker has two feet; this assembly has {len(feet)}")
    walker = ContactWalker(
        tree=tree,
        feet=(feet[0], feet[1]),
        normal=normal,
        friction=friction,
        gravity_along=gravity * math.sin(slope),
        gravity_down=gravity * math.cos(slope),
        slope=slope,
        held=held_bodies(assembly),
        knees=knees_of(assembly, knee_rules or KneeRules()),
        legs=legs_of(assembly),
        blank=(0.0,) * (4 + 2 * bodies),
        merging=Unmerged(),
    )
    return with_merged_bodies(walker)


def held_bodies(assembly: Assembly) -> Held | NoneHeld:
    """Which bodies follow others, always by a coupling or while a knee is locked."""
    if not assembly.knees and not assembly.couplings:
        return NoneHeld()
    n = len(assembly.bodies)
    weights, always = np.zeros((n, n)), np.zeros(n, bool)
    for knee in assembly.knees:
        weights[assembly.index(knee.shank), assembly.index(knee.thigh)] = 1.0
    for coupling in assembly.couplings:
        body = assembly.index(coupling.body)
        always[body] = True
        for other, weight in zip(coupling.of, coupling.weights, strict=True):
            weights[body, assembly.index(other)] = weight
    return Held(tuple(float(x) for x in weights.ravel()), tuple(bool(x) for x in always))


def knees_of(assembly: Assembly, rules: KneeRules) -> Knees | NoKnees:
    """The knees of both legs, or none; ValueError for a walker with a knee in one leg only."""
    if not assembly.knees:
        return NoKnees()
    if len(assembly.knees) != 2:
        raise ValueError(f"a walker has two knees or none; this assembly has {len(assembly.knees)}")
    thighs = [assembly.index(knee.thigh) for knee in assembly.knees]
    shanks = [assembly.index(knee.shank) for knee in assembly.knees]
    return Knees((thighs[0], thighs[1]), (shanks[0], shanks[1]), rules.stop, rules.release_at_touch)


def legs_of(assembly: Assembly) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Bodies of either leg; where none are named, those that carry the feet."""
    named = assembly.legs if all(assembly.legs) else tuple((foot.body,) for foot in assembly.feet)
    one, other = (tuple(assembly.index(body) for body in leg) for leg in named)
    return one, other


def pinned_walker(assembly: Assembly, walker: ContactWalker, foot: int, along: float) -> Pinned:
    """The walker hinged to the ground at the centre of a foot's ball, `along` the slope (m)."""
    ball = assembly.feet[foot]
    tree = tree_about(assembly, Anchor(ball.body, ball.centre_m))
    blank = (0.0,) * (2 * len(assembly.bodies))
    return Pinned(walker, tree, foot, along, blank, always_held(walker.held), no_stops(walker.knees))


def centre_to(assembly: Assembly, body: str, at_m: tuple[float, float]) -> Any:
    """Levers (bodies, 2), in m, from the centre of mass to a point of a body of a walker with feet."""
    foot = assembly.feet[0]
    anchor = Anchor(foot.body, foot.centre_m)
    _, foot_levers = tree_about_centre(assembly)
    return foot_levers[0] + levers(assembly, anchor, Anchor(body, at_m))
