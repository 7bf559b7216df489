"""Walks of both models from the paper's ADAMS start (Table 2), and the reason why they end."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.evidence.paper.measured import TIGHT
from walkerlab.evidence.paper.printed import adams_start_as_printed
from walkerlab.evidence.paper.prose import prose
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.comparison import Array
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, sample_energies, sample_feet
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_measures import energies, reactions
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.solvers.system import State

FALLING = 4  # number of last samples in the cubic fit of a falling hip's height


@dataclass(frozen=True)
class AdamsStart:
    """Walk of the rigid model from the ADAMS start."""

    state: State  # rad and rad/s
    slope: float  # rad
    energy: float  # J, kinetic plus potential energy, with heights measured from the stance foot
    weight: float  # N
    normal_force: float  # N, normal force of the ground at the start
    pull_from: float | None  # s, time from which the ground would have to pull; None if never
    heel_strikes: int  # number of heel strikes in the walk
    end: str  # outcome of the walk
    end_time: float  # s


@dataclass(frozen=True)
class AdamsWalk:
    """Walk of the contact model from the ADAMS start."""

    terrain: str  # terrain of the contact model
    rigid: AdamsStart  # walk of the rigid model from the same start, both feet on the config's slope
    walk: ContactWalkResult
    airborne_from: float | None  # s, first time at which no foot of the contact model touches the ground; None if never
    # N, largest normal force of the contact model after the rigid model's ground would have to pull
    later_normal_force: float | None
    normal: NDArray[np.float64]  # (samples, leg) N, normal forces of the contact model
    mechanical: NDArray[np.float64]  # (samples,) J, kinetic and potential energy of the contact model

    @property
    def reason(self) -> str:
        return prose("adams_start.reason", self, int(self.walk.touch_time_s.size))


def adams_start(walker: RigidModel, state: State) -> AdamsStart:
    """Simulate one step of the rigid model from `state`, the ADAMS start of Table 2."""
    walk = take_walk(walker, TIGHT, state, 1, sampled=True)
    assert walk.samples is not None
    time = walk.samples.time_s
    states = walk.samples.state
    start = np.array([state])
    end = float(time[-1])
    if walk.outcome is Outcome.FELL:  # the fall comes after the last sample, so extrapolate
        hip = np.cos(states[-FALLING:, 1] + walker.slope) - FALLEN_HIP
        end = float(np.polynomial.Polynomial.fit(hip, time[-FALLING:], FALLING - 1)(0.0))
    return AdamsStart(
        state=state,
        slope=walker.slope,
        energy=float(energies(walker, start).sum()),
        weight=float(walker.mass * walker.gravity),
        normal_force=float(reactions(walker, start)[0, 1]),
        pull_from=first_below_zero(time, reactions(walker, states)[:, 1]),
        heel_strikes=walk.steps,
        end=walk.outcome.label,
        end_time=end,
    )


def adams_walk(
    walker: RigidModel, walk: Callable[[State], ContactWalkResult], contact: ContactWalker, terrain: str
) -> AdamsWalk:
    """Simulate the contact model from the ADAMS start of Table 2: its stance angle and velocities, on the walker's
    slope.

    walk     function that simulates the contact model from a rigid start state, with samples
    terrain  terrain of the contact model, as named in the config
    """
    _, theta_2, omega_1, omega_2 = adams_start_as_printed()
    rigid = adams_start(walker, (-2.0 * walker.slope - theta_2, theta_2, omega_1, omega_2))
    result = walk(rigid.state)
    assert result.samples is not None
    time = result.samples.time_s
    normal = sample_feet(contact, result.samples)[:, :, 2]
    total = normal.sum(axis=1)
    airborne = time[(total <= 0.0) & (time > 0.0)]
    later = np.zeros(0) if rigid.pull_from is None else total[time >= rigid.pull_from]
    return AdamsWalk(
        terrain=terrain,
        rigid=rigid,
        walk=result,
        airborne_from=float(airborne[0]) if airborne.size else None,
        later_normal_force=float(later.max()) if later.size else None,
        normal=normal,
        mechanical=sample_energies(contact, result.samples)[:, :2].sum(axis=1),
    )


def first_below_zero(time: Array, values: Array) -> float | None:
    """Return the interpolated time (s) at which sampled values first cross zero downwards, or None if they do not."""
    below = np.flatnonzero(values < 0.0)
    if below.size == 0:
        return None
    # The order is reversed, because `np.interp` needs rising values.
    around = [int(below[0]), max(int(below[0]) - 1, 0)]
    return float(np.interp(0.0, values[around], time[around]))
