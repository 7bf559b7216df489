"""Causes for which a printed gait may differ: mistakes seen in publications and programs, and misprinted parameters.

Each is a change of the plain walker.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise, permutations
from typing import NamedTuple

from walkerlab.config.fields import Block, short_number
from walkerlab.config.reads import RigidConfig
from walkerlab.evidence.check.conventions import GRAVITIES
from walkerlab.evidence.check.gaits import plain_walker
from walkerlab.evidence.check.plain_walker import BENT, SHANK, STANCE, STRAIGHT, SWING, PlainWalker

EXTRA_TERMS = {
    (1.0, 0.0): "the trailing leg's rate",
    (0.0, 1.0): "the leading leg's rate",
    (1.0, -1.0): "the rate between the legs",
}
SLOPE = "slope_rad"
GRAVITY = "gravity_m_s2"
UNIT = re.compile(r"_(m|kg|kg_m2|rad|m_s2)$")


class Candidate(NamedTuple):
    """A walker that may explain the printed values."""

    kind: str  # mistake or misprint
    what: str  # ends a sentence that begins with 'All printed values follow if'
    walker: PlainWalker
    family: str = ""  # the mistake without its size, if it has one


class MistakeFamily(NamedTuple):
    """A mistake of some size, such as a time step."""

    what: str  # as for `Candidate`, with a place {} for the size
    limits: tuple[float, float]  # of sizes; smaller ones are within a program's own errors
    first: float  # a size to begin with
    of_size: Callable[[float], PlainWalker]


def generate_mistakes(right: PlainWalker) -> Iterator[Candidate]:
    """Yield walkers with mistakes that have no parameter."""

    def mistake(what: str, **changes: object) -> Candidate:
        return Candidate("mistake", what, replace(right, **changes))  # type: ignore[arg-type]

    for what, signs in wrong_signs(right.kneed):
        product = {term: right.signs.get(term, 1.0) * sign for term, sign in signs.items()}
        yield mistake(what, signs={**right.signs, **product})
    if right.leg_inertia:
        for weights, rate in EXTRA_TERMS.items():
            for sign, verb in ((1.0, "subtracts"), (-1.0, "adds")):
                term = f"the leg's inertia I times {rate}"
                what = f"the strike, in the balance of the trailing leg about the hip, also {verb} {term}"
                yield mistake(what, extra_inertia=(sign * weights[0], sign * weights[1]))
        massless = tuple(part._replace(inertia=0.0) for part in right.parts)
        yield mistake("the legs' inertia is left out", parts=massless)
        yield mistake("the legs' inertia is left out of the strike", strike_inertia=0.0)
    yield mistake("the trailing leg keeps its rate through the strike", keeps_trailing_rate=True)
    if right.radius:
        for point, name in ((right.foot, "the arc's centre"), (right.foot - 1j * right.radius, "the sole's middle")):
            what = f"the strike leaves out the foot's rolling: the leading leg turns about {name}"
            yield mistake(what, strike_foot=point)
            yield mistake(f"{what}, as the trailing leg does", strike_foot=point, turned_on_it=True)
    if right.hip_mass:
        yield mistake("the hip's mass counts once for each leg", hip_mass=2.0 * right.hip_mass)


def wrong_signs(kneed: bool) -> Iterator[tuple[str, dict[tuple[str, int, int], float]]]:
    """Yield wrong signs of velocity terms in the equations of motion: their description and the factors."""
    for phase in (STRAIGHT, BENT) if kneed else (STRAIGHT,):
        when = {BENT: " while the knee is free", STRAIGHT: " once the knee is locked" if kneed else ""}[phase]
        bodies = {"swing leg": (SWING, SHANK), "stance leg": (STANCE,)}
        if phase == BENT:
            bodies |= {"swing leg": (SWING,), "swing shank": (SHANK,)}
        for (row, rows), (column, columns) in permutations(bodies.items(), 2):
            signs = {(phase, k, l): -1.0 for k in rows for l in columns}
            yield (
                f"the term of the {column}'s squared rate in the equation of the {row} has the wrong sign{when}",
                signs,
            )
        signs = {(phase, row, column): -1.0 for row in range(4) for column in range(4)}
        yield f"all velocity terms have the wrong sign{when}", signs


def generate_families(right: PlainWalker) -> Iterator[MistakeFamily]:
    """Yield the mistakes that have a size."""
    early = "a touch counts already when the sum of the legs' angles is within {} rad of a touch"
    angles = (1e-5, 0.3)
    yield MistakeFamily(early, angles, 1e-3, lambda size: replace(right, window=size))
    evened = f"{early}, and both feet are then put on the slope"
    yield MistakeFamily(evened, angles, 1e-3, lambda size: replace(right, window=size, evens_angles=True))
    step = "the equations are integrated by Euler's method with a step of {} s"
    times = (2e-5, 0.2)
    first = 4e-3 * right.pendulum_time
    yield MistakeFamily(step, times, first, lambda size: replace(right, euler_step=size))
    late = f"{step} that ends a step after the strike"
    yield MistakeFamily(late, times, first, lambda size: replace(right, euler_step=size, interpolates=False))


def generate_misprints(config: RigidConfig) -> Iterator[Candidate]:
    """Yield walkers with one parameter changed as a misprint could change it."""
    values = parameters(config)
    for key, value in values.items():
        for other, how in misprinted(key, value, values):
            walker = walker_with(config, key, other)
            if walker is not None:
                yield Candidate("misprint", f"{key} is {short_number(other)} ({how})", walker)


def parameters(config: RigidConfig) -> dict[str, float]:
    """Return the parameters that are not zero, by dotted key."""
    found = {SLOPE: config.slope_rad, GRAVITY: config.gravity_m_s2, **dict(numbers_in("walker", config.walker))}
    return {key: value for key, value in found.items() if value and UNIT.search(key)}


def numbers_in(prefix: str, block: Block) -> Iterator[tuple[str, float]]:
    for name, value in block:
        if isinstance(value, Block):
            yield from numbers_in(f"{prefix}.{name}", value)
        elif isinstance(value, float):
            yield f"{prefix}.{name}", value


def walker_with(config: RigidConfig, key: str, value: float) -> PlainWalker | None:
    """Return the plain walker with another value of one parameter, or None if it cannot be built."""
    if key == SLOPE:
        return replace(plain_walker(config), slope=value)
    if key == GRAVITY:
        return replace(plain_walker(config), gravity=value) if value > 0.0 else None
    walker = plain_walker(config, with_inner(config.walker, key.removeprefix("walker."), value))
    turns = all(part.inertia + part.mass * abs(part.centre) ** 2 > 0.0 for part in walker.parts[: 1 + walker.kneed])
    return walker if turns and walker.leg_length > walker.radius >= 0.0 else None


def with_inner(block: Block, key: str, value: float) -> Block:
    """Return a block with another value of a dotted key. It is not validated."""
    first, _, rest = key.partition(".")
    return block.model_copy(update={first: with_inner(getattr(block, first), rest, value) if rest else value})


def misprinted(key: str, value: float, values: Mapping[str, float]) -> list[tuple[float, str]]:
    """Return the values for which a value may be a misprint, and how it came about."""
    unit = UNIT.findall(key)
    found = {other: f"the value of {name}" for name, other in values.items() if UNIT.findall(name) == unit}
    found |= dict.fromkeys(transposed(value), "two digits are transposed")
    found |= {float(f"{value * factor:.12g}"): "a factor of ten" for factor in (0.1, 10.0)}
    if key == SLOPE:
        found[math.radians(value)] = "degrees as radians"
    if key == GRAVITY:
        found |= dict.fromkeys(GRAVITIES, "another gravity")
    return [(other, how) for other, how in found.items() if other != value]


def transposed(value: float) -> Iterator[float]:
    """Yield the values that two neighbouring digits exchanged make of a number."""
    text = short_number(value)
    for place, (first, second) in enumerate(pairwise(text)):
        if first.isdigit() and second.isdigit() and first != second:
            yield float(text[:place] + second + first + text[place + 2 :])
