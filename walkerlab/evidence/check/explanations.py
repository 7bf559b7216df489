"""Search for a cause that reproduces all printed values: other conventions, a known mistake, or a misprint.

Each candidate is a walker: the plain model with a mistake that is known from publications and programs, or with a
misprinted parameter. A step from the printed state gives a first guess of its gait. Gaits are solved only for the best
candidates, and only a gait that reproduces the printed digits is an explanation.
"""

import heapq
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from operator import attrgetter, itemgetter
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config.fields import replace_key, short_number
from walkerlab.config.reads import RigidConfig, flatten
from walkerlab.evidence.check import plain_walker as plain
from walkerlab.evidence.check.gaits import GRAVITIES, CheckedStep, Convention, alternatives, gait_near
from walkerlab.evidence.check.plain_walker import EXACT, QUICK, Floats, Mistake, PlainWalker
from walkerlab.evidence.check.printed import Item, spell_name
from walkerlab.labels import join_words

MAX_SOLVED: Final = 5  # maximum number of candidates whose gaits are computed
FARTHEST_GUESS = 0.3  # rad, distance from the printed state above which a first guess makes no sense
SAME_GUESS = 1e-7  # a candidate that changes the first guess by less than this (relative) is skipped
# maximum number of rounds in which the size of a mistake is fitted, and the factor by which the fit must reduce the
# largest deviation from the printed values
FITTING_ROUNDS, MIN_GAIN = 4, 3.0
ROUND_SIZES: Final = (1.0, 2.0, 5.0, 2.5)
SIZE_SHARE = 0.03  # a round number is tried as the size if it is this close to the fitted size (relative)
MIN_REPRODUCED = 3  # an explanation must reproduce at least this many printed numbers, or all if fewer are printed
MUCH_CLOSER = 5.0  # a cause is reported only if it brings gaits this many times closer to the printed values
READINGS = 3  # number of other conventions under which we search for mistakes
# Conventions whose deviation is at most this multiple of the smallest one are ranked by their number of changes.
NEAR_FACTOR = 4.0
CONVERGED: Final = 1e-6  # a fit ends when its value changes by less than this (relative)
SLOPE = "slope_rad"
GRAVITY = "gravity_m_s2"
FIELDS: Final[Mapping[str, Any]] = {SLOPE: "slope", GRAVITY: "gravity"}
"""Fields of the plain walker that are top-level keys of the config."""
UNIT = re.compile(r"_(m|kg|kg_m2|rad|m_s2)$")


class Candidate(NamedTuple):
    """A walker that may explain the printed values."""

    kind: str  # mistake or misprint
    what: str  # completes the sentence 'All printed values follow if ...'
    walker: PlainWalker
    family: str = ""  # description of the mistake without its size; empty if it has no size


def generate_misprints(config: RigidConfig) -> Iterator[Candidate]:
    """Yield walkers with one parameter changed as a misprint could change it."""
    values = parameters(config)
    for key, value in values.items():
        for other, how in list_misprints(key, value, values):
            if (walker := walker_with(config, key, other)) is not None:
                yield Candidate("misprint", f"{key} is {short_number(other)} ({how})", walker)


def parameters(config: RigidConfig) -> dict[str, float]:
    """Return the parameters that are not zero, by dotted key."""
    block = {SLOPE: config.slope_rad, GRAVITY: config.gravity_m_s2, "walker": config.walker.model_dump()}
    return {key: value for key, value in flatten(block) if isinstance(value, float) and value and UNIT.search(key)}


def walker_with(config: RigidConfig, key: str, value: float) -> PlainWalker | None:
    """Return the plain walker with another value of one parameter, or None if it cannot be built."""
    own: dict[str, Any] = {FIELDS[key]: value} if key in FIELDS else {}
    changed = None if own else replace_key(config.walker, key.removeprefix("walker."), value)
    walker = replace(plain.plain_walker(config, changed), **own)
    turns = all(part.inertia + part.mass * abs(part.centre) ** 2 > 0.0 for part in walker.parts[: 1 + walker.kneed])
    return walker if turns and walker.leg_length > walker.radius >= 0.0 < walker.gravity else None


