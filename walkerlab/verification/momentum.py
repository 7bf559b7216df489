"""Momentum on compliant ground: what a walk gains is what ground and gravity give, from foot to foot through impacts.

The momenta are computed from positions and velocities of the masses, not from the assembled equations of motion; the
impulses from the forces of the ground at states that the walk passes. Where forces vary quickly, as at a touch that is
over within milliseconds, the walk is looked at again and again at closer times, until the sums settle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import RigidConfig, WalksConfig
from walkerlab.config.stability import Case
from walkerlab.ground.compliant import STANCE_FOOT
from walkerlab.ground.friction import steepest_change
from walkerlab.hybrid.contact_run import (
    ContactSamples,
    ContactWalkResult,
    MethodSettings,
    gather,
    new_observer,
    new_walk_state,
    run_parts,
    sampled_feet,
)
from walkerlab.mechanics.assembly import Anchor, levers, masses, total_mass
from walkerlab.mechanics.parts import Assembly
from walkerlab.scene.parts import assembly_of
from walkerlab.solvers.registry import method_named
from walkerlab.solvers.stepping import ACCEPTED
from walkerlab.verification.contact_start import ContactStart
from walkerlab.verification.scaling import pendulum_time
from walkerlab.verification.second_method import MAGNIFIED, promised
from walkerlab.verification.verdict import Measure, NotMeasured, finite

Array = NDArray[np.float64]
MEASURE: Final = "momentum not given by ground and gravity, over the walker's"
STEPS: Final = 2  # so that there is an impact, and what comes of it
INTERVALS: Final = 256  # to begin with
PASSES: Final = 9  # each looks four times as closely where it is needed
MOST_INTERVALS: Final = 30_000  # beyond which nothing is looked at more closely
SETTLED: Final = 1e-6  # of the walker's momentum: what an interval's sum may still change by, over the number of them
MOST_UNKNOWN: Final = 1e-3  # of the walker's momentum, beyond which a balance says nothing
FEET_ALONG, FEET_HEIGHT, FEET_NORMAL, FEET_FRICTION = 0, 1, 2, 3  # columns of sampled_feet


@dataclass(frozen=True)
class Balance:
    """Momentum against impulse.

    residual    largest over time and over both directions and the turning, as a share of the walker's momentum
    unsure      how far the sums of the impulses may be off, as such a share
    unresolved  what of friction's impulse hangs on slips below the tolerance, as such a share
    steps       of the solver
    """

    residual: float
    unsure: float
    unresolved: float
    steps: int


def momentum_finding(ready: ContactStart, config: WalksConfig, case: Case) -> Measure | NotMeasured:
    """Momentum against impulse, or why it cannot be judged.

    Errors of single steps are not magnified by the walk here: the balance holds along the path that was walked.
    """
    if ready.scene.pinned is not None:
        return NotMeasured(MEASURE, "the hinge pushes too")
    found = momentum_balance(ready, config, case)
    unknown = found.unsure + found.unresolved
    if unknown > MOST_UNKNOWN:
        return NotMeasured(MEASURE, why_unknown(found))
    limit = promised(case, config.solver.contact.rtol, found.steps) / MAGNIFIED + unknown
    return Measure(MEASURE, finite(found.residual), limit)


def why_unknown(found: Balance) -> str:
    """What keeps the impulses of a balance from being known."""
    shares = {
        "the impulses' sums do not settle": found.unsure,
        "friction hangs on slip velocities below the tolerance": found.unresolved,
    }
    return " and ".join(reason for reason, share in shares.items() if share > 0.5 * MOST_UNKNOWN)


def momentum_balance(ready: ContactStart, config: WalksConfig, case: Case) -> Balance:
    """Momentum against impulse over the first steps of a case."""
    short = case.model_copy(update={"steps": min(case.steps, STEPS)})
    mass, leg = config.walker.total_mass_kg, config.walker.leg_length_m
    rates = np.abs(ready.start[len(ready.start) // 2 :])
    speed = max(leg / pendulum_time(config), *rates[:2], leg * float(rates[2:].max()))
    scale = mass * np.array([speed, speed, speed * leg])
    walk = looked_at(ready, config, short, np.zeros(0))
    grid = np.linspace(0.0, walk.end_time_s, INTERVALS + 1)
    for _ in range(PASSES):
        samples = samples_of(looked_at(ready, config, short, with_middles(grid)))
        given = impulse_rate(samples, ready, config) / scale
        change = unsettled(samples.time_s, given)
        wanting = change > SETTLED / grid.size
        if not wanting.any() or grid.size > MOST_INTERVALS:
            break
        grid = split(samples.time_s, wanting)
    held = momentum(samples, config) / scale
    apart = np.abs(held - held[0] - impulse(samples.time_s, given))
    steps = int(walk.work[ACCEPTED])
    # in a state between the solver's own the slip is known to its tolerance, with another sign in every step
    slip = config.solver.contact.atol + config.solver.contact.rtol * speed
    push = steepest_change(ready.scene.walker.friction, slip) * config.gravity_m_s2 * walk.end_time_s / speed
    return Balance(float(apart.max()), float(change.sum()), push / max(1, steps) ** 0.5, steps)


def samples_of(walk: ContactWalkResult) -> ContactSamples:
    """The states that a walk was looked at in."""
    assert walk.samples is not None, "it was looked at"
    return walk.samples


def looked_at(ready: ContactStart, config: WalksConfig, case: Case, times: Array) -> ContactWalkResult:
    """Walk a case and keep its states at these times (s); sampling does not change the walk."""
    settings, scene = config.solver.contact, ready.scene
    methods = MethodSettings(method_named(settings.method), settings.rtol, settings.atol, case.budget)
    walk_state = new_walk_state(scene.walker, scene.terrain, STANCE_FOOT, case.steps, ready.start)
    observer = new_observer(scene.walker, walk_state, ready.start, 1.0, times.size)._replace(times=times)
    outcome, stopped = run_parts(scene.walker, scene.ground, scene.pinned, ready.start, methods, observer, walk_state)
    return gather(outcome, stopped, walk_state, observer, scene.walker, methods)


def with_middles(grid: Array) -> Array:
    """The ends and middles of intervals."""
    return np.sort(np.concatenate([grid, 0.5 * (grid[1:] + grid[:-1])]))


def split(times: Array, wanting: NDArray[np.bool_]) -> Array:
    """The ends of intervals, given with their middles, once those that want it are cut into four."""
    first, middle, last = times[:-1:2], times[1::2], times[2::2]
    halves = np.concatenate([middle, 0.5 * (first + middle), 0.5 * (middle + last)])
    return np.sort(np.concatenate([times[::2], halves[np.tile(wanting, 3)]]))


def impulse(times: Array, rate: Array) -> Array:
    """Sums (times, components) of a rate up to each interval's end, by Simpson's rule on ends and middles."""
    widths = np.diff(times[::2])[:, None]
    pieces = widths / 6.0 * (rate[:-1:2] + 4.0 * rate[1::2] + rate[2::2])
    return np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(pieces, axis=0)])


def unsettled(times: Array, rate: Array) -> Array:
    """How much each interval's sum changes by looking at its middle, in the worst component."""
    widths = np.diff(times[::2])[:, None]
    change = widths / 6.0 * (rate[:-1:2] - 2.0 * rate[1::2] + rate[2::2])
    return np.asarray(np.abs(change).max(axis=1))


