"""Search for a cause that reproduces all printed values: other conventions, a known mistake, or a misprint.

Each candidate is a walker. A step from the printed state gives a first guess of its gait. Gaits are solved only for the
best candidates, and only a gait with every printed digit is an explanation.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config.numbers import short_number
from walkerlab.config.reads import RigidConfig
from walkerlab.evidence.check.conventions import Convention, alternatives, start_from
from walkerlab.evidence.check.gaits import gait_near
from walkerlab.evidence.check.misprints import misprints_of, parameters, transposed, vary_walker
from walkerlab.evidence.check.mistakes import MistakeFamily, families_of, mistakes_of
from walkerlab.evidence.check.plain_walker import EXACT, QUICK, Floats, PlainWalker
from walkerlab.evidence.check.printed import Item
from walkerlab.evidence.check.walks import CheckedStep
from walkerlab.labels import join_words

REFINED: Final = 5  # candidates that are solved
FARTHEST_GUESS = 0.3  # rad; first guesses farther from the printed state are not used
SAME_WALK = 1e-7  # largest relative difference between first guesses that count as the same
# rounds that fit a mistake's size; smallest factor by which it must reduce the distance from the printed values
FITTING_ROUNDS, LEAST_GAIN = 4, 3.0
ROUND_SIZES: Final = (1.0, 2.0, 5.0, 2.5)
SIZE_SHARE = 0.03  # relative error of a fitted size within which a round one is tried
# Ranges of sizes by their unit. Smaller sizes cannot be told from the usual errors of programs.
LIMITS: Final = {"s": (2e-5, 0.2), "rad": (1e-5, 0.3)}
MIN_EXPLAINED = 3  # fewest numbers that an explanation must reproduce if it does not reproduce all
MUCH_CLOSER = 5.0  # smallest factor by which a reported cause reduces the largest difference
MAX_CHANGES = 3  # most conventions that one explanation changes


@dataclass(frozen=True)
class Explanation:
    """Cause that reproduces printed values."""

    kind: str  # convention, mistake or misprint
    what: str
    reproduces: tuple[str, ...]  # names of printed numbers
    digits: int  # smallest number of digits that agree


@dataclass(frozen=True)
class Question:
    """Printed numbers that the plain model can compute, and the right gait."""

    config: RigidConfig
    items: Sequence[Item]
    convention: Convention
    right: CheckedStep
    state: Floats | None  # of all bodies, as printed; None if no state is printed
    gaits: Sequence[CheckedStep] = ()  # all right gaits

    @property
    def walker(self) -> PlainWalker:
        return self.right.walker

    def explanation(self, kind: str, what: str, items: Sequence[Item] = ()) -> Explanation:
        reproduced = items or self.items
        return Explanation(kind, what, tuple(each.name for each in reproduced), min(each.digits for each in reproduced))

    def reproduced(
        self, walk: CheckedStep, convention: Convention | None = None, items: Sequence[Item] | None = None
    ) -> list[Item]:
        """Return the printed numbers that agree with a gait in every digit."""
        items = self.items if items is None else items
        values = walk.values(items, convention or self.convention)
        return [item for item in items if item.fits(values[item.name])]

    def fits(self, walk: CheckedStep, convention: Convention | None = None) -> bool:
        """Whether a gait agrees with the printed numbers in every digit. Numbers that need no derivative come first."""
        return all(
            len(self.reproduced(walk, convention, items)) == len(items) for items in (self.quick_items, self.items)
        )

    def explained_by(self, attempt: Attempt) -> Explanation | None:
        """Return the explanation by the gait of an attempt, or None if it explains too little.

        The gait must have every digit of all numbers, or at least of all states, of three or more numbers that are not
        right.
        """
        if len(self.reproduced(attempt.gait, items=self.state_items)) < len(self.state_items):
            return None
        reproduced = self.reproduced(attempt.gait)
        others = [item for item in self.items if item not in reproduced]
        kind = attempt.candidate.kind
        what = attempt.candidate.what
        return self.explanation(kind, what, reproduced) if not others or len(reproduced) >= MIN_EXPLAINED else None

    @cached_property
    def right_items(self) -> list[Item]:
        """Printed numbers that agree with the right gait in every digit."""
        return self.reproduced(self.right)

    def miss(self, walk: CheckedStep) -> float:
        """Return the largest distance of a walk from a printed value, in units of its last digit."""
        values = walk.values(self.quick_items, self.convention)
        return max((item.miss(values[item.name]) for item in self.quick_items), default=math.inf)

    @cached_property
    def state_items(self) -> list[Item]:
        """Printed numbers of states."""
        return [item for item in self.items if item.quantity.startswith("state")]

    @cached_property
    def quick_items(self) -> list[Item]:
        """Printed numbers of states or, if none is printed, all that need no derivative."""
        slow = ("multipliers", "spectral_radius")
        return self.state_items or [item for item in self.items if item.quantity not in slow]

    def guess(self, walker: PlainWalker, tolerance: float = QUICK) -> CheckedStep | None:
        """Return a walk near a walker's gait: a Newton step from the printed state, or from the right gait."""
        start = self.right.start if self.state is None else start_from(walker, self.state, self.convention.instant)
        step = None if start is None else walker.step(start, tolerance)
        if step is None or start is None or self.right.derivative is None:
            return None
        move = np.linalg.solve(np.eye(len(start)) - self.right.derivative, step.after - start)
        if np.abs(move[:2]).max() > FARTHEST_GUESS:
            return None
        after = walker.step(start + move, tolerance) if self.needs_times else step
        return None if after is None else CheckedStep(walker, start + move, after)

    def attempt(self, candidate: Candidate, guess: CheckedStep) -> Iterator[Attempt]:
        """Yield the gait of a candidate near a first guess, if there is one."""
        gait = gait_near(candidate.walker, guess.start, self.right.derivative)
        if gait is not None:
            yield Attempt(candidate, CheckedStep(candidate.walker, *gait))

    @property
    def needs_times(self) -> bool:
        """Whether a value is printed that the state alone does not determine."""
        return self.convention.instant != "after-strike" or any(item.quantity != "state" for item in self.quick_items)


