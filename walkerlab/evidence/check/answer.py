"""Check of a printed gait: a comparison of every printed value with the right one, and explanations of differences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from walkerlab.config.check import Check
from walkerlab.config.problems import suggestion
from walkerlab.config.reads import CheckConfig
from walkerlab.errors import ConfigError
from walkerlab.evidence.check.conventions import (
    Convention,
    coordinates_of,
    put_feet_on_slope,
    start_from,
    stated,
)
from walkerlab.evidence.check.explanations import (
    Explanation,
    Question,
    advise_on_ambiguity,
    explain,
    find_periodic_changes,
)
from walkerlab.evidence.check.gaits import PLAIN, CheckedStep, gait_near, plain_walker, scales, why_not_plain
from walkerlab.evidence.check.plain_walker import EXACT, STANCE, STRAIGHT, SWING, Floats, PlainWalker
from walkerlab.evidence.check.printed import (
    DIFFERENT,
    EXACT_ERROR,
    EXPLAINED,
    NOT_COMPARABLE,
    REPRODUCED,
    UNEXPLAINED,
    Item,
    Judgement,
    items_of,
    judge,
    spell_name,
)
from walkerlab.physics.orbits.fixed_point import GaitSearch, find_gaits
from walkerlab.pipeline.stages.fixedpoint import gait_summary
from walkerlab.scene.rigid import rigid_walker, state_names

SAME_ROUTE: Final = 1e-10  # largest difference between the two routes, with L and g of 1
SAME_GAIT: Final = 1e-6
CHOSEN: Final = "chosen"
SMALL_VALUE: Final = 1e-3  # smallest printed value whose differences are relative to it, not absolute
GAIT_VALUES: Final = (
    "state", "multipliers", "period_s", "step_length_m", "speed_m_s", "froude", "spectral_radius", "knee_strike_s",
    "energy_J", "energy_drift_J", "cost_of_transport", "min_normal_force_N", "max_friction_ratio", "max_scuff_depth_m",
    "min_normal_impulse_N_s", "max_impulse_ratio", "work_per_step_J.gravity", "work_per_step_J.push_off",
    "work_per_step_J.hip",
)  # fmt: skip
"""Values of `fixedpoint` that may be printed."""
WALK_VALUES: Final = {
    "mean_energy_J": "energy_J",
    "last_step_period_s": "period_s",
    "last_step_length_m": "step_length_m",
    "step_periods_s": "period_s",
    "step_lengths_m": "step_length_m",
}
"""Values of `simulate` that may be printed, with the equal values of `fixedpoint`."""
RATES = "rate"
ANGLES = "angle"


def refuse_unknown(config: CheckConfig) -> None:
    """Raise ConfigError if a config's block `check` names values that no gait has, or states that do not fit."""
    check = config.check
    if check is None:
        return
    known = (*GAIT_VALUES, *WALK_VALUES)
    for name in check.printed:
        if name not in known:
            hint = suggestion(name, known)
            place = ("check", "printed", name)
            raise ConfigError(f"check.printed: a gait has no {name}.{hint}", f"Choose from {', '.join(known)}.", place)
    for name, texts in states_of(check).items():
        if isinstance(texts, str):
            raise ConfigError(f"check.printed: {name} is one value.", "Give a list of angles and rates.")
        if texts and not why_not_plain(config):
            stated(check, len(texts), 3 if config.walker.type == "kneed" else 2, name)


def states_of(check: Check) -> dict[str, Any]:
    return {"state": check.printed.get("state"), "state_before": check.state_before}


