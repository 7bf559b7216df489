"""Check of a printed gait: compare every printed value with the right one, and explain the differences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from walkerlab.config.check import Check
from walkerlab.config.problems import suggestion
from walkerlab.config.reads import CheckConfig
from walkerlab.errors import ConfigError
from walkerlab.evidence.check import plain_walker as plain
from walkerlab.evidence.check.explanations import Explanation, Question, advise, explain, find_periodic_changes
from walkerlab.evidence.check.gaits import CheckedStep, Convention, Values, gait_near, put_feet_on_slope, stated
from walkerlab.evidence.check.plain_walker import EXACT, Floats, PlainStep, PlainWalker
from walkerlab.evidence.check.printed import EXACT_ERROR, UNEXPLAINED, Item, Verdict, items_of, judge, spell_name
from walkerlab.physics.orbits.fixed_point import GaitSearch, find_gaits
from walkerlab.pipeline.stages.fixedpoint import gait_summary
from walkerlab.scene.rigid import rigid_walker, state_names

SAME_ROUTE: Final = 1e-10  # both models agree if they differ by less than this, with L and g set to 1
SAME_GAIT: Final = 1e-6  # starts that differ by less than this belong to the same gait
SMALL_VALUE: Final = 1e-3  # differences are relative for printed values above this, and absolute below
GAIT_VALUES: Final = (
    "state", "multipliers", "period_s", "step_length_m", "speed_m_s", "froude", "spectral_radius", "knee_strike_s",
    "energy_J", "energy_drift_J", "cost_of_transport", "min_normal_force_N", "max_friction_ratio", "max_scuff_depth_m",
    "min_normal_impulse_N_s", "max_impulse_ratio", "work_per_step_J.gravity", "work_per_step_J.push_off",
    "work_per_step_J.hip",
)  # fmt: skip
"""Values of `fixedpoint` that may be printed."""
WALK_VALUES: Final = {
    "mean_energy_J": "energy_J", "last_step_period_s": "period_s", "last_step_length_m": "step_length_m",
    "step_periods_s": "period_s", "step_lengths_m": "step_length_m",
}  # fmt: skip
"""Values of `simulate` that may be printed, each with the value of `fixedpoint` that it equals on a gait."""


def refuse_unknown(check: Check) -> None:
    """Raise ConfigError if the block `check` names a value that no gait has, or if a printed state is not a list."""
    known = (*GAIT_VALUES, *WALK_VALUES)
    for name in check.printed:
        if name not in known:
            hint = suggestion(name, known)
            place = ("check", "printed", name)
            raise ConfigError(f"check.printed: a gait has no {name}.{hint}", f"Choose from {', '.join(known)}.", place)
    for name, texts in printed_states(check).items():
        if isinstance(texts, str):
            raise ConfigError(f"check.printed: {name} is one value, not a list.", "Give a list of angles and rates.")


def printed_states(check: Check) -> dict[str, Any]:
    """Return the printed states, by name."""
    states = {"state": check.printed.get("state"), "state_before": check.state_before}
    return {name: texts for name, texts in states.items() if texts}


@dataclass(frozen=True)
class Checked:
    """A printed gait and the correct gaits of its walker."""

    config: CheckConfig
    check: Check

    @cached_property
    def search(self) -> GaitSearch:
        return find_gaits(rigid_walker(self.config), self.config.seed)

    @cached_property
    def walker(self) -> PlainWalker:
        return plain.plain_walker(self.config)

    @cached_property
    def items(self) -> list[Item]:
        """All printed numbers, those of states first."""
        listed = printed_states(self.check)
        return items_of({**listed, **self.check.printed}, {name: self.stated(name).names for name in listed})

    def stated(self, name: str) -> Convention:
        """Return the convention that the config states for a printed state."""
        return stated(self.check, len(printed_states(self.check)[name]), 3 if self.walker.kneed else 2, name)

    def numbers(self, name: str) -> list[Item]:
        return [item for item in self.items if item.quantity == name]

    @cached_property
    def conventions(self) -> dict[str, Convention]:
        """Conventions of the printed states, by name."""
        return {
            name: put_feet_on_slope(self.stated(name), self.walker, self.numbers(name))
            for name in printed_states(self.check)
        }

    @property
    def convention(self) -> Convention:
        """Convention of the printed state or, if none is printed, the one that the block `check` states."""
        printed = next(iter(self.conventions.values()), None)
        return printed or stated(self.check, 2 * len(self.check.angles.order or (0, 0)), 3)

    def printed_state(self, name: str, known: Floats) -> tuple[Floats, Floats] | None:
        """Return a printed state of all bodies, and its change if each number changes by one unit in its last digit.

        Values that are not printed are taken from the state `known`. Return None if the state is not printed.
        """
        if name not in self.conventions:
            return None
        items = self.numbers(name)
        numbers = np.array([item.value for item in items])
        moves = np.diag([item.last_digit for item in items])
        convention = self.conventions[name]
        state, *moved = (convention.read(self.walker, each, known) for each in (numbers, *(numbers + moves)))
        return state, np.abs(np.subtract(moved, state)).sum(axis=0)

    @cached_property
    def gaits(self) -> dict[CheckedStep, dict[str, Any]]:
        """The correct gaits, with values from the compiled model. The gait that `fixedpoint` reports comes first."""
        names = state_names(self.config)
        found = {}
        # False sorts before True, so the reported gait comes first.
        for gait in sorted(self.search.gaits, key=lambda gait: gait is not self.search.gait):
            rates = gait.state[len(names) // 2 :]
            extra = (rates[2],) if self.walker.kneed and self.walker.free_at_strike else ()
            start = np.array([*(angle + self.walker.slope for angle in gait.state[:2]), *rates[:2], *extra])
            if (step := plain.take_step(self.walker, start)) is not None:
                found[CheckedStep(self.walker, start, step)] = printable_values(gait_summary(gait))
        return found

    @cached_property
    def right(self) -> CheckedStep:
        """The correct gait nearest to the printed one."""
        nearest = min(self.gaits, key=self.distance)
        printed = self.printed_state("state", plain.full_state(self.walker, nearest.start))
        start = None if printed is None else plain.start_from(self.walker, printed[0], self.convention.instant)
        if start is None or np.abs(start - nearest.start).max() < SAME_GAIT:
            return nearest
        # The search of the compiled model may miss a gait near the printed state.
        other = gait_near(self.walker, start, nearest.derivative) or nearest
        moved = np.abs(other.start - nearest.start).max() > SAME_GAIT
        return other if moved and self.distance(other) < self.distance(nearest) else nearest

    def values(self, gait: CheckedStep) -> Values:
        """Return a gait's values for all the printed numbers, in the printed convention."""
        return gait.values(self.items, self.convention, self.gaits.get(gait, {}))

    def distance(self, gait: CheckedStep) -> float:
        """Return the sum of the relative differences of a gait from all printed values, each at most 1."""
        values = self.values(gait)
        pairs = [(item.printed.value, values[item.name]) for item in self.items]
        return sum(
            1.0 if value is None else min(abs(value - printed) / (abs(printed) + SMALL_VALUE), 1.0)
            for printed, value in pairs
        )

    @cached_property
    def question(self) -> Question:
        """The printed values that the plain model can compute. An explanation must reproduce these."""
        values = self.right.values(self.items, self.convention)
        items = [item for item in self.items if values[item.name] is not None]
        printed = self.printed_state("state", plain.full_state(self.walker, self.right.start))
        return Question(self.config, items, self.convention, self.right, printed and printed[0], [*self.gaits])

    @cached_property
    def printed_step(self) -> PrintedStep | None:
        """A step from the printed state, or None if no state of both legs is printed."""
        printed = self.printed_state("state", plain.full_state(self.walker, self.right.start))
        if printed is None or not {"swing", "stance"}.issubset(self.convention.order):
            return None
        start = plain.start_from(self.walker, printed[0], self.convention.instant)
        step = None if start is None else plain.take_step(self.walker, start)
        return PrintedStep(start, step, plain.coordinates(self.walker, printed[1]))


