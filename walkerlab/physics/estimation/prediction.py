"""Predicted steps and angles of a walk, and their derivatives by parameters, start, sensors and floor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.estimation.measurements import LEG_ANGLE, STEP_LENGTH, STEP_PERIOD, MeasuredAngles, MeasuredSteps
from walkerlab.physics.orbits.robustness import CENTRAL_4TH
from walkerlab.physics.orbits.step_map import CENTRAL_2ND, DisturbedWalk
from walkerlab.physics.solvers.system import Floats

CLOCK, OFFSET, GAIN, DELAY = "clock_rate", "angle_offset_rad", "angle_gain", "time_offset_s"
NUISANCES: Final[Mapping[str, tuple[float, float]]] = {
    CLOCK: (1.0, 0.1),
    OFFSET: (0.0, 0.1),
    GAIN: (1.0, 0.1),
    DELAY: (0.0, 0.05),
}
"""Properties of clock and sensors that may be estimated too: value if they are not, and typical change."""
FELT: Final = 1e-3  # change of the next step by a change of the start, below which a direction of the start is lost
LAST_INSTANT: Final = 1e-9  # share of a walk before its last heel strike that counts as after it
START_SCALE: Final = 0.02  # typical change of the start, in coordinates of the section
QUICK_STEP: Final = 1e-5  # of an unknown's scale, in difference quotients while searching
EXACT_STEP: Final = 1e-4  # in those of the result


class WalkMap(Protocol):
    """Walks of a family of walkers from the section; `step_map.StepMap` with values of several parameters."""

    def disturbed(self, z: Floats, p: Any, heights_m: Floats) -> DisturbedWalk:
        """Walk from z (d,) over footholds (steps + 1,)."""

    def sampled(self, z: Floats, p: Any, heights_m: Floats, times_s: Floats) -> Floats:
        """Return the legs' angles (times, 2) at times from the first heel strike, the first swing leg's first."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """Function from unknowns to predicted values.

    The unknowns are parameters, coordinates of the start along `directions`, and nuisances, each over its scale. Angles
    at shares of each step are easy to fit from afar. Angles at their times have no errors of measured heel strikes in
    them: periods are then not measured values of their own.
    """

    walks: WalkMap
    admits: Callable[[tuple[float, ...]], bool]  # whether parameters make a walker
    scales: Floats  # (parameters,) typical changes
    z: Floats  # (d,) start about which the start is sought
    directions: Floats  # (d, starts) of the start, those that the next step feels
    measured: MeasuredSteps | MeasuredAngles
    nuisances: tuple[str, ...] = ()
    in_phase: bool = True  # angles at shares of each measured step rather than at their times

    @cached_property
    def steps(self) -> MeasuredSteps:
        return self.measured.steps if isinstance(self.measured, MeasuredAngles) else self.measured

    @property
    def unknowns(self) -> int:
        return int(self.scales.size + self.directions.shape[1] + len(self.nuisances))

    @property
    def heights(self) -> int:
        """Number of footholds: in time, a step more than measured, in case predicted steps are shorter."""
        return self.steps.count + (1 if self.in_phase else 2)

    @cached_property
    def channels(self) -> dict[str, Floats]:
        """Measured values (steps,) by quantity of the steps."""
        return {name: values for name, values in self.steps.channels().items() if self.in_phase or name != STEP_PERIOD}

    @cached_property
    def values(self) -> Floats:
        """Measured values (values,): channels of the steps, then angles."""
        angles = [self.measured.angles_rad.ravel()] if isinstance(self.measured, MeasuredAngles) else []
        return np.concatenate([*self.channels.values(), *angles])

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        return (*self.channels, *([LEG_ANGLE] if isinstance(self.measured, MeasuredAngles) else []))

    @cached_property
    def quantity(self) -> NDArray[np.int64]:
        """Index (values,) of each value's quantity."""
        sizes = [self.steps.count] * len(self.channels)
        sizes += [self.values.size - sum(sizes)] if isinstance(self.measured, MeasuredAngles) else []
        return np.repeat(np.arange(len(sizes)), sizes)

    def parameters(self, u: Floats) -> tuple[float, ...]:
        return tuple((u[: self.scales.size] * self.scales).tolist())

    def sensors(self, u: Floats) -> dict[str, float]:
        """Return the values of all nuisances."""
        own = dict(zip(self.nuisances, u[self.unknowns - len(self.nuisances) :], strict=True))
        return {name: value + own.get(name, 0.0) * change for name, (value, change) in NUISANCES.items()}

    def start(self, u: Floats) -> Floats:
        first = self.scales.size
        return np.asarray(self.z + START_SCALE * self.directions @ u[first : first + self.directions.shape[1]])

    def predict(self, u: Floats, heights_m: Floats) -> Floats | None:
        """Return the predicted values (values,); None where the walk ends early or the parameters make no walker."""
        p, z, sensors = self.parameters(u), self.start(u), self.sensors(u)
        if not self.admits(p):
            return None
        walk = self.walks.disturbed(z, p, heights_m)
        count = self.steps.count
        if walk.outcome is not Outcome.WALKED or walk.durations_s.size < self.heights - 1:
            return None
        predicted = {
            STEP_PERIOD: walk.durations_s * sensors[CLOCK],
            STEP_LENGTH: walk.lengths_m,
            LEG_ANGLE: walk.angles_rad,
        }
        parts = [predicted[name][:count] for name in self.channels]
        if isinstance(self.measured, MeasuredAngles):
            touches = np.append(0.0, np.cumsum(walk.durations_s))
            times = self._times(touches, walk.durations_s) / (1.0 if self.in_phase else sensors[CLOCK]) + sensors[DELAY]
            order = np.argsort(times)
            angles = np.empty((times.size, 2))
            last = touches[-1] * (1.0 - LAST_INSTANT)
            angles[order] = self.walks.sampled(z, p, heights_m, np.clip(times[order], 0.0, last))
            parts.append((sensors[OFFSET] + sensors[GAIN] * angles).ravel())
        return np.concatenate(parts)

    def _times(self, touches: Floats, durations: Floats) -> Floats:
        """Return the times (samples,) of the samples in the predicted walk, from its first heel strike."""
        assert isinstance(self.measured, MeasuredAngles), "only angles are sampled"
        step, phase = self.measured.step, self.measured.phase
        if self.in_phase:
            return np.asarray(touches[step] + phase * durations[step])
        measured = self.measured.touches_s
        return np.asarray(measured[step] + phase * np.diff(measured)[step] - measured[0])

    def differentiate(self, u: Floats, heights_m: Floats, exact: bool) -> Floats | None:
        """Return the derivatives (values, unknowns) by the unknowns, as difference quotients of exact walks."""

        def moved(place: int, change: float) -> Floats | None:
            shifted = u.copy()
            shifted[place] += change
            return self.predict(shifted, heights_m)

        step = EXACT_STEP if exact else QUICK_STEP
        return self._columns(moved, self.unknowns, CENTRAL_4TH if exact else CENTRAL_2ND, step)

    def respond(self, u: Floats, heights_m: Floats, leg_length_m: float) -> Floats | None:
        """Return the derivatives (values, heights) by the footholds' heights (1/m)."""

        def raised(place: int, change: float) -> Floats | None:
            heights = heights_m.copy()
            heights[place] += change
            return self.predict(u, heights)

        return self._columns(raised, self.heights, CENTRAL_2ND, QUICK_STEP * leg_length_m)

    def _columns(
        self,
        changed: Callable[[int, float], Floats | None],
        count: int,
        formula: Sequence[tuple[int, float]],
        step: float,
    ) -> Floats | None:
        columns = []
        for place in range(count):
            values = [changed(place, offset * step) for offset, _ in formula]
            known = [value for value in values if value is not None]
            if len(known) < len(values):
                return None
            columns.append(np.tensordot([weight / step for _, weight in formula], known, 1))
        return np.array(columns).reshape(count, self.values.size).T


def felt_directions(DP: Floats) -> Floats:
    """Return the directions (d, starts) of the section that the next step feels."""
    _, sizes, rows = np.linalg.svd(DP)
    return np.asarray(rows[sizes > FELT * max(1.0, sizes[0])].T)