def list_misprints(key: str, value: float, values: Mapping[str, float]) -> list[tuple[float, str]]:
    """Return the values that may have been misprinted as `value`, each with a description of the misprint.

    values  parameters of the config, one of which may have been printed in place of another
    """
    unit = UNIT.findall(key)
    found = {other: f"the value of {name}" for name, other in values.items() if UNIT.findall(name) == unit}
    found |= dict.fromkeys(transpose_digits(value), "two digits are transposed")
    found |= {float(f"{value * factor:.12g}"): "a factor of ten" for factor in (0.1, 10.0)}
    if key == SLOPE:
        found[math.radians(value)] = "degrees as radians"
    if key == GRAVITY:
        found |= dict.fromkeys(GRAVITIES, "another gravity")
    return [(other, how) for other, how in found.items() if other != value]


def transpose_digits(value: float) -> Iterator[float]:
    """Yield the numbers obtained from `value` by swapping two neighbouring digits."""
    text = short_number(value)
    for place, (first, second) in enumerate(pairwise(text)):
        if first.isdigit() and second.isdigit() and first != second:
            yield float(text[:place] + second + first + text[place + 2 :])


@dataclass(frozen=True)
class Explanation:
    """A cause that would produce the printed values."""

    kind: str  # convention, mistake or misprint
    what: str  # completes the sentence 'All printed values follow if ...'
    reproduces: tuple[str, ...]  # names of the printed numbers that follow from it
    digits: int  # number of digits of the least precise of these numbers


Attempt = tuple[Candidate, CheckedStep]
"""A candidate and the gait of its walker."""


@dataclass(frozen=True)
class Question:
    """Printed numbers that the plain model can compute, and the correct gait."""

    config: RigidConfig
    items: Sequence[Item]
    convention: Convention
    right: CheckedStep
    state: Floats | None  # printed state of all bodies, or None if no state is printed
    gaits: Sequence[CheckedStep] = ()  # all correct gaits

    @property
    def walker(self) -> PlainWalker:
        return self.right.walker

    @cached_property
    def state_items(self) -> list[Item]:
        """Printed numbers of states."""
        return [item for item in self.items if item.quantity.startswith("state")]

    @cached_property
    def exact_items(self) -> list[Item]:
        """Printed numbers that need no derivative."""
        return [item for item in self.items if item.quantity not in ("multipliers", "spectral_radius")]

    @cached_property
    def quick_items(self) -> list[Item]:
        """Printed numbers of states or, if no state is printed, all numbers that need no derivative."""
        return self.state_items or self.exact_items

    def explanation(self, kind: str, what: str, items: Sequence[Item] = ()) -> Explanation:
        reproduced = items or self.items
        return Explanation(kind, what, tuple(each.name for each in reproduced), min(each.count for each in reproduced))

    def reproduced(self, walk: CheckedStep, items: Sequence[Item], convention: Convention | None = None) -> list[Item]:
        """Return the printed numbers that a gait reproduces to every digit."""
        values = walk.values(items, convention or self.convention)
        return [item for item in items if item.fits(values[item.name])]

    def fits(self, walk: CheckedStep, convention: Convention) -> bool:
        """Whether a gait reproduces every printed digit. The numbers that are fastest to compute are compared first."""
        return all(self.reproduced(walk, items, convention) == items for items in (self.quick_items, self.items))

    def explained_by(self, candidate: Candidate, gait: CheckedStep) -> Explanation | None:
        """Return what a candidate's gait explains, or None if it explains too little.

        The gait must reproduce every digit of the printed states, and of at least three printed numbers (of all, if
        fewer are printed).
        """
        if self.reproduced(gait, self.state_items) != self.state_items:
            return None
        reproduced = self.reproduced(gait, self.items)
        enough = len(reproduced) >= min(MIN_REPRODUCED, len(self.items))
        return self.explanation(candidate.kind, candidate.what, reproduced) if enough else None

    def miss(self, walk: CheckedStep, items: Sequence[Item]) -> float:
        """Return the largest difference between a walk and a printed value, in units of the value's last digit."""
        values = walk.values(items, self.convention)
        return max((item.miss(values[item.name]) for item in items), default=math.inf)

    def misses(self, walker: PlainWalker | None) -> Floats | None:
        """Return how far a walker's first guess is from each printed value: signed, in units of its last digit.

        Return None if there is no first guess, or if there are fewer than two values to compare.
        """
        walk = None if walker is None else self.guess(walker, EXACT)
        if walk is None:
            return None
        values = walk.values(self.quick_items, self.convention)
        known = [(values[item.name], item) for item in self.quick_items if item.printed.bounds is None]
        found = [(value.real - item.value) / item.last_digit for value, item in known if value is not None]
        return np.array(found) if len(found) > 1 else None

    def guess(self, walker: PlainWalker, tolerance: float = QUICK) -> CheckedStep | None:
        """Return a first guess of a walker's gait, by one Newton step.

        The step begins at the printed state or, if no state is printed, at the start of the correct gait. Returns None
        if it leads nowhere.
        """
        instant = self.convention.instant
        start = self.right.start if self.state is None else plain.start_from(walker, self.state, instant)
        step = None if start is None else plain.take_step(walker, start, tolerance)
        if step is None or start is None or self.right.derivative is None:
            return None
        move = np.linalg.solve(np.eye(len(start)) - self.right.derivative, step.after - start)
        if np.abs(move[:2]).max() > FARTHEST_GUESS:
            return None
        # Printed values such as the period need the step from the new start. A state just after a strike does not.
        quantities = {instant, *(item.quantity for item in self.quick_items)}
        after = step if quantities == {"after-strike", "state"} else plain.take_step(walker, start + move, tolerance)
        return None if after is None else CheckedStep(walker, start + move, after)

    def attempt(self, candidate: Candidate, guess: CheckedStep | None) -> Iterator[Attempt]:
        """Yield the gait of a candidate near a first guess, if there is one."""
        gait = None if guess is None else gait_near(candidate.walker, guess.start, self.right.derivative)
        if gait is not None:
            yield candidate, gait