class PrintedStep(NamedTuple):
    """An exact step from a printed state."""

    start: Floats | None  # coordinates just after a heel strike, or None if the state does not lead to one
    step: PlainStep | None
    rounding: Floats  # change of the start that is due to the rounding of the printed state


def printable_values(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the printable values of a gait by name, from its summary."""
    values: dict[str, Any] = {name: value for name, value in summary.items() if isinstance(value, int | float)}
    values |= {f"work_per_step_J.{source}": work for source, work in summary["work_per_step_J"].items()}
    values["multipliers"] = tuple(complex(*pair) for pair in summary["multipliers"])
    for name, same in WALK_VALUES.items():
        # On a gait all steps are equal, however many are printed.
        values[name] = [values[same]] * 1000 if name.startswith("step_") else values[same]
    return values


def check_gait(config: CheckConfig) -> dict[str, Any]:
    """Check the printed gait of a config, and return the answer as JSON values.

    Raises ConfigError if the config has no block `check`, or if the block does not fit the walker.
    """
    check = config.check
    if check is None:
        raise ConfigError("the config has no check block.", "`walkerlab init FILE --check` writes one to fill in.")
    refuse_unknown(check)
    if reason := plain.why_not_plain(config):
        return answer_without(check, f"{reason}, so no second route confirms the right values")
    checked = Checked(config, check)
    items = checked.items  # raises ConfigError if states do not fit the walker
    if not checked.gaits:
        return answer_without(check, f"the walker has no gait here ({checked.search.reason})")
    right = checked.right
    values = checked.values(right)
    rows = [judge(item, values[item.name], f"this gait has no {spell_name(item.name)}").row for item in items]
    searched = any(row["digits"] < row["of_digits"] and row["right"] is not None for row in rows)
    explanations, closest = explain(checked.question) if searched else ([], None)
    periodic = periodicity(checked, right)
    if periodic and searched and not periodic["is_periodic"]:
        periodic["periodic_with"] = find_periodic_changes(checked.question)
    return {
        "source": check.source.model_dump(),
        "finding": summarise_verdicts(rows, explanations),
        "conventions": asdict(checked.convention),
        "values": rows,
        "periodic": periodic,
        "momenta": momenta(checked, right),
        **energy_drift(checked, right),
        "explanations": [asdict(each) for each in explanations],
        "closest": closest,
        "undecided": advise(explanations),
        "searched": searched,
        "nearest_gait": nearest_gait(checked, right),
        "routes": routes(checked, right),
    }


def answer_without(check: Check, reason: str) -> dict[str, Any]:
    """Return the answer for a gait that cannot be compared, for the given reason."""
    items = items_of({**check.printed, "state_before": check.state_before}, {})
    head = {
        "source": check.source.model_dump(),
        "finding": Verdict.NOT_COMPARABLE.value,
        "reason": reason,
        "values": [judge(item, None, reason).row for item in items],
    }
    lists: dict[str, Any] = {"momenta": [], "explanations": [], "undecided": "", "searched": False}
    return {**head, **lists, **dict.fromkeys(("periodic", "closest", "nearest_gait", "routes"))}


def summarise_verdicts(rows: Sequence[Mapping[str, Any]], explanations: Sequence[Explanation]) -> str:
    """Summarise the verdicts: reproduced, explained, different without explanation, or not comparable."""
    verdicts = {row["verdict"] for row in rows}
    wrong = {row["name"] for row in rows if row["verdict"] == Verdict.DIFFERENT}
    if explanations and wrong.issubset(explanations[0].reproduces):
        return Verdict.EXPLAINED.value
    if Verdict.DIFFERENT in verdicts:
        return UNEXPLAINED
    return (Verdict.REPRODUCED if Verdict.REPRODUCED in verdicts else Verdict.NOT_COMPARABLE).value


def periodicity(checked: Checked, right: CheckedStep) -> dict[str, Any] | None:
    """Measure how far the printed state is from periodic, or return None if no state is printed."""
    walker = checked.walker
    printed = checked.printed_step
    if printed is None or right.derivative is None:
        return None
    start, step, rounding = printed
    if start is None or step is None:
        return {"residual": None, "digits": 0, "is_periodic": False}
    unit = plain.scales(walker, len(start))
    residual = np.abs(step.after - start)
    # A periodic state may change by this much over a step, because it is printed with rounding.
    allowed = np.abs(right.derivative - np.eye(len(start))) @ rounding + EXACT_ERROR * unit
    largest = float((residual / unit).max())
    answer = {
        "residual": largest,
        "unit": "angles in rad, rates times sqrt(L/g)",
        "digits": max(0, math.floor(-math.log10(max(largest, EXACT)))),
        "in_units_of_last_digit": float((residual / np.maximum(rounding, EXACT_ERROR * unit)).max()),
        "is_periodic": bool(np.all(residual <= allowed)),
        "distance_from_gait": float((np.abs(start - right.start) / unit).max()),
        "distance_after_a_step": float((np.abs(step.after - right.start) / unit).max()),
        "state_after_step": checked.convention.write(walker, plain.full_state(walker, step.after)),
    }
    if checked.convention.origin == "vertical" and checked.convention.instant == "after-strike":
        # the slope on which both feet stand with the legs at these angles
        answer["slope_rad"] = walker.slope - 0.5 * walker.feet_apart(start)
    return answer


def momenta(checked: Checked, right: CheckedStep) -> list[dict[str, Any]]:
    """Return how well angular momentum is conserved over the heel strike just before the printed state."""
    walker = checked.walker
    own = checked.printed_step
    if own is None or own.start is None or checked.convention.instant != "after-strike":
        return []
    start = own.start
    rounding = own.rounding
    printed = checked.printed_state("state_before", plain.full_state(walker, right.step.before))
    if printed is not None:
        n = len(printed[0]) // 2
        before, moved = (values[[0, 1, n, n + 1]] for values in printed)
        rounding = rounding + np.resize(moved, len(rounding))
    elif own.step is not None:
        before = own.step.before
    else:
        return []
    M, momentum = plain.strike_balances(walker, before)
    # Rounding changes the momenta before the strike about as much as those after it, hence the factor of 2.
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
        for about, row, residual, limit in zip(
            plain.name_balances(walker), M, M @ start[2:] - momentum, allowed, strict=True
        )
    ]


def energy_drift(checked: Checked, right: CheckedStep) -> dict[str, Any]:
    """Return the change of energy (J) between the printed state just after a strike and the one just before the next.

    The result is empty if one of them is not printed.
    """
    walker = checked.walker
    if walker.kneed or checked.convention.instant != "after-strike":
        return {}
    start = checked.printed_state("state", right.start)
    end = checked.printed_state("state_before", right.step.before)
    if start is None or end is None:
        return {}
    return {"energy_drift_J": plain.energy(walker, end[0]) - plain.energy(walker, start[0])}


def nearest_gait(checked: Checked, gait: CheckedStep) -> dict[str, Any]:
    """Describe the correct gait that is nearest to the printed one."""
    names = ("period_s", "step_length_m", "multipliers", "spectral_radius")
    measured = checked.gaits.get(gait, {})
    values = {name: measured[name] if name in measured else gait.quantity(name) for name in names}
    radius = values["spectral_radius"]
    return {
        "state": [*(float(angle) - gait.walker.slope for angle in gait.start[:2]), *map(float, gait.start[2:])],
        "state_names": ["theta_1", "theta_2", "dtheta_1", "dtheta_2", "dtheta_1_shank"][: len(gait.start)],
        "period_s": values["period_s"],
        "step_length_m": values["step_length_m"],
        "multipliers": [[value.real, value.imag] for value in values["multipliers"]],
        "stable": radius is not None and radius < 1.0,
        "gaits": len(checked.gaits),
    }


def routes(checked: Checked, gait: CheckedStep) -> dict[str, Any]:
    """Compare both models: in the plain model, the gait of the compiled model must return to itself after a step."""
    unit = plain.scales(gait.walker, len(gait.start))
    period = checked.gaits.get(gait, {}).get("period_s", gait.step.period)
    difference = float(np.abs((gait.step.after - gait.start) / unit).max())
    difference = max(difference, abs(period - gait.step.period) / gait.walker.pendulum_time)
    return {"difference": difference, "agree": difference < SAME_ROUTE}
