"""Momentum balance on compliant ground: a walk's change of momentum compared with the impulse of ground and gravity.

Momenta are computed from positions and velocities of the masses, not from the equations of motion. Impulses are
integrated from forces at sampled states; sampling is refined until the integrals settle, because an impact lasts only
milliseconds.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.stability import Case
from walkerlab.evidence.verification.masses import Masses
from walkerlab.evidence.verification.scaling import pendulum_time
from walkerlab.evidence.verification.verdict import MAGNIFIED, Measure, NotMeasured, allowed_difference, finite
from walkerlab.physics.ground.friction import steepest_change
from walkerlab.physics.hybrid.contact_record import ContactSamples
from walkerlab.physics.hybrid.contact_result import sample_feet
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.stepping import ACCEPTED
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.contact import ContactScene
from walkerlab.scene.parts import assembly_of

MEASURE: Final = "momentum change not explained by ground and gravity, relative to the walker's momentum"
BALANCE_STEPS: Final = 2  # enough for an impact and the motion after it
INITIAL_INTERVALS: Final = 256
MAX_PASSES: Final = 9  # refinements; each splits unsettled intervals into four
MAX_INTERVALS: Final = 30_000  # finer grids are not refined further
# largest total error of the impulse, as a fraction of the walker's momentum; each interval gets an equal part of it
SETTLED_IMPULSE_SHARE: Final = 1e-6
MAX_UNKNOWN: Final = 1e-3  # fraction of the walker's momentum; a balance with more unknown impulse is inconclusive


@dataclass(frozen=True)
class Balance:
    """Result of a momentum balance, in fractions of the walker's momentum."""

    residual: float  # largest difference between momentum change and impulse, over time and components
    unsure: float  # estimated error of the integrated impulse
    unresolved: float  # error of the friction's impulse, since slip velocities are known only to the tolerance
    steps: int  # solver steps


def momentum_finding(config: WalksConfig, scene: ContactScene, start: State, case: Case) -> Measure | NotMeasured:
    """Measure the momentum balance of a case's walk, or state why it cannot be judged."""
    if scene.pinned:
        return NotMeasured(MEASURE, "the pin transmits forces as well")
    balance = momentum_balance(config, scene, start, case)
    unknown = balance.unsure + balance.unresolved
    if unknown > MAX_UNKNOWN:
        shares = {
            "the impulse sums do not settle": balance.unsure,
            "friction depends on slip velocities below the tolerance": balance.unresolved,
        }
        why = " and ".join(reason for reason, share in shares.items() if share > 0.5 * MAX_UNKNOWN)
        return NotMeasured(MEASURE, why)
    # step errors add up without growing, because the balance holds along the computed path: no factor MAGNIFIED
    limit = allowed_difference(case, config.solver.contact.rtol, balance.steps) / MAGNIFIED + unknown
    return Measure(MEASURE, finite(balance.residual), limit)


def momentum_balance(config: WalksConfig, scene: ContactScene, start: State, case: Case) -> Balance:
    """Compare the change of momentum with the impulse over the first steps of a case."""
    mass = config.walker.total_mass_kg
    leg = config.walker.leg_length_m
    rates = np.abs(start[len(start) // 2 :])
    speed = max(leg / pendulum_time(config), *rates[:2], leg * float(rates[2:].max()))
    scale = mass * np.array([speed, speed, speed * leg])
    settings = config.solver.contact
    steps = min(case.steps, BALANCE_STEPS)
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, case.budget)
    walk = scene.walk(start, steps, tolerances)
    grid = np.linspace(0.0, walk.end_time_s, INITIAL_INTERVALS + 1)
    if scene.walker.whole.push_off != 0.0:
        pulse = scene.walker.whole.push_off_duration * np.linspace(0.0, 1.0, 9)
        pushed = (walk.touch_time_s[:, None] + pulse).ravel()
        grid = np.union1d(grid, pushed[pushed < walk.end_time_s])
    for _ in range(MAX_PASSES):
        samples = scene.walk(start, steps, tolerances, add_midpoints(grid)).samples
        assert samples is not None, "the walk is sampled"
        rates = impulse_rate(samples, scene, config, walk.touch_time_s) / scale
        change = unsettled(samples.time_s, rates)
        wanting = change > SETTLED_IMPULSE_SHARE / grid.size
        if not wanting.any() or grid.size > MAX_INTERVALS:
            break
        grid = split(samples.time_s, wanting)
    assert samples is not None, "the walk is sampled"
    momenta = momentum(samples, config) / scale
    differences = np.abs(momenta - momenta[0] - impulse(samples.time_s, rates))
    accepted = int(walk.work[ACCEPTED])
    # between solver steps the slip velocity is known only to the tolerance; its error has a random sign in each step
    slip = tolerances.atol + tolerances.rtol * speed
    push = steepest_change(scene.walker.friction, slip) * config.gravity_m_s2 * walk.end_time_s / speed
    return Balance(float(differences.max()), float(change.sum()), push / max(1, accepted) ** 0.5, accepted)


def add_midpoints(grid: Floats) -> Floats:
    """Return the ends and midpoints of intervals in ascending order."""
    return np.sort(np.concatenate([grid, 0.5 * (grid[1:] + grid[:-1])]))


def split(times: Floats, wanting: NDArray[np.bool_]) -> Floats:
    """Return the ends of intervals after splitting those marked in `wanting` into four. `times` holds ends and
    midpoints.
    """
    first = times[:-1:2]
    middle = times[1::2]
    last = times[2::2]
    halves = np.concatenate([middle, 0.5 * (first + middle), 0.5 * (middle + last)])
    return np.sort(np.concatenate([times[::2], halves[np.tile(wanting, 3)]]))


def impulse(times: Floats, rate: Floats) -> Floats:
    """Integrate a rate (times, components) by Simpson's rule up to the end of each interval. Returns (ends,
    components).
    """
    widths = np.diff(times[::2])[:, None]
    pieces = widths / 6.0 * (rate[:-1:2] + 4.0 * rate[1::2] + rate[2::2])
    return np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(pieces, axis=0)])


