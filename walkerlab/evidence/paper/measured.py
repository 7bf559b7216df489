"""Measurements to compare with the printed numbers: from both sets of rigid equations, and from the contact model.

Measurements on a scene other than that of the paper neither confirm nor refute its numbers.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.contact import BOUNDS_SI, Contact
from walkerlab.config.drives import drives_and_springs_of
from walkerlab.config.fields import are_equal
from walkerlab.config.reads import CompareConfig
from walkerlab.config.schema import Config, Equations
from walkerlab.config.walkers import CompassWalker
from walkerlab.evidence.paper.appendix_a import RigidWalker, assembled, step_length
from walkerlab.evidence.paper.printed import STATE_NAMES, X_P, adams_start_as_printed, slope_of
from walkerlab.evidence.paper.prose import prose
from walkerlab.outcome import Outcome
from walkerlab.physics.ground.walker import ContactWalker
from walkerlab.physics.hybrid.comparison import Array, WalkDifference
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, sample_energies, sample_feet
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_measures import energies, reactions
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.solvers.registry import ENDLESS, Tolerances
from walkerlab.physics.solvers.system import State

TIGHT = Tolerances("dop853", 1e-12, 1e-14, ENDLESS)
"""Tolerances at which errors are far smaller than any printed digit."""
EQUATION_SETS: tuple[Equations, ...] = ("as-printed", "corrected")
PAPER_CYCLES = 5  # gait cycles walked in the paper
ENERGY_STEPS = 5  # steps over which the paper averages the energy


@dataclass(frozen=True)
class Characteristics:
    """Quantities of Table 3 in SI units. They are None if the walk or its record is too short."""

    t_left: float | None  # period of the first step of the last completed stride
    t_right: float | None  # period of the second step of that stride
    t_cycle: float | None  # sum of both periods
    v_com: float | None  # length of that stride along the slope, divided by t_cycle
    # time average of kinetic plus potential energy over several steps, with heights from the current stance foot
    E_avg: float | None


def characteristics(periods: Array, lengths: Array, mean_energy: float | None) -> Characteristics:
    """Compute the quantities of Table 3 from step periods (s), step lengths (m) and the mean energy (J) of a walk."""
    strides = len(periods) // 2
    if strides == 0:
        return Characteristics(float(periods[0]) if len(periods) else None, None, None, None, mean_energy)
    left, right = 2 * strides - 2, 2 * strides - 1
    cycle = float(periods[left] + periods[right])
    speed = float(lengths[left] + lengths[right]) / cycle
    return Characteristics(float(periods[left]), float(periods[right]), cycle, speed, mean_energy)


@dataclass(frozen=True)
class EnergyRecord:
    """Time average and extremes (J) of an energy."""

    mean: float
    least: float
    most: float


def mean_over_last_steps(time: Array, energy: Array, step_ends: Array) -> EnergyRecord | None:
    """Average a sampled energy (J) over the last five completed steps, or over all if there are fewer.

    Return None if no step was completed.
    """
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
    """Measurements of the gait of one set of equations, and of a walk that starts from it."""

    state: State  # fixed point, rad and rad/s
    steps: int  # completed steps, out of ten
    step_length: float  # m, distance between the feet at the fixed point
    table_3: Characteristics
    energy_least: float  # J, minimum energy during the walk
    energy_most: float  # J, maximum energy during the walk
    energy_drift: float  # J, largest change of the energy within a swing


def measure_rigid_model(walker: RigidWalker, state: State) -> RigidMeasurements:
    """Simulate five cycles from the fixed point `state`. Heights are measured from the current stance foot."""
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
    """Measurements on the contact model, for comparison with the ADAMS model of the paper."""

    law: Contact  # contact block of the config
    foot_radius: float  # m
    summary: Mapping[str, Any]  # stored summary of the walk
    start: State | None  # initial rigid state, rad and rad/s, or None if states were not stored
    table_3: Characteristics
    step_length: float | None  # m, mean over the last completed stride, or None if no stride was completed
    energy: EnergyRecord | None  # energy over the last five steps, or None if energies were not stored
    from_x_p: tuple[int, str]  # completed steps and outcome of a walk of up to ten steps from the printed x_p

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
between_impacts  as aligned, but without the start of each step, while a compliant impact is still in progress
settled          as between_impacts, but only for the last completed stride
"""


@dataclass(frozen=True)
class Departures:
    """How a scene differs from that of the paper, in words."""

    rigid: tuple[str, ...]  # differences that affect the rigid model
    contact: tuple[str, ...]  # differences that affect the contact model, including those that affect the rigid model


