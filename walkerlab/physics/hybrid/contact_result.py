"""A whole walk on compliant ground, with or without a pinned first step, and its result."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.outcome import Outcome
from walkerlab.physics.energy_channels import ENTRIES, KNEE_STRIKES, LOSS_ENTRIES, LOSSES, PUSH_OFF, TORQUE
from walkerlab.physics.ground import walker as forms
from walkerlab.physics.ground.energy import kinetic_energy, potential_energy, total_energy
from walkerlab.physics.ground.hinges import hinge_energies
from walkerlab.physics.ground.terrain import is_uneven
from walkerlab.physics.ground.walker import BODY_VECTOR, ContactWalker, FootMotion, OnGround
from walkerlab.physics.hybrid import contact_state as events
from walkerlab.physics.hybrid.contact_crossings import hip_height
from walkerlab.physics.hybrid.contact_jumps import change_form
from walkerlab.physics.hybrid.contact_loop import AT_LIFT, NO_LIMIT, walk_in_form
from walkerlab.physics.hybrid.contact_record import CONTACT_TALLY, ContactObserver, ContactSamples, new_tangent
from walkerlab.physics.hybrid.contact_state import JudgedGround, WalkState, material_along, new_walk_state
from walkerlab.physics.hybrid.endings import CHANGES_FORM, FALLEN_HIP
from walkerlab.physics.hybrid.walk_record import DrivenWork, WalkRecord, WalkWork
from walkerlab.physics.kernels import kernel, uncompiled, vector
from walkerlab.physics.mechanics.hinges import DAMPING, HIP_ROW
from walkerlab.physics.mechanics.tree import new_record
from walkerlab.physics.solvers.registry import Tolerances, finder_for, method_named, share_counts
from walkerlab.physics.solvers.stepping import BUDGET, RHS, T
from walkerlab.physics.solvers.system import Floats, State

EXPECTED_STEP = 3.0  # longer than most steps, in pendulum times
# Limit for the residual of the energy balance, divided by rtol times (energy + work exchanged). In random walks this is
# at most 0.5 with radau5 for rtol from 1e-2 to 1e-9 (scripts/contact_campaign.py prints it), and at most 9 with the
# libraries' multistep methods. In the stability catalogue it is at most 9, for ground of 1e14 N/m.
RESIDUAL_FACTOR = 100.0
SET_STIFF = "set solver.contact.method to radau5."
# rtol below which rounding, not the tolerance, determines the residual
FINEST_RTOL = 1e-10


@dataclass(frozen=True)
class Stopped:
    outcome: Outcome
    time_s: float
    state: State  # state of the free walker with all bodies
    work: NDArray[np.int64]  # (4,) counts, as in `stepping`


def sample_energies(walker: ContactWalker, samples: ContactSamples) -> Floats:
    """Compute the kinetic, potential and total energy (samples, 3) of every sample, in J."""
    energies = np.zeros((samples.time_s.size, 3))
    fill_energies(forms.place_on_ground(walker, (False, False)), samples, energies)
    return energies


def sample_feet(walker: ContactWalker, samples: ContactSamples) -> Floats:
    """Compute five values for each sample and foot, (samples, 2, 5).

    They are position along the slope (m), height (m), normal force (N), friction (N) and slip velocity (m/s).
    """
    feet = np.zeros((samples.time_s.size, 2, 5))
    fill_feet(walker, samples, feet)
    return feet


@kernel
def fill_energies(system: OnGround, samples: ContactSamples, energies: Any) -> None:
    """Write the energies of all samples into `energies`.

    This overwrites the ground and knee states of `system`, which must be the free walker.
    """
    for i in range(samples.states.shape[0]):
        for k in range(2):
            system.has_ground[k], system.knee[k] = samples.has_ground[i, k], samples.knees[i, k]
            system.level[k] = samples.level[i, k]
        energies[i, 0] = kinetic_energy(system.form, samples.states[i])
        energies[i, 1] = potential_energy(system.form, samples.states[i])
        energies[i, 2] = total_energy(system, samples.states[i])


@kernel
def fill_feet(walker: ContactWalker, samples: ContactSamples, feet: Any) -> None:
    for i in range(samples.states.shape[0]):
        motions = forms.feet_motion(walker.forms[0, 0], samples.states[i])
        for foot in range(2):
            along, height, slip, vertical_velocity = motions[foot]
            height -= samples.level[i, foot]
            feet[i, foot, 0], feet[i, foot, 1], feet[i, foot, 4] = along, height, slip
            if samples.has_ground[i, foot] != 0 and height < 0.0:
                force = forms.foot_force(walker, FootMotion(along, height, slip, vertical_velocity))
                feet[i, foot, 2], feet[i, foot, 3] = force.normal.force, force.along


@dataclass(frozen=True, eq=False)
class ContactWalkResult(WalkRecord):
    """Result of a walk on compliant ground."""

    slip_m: Floats  # (steps,) material slip of the stance foot; the last step is missing if its foot has not lifted
    rolling_m: Floats  # (steps,) rolling distance of the stance foot in these steps
    stance_s: Floats  # (steps,) time from touch to lift of the stance foot in these steps
    end_state: State
    max_penetration_m: float
    energy_balance_residual_J: float
    explained_residual_J: float  # largest residual that the tolerance explains
    dissipated_J: Floats  # (5,) energies lost, in the order of `energy_channels.LOSSES`
    samples: ContactSamples | None
    method: str  # integration method

    @property
    def advice(self) -> str:
        """Meaning of the outcome and what to try next."""
        stiff = method_named(self.method).stiff
        if self.outcome is Outcome.BUDGET_EXHAUSTED and not stiff:
            return (
                f"The walk exhausted its evaluation budget: on stiff ground, {self.method} needs short steps "
                f"at any tolerance; {SET_STIFF}"
            )
        if self.energy_balance_residual_J <= self.explained_residual_J:
            return super().advice
        return (
            f"The energy balance does not close: it is off by {self.energy_balance_residual_J:.3g} J, of which the "
            f"solver's tolerance explains {self.explained_residual_J:.2g} J at most, so the walk is wrong; "
            + ("tighten solver.contact.rtol or choose another solver.contact.method." if stiff else SET_STIFF)
            + " If that does not help, the program is at fault."
        )


def new_observer(
    walker: ContactWalker,
    walk_state: WalkState,
    y: State,
    times: Floats | None = None,
    track_energy: bool = True,
    directions: int = 0,
) -> ContactObserver:
    """Create an observer of a walk that starts in state y.

    times       rising sample times (s), or None for no samples
    directions  number of columns of the tangent
    """
    times = np.zeros(0) if times is None else times
    samples = times.size
    tally = new_record(CONTACT_TALLY)
    # The work in completed steps needs the springs' energy at the start even if no balance is kept.
    if track_energy or walker.whole.sprung:
        system = forms.place_on_ground(
            walker, walk_state.has_ground, level=walk_state.level, progress=walk_state.progress
        )
        tally.start_energy = total_energy(system, y)
        tally.start_spring = hinge_energies(system, y)[0]
        # The tolerance is relative to this energy, which must not depend on how far down the slope the walk starts.
        tally.energy_below = tally.start_energy + walker.mass * walker.gravity_along * y[0]
    room = ContactSamples(
        times,
        np.zeros((samples, walker.size)),
        np.zeros((samples, 2), np.int8),
        np.zeros(samples, np.int64),
        np.zeros((samples, 2), np.int8),
        np.zeros((samples, 2)),
        np.zeros((samples, ENTRIES)),
    )
    tangent = new_tangent(walker.size, directions)
    return ContactObserver(track_energy, room, np.zeros(ENTRIES), np.zeros(ENTRIES), tally, tangent)


def present_walker(walker: ContactWalker, walk_state: WalkState, pinned: bool = False) -> OnGround:
    """Return the walker in its present form. It shares memory with the walk state."""
    return forms.place_on_ground(
        walker, walk_state.has_ground, walk_state.knee, pinned, walk_state.level, walk_state.progress
    )


def walk_on(
    walker: ContactWalker,
    tolerances: Tolerances,
    walk_state: WalkState,
    observer: ContactObserver,
    start: State,
    until: int = NO_LIMIT,
    pinned: bool = False,
) -> Stopped:
    """Continue a walk from a state of the free walker, changing the form as knees lock and are released.

    A `pinned` walk ends with its first step. `until` is as in `walk_in_form`. The outcome is `SOLVER_FAILED` if the
    energy balance does not close.
    """
    walk = walk_in_form if tolerances.compiled else uncompiled(walk_in_form)
    system = present_walker(walker, walk_state, pinned)
    tangent = observer.tangent.Phi
    half = len(start) // 2
    # A pinned form has no coordinates of the root.
    root = 2 if pinned else 0
    y = forms.to_form(system.form, (*start[root:half], *start[half + root :]))
    if tangent.shape[1] > 0:
        tangent[: y.size] = forms.to_form(system.form, tangent)
    lead = tolerances.new(y.size)
    lead.clock[T] = walk_state.progress.stopped_at
    # Forms have states of different sizes, and each size needs its own method object. These objects share clock and
    # counts, so that they act as one.
    by_size = {y.size: lead}
    finder = finder_for(lead, events.EVENT_ROWS, walker.size)
    while True:
        if y.size not in by_size:
            by_size[y.size] = share_counts(tolerances.new(y.size), lead.clock, lead.counts)
        method = by_size[y.size]
        method.y[:] = y
        ended, event = walk(system, method, finder, observer, walk_state, until)
        if ended != CHANGES_FORM:
            break
        before = system
        system = present_walker(walker, walk_state, pinned)
        y = change_form(walker, before, system, event, observer, method)
    if tangent.shape[1] > 0:
        tangent[:] = forms.to_full(system.form, tangent[: method.y.size], walker.size)
    end = forms.floating_state(system.form, method.y, walker.size)
    walk_state.progress.stopped_at = lead.clock[T]
    return Stopped(check_balance(ended, observer, tolerances), float(lead.clock[T]), end, lead.counts[:BUDGET].copy())


def walk_contact(
    walker: ContactWalker,
    ground: JudgedGround,
    pinned: bool,
    stance: int,
    start: State,
    tolerances: Tolerances,
    steps: int,
    sampling: float | Floats | None,
) -> ContactWalkResult:
    """Walk up to `steps` steps, the first on foot `stance`, which is pinned during that step if `pinned`.

    start     (4 + 2 n) state of the free walker, of which a pinned step uses only angles and angular velocities
    sampling  sampling interval (s), rising sample times (samples,) in s, or None for no samples

    A start whose hip is already too low is rejected.
    """
    frame = ground.frame
    s, c = vector(BODY_VECTOR), vector(BODY_VECTOR)
    forms.sines_cosines(walker.whole, start, s, c)
    if hip_height(walker.whole, s, c, start) < FALLEN_HIP * frame.leg_length:
        walk_state = new_walk_state(walker, ground, stance, steps, start)
        stopped = Stopped(Outcome.REJECTED, 0.0, start, np.zeros(4, np.int64))
        return gather(stopped, walk_state, new_observer(walker, walk_state, start), walker, tolerances)
    # The number of samples is not known in advance. If the memory fills up, the walk is repeated with twice as much.
    room = int(EXPECTED_STEP * steps * frame.pendulum_time / sampling) + 2 if isinstance(sampling, float) else 0
    while True:
        walk_state = new_walk_state(walker, ground, stance, steps, start)
        times = sampling * np.arange(room, dtype=np.float64) if isinstance(sampling, float) else sampling
        observer = new_observer(walker, walk_state, start, times, tolerances.track_energy)
        stopped = run_parts(walker, pinned, start, tolerances, observer, walk_state)
        if room == 0 or observer.tally.recorded < room:
            return gather(stopped, walk_state, observer, walker, tolerances)
        room *= 2


def run_parts(
    walker: ContactWalker,
    pinned: bool,
    start: State,
    tolerances: Tolerances,
    observer: ContactObserver,
    walk_state: WalkState,
) -> Stopped:
    """Walk the pinned step, if there is one, and then the free steps."""
    # A walk that completed all steps continues, unobserved, until the last stance foot lifts: its slip is then known.
    y = start
    spent = np.zeros(4, np.int64)
    if pinned:
        first = walk_on(walker, tolerances, walk_state, observer, start, pinned=True)
        y = first.state
        spent = first.work
        release_pin(walker, walk_state, y)
        if first.outcome is not Outcome.WALKED:
            return first
        # The pinned foot was on the ground until now.
        walk_state.progress.airborne_since = first.time_s
    stopped = walk_on(walker, tolerances, walk_state, observer, y)
    if stopped.outcome is Outcome.WALKED:
        unseen = new_observer(walker, walk_state, stopped.state, track_energy=False)
        left = replace(tolerances, budget=tolerances.budget - int(stopped.work[RHS]))
        walk_on(walker, left, walk_state, unseen, stopped.state, AT_LIFT)
    return replace(stopped, work=spent + stopped.work)


def losses_by_channel(walker: ContactWalker, dissipated: Floats) -> dict[str, float]:
    """Return the dissipated energies (J) by channel, without the knees' channels for a walker without knees."""
    pairs = zip(LOSSES, dissipated.tolist(), strict=True)
    return {loss.key: joules for index, (loss, joules) in enumerate(pairs) if walker.kneed or index < KNEE_STRIKES}


