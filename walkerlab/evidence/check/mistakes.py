"""Mistakes found in published gaits and programs, expressed as changes of the plain walker."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

from walkerlab.evidence.check.plain_walker import BENT, SHANK, STANCE, STRAIGHT, SWING, PlainWalker

NAMES = {SWING: "swing leg", STANCE: "stance leg", SHANK: "swing shank"}
EXTRA_TERMS = {
    (1.0, 0.0): "the trailing leg's rate",
    (0.0, 1.0): "the leading leg's rate",
    (1.0, -1.0): "the rate between the legs",
}


class Mistake(NamedTuple):
    """A mistake that has no parameter."""

    what: str  # ends a sentence that begins with 'All printed values follow if'
    walker: PlainWalker  # with the mistake


class MistakeFamily(NamedTuple):
    """A mistake of some size, such as a time step."""

    what: str  # as for `Mistake`, with {} in place of the size
    unit: str
    first: float  # first size to try
    of_size: Callable[[float], PlainWalker]


def mistakes_of(right: PlainWalker) -> Iterator[Mistake]:
    """Yield the mistakes that have no parameter."""
    yield from wrong_signs(right)
    if right.leg_inertia:
        for weights, rate in EXTRA_TERMS.items():
            for sign, verb in ((1.0, "subtracts"), (-1.0, "adds")):
                signed = (sign * weights[0], sign * weights[1])
                what = f"the strike, in the balance of the trailing leg about the hip, also {verb} I times {rate}"
                yield Mistake(what, replace(right, extra_inertia=signed))
        massless = tuple(part._replace(inertia=0.0) for part in right.parts)
        yield Mistake("the legs' inertia is left out", replace(right, parts=massless))
        yield Mistake("the legs' inertia is left out of the strike", replace(right, strike_inertia=0.0))
    yield Mistake("the trailing leg keeps its rate through the strike", replace(right, keeps_trailing_rate=True))
    if right.radius:
        for point, name in ((right.foot, "the arc's centre"), (right.foot - 1j * right.radius, "the sole's middle")):
            what = f"the strike leaves out the foot's rolling: the leading leg turns about {name}"
            yield Mistake(what, replace(right, strike_foot=point))
            yield Mistake(f"{what}, as the trailing leg does", replace(right, strike_foot=point, turned_on_it=True))
    if right.hip_mass:
        yield Mistake("the hip's mass counts once for each leg", replace(right, hip_mass=2.0 * right.hip_mass))


def wrong_signs(right: PlainWalker) -> Iterator[Mistake]:
    """Yield wrong signs of the velocity terms of the equations of motion."""
    names = dict(NAMES) if right.kneed else {SWING: "swing leg", STANCE: "stance leg"}
    for phase in (STRAIGHT, BENT) if right.kneed else (STRAIGHT,):
        moving = [body for body in names if body != SHANK or phase == BENT]
        pairs = [(row, column) for row in moving for column in moving if row != column]
        swing = {BENT: " while the knee is free", STRAIGHT: " once the knee is locked" if right.kneed else ""}[phase]
        for row, column in pairs:
            signs = {(phase, row, column): -1.0}
            what = (
                f"the term of the {names[column]}'s squared rate in the equation of the {names[row]} has the wrong sign"
            )
            yield Mistake(what + swing, changed_signs(right, signs))
        everything = {(phase, row, column): -1.0 for row in range(4) for column in range(4)}
        yield Mistake(f"all velocity terms have the wrong sign{swing}", changed_signs(right, everything))


def changed_signs(right: PlainWalker, signs: dict[tuple[str, int, int], float]) -> PlainWalker:
    merged = {place: right.signs.get(place, 1.0) * sign for place, sign in signs.items()}
    return replace(right, signs={**right.signs, **merged})


def families_of(right: PlainWalker) -> Iterator[MistakeFamily]:
    """Yield the mistakes that have a size."""
    early = "a touch counts already when the sum of the legs' angles is within {} rad of a touch"
    yield MistakeFamily(early, "rad", 1e-3, lambda size: replace(right, window=size))
    evened = f"{early}, and both feet are then put on the slope"
    yield MistakeFamily(evened, "rad", 1e-3, lambda size: replace(right, window=size, evens_angles=True))
    step = "the equations are integrated by Euler's method with a step of {} s"
    first = 4e-3 * right.pendulum_time
    yield MistakeFamily(step, "s", first, lambda size: replace(right, euler_step=size))
    late = f"{step} that ends a step after the strike"
    yield MistakeFamily(late, "s", first, lambda size: replace(right, euler_step=size, interpolates=False))