def unsettled(times: Floats, rate: Floats) -> Floats:
    """Estimate each interval's integration error, in its worst component: Simpson's rule minus the midpoint rule."""
    widths = np.diff(times[::2])[:, None]
    change = widths / 6.0 * (rate[:-1:2] - 2.0 * rate[1::2] + rate[2::2])
    return np.asarray(np.abs(change).max(axis=1))


def impulse_rate(samples: ContactSamples, scene: ContactScene, config: RigidConfig, touches: Floats) -> Floats:
    """Return (times, 3): force along and normal to the slope (N), and torque about a point of the slope (N m).

    Ground, gravity and push-offs contribute; push-offs start at the touch times, `touches` (steps,) in s.
    """
    along, height, normal, friction, _ = np.moveaxis(sample_feet(scene.walker, samples), 2, 0)
    slope = config.slope_rad
    weight = config.walker.total_mass_kg * config.gravity_m_s2 * np.array([np.sin(slope), -np.cos(slope)])
    torque = (along * normal - height * friction).sum(axis=1) + cross(samples.states[:, :2], weight)
    rates = np.column_stack([friction.sum(axis=1) + weight[0], normal.sum(axis=1) + weight[1], torque])
    form = scene.walker.whole
    samples_range = np.arange(samples.time_s.size)
    if form.push_off != 0.0:
        pushing = 1 - samples.stance
        y = samples.states
        foot = np.column_stack([along[samples_range, pushing], height[samples_range, pushing]])
        angles = y[:, 2 : y.shape[1] // 2] + slope
        s = np.sin(angles)
        c = np.cos(angles)
        x = form.hip_x[: angles.shape[1]]
        up = form.hip_y[: angles.shape[1]]
        line = y[:, :2] + np.column_stack([c @ x - s @ up, s @ x + c @ up]) - foot
        u = np.clip((samples.time_s[:, None] - touches) / form.push_off_duration, 0.0, 1.0)
        bell = 30.0 * ((u * (1.0 - u)) ** 2).sum(axis=1) * form.push_offs[pushing] / form.push_off_duration
        push = (bell / np.hypot(*line.T))[:, None] * line
        rates += np.column_stack([push, cross(foot, push)])
    return rates


def momentum(samples: ContactSamples, config: RigidConfig) -> Floats:
    """Return (ends, 3): momentum along and normal to the slope (kg m/s), and about a point of the slope (kg m^2/s)."""
    y = samples.states[::2]
    n = y.shape[1] // 2 - 2
    walker_masses = Masses(assembly_of(config.walker))
    rate = y[:, 4 + n :]
    place, velocity = walker_masses.moving(y[:, 2 : 2 + n] + config.slope_rad, rate)
    r, v = y[:, None, 0:2] + place, y[:, None, 2 + n : 4 + n] + velocity
    return np.column_stack([walker_masses.mass @ v, cross(r, v) @ walker_masses.mass + rate @ walker_masses.inertia])


def cross(r: Floats, v: Floats) -> Floats:
    """Return the planar cross product (...) of vectors (..., 2)."""
    return np.asarray(r[..., 0] * v[..., 1] - r[..., 1] * v[..., 0])
