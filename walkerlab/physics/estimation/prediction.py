"""Predicted steps and angles of a walk, and their derivatives with respect to parameters, start, sensors and floor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.estimation.measurements import LEG_ANGLE, STEP_LENGTH, STEP_PERIOD, MeasuredWalk
from walkerlab.physics.orbits.robustness import derivative
from walkerlab.physics.orbits.step_map import DisturbedWalk, StepMap, VariedWalk
from walkerlab.physics.solvers.system import Floats

CLOCK = "clock_rate"
OFFSET = "angle_offset_rad"
GAIN = "angle_gain"
DELAY = "time_offset_s"
NUISANCES: Final[Mapping[str, tuple[float, float]]] = {
    CLOCK: (1.0, 0.1),
    OFFSET: (0.0, 0.1),
    GAIN: (1.0, 0.1),
    DELAY: (0.0, 0.05),
}
"""Properties of the clock and the sensors that can be estimated. For each: its value if it is not estimated, and a
typical change."""
# Drop directions of the start in which a change affects the next step by less than this (relative).
MIN_EFFECT: Final = 1e-3
LAST_INSTANT: Final = 1e-9  # Samples in this last fraction of a walk count as after the last heel strike.
START_SCALE: Final = 0.02  # typical change of each section coordinate of the start
SETTLING_STEP: Final = 1e-4  # step in section coordinates, for difference quotients of settled starts
QUICK_STEP: Final = 1e-6  # step for difference quotients during the search, as a fraction of an unknown's scale
EXACT_STEP: Final = 1e-3  # the same, for difference quotients of the result
# Replaces EXACT_STEP for sampled angles. A larger step would shift their kinks at heel strikes across sample times.
SAMPLED_STEP: Final = 1e-5
# number of predictions to cache, because the search, derivatives and checks request the same walks
KEPT_PREDICTIONS: Final = 16


class Prediction(NamedTuple):
    """A predicted walk. Never write to its arrays, because callers share them."""

    values: Floats  # (values,) predicted values
    walk: DisturbedWalk
    times_s: Floats  # (samples,) times of the angle samples since the first heel strike of the walk
    inside: NDArray[np.bool_]  # (samples,) whether each sample is within the walk
    angles_rad: Floats  # (samples, 2) predicted angles, before offset and gain of the sensors


@dataclass(frozen=True, eq=False, kw_only=True)
class Readings:
    """Measured values of a walk, and how clock and sensors would show a predicted walk.

    If `in_phase`, angles are compared at fractions of each step, so that fits converge from a poor first guess.
    Otherwise they are compared at their sample times, which do not depend on measured heel strikes, and periods do not
    count as measured values.
    """

    measured: MeasuredWalk
    nuisances: tuple[str, ...] = ()  # properties of clock and sensors that are estimated
    in_phase: bool = True  # whether angles are compared at fractions of each step rather than at their sample times

    @cached_property
    def channels(self) -> dict[str, Floats]:
        """Measured values (steps,) by quantity, without angle samples."""
        measured = self.measured.channels()
        return measured if self.in_phase else {name: measured[name] for name in measured if name != STEP_PERIOD}

    @cached_property
    def values(self) -> Floats:
        """Measured values (values,): quantities of the steps, then angle samples."""
        return np.concatenate((*self.channels.values(), self.measured.angles_rad.ravel()))

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        return (*self.channels, LEG_ANGLE) if self.measured.sampled else tuple(self.channels)

    @cached_property
    def quantity(self) -> NDArray[np.int64]:
        """Index (values,) of the quantity that each value measures."""
        sizes = [self.measured.count] * len(self.channels)
        sizes.append(self.measured.angles_rad.size)
        return np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def half_steps(self) -> NDArray[np.int64]:
        """Group index (values,) of each angle: angles of one leg in one half step have the same index.

        Empty if angles are not compared at sample times.
        """
        if self.in_phase or not self.measured.sampled:
            return np.zeros(0, np.int64)
        half = 2 * self.measured.step + (self.measured.phase >= 0.5)
        return np.unique(2 * half[:, None] + [0, 1], return_inverse=True)[1].ravel()

    def sensors(self, u: Floats) -> dict[str, float]:
        """Return the properties of clock and sensors for the unknowns u, which end with the nuisance parameters."""
        estimated = dict(zip(self.nuisances, u[u.size - len(self.nuisances) :], strict=True))
        return {name: value + estimated.get(name, 0.0) * change for name, (value, change) in NUISANCES.items()}

    def step_values(self, walk: DisturbedWalk | VariedWalk, sensors: Mapping[str, float]) -> list[Floats]:
        """Return each channel's values (steps,) in a walk, or their derivatives (steps, columns)."""
        values = {
            STEP_PERIOD: walk.durations_s * sensors[CLOCK],
            STEP_LENGTH: walk.lengths_m,
            LEG_ANGLE: walk.angles_rad,
        }
        return [values[name][: self.measured.count] for name in self.channels]

    def sample_times(self, walk: DisturbedWalk, sensors: Mapping[str, float]) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the sample times (samples,) from the first heel strike of the walk, and whether each is within the
        walk.
        """
        durations, rate = (walk.durations_s, 1.0) if self.in_phase else (self.measured.periods_s, sensors[CLOCK])
        times = self.times_in_steps(durations) / rate + sensors[DELAY]
        last = np.cumsum(walk.durations_s)[-1] * (1.0 - LAST_INSTANT)
        return np.clip(times, 0.0, last), (times >= 0.0) & (times <= last)

    def times_in_steps(self, durations: Floats) -> Floats:
        """Return the sample times (samples, ...), from the first heel strike, in steps of these durations (steps, ...).

        With the measured periods, these are the times on the measurement's own clock. The times are linear in the
        durations, so this also converts changes of durations to changes of times.
        """
        touches = np.concatenate((np.zeros_like(durations[:1]), np.cumsum(durations, axis=0)))
        step = self.measured.step
        return np.asarray(touches[step] + (self.measured.phase * durations[step].T).T)


@dataclass(frozen=True, eq=False, kw_only=True)
class Forecast(Readings):
    """Function from unknowns to predicted values.

    The unknowns are parameters, coordinates of the start along `directions`, and nuisances, each divided by its scale.
    """

    walks: StepMap  # walks of a family of walkers with several parameters, so p is a tuple, not a number
    admits: Callable[[tuple[float, ...]], bool]  # whether parameters give a valid walker
    scales: Floats  # (parameters,) typical changes
    z: Floats  # (d,) section coordinates around which the start is searched for
    directions: Floats  # (d, starts) directions of the start that affect the next step
    kicked: bool = False  # whether kicks disturb the walk in addition to the floor's heights

    @property
    def unknowns(self) -> int:
        return int(self.scales.size + self.directions.shape[1] + len(self.nuisances))

    @property
    def heights(self) -> int:
        """Number of footholds, with one more for angles at sample times, in case predicted steps are shorter."""
        return self.measured.count + (1 if self.in_phase else 2)

    def parameters(self, u: Floats) -> Any:
        return tuple((u[: self.scales.size] * self.scales).tolist())

    def start(self, u: Floats) -> Floats:
        return self.walks.rest_on_ground(self._start_before_settling(u), self.parameters(u))

    def _start_before_settling(self, u: Floats) -> Floats:
        first = self.scales.size
        return np.asarray(self.z + START_SCALE * self.directions @ u[first : first + self.directions.shape[1]])

    def predict(self, u: Floats, heights_m: Floats) -> Prediction | None:
        """Predict the walk, or return None if it ends early or there is no valid walker."""
        prediction: Prediction | None = self._recent(u.tobytes(), heights_m.tobytes())
        return prediction

    @property
    def walks_taken(self) -> int:
        """Number of walks predicted so far."""
        return int(self._recent.cache_info().misses)

    @cached_property
    def _recent(self) -> Any:
        # Arrays cannot be keys of a cache, so use their bytes.
        return lru_cache(KEPT_PREDICTIONS)(lambda *arrays: self._predict(*map(np.frombuffer, arrays)))

    def _predict(self, u: Floats, heights_m: Floats) -> Prediction | None:
        p = self.parameters(u)
        if not self.admits(p):
            return None
        z = self.start(u)
        sensors = self.sensors(u)
        walk = self.walks.take_disturbed_walk(z, p, heights_m)
        if walk.outcome is not Outcome.WALKED or walk.durations_s.size < self.heights - 1:
            return None
        times, inside = self.sample_times(walk, sensors)
        angles = self.walks.sample_legs(z, p, heights_m, times) if times.size else np.zeros((0, 2))
        values = np.concatenate((*self.step_values(walk, sensors), (sensors[OFFSET] + sensors[GAIN] * angles).ravel()))
        return Prediction(values, walk, times, inside, angles)

    def differentiate(
        self, u: Floats, heights_m: Floats, exact: bool, disturbed: bool = True
    ) -> tuple[Floats, Floats] | None:
        """Return derivatives with respect to unknowns (values, unknowns) and disturbances (values, heights + kicks).

        exact      whether differences over parameters are of fourth order; they are one-sided if a walk on one side
        fails
        disturbed  whether to differentiate with respect to the disturbances as well
        """
        # Derivatives with respect to parameters are difference quotients of walks. The others come from tangent
        # columns.
        prediction = self.predict(u, heights_m)
        starts = self.directions.shape[1]
        if prediction is None:
            return None
        by_parameter = [self.slope_along(u, unit, heights_m, exact) for unit in np.eye(u.size)[: self.scales.size]]
        lifts = np.eye(heights_m.size, heights_m.size if disturbed else 0)
        tangents = self._tangents(u, heights_m, lifts, prediction)
        if tangents is None or any(column is None for column in by_parameter):
            return None
        moves, by_sensor = tangents
        return np.column_stack((*by_parameter, moves[:, :starts], by_sensor)), moves[:, starts:]  # type: ignore[arg-type]

    def slope_along(self, u: Floats, direction: Floats, heights_m: Floats, exact: bool) -> Floats | None:
        """Return the difference quotient (values,) along a direction (unknowns,)."""

        def values(share: float) -> Floats | None:
            prediction = self.predict(u + share * direction, heights_m)
            return None if prediction is None else prediction.values

        if exact:
            return derivative(values, SAMPLED_STEP if self.measured.sampled else EXACT_STEP)
        # During the search, differences are one-sided, because these cost one walk instead of two.
        here = values(0.0)
        ahead = values(QUICK_STEP)
        return None if here is None or ahead is None else (ahead - here) / QUICK_STEP

    def _tangents(
        self, u: Floats, heights_m: Floats, lifts: Floats, prediction: Prediction
    ) -> tuple[Floats, Floats] | None:
        """Return the derivatives with respect to the start and the disturbances (values, columns), and those with
        respect to the sensors (values, nuisances).

        lifts  (heights, n) changes of the heights (m) in each disturbance
        """
        sensors = self.sensors(u)
        walk = prediction.walk
        z = self.start(u)
        starts = self.directions.shape[1]
        along = np.zeros((z.size + heights_m.size, starts + lifts.shape[1]))
        p = self.parameters(u)
        settling = differentiate_settling(self.walks, self._start_before_settling(u), p, self.directions)
        along[: z.size, :starts], along[z.size :, starts:] = START_SCALE * settling, lifts
        kicked = self.kicked and lifts.size > 0
        varied = self.walks.differentiate_walk(z, p, heights_m, along, prediction.times_s, kicked)
        if varied is None:
            return None
        angles = prediction.angles_rad
        count = self.measured.count
        # A sample outside the walk has the angle at the nearest end of the walk, so its time has no effect.
        rates = sensors[GAIN] * varied.rates * prediction.inside[:, None]
        moving = varied.samples_rad * sensors[GAIN]
        if self.in_phase:
            moving += rates[:, None] * self.times_in_steps(varied.durations_s)[:, :, None]
        moves = np.concatenate((*self.step_values(varied, sensors), moving.swapaxes(1, 2).reshape(-1, moving.shape[1])))
        # The time of a sample in the model is its measured time divided by the rate of the clock.
        clock = 0.0 if self.in_phase else -self.times_in_steps(self.measured.periods_s)[:, None] / sensors[CLOCK] ** 2
        by_name = {OFFSET: np.ones_like(angles), GAIN: angles, DELAY: rates, CLOCK: rates * clock}
        by_sensor = np.zeros((self.values.size, len(self.nuisances)))
        for column, name in zip(by_sensor.T, self.nuisances, strict=True):
            column[count * len(self.channels) :] = by_name[name].ravel()
            if name == CLOCK and STEP_PERIOD in self.channels:
                column[:count] = walk.durations_s[:count]
            column *= NUISANCES[name][1]
        return moves, by_sensor


def differentiate_settling(walks: StepMap, z: Floats, p: Any, directions: Floats) -> Floats:
    """Return the derivative of the start after `rest_on_ground` with respect to the start before, z (d,).

    directions  (d, starts) directions of z, one derivative for each column
    """
    moves = SETTLING_STEP * directions.T
    ends = [walks.rest_on_ground(z + move, p) - walks.rest_on_ground(z - move, p) for move in moves]
    return np.array(ends).reshape(-1, z.size).T / (2.0 * SETTLING_STEP)


def effective_directions(walks: StepMap, z: Floats, p: Any) -> Floats:
    """Return the directions (d, starts) in which a change of the start z (d,) affects the next step."""
    DP = walks.step(walks.rest_on_ground(z, p), p).DP
    _, sizes, rows = np.linalg.svd(DP @ differentiate_settling(walks, z, p, np.eye(z.size)))
    return np.asarray(rows[sizes > MIN_EFFECT * max(1.0, sizes[0])].T)