@dataclass(frozen=True)
class Measured:
    """All measurements on a config's scene."""

    walker: RigidWalker
    equations: str
    models: Mapping[str, RigidMeasurements]  # by set of equations; sets without a gait are left out
    spectral_radii: Mapping[str, float]  # spectral radii of these gaits, by set of equations
    contact: ContactMeasurements
    errors: Errors
    departures: Departures

    @property
    def raised(self) -> list[float | None]:
        """By how much (%) each coordinate of the contact model's start exceeds that of the rigid gait."""
        gait = self.models.get(self.equations)
        start = self.contact.start
        if gait is None or start is None:
            return [None] * len(STATE_NAMES)
        pairs = zip(start, gait.state, strict=True)
        return [None if ours == 0.0 else 100.0 * (initial / ours - 1.0) for initial, ours in pairs]

    @property
    def speed_differences(self) -> dict[str, float]:
        """Difference (%) of the average velocities of contact and rigid model, by set of equations."""
        contact = self.contact.table_3.v_com
        return {
            name: 100.0 * abs(contact - rigid) / abs(rigid)
            for name, model in self.models.items()
            if (rigid := model.table_3.v_com) and contact is not None
        }


CONTACT_MODEL_KEYS: Final = ("foot_radius_m",)
SI_KEYS: Final = ("stiffness", "damping", *BOUNDS_SI)
"""Keys of the contact block whose values depend on the block's units."""
UNITLESS_KEYS: Final = tuple(name for name in Contact.model_fields if name not in (*SI_KEYS, "units", "stance"))
"""Remaining keys of the contact block. `stance` is left out, because the paper also pins the first stance foot."""


def departures(config: CompareConfig, start_moved: bool) -> Departures:
    """Describe how the scene differs from that of the paper. Slopes within the rounding of x_p count as equal.

    start_moved  whether the contact model starts away from the fixed point of the rigid model
    """
    walker = config.walker
    contact = config.contact
    paper = CompassWalker()
    rigid: list[str] = []
    of_contact: list[str] = []
    if acting := drives_and_springs_of(config):
        rigid.append(f"the walker has {' and '.join(acting)}")
    if not config.ground.even:
        rigid.append("the ground is uneven")
    if not isinstance(walker, CompassWalker):
        rigid.append(describe("walker.type", walker.type, paper.type))
    else:
        compass = [name for name in CompassWalker.model_fields if name not in (*CONTACT_MODEL_KEYS, "hip")]
        rigid += describe_differences(walker, paper, compass)
        rigid += describe_differences(config, Config(), ["gravity_m_s2"])
        slope, rounding = slope_of(*X_P[:2])
        if abs(config.slope_rad - slope) > rounding:
            rigid.append(describe("slope_rad", config.slope_rad, slope))
        if contact is not None:
            of_contact += describe_differences(walker, paper, CONTACT_MODEL_KEYS)
            of_contact += describe_differences(contact.to_si(), Contact().to_si(), SI_KEYS, "contact.{} (SI)")
            of_contact += describe_differences(contact, Contact(), UNITLESS_KEYS, "contact.{}")
    if start_moved:
        of_contact.append("the start is not the rigid model's fixed point")
    return Departures(tuple(rigid), (*rigid, *of_contact))


def describe_differences(used: Any, paper: Any, names: Iterable[str], called: str = "{}") -> Iterator[str]:
    for name in names:
        if not are_equal(getattr(used, name), getattr(paper, name)):
            yield describe(called.format(name), getattr(used, name), getattr(paper, name))


def describe(name: str, *values: Any) -> str:
    used, paper = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in values)
    return f"{name} {used} instead of {paper}"


FALLING = 4  # a cubic through this many samples at the end of a fall extrapolates when the hip reaches `FALLEN_HIP`


@dataclass(frozen=True)
class AdamsStart:
    """Walk of the rigid model from the ADAMS start."""

    state: State  # rad and rad/s
    slope: float  # rad
    energy: float  # J, kinetic plus potential energy, with heights measured from the stance foot
    weight: float  # N
    normal_force: float  # N, normal force of the ground at the start
    pull_from: float | None  # s, time from which the ground would have to pull, or None if never
    heel_strikes: int  # number of heel strikes in the walk
    end: str  # outcome of the walk
    end_time: float  # s


@dataclass(frozen=True)
class AdamsWalk:
    """Walk of the contact model from the ADAMS start."""

    terrain: str  # terrain of the contact model
    rigid: AdamsStart  # walk of the rigid model from the same start, both feet on the config's slope
    walk: ContactWalkResult
    airborne_from: float | None  # s, first time at which no foot touches the ground, or None if one always does
    # N, largest normal force of the contact model after the moment at which the rigid model's ground would have to pull
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
    """Simulate both models from the ADAMS start of Table 2.

    The stance angle and the velocities are the printed ones. The swing angle is chosen to put both feet on the slope.

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
    """Return the interpolated time (s) at which sampled values first fall below zero, or None if they never do."""
    below = np.flatnonzero(values < 0.0)
    if below.size == 0:
        return None
    # The order is reversed, because `np.interp` needs rising values.
    around = [int(below[0]), max(int(below[0]) - 1, 0)]
    return float(np.interp(0.0, values[around], time[around]))