def explain(question: Question) -> tuple[list[Explanation], dict[str, Any] | None]:
    """Return the explanations that fit or, if none does, the cause that comes closest.

    Other conventions and misprinted values are tried first, then mistakes and misprinted parameters, and finally these
    together with other conventions.
    """
    # Almost any cause can explain a single number.
    if sum(item.printed.bounds is None for item in question.items) < 2:
        return [], None
    if found := [*find_conventions(question), *find_misprinted_value(question)]:
        return found, None
    attempts = [*attempt_all(question)]
    found = [*find_strike_at_start(question), *explain_by_gaits(question, attempts)]
    if not found:
        for changes, reading in find_closer_readings(question):
            for each in explain_by_gaits(reading, attempt_all(reading)):
                if len(each.reproduces) == len(question.items):
                    found.append(replace(each, what=f"{changes}, and {each.what}"))
            if found:
                break
    most = max((len(each.reproduces) for each in found), default=0)
    complete = [each for each in found if len(each.reproduces) == most]
    return complete, None if complete else find_closest(question, attempts)


def explain_by_gaits(question: Question, attempts: Iterator[Attempt] | Sequence[Attempt]) -> Iterator[Explanation]:
    """Yield an explanation for each attempt whose gait supports one. A mistake tried at several sizes counts once."""
    families: set[str] = set()
    for candidate, gait in attempts:
        explanation = None if candidate.family in families else question.explained_by(candidate, gait)
        if explanation is not None:
            yield explanation
            families |= {candidate.family} - {""}


def find_closer_readings(question: Question) -> Iterator[tuple[str, Question]]:
    """Yield each convention that fits the printed values better than the stated one, and the question restated in it.

    A convention must bring the correct gait much closer to the printed values, or at least closer if it puts both feet
    on the slope and the stated one does not.
    """
    if question.state is None:
        return
    walker = question.walker
    items = [item for item in question.items if item.quantity == "state"]
    far = question.miss(question.right, question.exact_items)
    readings: dict[Any, tuple[float, Convention]] = {}
    for other in alternatives(question.convention):
        # If the correct gait has the same values in several conventions, keep the first, which has the fewest changes.
        values = question.right.values(question.exact_items, other)
        miss = max(item.miss(values[item.name]) for item in question.exact_items)
        if miss < far:
            readings.setdefault(tuple(values.values()), (miss, other))
    standing = [(miss, other) for miss, other in readings.values() if other.stands(walker, items)]
    gain = 1.0 if standing and not question.convention.stands(walker, items) else MUCH_CLOSER
    closer = [(miss, other) for miss, other in standing or readings.values() if miss * gain < far]
    near = NEAR_FACTOR * min((miss for miss, _ in closer), default=0.0)
    closer.sort(key=lambda each: (len(each[1].differences(question.convention)), each[0]))
    for other in [other for miss, other in closer if miss <= near][:READINGS]:
        state = other.read(walker, [item.value for item in items], plain.full_state(walker, question.right.start))
        yield join_words(other.differences(question.convention)), replace(question, convention=other, state=state)


