"""Predicted steps and angles of a walk, and their derivatives with respect to parameters, start, sensors and floor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.estimation.measurements import LEG_ANGLE, STEP_LENGTH, STEP_PERIOD, MeasuredAngles, MeasuredSteps
from walkerlab.physics.orbits.robustness import CENTRAL_4TH
from walkerlab.physics.orbits.step_map import NO_TIMES, DisturbedWalk, MappedStep, VariedWalk
from walkerlab.physics.solvers.system import Floats

CLOCK, OFFSET, GAIN, DELAY = "clock_rate", "angle_offset_rad", "angle_gain", "time_offset_s"
NUISANCES: Final[Mapping[str, tuple[float, float]]] = {
    CLOCK: (1.0, 0.1),
    OFFSET: (0.0, 0.1),
    GAIN: (1.0, 0.1),
    DELAY: (0.0, 0.05),
}
"""Properties of clock and sensors that may be estimated: value if not estimated, and typical change."""
# a direction of the start is dropped if a change along it has a smaller relative effect on the next step
FELT: Final = 1e-3
LAST_INSTANT: Final = 1e-9  # samples in this last fraction of a walk count as after its last heel strike
START_SCALE: Final = 0.02  # typical change of the start, in section coordinates
SETTLING_STEP: Final = 1e-4  # step in section coordinates, for difference quotients of settled starts
QUICK_STEP: Final = 1e-6  # step in an unknown's scale, for difference quotients during the search
FORWARD: Final = ((0, -1.0), (1, 1.0))
EXACT_STEP: Final = 1e-4  # step in an unknown's scale, for difference quotients of the result


class WalkMap(Protocol):
    """Walks of a family of walkers from the section; like `step_map.StepMap`, but with several parameters."""

    def step(self, z: Floats, p: Any) -> MappedStep:
        """Take a step from z (d,), with its derivative."""

    def disturbed(self, z: Floats, p: Any, heights_m: Floats) -> DisturbedWalk:
        """Walk from z (d,) over foothold heights (steps + 1,) in m."""

    def settled(self, z: Floats, p: Any) -> Floats:
        """Return z (d,) with the stance foot at rest on the ground."""

    def sampled(self, z: Floats, p: Any, heights_m: Floats, times_s: Floats) -> Floats:
        """Return the legs' angles (times, 2), first swing leg first, at times counted from the first heel strike."""

    def varied(self, z: Floats, p: Any, heights_m: Floats, along: Floats, times_s: Floats = ...) -> VariedWalk | None:
        """Differentiate the walk and its samples along columns (d + steps + 1, columns) of start and heights."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """Function from unknowns to predicted values.

    The unknowns are parameters, coordinates of the start along `directions`, and nuisances, each divided by its scale.
    If `in_phase`, angles are compared at fractions of each step, so that fits converge from a poor first guess; if not,
    at their sample times, which do not depend on measured heel strikes, and periods do not count as measured values.
    """

    walks: WalkMap
    admits: Callable[[tuple[float, ...]], bool]  # whether parameters give a valid walker
    scales: Floats  # (parameters,) typical changes
    z: Floats  # (d,) section coordinates around which the start is searched for
    directions: Floats  # (d, starts) directions of the start that affect the next step
    measured: MeasuredSteps | MeasuredAngles
    nuisances: tuple[str, ...] = ()
    in_phase: bool = True  # whether angles are compared at fractions of each step rather than at their sample times

    @cached_property
    def steps(self) -> MeasuredSteps:
        return self.measured.steps if isinstance(self.measured, MeasuredAngles) else self.measured

    @property
    def unknowns(self) -> int:
        return int(self.scales.size + self.directions.shape[1] + len(self.nuisances))

    @property
    def heights(self) -> int:
        """Number of footholds; one more for angles at sample times, in case predicted steps are shorter."""
        return self.steps.count + (1 if self.in_phase else 2)

    @cached_property
    def channels(self) -> dict[str, Floats]:
        """Measured values (steps,) by quantity, without angle samples."""
        return {name: values for name, values in self.steps.channels().items() if self.in_phase or name != STEP_PERIOD}

    @cached_property
    def values(self) -> Floats:
        """Measured values (values,): quantities of the steps, then angle samples."""
        angles = [self.measured.angles_rad.ravel()] if isinstance(self.measured, MeasuredAngles) else []
        return np.concatenate([*self.channels.values(), *angles])

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        return (*self.channels, *([LEG_ANGLE] if isinstance(self.measured, MeasuredAngles) else []))

    @cached_property
    def quantity(self) -> NDArray[np.int64]:
        """Index (values,) of the quantity of each value."""
        sizes = [self.steps.count] * len(self.channels)
        sizes += [self.values.size - sum(sizes)] if isinstance(self.measured, MeasuredAngles) else []
        return np.repeat(np.arange(len(sizes)), sizes)

    def parameters(self, u: Floats) -> tuple[float, ...]:
        return tuple((u[: self.scales.size] * self.scales).tolist())

    def sensors(self, u: Floats) -> dict[str, float]:
        own = dict(zip(self.nuisances, u[self.unknowns - len(self.nuisances) :], strict=True))
        return {name: value + own.get(name, 0.0) * change for name, (value, change) in NUISANCES.items()}

    def start(self, u: Floats) -> Floats:
        return self.walks.settled(self._unsettled(u), self.parameters(u))

    def _unsettled(self, u: Floats) -> Floats:
        first = self.scales.size
        return np.asarray(self.z + START_SCALE * self.directions @ u[first : first + self.directions.shape[1]])

    def predict(self, u: Floats, heights_m: Floats) -> Floats | None:
        """Return the predicted values (values,); None if the walk ends early or there is no valid walker."""
        walk = self._walk(u, heights_m)
        if walk is None:
            return None
        sensors, count = self.sensors(u), self.steps.count
        predicted = {
            STEP_PERIOD: walk.durations_s * sensors[CLOCK],
            STEP_LENGTH: walk.lengths_m,
            LEG_ANGLE: walk.angles_rad,
        }
        parts = [predicted[name][:count] for name in self.channels]
        if isinstance(self.measured, MeasuredAngles):
            angles = self.walks.sampled(self.start(u), self.parameters(u), heights_m, self._times(walk, sensors)[0])
            parts.append((sensors[OFFSET] + sensors[GAIN] * angles).ravel())
        return np.concatenate(parts)

    def differentiate(self, u: Floats, heights_m: Floats, exact: bool) -> Floats | None:
        """Return derivatives (values, unknowns); differences over parameters are forward, or 4th-order if `exact`."""
        # Derivatives for parameters are difference quotients of exact walks; the others follow from tangent columns.
        none = np.zeros((heights_m.size, 0))
        columns = self._columns_along(u, heights_m, none)
        return None if columns is None else self._with_parameters(u, heights_m, columns, exact)

    def differentiate_all(self, u: Floats, heights_m: Floats, exact: bool) -> tuple[Floats, Floats] | None:
        """Return derivatives with respect to unknowns, (values, unknowns), and to heights, (values, heights) in 1/m."""
        columns = self._columns_along(u, heights_m, np.eye(heights_m.size))
        J = None if columns is None else self._with_parameters(u, heights_m, columns, exact)
        if columns is None or J is None:
            return None
        starts = self.directions.shape[1]
        return J, columns[:, starts : starts + heights_m.size]

    def _walk(self, u: Floats, heights_m: Floats) -> DisturbedWalk | None:
        p = self.parameters(u)
        if not self.admits(p):
            return None
        walk = self.walks.disturbed(self.start(u), p, heights_m)
        whole = walk.outcome is Outcome.WALKED and walk.durations_s.size >= self.heights - 1
        return walk if whole else None

    def _times(self, walk: DisturbedWalk, sensors: Mapping[str, float]) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the sample times (samples,) from the walk's first heel strike, and whether each is within the walk."""
        assert isinstance(self.measured, MeasuredAngles), "only angles are sampled"
        touches, step = np.append(0.0, np.cumsum(walk.durations_s)), self.measured.step
        times = self._measured_times() / sensors[CLOCK]
        if self.in_phase:
            times = touches[step] + self.measured.phase * walk.durations_s[step]
        times, last = times + sensors[DELAY], touches[-1] * (1.0 - LAST_INSTANT)
        return np.clip(times, 0.0, last), (times >= 0.0) & (times <= last)

    def _measured_times(self) -> Floats:
        """Return the sample times (samples,) from the first measured heel strike, on the measurement's clock."""
        assert isinstance(self.measured, MeasuredAngles), "only angles are sampled"
        touches, step = self.measured.touches_s, self.measured.step
        return np.asarray(touches[step] + self.measured.phase * np.diff(touches)[step] - touches[0])

    def _columns_along(self, u: Floats, heights_m: Floats, lifts: Floats) -> Floats | None:
        """Return derivatives (values, columns) for coordinates of the start, heights along `lifts`, and nuisances."""
        walk, sensors, count = self._walk(u, heights_m), self.sensors(u), self.steps.count
        if walk is None:
            return None
        z, starts = self.start(u), self.directions.shape[1]
        along = np.zeros((z.size + heights_m.size, starts + lifts.shape[1]))
        settling = settling_along(self.walks, self._unsettled(u), self.parameters(u), self.directions)
        along[: z.size, :starts], along[z.size :, starts:] = START_SCALE * settling, lifts
        sampled = isinstance(self.measured, MeasuredAngles)
        times, inside = self._times(walk, sensors) if sampled else (NO_TIMES, NO_TIMES)
        varied = self.walks.varied(z, self.parameters(u), heights_m, along, times)
        if varied is None:
            return None
        changes = {
            STEP_PERIOD: varied.durations_s * sensors[CLOCK],
            STEP_LENGTH: varied.lengths_m,
            LEG_ANGLE: varied.angles_rad,
        }
        parts = [changes[name][:count] for name in self.channels]
        by_sensor = {name: [np.zeros(count) for _ in self.channels] for name in self.nuisances}
        if CLOCK in by_sensor and STEP_PERIOD in self.channels:
            by_sensor[CLOCK][list(self.channels).index(STEP_PERIOD)] = walk.durations_s[:count]
        if sampled:
            rates = sensors[GAIN] * varied.rates * inside[:, None]
            moving = varied.samples_rad * sensors[GAIN] + rates[:, None] * self._drift(varied.durations_s)[:, :, None]
            parts.append(moving.swapaxes(1, 2).reshape(-1, along.shape[1]))
            angles = self.walks.sampled(z, self.parameters(u), heights_m, times)
            clock = np.zeros(times.size) if self.in_phase else -self._measured_times() / sensors[CLOCK] ** 2
            own = {OFFSET: np.ones_like(angles), GAIN: angles, DELAY: rates, CLOCK: rates * clock[:, None]}
            for name, columns in by_sensor.items():
                columns.append(own[name].ravel())
        last = [NUISANCES[name][1] * np.concatenate(columns) for name, columns in by_sensor.items()]
        return np.column_stack((np.concatenate(parts), *last))

    def _drift(self, durations: Floats) -> Floats:
        """Return the changes (samples, columns) of the sample times caused by changes of the steps' durations."""
        assert isinstance(self.measured, MeasuredAngles), "only angles are sampled"
        if not self.in_phase:
            return np.zeros((self.measured.step.size, durations.shape[1]))
        touches = np.concatenate((np.zeros((1, durations.shape[1])), np.cumsum(durations, axis=0)))
        step = self.measured.step
        return np.asarray(touches[step] + self.measured.phase[:, None] * durations[step])

    def _with_parameters(self, u: Floats, heights_m: Floats, columns: Floats, exact: bool) -> Floats | None:
        """Join the derivatives for parameters with the `columns` of the other unknowns; returns (values, unknowns)."""
        formula, step = (CENTRAL_4TH, EXACT_STEP) if exact else (FORWARD, QUICK_STEP)
        starts, own = self.directions.shape[1], []
        predict = cache(lambda place, offset: self.predict(u + offset * step * np.eye(u.size)[place], heights_m))
        for place in range(self.scales.size):
            values = [predict(place if offset else 0, offset) for offset, _ in formula]
            known = [value for value in values if value is not None]
            if len(known) < len(values):
                return None
            own.append(np.tensordot([weight / step for _, weight in formula], known, 1))
        return np.column_stack((*own, columns[:, :starts], columns[:, columns.shape[1] - len(self.nuisances) :]))


def settling_along(walks: WalkMap, z: Floats, p: Any, directions: Floats) -> Floats:
    """Return the derivatives (d, starts) of the settled start along directions (d, starts) of z (d,)."""
    h = SETTLING_STEP
    ends = [walks.settled(z + h * column, p) - walks.settled(z - h * column, p) for column in directions.T]
    return np.array(ends).reshape(-1, z.size).T / (2.0 * h)


def felt_directions(walks: WalkMap, z: Floats, p: Any) -> Floats:
    """Return the directions (d, starts) in which a change of the start z (d,) affects the next step."""
    DP = walks.step(walks.settled(z, p), p).DP
    _, sizes, rows = np.linalg.svd(DP @ settling_along(walks, z, p, np.eye(z.size)))
    return np.asarray(rows[sizes > FELT * max(1.0, sizes[0])].T)