def release_pin(walker: ContactWalker, walk_state: WalkState, y: State) -> None:
    """Update the walk state for the release of a pinned foot: it has not slipped or rolled, and is at the surface."""
    foot = int(walker.forms[1, 0]["pinned"])
    steps = walk_state.progress.steps
    walk_state.slip[:steps], walk_state.rolling[:steps] = 0.0, 0.0
    walk_state.touched[foot] = material_along(walker.whole, foot, forms.feet_motion(walker.whole, y)[foot].along, y)
    walk_state.slipped[foot], walk_state.rolled[foot] = 0.0, 0.0
    # The released foot is exactly at the surface, which does not count as a touch.
    walk_state.at_zero[foot * events.PER_FOOT + events.HEIGHT] = 1


def explained_residual(observer: ContactObserver, tolerances: Tolerances) -> float:
    """Compute the largest residual of the energy balance (J) that the tolerance explains. A larger one is a fault."""
    exchanged = observer.tally.energy_below + np.abs(observer.account[:TORQUE]).sum()
    return float(RESIDUAL_FACTOR * max(tolerances.rtol, FINEST_RTOL) * exchanged)


def check_balance(ended: int, observer: ContactObserver, tolerances: Tolerances) -> Outcome:
    """Return the outcome of a walk, or `SOLVER_FAILED` if its energy balance does not close."""
    # This detects faults but does not estimate errors: a walk's error may be far larger than its residual.
    closes = observer.tally.residual <= explained_residual(observer, tolerances)
    return Outcome(ended) if closes else Outcome.SOLVER_FAILED


