"""Measurements to compare with the printed numbers: both sets of rigid equations, and the contact model."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from walkerlab.config.contact import Contact
from walkerlab.evidence.paper.appendix_a import RigidWalker, assembled, step_length
from walkerlab.physics.hybrid.comparison import Array, WalkDifference
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_measures import energies
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import State

TIGHT = Tolerances("dop853", 1e-12, 1e-14, ENDLESS)
"""Errors are far below any printed digit."""
PAPER_CYCLES = 5  # walked in the paper
ENERGY_STEPS = 5  # over which the paper averages the energy


@dataclass(frozen=True)
class Characteristics:
    """Quantities of Table 3, SI units; None where the walk or its record is too short."""

    t_left: float | None  # period of the first step of the last completed stride
    t_right: float | None  # period of its second step
    t_cycle: float | None  # their sum
    v_com: float | None  # length of the stride along the slope over t_cycle
    # time mean of kinetic and potential energy, from the current stance foot, over at least five steps
    E_avg: float | None


def characteristics(periods: Array, lengths: Array, mean_energy: float | None) -> Characteristics:
    """Compute Table 3 from the periods (s) and lengths (m) of a walk's steps."""
    strides = len(periods) // 2
    if strides == 0:
        first = float(periods[0]) if len(periods) else None
        return Characteristics(first, None, None, None, mean_energy)
    left, right = 2 * strides - 2, 2 * strides - 1
    cycle = float(periods[left] + periods[right])
    speed = float(lengths[left] + lengths[right]) / cycle
    return Characteristics(float(periods[left]), float(periods[right]), cycle, speed, mean_energy)


@dataclass(frozen=True)
class EnergyRecord:
    """Time mean and extremes (J) of an energy."""

    mean: float
    least: float
    most: float


def over_last_steps(time: Array, energy: Array, step_ends: Array) -> EnergyRecord | None:
    """Average a sampled energy over the last five completed steps, or fewer; None without a step."""
    if step_ends.size == 0:
        return None
    start = step_ends[-1 - ENERGY_STEPS] if step_ends.size > ENERGY_STEPS else time[0]
    end = min(step_ends[-1], time[-1])
    inside = (time > start) & (time < end)
    times = np.concatenate(([start], time[inside], [end]))
    record = np.interp(times, time, energy)
    mean = np.sum(0.5 * (record[1:] + record[:-1]) * np.diff(times)) / (end - start)
    return EnergyRecord(float(mean), float(record.min()), float(record.max()))


@dataclass(frozen=True)
class RigidMeasurements:
    """Gait of one set of equations, and a walk from it."""

    state: State  # fixed point, rad and rad/s
    steps: int  # completed, of ten
    step_length: float  # m, between the feet at that state
    table_3: Characteristics
    energy_least: float  # J, minimum and maximum energy during the walk
    energy_most: float
    energy_drift: float  # J, largest spread within a swing


def measure_rigid_model(walker: RigidWalker, state: State) -> RigidMeasurements:
    """Walk five cycles from a gait's fixed point; energy is measured from the current stance foot."""
    model = assembled(walker)
    walk = take_walk(model, TIGHT, state, 2 * PAPER_CYCLES, sampled=True)
    assert walk.samples is not None
    energy = energies(model, walk.samples.state).sum(axis=1)
    return RigidMeasurements(
        state=state,
        steps=walk.steps,
        step_length=step_length(walker, state[0], state[1]),
        table_3=characteristics(walk.periods_s, walk.lengths_m, walk.mean_energy),
        energy_least=float(energy.min()),
        energy_most=float(energy.max()),
        energy_drift=walk.energy_drift,
    )


@dataclass(frozen=True)
class ContactMeasurements:
    """Walk of the contact model, to compare with the paper's ADAMS model."""

    law: Contact  # the contact block of its config
    foot_radius: float  # m
    summary: Mapping[str, Any]  # stored summary of the walk
    start: State | None  # initial rigid state, rad and rad/s; None if states were not stored
    table_3: Characteristics
    step_length: float | None  # m, mean over the last completed stride; None without one
    energy: EnergyRecord | None  # over the last five steps; None if energies were not stored
    from_x_p: tuple[int, str]  # steps from x_p with its printed digits, of ten, and the outcome of that walk

    @property
    def steps(self) -> int:
        return int(self.summary["steps"])

    @property
    def outcome(self) -> str:
        return str(self.summary["outcome"])


Errors = Mapping[str, WalkDifference]
"""Differences between the contact and the rigid model, by alignment:

raw              at the same time
aligned          at the same phase of each step
between_impacts  the same without the start of each step, while a compliant impact is still in progress
settled          the same for the last completed stride only
"""


@dataclass(frozen=True)
class Departures:
    """Descriptions of a scene's differences from the paper's."""

    rigid: tuple[str, ...]  # of the rigid model
    contact: tuple[str, ...]  # of the contact model, those of the rigid model included


@dataclass(frozen=True)
class Measured:
    """All measurements on a config's scene."""

    walker: RigidWalker
    equations: str
    models: Mapping[str, RigidMeasurements]  # by set of equations, if it has a gait
    spectral_radii: Mapping[str, float]  # of the same gaits
    contact: ContactMeasurements
    errors: Errors
    departures: Departures
