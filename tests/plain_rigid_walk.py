"""Simulate a rigid walk over footholds of any height in Python, event by event, with the integrator of a library."""

import numpy as np
from scipy.integrate import solve_ivp

from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.mechanics import impact
from walkerlab.physics.mechanics.rigid_model import AT_STRIKE, BENT, NO_SHANK, STANCE, STRAIGHT, Mode
from walkerlab.physics.solvers.system import derivative

LATEST = 10.0  # maximum duration of a swing, in pendulum times
CLOSEST_LOOK = 0.01  # pendulum times; two crossings of the height of a foothold within less time are missed
# s; after this time a knee is no longer straight, and a foot no longer at the height of its foothold
RELEASED, PASSED = 1e-3, 1e-6
EXACT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13}


def foot_of(walker, y):
    """Return how far a foot is ahead of and above the present contact point (m), by the definition of the levers."""
    psi = np.array(y[: len(walker.arm_x)]) + walker.slope
    return (
        float(np.cos(psi) @ walker.foot_x - np.sin(psi) @ walker.foot_y),
        float(np.sin(psi) @ walker.foot_x + np.cos(psi) @ walker.foot_y),
    )


def hip_over_fall(walker, y):
    """Return how much higher the hip is (m) than where the walker counts as fallen."""
    psi = y[STANCE] + walker.slope
    height = walker.radius + np.sin(psi) * walker.hip_x + np.cos(psi) * walker.hip_y
    return height - FALLEN_HIP * walker.leg_length


def plain_walk(walker, y, heights, nearest=0.0, disturb=lambda y: y, pieces=None):
    """Walk over footholds from a state y (2 n,) just after a heel strike.

    heights  (steps + 1,) m, the start's first
    nearest  m, ahead of the stance foot: a foot that lands nearer ends the walk
    disturb  changes a state just after a heel strike
    pieces   list that receives the parts of the walk, as the integrator returns them

    Returns (steps, 1 + 2 n) times and states after the heel strikes, the outcome, and how far ahead of the other each
    foot landed (m), the one that ended the walk too.
    """
    t, seen, ahead = 0.0, [], []
    for rise in np.diff(heights):
        t, before, outcome = swing(walker, t, y, rise, pieces)
        if outcome is Outcome.WALKED:
            ahead.append(foot_of(walker, before)[0])
            outcome = Outcome.FELL if ahead[-1] < nearest else outcome
        if outcome is not Outcome.WALKED:
            return np.array(seen).reshape(len(seen), 1 + len(y)), outcome, ahead
        y = np.zeros(len(y))
        impact.strike(walker, walker, AT_STRIKE, before, y)
        y = disturb(y)
        seen.append((t, *y))
    return np.array(seen), Outcome.WALKED, ahead


def swing(walker, t, y, rise, pieces=None):
    """Return time and state at the end of a swing, and its outcome: WALKED if the foot lands ahead on a
    straight leg.
    """
    pendulum_time = np.sqrt(walker.leg_length / walker.gravity)
    kneed = walker.shank != NO_SHANK
    phase, end, left_s = BENT if kneed else STRAIGHT, t + LATEST * pendulum_time, RELEASED

    def rate(_t, y):
        f = np.zeros(len(y))
        derivative(Mode(walker, phase), 0.0, y, f)
        return f

    def strike(_t, y):
        return foot_of(walker, y)[1] - rise

    def fall(_t, y):
        return hip_over_fall(walker, y)

    def knee(_t, y):
        return y[walker.shank] - y[walker.thigh]

    strike.direction, fall.direction, knee.direction = -1, -1, 1
    strike.terminal = fall.terminal = knee.terminal = True
    dense = {**EXACT, "dense_output": pieces is not None}
    pieces = [] if pieces is None else pieces
    while True:
        if left_s:  # An event that has just occurred must not be found again.
            passed = solve_ivp(rate, (t, t + left_s), y, **dense)
            pieces.append(passed)
            t, y = passed.t[-1], passed.y[:, -1]
        events = [strike, fall, knee] if phase == BENT and kneed else [strike, fall]
        piece = solve_ivp(rate, (t, end), y, events=events, max_step=CLOSEST_LOOK * pendulum_time, **dense)
        pieces.append(piece)
        t, y = piece.t[-1], piece.y[:, -1]
        met = [bool(times.size) for times in piece.t_events]
        if met[1]:
            return t, y, Outcome.FELL
        if len(met) > 2 and met[2]:
            new = np.zeros(len(y))
            impact.strike(walker, walker, STRAIGHT, y, new)
            phase, y, left_s = STRAIGHT, new, 0.0
        elif not met[0]:
            return t, y, Outcome.NO_HEEL_STRIKE
        elif foot_of(walker, y)[0] > 0.0:
            return t, y, Outcome.BENT_KNEE if phase == BENT and kneed else Outcome.WALKED
        else:
            left_s = PASSED
