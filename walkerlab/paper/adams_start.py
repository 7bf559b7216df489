"""The start that the paper gives its ADAMS model (Table 2), run as it stands, and why it ends as it does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.walker import ContactWalker
from walkerlab.hybrid.contact_run import ContactWalkResult, sampled_energies, sampled_feet
from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.hybrid.rigid_measures import energies, reactions
from walkerlab.mechanics.standing import Standing
from walkerlab.paper.printed import E_AVG, TABLE_2
from walkerlab.solvers.registry import method_named
from walkerlab.solvers.system import State

METHOD, RTOL, ATOL, ENDLESS = "dop853", 1e-10, 1e-12, 2**62


@dataclass(frozen=True)
class PaperStart:
    """The walk of the contact model from there, and what explains it.

    state           the start: the printed stance angle and velocities, both feet on the config's slope
    energy          J, of the rigid model, from the stance foot
    weight          N
    rigid_normal    N, force of the ground on the rigid model's stance foot at the start
    pull_from       s, from when on the rigid model's ground would have to pull; None if it never has to
    airborne_from   s, from when on no foot of the contact model is carried; None if one always is
    carried_later   N, the most that the contact model's ground carries once the rigid one's would have to pull
    time            (samples,) s
    normal          (samples, leg) N, normal forces of the contact model
    mechanical      (samples,) J, kinetic and potential energy of the contact model
    """

    state: State
    walk: ContactWalkResult
    energy: float
    weight: float
    rigid_normal: float
    pull_from: float | None
    airborne_from: float | None
    carried_later: float | None
    time: NDArray[np.float64]
    normal: NDArray[np.float64]
    mechanical: NDArray[np.float64]

    @property
    def reason(self) -> str:
        """Why it ends as it does, in words with numbers."""
        parts = [
            f"it has {self.energy:.4g} J, the paper's own gait {E_AVG.adams.text} J (Table 3)",
            f"the ground carries {self.rigid_normal:.3g} N of {self.weight:.4g} N at the start",
        ]
        if self.pull_from is not None:
            parts.append(f"to keep the stance foot down it would have to pull from {self.pull_from:.3g} s on")
        if self.carried_later is not None:
            parts.append(f"as it cannot, it carries no more than {self.carried_later:.2g} N from then on")
        if self.airborne_from is not None:
            parts.append(f"so both feet are off the ground from {self.airborne_from:.3g} s on")
        steps = int(self.walk.touch_time_s.size)
        taken = f"after {steps} step{'' if steps == 1 else 's'}" if steps else "before its first step is done"
        fate = f"the walk ends at {self.walk.end_time_s:.3g} s, {taken} ({self.walk.outcome.label})"
        return "; ".join((*parts, fate))


def paper_start(walker: Standing, walk: Callable[[State], ContactWalkResult], contact: ContactWalker) -> PaperStart:
    """Run Table 2's ADAMS start.

    walk  walks the contact model from a rigid start state, with samples
    """
    _, theta_2, omega_1, omega_2 = (row.adams.value for row in TABLE_2)
    state = (-2.0 * walker.slope - theta_2, theta_2, omega_1, omega_2)
    method = method_named(METHOD).new(len(state), RTOL, ATOL, ENDLESS)
    rigid = take_walk(walker, method, state, 1, sampled=True)
    start = np.array([state])
    result = walk(state)
    time, normal, mechanical = forces_of(result, contact)
    pull_from = None if rigid.samples is None else pulls_from(walker, rigid.samples.time, rigid.samples.state)
    later = normal[time >= pull_from].sum(axis=1) if pull_from is not None else np.zeros(0)
    return PaperStart(
        state=state,
        walk=result,
        energy=float(energies(walker, start).sum()),
        weight=float(contact.tree.mass * np.hypot(contact.gravity_along, contact.gravity_down)),
        rigid_normal=float(reactions(walker, start)[0, 1]),
        pull_from=pull_from,
        airborne_from=first(time, normal.sum(axis=1) <= 0.0),
        carried_later=float(later.max()) if later.size else None,
        time=time,
        normal=normal,
        mechanical=mechanical,
    )


def pulls_from(walker: Standing, time: NDArray[np.float64], states: NDArray[np.float64]) -> float | None:
    """When the normal force on the rigid model's stance foot first falls below zero (s)."""
    return first(time, reactions(walker, states)[:, 1] < 0.0)


def first(time: NDArray[np.float64], holds: NDArray[np.bool_]) -> float | None:
    """The first sample, after the start, at which something holds; None if it never does."""
    where = np.flatnonzero(holds & (time > 0.0))
    return float(time[where[0]]) if where.size else None


def forces_of(
    walk: ContactWalkResult, walker: ContactWalker
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Times, normal forces (samples, leg) and mechanical energy of a sampled walk."""
    samples = walk.samples
    if samples is None:
        raise ValueError("the walk was not sampled")
    feet, books = np.zeros((samples.time_s.size, 2, 5)), np.zeros((samples.time_s.size, 3))
    sampled_feet(walker, samples.states, samples.carried, feet)
    sampled_energies(walker, samples.states, samples.carried, samples.knees, books)
    return samples.time_s, feet[:, :, 2], books[:, 0] + books[:, 1]