class Candidate(NamedTuple):
    """A walker that may explain the printed values."""

    kind: str
    what: str
    walker: PlainWalker
    family: str = ""  # the mistake without its size, if it has one


class Attempt(NamedTuple):
    """The gait of a walker that may explain the printed values."""

    candidate: Candidate
    gait: CheckedStep


def explain(question: Question) -> tuple[list[Explanation], dict[str, Any] | None]:
    """Return the explanations that fit, and the cause that comes closest if none does.

    Conventions come first, then misprinted values, then mistakes and misprinted parameters together.
    """
    if sum(item.printed.bounds is None for item in question.items) < 2:
        return [], None
    if found := [*conventions(question), *misprinted_values(question)]:
        return found, None
    attempts = [*solve_best(question, candidates(question)), *fit_families(question)]
    found = list(strike_at_start(question))
    families: set[str] = set()
    for attempt in attempts:
        explanation = None if attempt.candidate.family in families else question.explained_by(attempt)
        if explanation is not None:
            found.append(explanation)
            families |= {attempt.candidate.family} - {""}
    most = max((len(each.reproduces) for each in found), default=0)
    complete = [each for each in found if len(each.reproduces) == most]
    return complete, None if complete else closest(question, attempts)


def closest(question: Question, attempts: Sequence[Attempt]) -> dict[str, Any] | None:
    """Return the cause that brings a gait much closer to the printed values, or None if no cause does."""
    if not question.quick_items:
        return None
    without = question.miss(question.right)
    miss, attempt = min(
        ((question.miss(each.gait), each) for each in attempts), default=(math.inf, None), key=itemgetter(0)
    )
    if attempt is None or miss * MUCH_CLOSER > without:
        return None
    kind = attempt.candidate.kind
    what = attempt.candidate.what
    return {"kind": kind, "what": what, "miss_in_units": miss, "without_in_units": without}


