"""Gaits of the right walker and of walkers with mistakes, with all values that may be printed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import numpy as np

from walkerlab.config.check import Instant
from walkerlab.evidence.check.conventions import Convention, state_at
from walkerlab.evidence.check.gaits import derivative
from walkerlab.evidence.check.plain_walker import Floats, PlainStep, PlainWalker
from walkerlab.evidence.check.printed import Item, match_multipliers

POWERS_OF_TIME = {"period_s": -1, "knee_strike_s": -1, "speed_m_s": 1}
"""Power of rates in which a quantity scales with the unit of time."""
ADD_UP = ("period_s", "step_length_m")
"""Quantities whose value for a stride is the sum over its steps."""
PLAIN = (
    "state", "state_before", "multipliers", "spectral_radius", "period_s", "step_length_m", "speed_m_s", "froude",
    "knee_strike_s",
)  # fmt: skip
"""Quantities that the plain model computes."""


@dataclass(frozen=True, eq=False)
class CheckedStep:
    """One step of a walker: a gait, or a first guess at one."""

    walker: PlainWalker
    start: Floats  # coordinates just after the heel strike
    step: PlainStep
    measured: Mapping[str, Any] = field(default_factory=dict)  # values of the compiled model by name

    @cached_property
    def derivative(self) -> Floats | None:
        return derivative(self.walker, self.start)

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the step map on its section, largest first. The one that is always zero is left out."""
        if self.derivative is None:
            return ()
        values = sorted(map(complex, np.linalg.eigvals(self.derivative).tolist()), key=abs, reverse=True)
        return tuple(values[:-1])

    def quantity(self, name: str) -> Any:
        """Return a value of the compiled model or, failing that, of the plain model. None if neither has it."""
        if name in self.measured:
            return self.measured[name]
        if name == "multipliers":
            return self.multipliers
        if name == "spectral_radius":
            return abs(self.multipliers[0]) if self.multipliers else None
        step = self.step
        speed = self.step.length / self.step.period
        return {
            "period_s": step.period,
            "step_length_m": step.length,
            "speed_m_s": speed,
            "froude": speed / math.sqrt(self.walker.gravity * self.walker.leg_length),
            "knee_strike_s": step.knee_strike,
        }.get(name)

    def values(self, items: Sequence[Item], convention: Convention) -> dict[str, complex | None]:
        """Return the value of each printed number, in the printed conventions, or None where there is none."""
        values: dict[str, complex | None] = {}
        factor = convention.rate_factor(self.walker)
        written = self.written(items, convention)
        for item in items:
            value = written[item.quantity] if item.quantity in written else self.quantity(item.quantity)
            if isinstance(value, list | tuple):
                value = value[item.place] if item.place < len(value) else None
            if isinstance(value, int | float | complex):
                scale = factor ** POWERS_OF_TIME.get(item.quantity, 0)
                scale *= convention.steps if item.quantity in ADD_UP else 1
                power = convention.steps if item.quantity == "spectral_radius" else 1
                values[item.name] = complex((value * scale) ** power)
            else:
                values[item.name] = None
        listed = [item for item in items if item.quantity == "multipliers"]
        multipliers = self.quantity("multipliers") if listed else ()
        return values | match_multipliers(listed, [value**convention.steps for value in multipliers])

    @cache  # noqa: B019 - walks are few, and live as long as their check
    def state(self, instant: Instant, vertical: bool) -> Floats | None:
        return state_at(self.walker, self.start, self.step, instant, vertical)

    def written(self, items: Sequence[Item], convention: Convention) -> dict[str, list[float]]:
        """Return the numbers of the printed states by quantity, with an empty list for a state that does not exist."""
        written = {}
        instants = {"state": convention.instant, "state_before": BEFORE}
        for name in instants.keys() & {item.quantity for item in items}:
            state = self.state(instants[name], convention.origin == "vertical")
            written[name] = [] if state is None else convention.write(self.walker, state)
        return written


BEFORE: Instant = "before-strike"