@dataclass(frozen=True)
class Checked:
    """A printed gait and the right gaits of its walker."""

    config: CheckConfig
    check: Check
    search: GaitSearch

    @cached_property
    def walker(self) -> PlainWalker:
        return plain_walker(self.config)

    @cached_property
    def items(self) -> list[Item]:
        """Printed numbers of a gait, those of states first."""
        listed = states_of(self.check)
        return items_of({**listed, **self.check.printed}, {name: self.components(name) for name in listed})

    def components(self, name: str) -> list[str]:
        """Return the names of the numbers of a printed state."""
        convention = self.conventions.get(name)
        if convention is None:
            return []
        pairs = [[f"{body}_{kind}" for kind in (ANGLES, RATES)] for body in convention.order]
        interleaved = [name for pair in pairs for name in pair]
        return interleaved if convention.layout == "interleaved" else interleaved[::2] + interleaved[1::2]

    @cached_property
    def conventions(self) -> dict[str, Convention]:
        """Conventions of the printed states, by name."""
        found = {}
        for name, texts in states_of(self.check).items():
            if texts:
                reading = stated(self.check, len(texts), 3 if self.walker.kneed else 2, name)
                printed = items_of({name: texts}, {})
                unit = max(item.unit for item in printed)
                numbers = [item.printed.value.real for item in printed]
                found[name] = put_feet_on_slope(reading, self.walker, numbers, unit)
        return found

    @property
    def convention(self) -> Convention:
        """Convention of the printed state or, if none is printed, this package's own."""
        if self.conventions:
            return next(iter(self.conventions.values()))
        return stated(self.check, 2 * len(self.check.angles.order or (0, 0)), 3)

    @property
    def has_both_legs(self) -> bool:
        """Whether the printed states have the rates of both legs."""
        return {"swing", "stance"}.issubset(self.convention.order)

    def printed_state(self, name: str, known: Floats) -> Floats | None:
        """Return a printed state of all bodies. Values that are not printed are those of the state `known`."""
        if name not in self.conventions:
            return None
        return self.conventions[name].read(self.walker, self.numbers(name), known)

    def numbers(self, name: str) -> list[float]:
        return [item.printed.value.real for item in self.items if item.quantity == name]

    def rounding(self, name: str, known: Floats) -> Floats:
        """Return how much the numbers of a state change if each printed one changes by a unit of its last digit."""
        convention = self.conventions[name]
        units = [item.unit for item in self.items if item.quantity == name]
        numbers = np.array(self.numbers(name))
        state = convention.read(self.walker, numbers.tolist(), known)
        total = np.zeros(len(known))
        for move in np.diag(units):
            total += np.abs(convention.read(self.walker, (numbers + move).tolist(), known) - state)
        return total

    @cached_property
    def walks(self) -> list[CheckedStep]:
        """The right gaits, with their values by the compiled model."""
        names = state_names(self.config)
        found = []
        for gait in self.search.gaits:
            rates = gait.state[len(names) // 2 :]
            extra = (rates[2],) if self.walker.kneed and self.walker.free_at_strike else ()
            start = np.array([*(angle + self.walker.slope for angle in gait.state[:2]), *rates[:2], *extra])
            step = self.walker.step(start)
            if step is not None:
                measured = {**values_of(gait_summary(gait)), CHOSEN: gait is self.search.gait}
                found.append(CheckedStep(self.walker, start, step, measured))
        return found

    @cached_property
    def right(self) -> CheckedStep | None:
        """The right gait nearest to the printed one, or None if no gait was found."""
        if not self.walks:
            return None
        if not self.items:
            return max(self.walks, key=lambda walk: bool(walk.measured[CHOSEN]))
        nearest = min(self.walks, key=self.distance)
        state = self.printed_state("state", self.walker.full_state(nearest.start))
        start = None if state is None else start_from(self.walker, state, self.convention.instant)
        if start is None or np.abs(start - nearest.start).max() < SAME_GAIT:
            return nearest
        gait = gait_near(self.walker, start)
        other = nearest if gait is None else CheckedStep(self.walker, *gait)
        moved = np.abs(other.start - nearest.start).max() > SAME_GAIT
        return other if moved and self.distance(other) < self.distance(nearest) else nearest

    def distance(self, walk: CheckedStep) -> float:
        """Return the distance of a gait from the printed values, each relative to its size."""
        values = walk.values(self.items, self.convention)
        pairs = [(item.printed.value, values[item.name]) for item in self.items]
        return sum(
            1.0 if value is None else min(abs(value - printed) / (abs(printed) + SMALL_VALUE), 1.0)
            for printed, value in pairs
        )

    def judged(self) -> Iterator[tuple[Item, complex | None, Judgement]]:
        """Yield each printed number with the right one and its verdict."""
        values = {} if self.right is None else self.right.values(self.items, self.convention)
        for item in self.items:
            right = values.get(item.name)
            why = self.search.reason if self.right is None else f"this gait has no {spell_name(item.name)}"
            yield item, right, judge(item, right, why)

    @cached_property
    def question(self) -> Question | None:
        """Printed values to explain, or None without a right gait."""
        right = self.right
        if right is None:
            return None
        plain = CheckedStep(right.walker, right.start, right.step)
        values = plain.values(self.items, self.convention)
        items = [item for item in self.items if item.quantity in PLAIN and values[item.name] is not None]
        state = self.printed_state("state", self.walker.full_state(right.start))
        return Question(self.config, items, self.convention, plain, state, self.walks)


def values_of(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the printable values of a gait by name, from its summary."""
    values: dict[str, Any] = {name: value for name, value in summary.items() if isinstance(value, int | float)}
    values |= {f"work_per_step_J.{source}": work for source, work in summary["work_per_step_J"].items()}
    values["multipliers"] = tuple(complex(*pair) for pair in summary["multipliers"])
    for name, same in WALK_VALUES.items():
        values[name] = [values[same]] * 1000 if name.startswith("step_") else values[same]
    return values


def check_gait(config: CheckConfig, explains: bool = True) -> dict[str, Any]:
    """Check the printed gait of a config, and return the answer as JSON values.

    explains  whether to search for an explanation of values that differ

    Raises ConfigError if the config has no block `check`, or one that does not fit its walker.
    """
    if config.check is None:
        raise ConfigError("the config has no check block.", "`walkerlab init FILE --check` writes one to fill in.")
    refuse_unknown(config)
    if reason := why_not_plain(config):
        return answer_without(config.check, f"{reason}, so no second route confirms the right values")
    checked = Checked(config, config.check, find_gaits(rigid_walker(config), config.seed))
    right = checked.right
    question = checked.question
    if right is None or question is None:
        return answer_without(config.check, f"the walker has no gait here ({checked.search.reason})")
    judged = [*checked.judged()]
    rows = [as_row(*each) for each in judged]
    searched = explains and any(verdict.digits < item.digits for item, value, verdict in judged if value is not None)
    explanations, closest = explain(question) if searched else ([], None)
    periodic = periodicity(checked, question)
    if periodic and searched and not periodic["is_periodic"]:
        periodic["periodic_with"] = find_periodic_changes(question)
    return {
        "source": config.check.source.model_dump(),
        "finding": finding_of(rows, explanations),
        "conventions": asdict(checked.convention),
        "values": rows,
        "periodic": periodic,
        "momenta": momenta(checked),
        **energy_drift(checked),
        "explanations": [asdict(each) for each in explanations],
        "closest": closest,
        "undecided": advise_on_ambiguity(explanations),
        "searched": searched,
        "nearest_gait": nearest_gait(checked, right),
        "routes": routes(right),
    }


def answer_without(check: Check, reason: str) -> dict[str, Any]:
    """Return the answer if there is no right gait to compare with."""
    items = items_of({**check.printed, "state_before": check.state_before}, {})
    rows = [as_row(item, None, judge(item, None, reason)) for item in items]
    head = {"source": check.source.model_dump(), "finding": NOT_COMPARABLE, "reason": reason, "values": rows}
    lists: dict[str, Any] = {"momenta": [], "explanations": [], "undecided": "", "searched": False}
    return {**head, **lists, **dict.fromkeys(("periodic", "closest", "nearest_gait", "routes"))}


def as_row(item: Item, right: complex | None, verdict: Judgement) -> dict[str, Any]:
    """Return a printed number and its verdict as JSON values. A complex right value is a pair."""
    value: Any = None
    if right is not None:
        value = [right.real, right.imag] if item.printed.imaginary or right.imag else right.real
    return {
        "name": item.name,
        "printed": item.printed.text,
        "right": value,
        "right_text": "" if right is None else as_printed(right, item),
        "digits": verdict.digits,
        "of_digits": item.digits,
        "difference_in_units": None if right is None else item.miss(right),
        "verdict": verdict.verdict,
        "evidence": verdict.evidence,
    }


MORE_DIGITS: Final = 2  # digits of a right value beyond those of the printed one
MOST_DECIMALS: Final = 12


def as_printed(right: complex, item: Item) -> str:
    """Format a right value with `MORE_DIGITS` more digits than the printed one."""
    decimals = min(max(round(-math.log10(item.printed.real.unit)) + MORE_DIGITS, 0), MOST_DECIMALS)
    text = f"{right.real:.{decimals}f}"
    if item.printed.imaginary is None and not right.imag:
        return text
    sign = "±" if item.printed.both_signs else "+" if right.imag >= 0.0 else "-"
    return f"{text} {sign} {abs(right.imag):.{decimals}f}i"


def finding_of(rows: Sequence[Mapping[str, Any]], explanations: Sequence[Explanation]) -> str:
    """Summarise the verdicts: reproduced, explained, different without explanation, or not comparable."""
    verdicts = {row["verdict"] for row in rows}
    wrong = {row["name"] for row in rows if row["verdict"] == DIFFERENT}
    if explanations and wrong.issubset(explanations[0].reproduces):
        return EXPLAINED
    if DIFFERENT in verdicts:
        return UNEXPLAINED
    return REPRODUCED if REPRODUCED in verdicts else NOT_COMPARABLE


def periodicity(checked: Checked, question: Question) -> dict[str, Any] | None:
    """Measure how far the printed state is from periodic, or return None if none is printed or it does not walk."""
    walker = checked.walker
    right = question.right
    state = question.state if checked.has_both_legs else None
    if state is None or right.derivative is None:
        return None
    start = start_from(walker, state, question.convention.instant)
    step = None if start is None else walker.step(start)
    if start is None or step is None:
        return {"residual": None, "digits": 0, "is_periodic": False}
    unit = scales(walker, len(start))
    known = walker.full_state(right.start)
    residual = np.abs(step.after - start)
    # change of the state just after a strike that is due to the rounding of the printed state alone
    rounding = coordinates_of(walker, checked.rounding("state", known))
    left = np.abs(right.derivative - np.eye(len(start))) @ rounding + EXACT_ERROR * unit
    largest = float((residual / unit).max())
    before = float((np.abs(start - right.start) / unit).max())
    answer = {
        "residual": largest,
        "unit": "angles in rad, rates times sqrt(L/g)",
        "digits": max(0, math.floor(-math.log10(max(largest, EXACT)))),
        "in_units_of_last_digit": float((residual / np.maximum(rounding, EXACT_ERROR * unit)).max()),
        "is_periodic": bool(np.all(residual <= left)),
        "distance_from_gait": before,
        "distance_after_a_step": float((np.abs(step.after - right.start) / unit).max()),
        "state_after_step": checked.convention.write(walker, walker.full_state(step.after)),
    }
    if question.convention.origin == "vertical" and question.convention.instant == "after-strike":
        # both feet stand on the slope that the legs' angles have
        answer["slope_rad"] = float(walker.slope - 0.5 * (start[SWING] + start[STANCE]) - walker.lean)
    return answer


def momenta(checked: Checked) -> list[dict[str, Any]]:
    """Return the balances of angular momentum over the heel strike that precedes the printed state."""
    if checked.right is None or checked.convention.instant != "after-strike" or not checked.has_both_legs:
        return []
    walker = checked.walker
    right = checked.right
    known = walker.full_state(right.start)
    state = checked.printed_state("state", known)
    if state is None:
        return []
    start = coordinates_of(walker, state)
    rounding = coordinates_of(walker, checked.rounding("state", known))
    known = walker.full_state(right.step.before)
    printed = checked.printed_state("state_before", known)
    if printed is None:
        step = walker.step(start)
        if step is None:
            return []
        before = step.before
    else:
        n = len(printed) // 2
        before = np.concatenate((printed[:2], printed[n : n + 2]))
        rounding = rounding + np.resize(checked.rounding("state_before", known)[[0, 1, n, n + 1]], len(rounding))
    M, momentum = walker.strike_balances(before)
    # the momenta before change with rounded angles and rates about as much as those after
    size = np.abs(start[2:]).max()
    allowed = 2.0 * np.abs(M).sum(axis=1) * (rounding[2:].max() + size * rounding[:2].max() + EXACT_ERROR)
    return [
        {
            "about": about,
            "residual": float(residual),
            "unit": "kg m^2/s",
            "relative": float(abs(residual) / np.abs(row * start[2:]).sum()),
            "conserved": bool(abs(residual) <= limit),
            "before": "computed from the printed state" if printed is None else "printed",
        }
        for about, row, residual, limit in zip(walker.balances(), M, M @ start[2:] - momentum, allowed, strict=True)
    ]


def energy_drift(checked: Checked) -> dict[str, Any]:
    """Return the change of energy (J) from the printed state just after a strike to the one before the next."""
    if checked.right is None or checked.convention.instant != "after-strike" or checked.walker.kneed:
        return {}
    right = checked.right
    walker = checked.walker
    start = checked.printed_state("state", right.start)
    end = checked.printed_state("state_before", right.step.before)
    if start is None or end is None:
        return {}
    return {"energy_drift_J": walker.energy(STRAIGHT, end) - walker.energy(STRAIGHT, start)}


def nearest_gait(checked: Checked, walk: CheckedStep) -> dict[str, Any]:
    """Describe the right gait that is nearest to the printed one."""
    radius = walk.quantity("spectral_radius")
    return {
        "state": [*(float(angle) - walk.walker.slope for angle in walk.start[:2]), *map(float, walk.start[2:])],
        "state_names": ["theta_1", "theta_2", "dtheta_1", "dtheta_2", "dtheta_1_shank"][: len(walk.start)],
        "period_s": walk.quantity("period_s"),
        "step_length_m": walk.quantity("step_length_m"),
        "multipliers": [[value.real, value.imag] for value in walk.quantity("multipliers")],
        "stable": radius is not None and radius < 1.0,
        "gaits": len(checked.walks),
    }


def routes(walk: CheckedStep) -> dict[str, Any]:
    """Compare both routes: the compiled model's gait must return to itself in the plain model."""
    unit = scales(walk.walker, len(walk.start))
    difference = float(np.abs((walk.step.after - walk.start) / unit).max())
    if "period_s" in walk.measured:
        difference = max(difference, abs(walk.measured["period_s"] - walk.step.period) / walk.walker.pendulum_time)
    return {"difference": difference, "agree": difference < SAME_ROUTE}