def find_closest(question: Question, attempts: Sequence[Attempt]) -> dict[str, Any] | None:
    """Return the cause that comes closest to the printed values, or None if it is not much closer than the gait."""
    if not question.quick_items:
        return None
    without = question.miss(question.right, question.quick_items)
    misses = ((question.miss(gait, question.quick_items), candidate) for candidate, gait in attempts)
    miss, candidate = min(misses, default=(math.inf, None), key=itemgetter(0))
    if candidate is None or miss * MUCH_CLOSER > without:
        return None
    return {"kind": candidate.kind, "what": candidate.what, "miss_in_units": miss, "without_in_units": without}


def attempt_all(question: Question) -> Iterator[Attempt]:
    """Yield the most promising candidates, then mistakes with a fitted size, each with its gait."""
    right = question.guess(question.walker)
    guesses = []
    mistakes = [*plain.list_mistakes(question.walker)]
    candidates = [Candidate("mistake", each.what, each.of_size(0.0)) for each in mistakes if not each.first]
    candidates += generate_misprints(question.config)
    for place, candidate in enumerate(candidates):
        guess = question.guess(candidate.walker)
        if guess is not None and not (right and np.allclose(guess.start, right.start, SAME_GUESS, SAME_GUESS)):
            guesses.append((question.miss(guess, question.quick_items), place, guess))
    # The index breaks ties, because guesses cannot be compared.
    for _, place, guess in heapq.nsmallest(MAX_SOLVED, guesses):
        yield from question.attempt(candidates[place], guess)
    if len(question.items) < MIN_REPRODUCED:
        return
    for mistake in filter(attrgetter("first"), mistakes):
        for size in sizes_to_try(question, mistake):
            candidate = Candidate("mistake", mistake.what.format(f"{size:.4g}"), mistake.of_size(size), mistake.what)
            yield from question.attempt(candidate, question.guess(candidate.walker, EXACT))


class FittedSize(NamedTuple):
    """Value of a parameter that brings gaits closest to the printed values."""

    value: float
    change: float  # relative change of the value in the last round
    without: float  # largest distance from the printed values at `begin`, in units of their last digits
    left: float  # predicted largest distance after the fit, if gaits change in proportion to the parameter


def fit(
    question: Question, walker_of: Callable[[float], PlainWalker | None], begin: float, near: float,
    limits: tuple[float, float] = (-math.inf, math.inf),
) -> FittedSize | None:  # fmt: skip
    """Fit a parameter to the printed values by the secant method, or return None if that leads nowhere.

    begin, near  two values of the parameter with which the method starts
    limits       smallest and largest value allowed
    """
    without = question.misses(walker_of(begin))
    result = None
    for _ in range(FITTING_ROUNDS):
        there = question.misses(walker_of(near))
        if without is None or there is None or near == begin:
            return None
        slope = (there - without) / (near - begin)
        # A parameter that changes no printed value must not move, hence the division by infinity.
        move = -float(slope @ without) / float(slope @ slope or math.inf)
        value = begin + move
        if not limits[0] <= value <= limits[1]:
            return None
        left = float(np.abs(without + move * slope).max())
        result = FittedSize(value, abs(value / near - 1.0), float(np.abs(without).max()), left)
        if result.change < CONVERGED:
            break
        near = value
    return result


def sizes_to_try(question: Question, mistake: Mistake) -> Iterator[float]:
    """Fit the size of a mistake to the printed values. Yield round sizes near the fitted one, then the fitted one.

    Yield nothing if the mistake does not come much closer than the correct gait.
    """
    fitted = fit(question, mistake.of_size, 0.0, mistake.first, mistake.limits)
    if fitted is None or fitted.left * MIN_GAIN > fitted.without:
        return
    size = fitted.value
    power = 10.0 ** math.floor(math.log10(size))
    for digit in (*ROUND_SIZES, 10.0):
        if abs(digit * power / size - 1.0) < SIZE_SHARE:
            yield float(f"{digit * power:.3g}")
    yield float(f"{size:.3g}")
    yield size