def impulse_rate(samples: ContactSamples, ready: ContactStart, config: RigidConfig) -> Array:
    """Force along and up from the slope (N), and torque about a point of the slope (N m), of ground and gravity."""
    walker = ready.scene.walker
    feet = np.zeros((samples.time_s.size, 2, 5))
    sampled_feet(walker, samples.states, samples.has_ground, feet)
    normal, friction = feet[:, :, FEET_NORMAL], feet[:, :, FEET_FRICTION]
    mass, gravity, slope = config.walker.total_mass_kg, config.gravity_m_s2, config.slope_rad
    weight = mass * gravity * np.array([np.sin(slope), -np.cos(slope)])
    centre = samples.states[:, :2]
    torque = feet[:, :, FEET_ALONG] * normal - feet[:, :, FEET_HEIGHT] * friction
    return np.column_stack(
        [
            friction.sum(axis=1) + weight[0],
            normal.sum(axis=1) + weight[1],
            torque.sum(axis=1) + centre[:, 0] * weight[1] - centre[:, 1] * weight[0],
        ]
    )


def momentum(samples: ContactSamples, config: RigidConfig) -> Array:
    """Momentum along and up from the slope (kg m/s) and about a point of the slope (kg m^2/s), at intervals' ends."""
    parts = assembly_of(config.walker)
    n = len(parts.bodies)
    y = samples.states[::2]
    angle, rate = y[:, 2 : 2 + n] + config.slope_rad, y[:, 4 + n :]
    s, c = np.sin(angle), np.cos(angle)
    spin = rate @ np.array([body.inertia_kg_m2 for body in parts.bodies])
    linear, turning = np.zeros((len(y), 2)), spin
    for mass, d in levers_from_centre(parts):
        arm = np.stack([c * d[:, 0] - s * d[:, 1], s * d[:, 0] + c * d[:, 1]], axis=2)  # samples, bodies, axes
        turned = np.stack([-arm[:, :, 1], arm[:, :, 0]], axis=2) * rate[:, :, None]
        r, v = y[:, 0:2] + arm.sum(axis=1), y[:, 2 + n : 4 + n] + turned.sum(axis=1)
        linear = linear + mass * v
        turning = turning + mass * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0])
    return np.column_stack([linear, turning])


def levers_from_centre(parts: Assembly) -> list[tuple[float, Array]]:
    """Every mass (kg) and its levers (bodies, 2) in m from the walker's centre of mass."""
    first = parts.bodies[0]
    root = Anchor(first.name, first.centre_m)
    found = [(mass, levers(parts, root, at)) for mass, at in masses(parts)]
    centre = sum((mass * d for mass, d in found), np.zeros((len(parts.bodies), 2))) / total_mass(parts)
    return [(mass, d - centre) for mass, d in found]