def candidates(question: Question) -> Iterator[Candidate]:
    """Yield walkers with mistakes or misprints whose size is known."""
    for what, walker in mistakes_of(question.walker):
        yield Candidate("mistake", what, walker)
    for key, value, how, walker in misprints_of(question.config):
        yield Candidate("misprint", f"{key} is {short_number(value)} ({how})", walker)


def solve_best(question: Question, walkers: Iterable[Candidate]) -> Iterator[Attempt]:
    """Yield the gaits of the most promising candidates."""
    right = question.guess(question.walker)
    guesses = []
    for place, candidate in enumerate(walkers):
        guess = question.guess(candidate.walker)
        if guess is not None and (right is None or not is_same_walk(guess, right)):
            guesses.append((question.miss(guess), place, candidate, guess))
    for _, _, candidate, guess in heapq.nsmallest(REFINED, guesses):
        yield from question.attempt(candidate, guess)


def is_same_walk(walk: CheckedStep, other: CheckedStep) -> bool:
    return bool(np.abs(walk.start - other.start).max() < SAME_WALK * np.abs(other.start).max())


def fit_families(question: Question) -> Iterator[Attempt]:
    """Yield the gaits of walkers with mistakes that have a size, which is fitted to the printed values."""
    if len(question.items) < MIN_EXPLAINED:
        return
    for family in families_of(question.walker):
        size = fitted_size(question, family)
        for tried in () if size is None else sizes_to_try(size):
            walker = family.of_size(tried)
            guess = question.guess(walker, EXACT)
            what = family.what.format(f"{tried:.4g}")
            if guess is not None:
                yield from question.attempt(Candidate("mistake", what, walker, family.what), guess)


def fitted_size(question: Question, family: MistakeFamily) -> float | None:
    """Return the size of a mistake that brings its gait closest to the printed values, or None if none does."""
    low, high = LIMITS[family.unit]
    without = signed_misses(question, question.guess(family.of_size(0.0), EXACT))
    size = family.first
    best = 0.0
    left = without
    for _ in range(FITTING_ROUNDS):
        there = signed_misses(question, question.guess(family.of_size(size), EXACT))
        if without is None or there is None:
            return None
        slope = (there - without) / size
        best = -float(slope @ without) / float(slope @ slope or math.inf)
        if not low <= best <= high:
            return None
        left = without + best * slope
        if abs(best / size - 1.0) < SIZE_SHARE:
            break
        size = best
    if without is None or left is None or np.abs(left).max() * LEAST_GAIN > np.abs(without).max():
        return None
    return best


def signed_misses(question: Question, walk: CheckedStep | None) -> Floats | None:
    """Return the signed distances of a walk from the printed values in units of their last digits."""
    if walk is None:
        return None
    values = walk.values(question.quick_items, question.convention)
    found = [
        (values[item.name].real - item.printed.value.real) / item.unit  # type: ignore[union-attr]
        for item in question.quick_items
        if values[item.name] is not None and item.printed.bounds is None
    ]
    return np.array(found) if len(found) > 1 else None


def sizes_to_try(size: float) -> Iterator[float]:
    """Yield round sizes near a fitted one, then the fitted one itself."""
    power = 10.0 ** math.floor(math.log10(size))
    for digit in (*ROUND_SIZES, 10.0):
        if abs(digit * power / size - 1.0) < SIZE_SHARE:
            yield float(f"{digit * power:.3g}")
    yield float(f"{size:.3g}")
    yield size


def strike_at_start(question: Question) -> Iterator[Explanation]:
    """Yield the explanation that a script meets the event at the start, if only the printed multipliers contain -1."""
    listed = [item for item in question.items if item.quantity == "multipliers"]
    minus_one = [item for item in listed if item.fits(-1.0)]
    others = [item for item in question.items if item not in minus_one]
    values = question.right.values(others, question.convention)
    if minus_one and all(item.fits(values[item.name]) for item in others):
        what = "the integration starts on the strike's surface and meets it at once, which adds a multiplier of -1"
        yield question.explanation("mistake", what)