def find_strike_at_start(question: Question) -> Iterator[Explanation]:
    """Yield the explanation that the integration starts at a heel strike and detects that strike again at once.

    It applies only if a multiplier of -1 is printed and the gait reproduces all other values.
    """
    minus_one = [item for item in question.items if item.quantity == "multipliers" and item.fits(-1.0)]
    others = [item for item in question.items if item not in minus_one]
    if minus_one and len(question.reproduced(question.right, others)) == len(others):
        what = "the integration starts at a heel strike, which is found again at once and adds a multiplier of -1"
        yield question.explanation("mistake", what)


def find_conventions(question: Question) -> Iterator[Explanation]:
    """Yield other conventions under which the correct gait reproduces every printed digit.

    Only those with the fewest changes are kept.
    """
    found: dict[str, int] = {}
    for what, walk in list_right_gaits(question):
        for other in (question.convention, *alternatives(question.convention)):
            changes = [*([what] if what else []), *other.differences(question.convention)]
            if not changes or len(changes) > min(found.values(), default=math.inf):
                continue
            times = replace(question.convention, time=other.time, steps=other.steps)
            if (question.state_items or other == times) and question.fits(walk, other):
                found.setdefault(join_words(changes), len(changes))
    for what, changed in found.items():
        if changed == min(found.values()):
            yield question.explanation("convention", what)


def list_right_gaits(question: Question) -> Iterator[tuple[str, CheckedStep]]:
    """Yield correct gaits with the change that each needs: none, or another reading of the stated leg length.

    The leg length may have been meant to include the foot's radius, or to exclude it.
    """
    yield from (("", gait) for gait in question.gaits)
    walker = question.walker
    printed = None if question.state is None else plain.start_from(walker, question.state, question.convention.instant)
    starts = [start for start in (printed, question.right.start) if start is not None]
    for sign, how in ((1.0, "excludes"), (-1.0, "includes")) if walker.radius else ():
        foot = walker.foot - sign * 1j * walker.radius
        other = replace(walker, foot=foot)
        # The search makes no sense for a foot above the hip.
        gaits = (gait_near(other, start) for start in starts if foot.imag < 0.0)
        for gait in [*filter(None, gaits)][:1]:
            yield f"the stated leg length {how} the foot's radius", gait


def find_misprinted_value(question: Question) -> Iterator[Explanation]:
    """Yield the explanation that one value has a wrong sign or two exchanged digits.

    All other values must be right, except for multipliers, which do not count.
    """
    items = [item for item in question.items if item.quantity != "multipliers"]
    values = question.right.values(items, question.convention)
    wrong = [item for item in items if not item.fits(values[item.name])]
    right = values[wrong[0].name] if len(wrong) == 1 < len(items) else None
    if right is None:
        return
    item = wrong[0]
    name = spell_name(item.name)
    printed = item.value
    reproduced = [item, *question.reproduced(question.right, question.items)]
    if item.fits(-right):
        yield question.explanation("misprint", f"the sign of the printed {name} is wrong", reproduced)
    elif any(item.fits(right + printed - other) for other in transpose_digits(printed)):
        yield question.explanation("misprint", f"two digits of the printed {name} are transposed", reproduced)


def find_periodic_changes(question: Question) -> list[dict[str, float | str]]:
    """Return new values of parameters, by key. Each of them alone would make the printed state periodic."""
    if question.state is None:
        return []
    states = replace(question, items=[item for item in question.items if item.quantity == "state"])
    found: list[dict[str, float | str]] = []
    for key, value in parameters(question.config).items():
        change = fit(states, partial(walker_with, question.config, key), value, value * (1.0 + 1e-4))
        if change is not None and change.change < CONVERGED and change.left <= 1.0:
            found.append({"key": key, "value": float(f"{change.value:.6g}")})
    return found


def advise(explanations: Sequence[Explanation]) -> str:
    """Return a sentence on how to decide between several explanations, or '' if there is at most one."""
    if len(explanations) < 2:
        return ""
    if {each.kind for each in explanations} == {"convention"}:
        return "Several conventions fit. The source must say which of them it uses."
    return "Several explanations fit. More printed digits, or another printed value, would decide between them."