def driven_work(walker: ContactWalker, along: float, up: float, account: Floats, springs: float = 0.0) -> DrivenWork:
    """Return gravity's work over a displacement (`along` the slope and `up`, m) and the drives' work from the account.

    springs  work of the springs (J), which the account does not contain
    """
    gravity = walker.mass * (walker.gravity_along * along - walker.gravity_down * up)
    work = DrivenWork(walker.mass * walker.gravity, gravity, *account[PUSH_OFF:].tolist())
    if not walker.whole.laws[HIP_ROW + 1 :, DAMPING].any():
        return work._replace(hip=work.hip + springs)
    # If the knees have dampers, the hip has none. All work in `hip` that is not the torque's is then the knees'.
    return work._replace(hip=work.hip_torque + springs, knees=work.hip - work.hip_torque)


def gather(
    stopped: Stopped, walk_state: WalkState, observer: ContactObserver, walker: ContactWalker, tolerances: Tolerances
) -> ContactWalkResult:
    done = int(walk_state.progress.steps)
    lifted = events.steps_with_lift(walk_state)
    seen = int(observer.tally.recorded)
    samples = ContactSamples(*(each[:seen] for each in observer.samples)) if observer.samples.time_s.size else None
    strikes = walk_state.knee_strike[:done]
    along, up = (float(each[done - 1]) if done else 0.0 for each in (walk_state.touch_along, walk_state.touch_height))
    return ContactWalkResult(
        foothold_height_m=walk_state.touch_height[:done] if is_uneven(walk_state.ground.terrain) else None,
        outcome=stopped.outcome,
        touch_time_s=walk_state.touch_time[:done],
        touch_along_m=walk_state.touch_along[:done],
        knee_strike_time_s=np.where(strikes < 0.0, np.nan, strikes) if walker.kneed else None,
        end_time_s=stopped.time_s,
        work=WalkWork(*stopped.work.tolist()),
        slip_m=walk_state.slip[:lifted],
        rolling_m=walk_state.rolling[:lifted],
        stance_s=walk_state.lift_time[:lifted] - np.append(0.0, walk_state.touch_time)[:lifted],
        end_state=stopped.state,
        max_penetration_m=float(observer.tally.max_penetration),
        energy_balance_residual_J=float(observer.tally.residual),
        explained_residual_J=explained_residual(observer, tolerances),
        dissipated_J=observer.account[LOSS_ENTRIES].copy(),
        driven=driven_work(walker, along, up, observer.account_at_touch, float(observer.tally.spring_work)),
        samples=samples,
        method=tolerances.method,
    )