def conventions(question: Question) -> list[Explanation]:
    """Return the conventions with the fewest changes under which the right gait has every printed digit."""
    found: list[tuple[int, str]] = []
    measures = {item.quantity for item in question.items}
    for what, walk in scenes(question):
        for other in (question.convention, *alternatives(question.convention)):
            changes = [*([what] if what else []), *other.differences(question.convention)]
            if len(changes) > (min(found)[0] if found else MAX_CHANGES) or (not changes):
                continue
            if not measures & {"state", "state_before"} and not only_times(question.convention, other):
                continue
            if question.fits(walk, other):
                found.append((len(changes), join_words(changes)))
    fewest = min((count for count, _ in found), default=0)
    return [question.explanation("convention", what) for count, what in dict.fromkeys(found) if count == fewest]


def only_times(convention: Convention, other: Convention) -> bool:
    return replace(other, time=convention.time, steps=convention.steps) == convention


def scenes(question: Question) -> Iterator[tuple[str, CheckedStep]]:
    """Yield the right gaits, and those of walkers whose leg length includes or excludes the foot's radius."""
    yield from (("", CheckedStep(gait.walker, gait.start, gait.step)) for gait in question.gaits)
    walker = question.walker
    printed = None if question.state is None else start_from(walker, question.state, question.convention.instant)
    starts = [start for start in (printed, question.right.start) if start is not None]
    for sign, how in ((1.0, "excludes"), (-1.0, "includes")) if walker.radius else ():
        foot = walker.foot - sign * 1j * walker.radius
        other = replace(walker, foot=foot)
        gaits = (gait_near(other, start) for start in starts) if foot.imag < 0.0 else iter(())
        gait = next(filter(None, gaits), None)
        if gait is not None:
            yield f"the stated leg length {how} the foot's radius", CheckedStep(other, *gait)


def misprinted_values(question: Question) -> Iterator[Explanation]:
    """Yield explanations by one value with a lost sign or transposed digits, if all but multipliers are right."""
    items = [item for item in question.items if item.quantity != "multipliers"]
    values = question.right.values(items, question.convention)
    wrong = [item for item in items if not item.fits(values[item.name])]
    right = values[wrong[0].name] if len(wrong) == 1 < len(items) else None
    if right is None:
        return
    item = wrong[0]
    name = item.name.removeprefix("state.").replace("_", " ").replace(".", ", ")
    printed = item.printed.real.value
    reproduced = [each for each in question.items if each in question.right_items or each is item]
    if item.fits(-right):
        yield question.explanation("misprint", f"the sign of the printed {name} is wrong", reproduced)
    elif any(item.fits(right + printed - other) for other in transposed(printed)):
        yield question.explanation("misprint", f"two digits of the printed {name} are transposed", reproduced)


def find_periodic_changes(question: Question) -> list[dict[str, float | str]]:
    """Return parameters with new values, each of which alone makes the printed state periodic."""
    if question.state is None:
        return []
    states = replace(question, items=[item for item in question.items if item.quantity == "state"])
    found: list[dict[str, float | str]] = []
    for key, value in parameters(question.config).items():
        size = one_change(states, key, value)
        if size is not None:
            found.append({"key": key, "value": float(f"{size:.6g}")})
    return found


def one_change(question: Question, key: str, value: float) -> float | None:
    """Return the value of a parameter for which the printed state is periodic to its digits, or None."""
    without = signed_misses(question, question.guess(question.walker))
    near = value * (1.0 + 1e-4)
    for _ in range(FITTING_ROUNDS):
        changed = vary_walker(question.config, key, near)
        there = None if changed is None else signed_misses(question, question.guess(changed))
        if without is None or there is None or near == value:
            return None
        slope = (there - without) / (near - value)
        if not slope @ slope:
            return None
        best = value - float(slope @ without / (slope @ slope))
        if abs(best - near) < 1e-6 * abs(value):
            return best if np.abs(there).max() <= 1.0 else None
        near = best
    return None


def undecided(explanations: Sequence[Explanation]) -> str:
    """Return a sentence on how to decide between several explanations, or '' if there is at most one."""
    if len(explanations) < 2:
        return ""
    if {each.kind for each in explanations} == {"convention"}:
        return "Several conventions fit; the source must say which of them it uses."
    return "Several explanations fit; more printed digits, or another printed value, would decide between them."
