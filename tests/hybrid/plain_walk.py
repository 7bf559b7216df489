"""Walking on compliant ground as one would write it in an afternoon: the rules of docs/theory.md, and nothing else.

Masses on levers from the hip, Newton's equations with multipliers for whatever is held, Runge-Kutta's classical method
with one small step for everything, a smaller one with both feet in the ground, events by halving that step. It knows
nothing of the package: what the two agree on is in the rules. Angles are absolute, from the vertical; positions are
along and over the slope.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

CHECKERBOARD, AFTER_MID_SWING, PLANE = 0, 1, 2
WALKED, FELL, OFF_PAD, LIFTED_OFF, SLID, NO_HEEL_STRIKE, BENT_KNEE = 0, 1, 2, 3, 4, 5, 9
# rows of events: two feet of (height, left edge, right edge), feet passing, hip, slide, two knees, sinking
PASSING, FALL, SLIDE, KNEES, SINKING, EVENTS = 6, 7, 8, 9, 11, 12
ARMED = 0.01  # rad of flexion from which on a knee locks
ROUNDING = 1e-12  # s, m
HALVINGS = 60
# so many times shorter are steps with both feet in the ground: friction holds a foot below a light, unlocked shank at
# rates of 1e6/s and more while the other strikes
SHORTER = 8.0


class Plain(NamedTuple):
    """A walker and its ground, SI."""

    masses: np.ndarray  # (m,)
    levers: np.ndarray  # (m, n, 2) ahead and up in the bodies' frames, summed from the hip
    inertias: np.ndarray  # (n,)
    foot_levers: np.ndarray  # (2, n, 2) to the centres of the balls
    foot_bodies: np.ndarray  # (2,)
    radius: float
    knees: np.ndarray  # (knees, 2) thigh and shank
    leg: float
    gravity: float
    slope: float
    stiffness: float
    exponent: float
    damping: float
    full: float
    static: float
    dynamic: float
    stiction: float
    sliding: float
    terrain: int
    pitch: float
    release_at_touch: bool


def straight_legs(leg, foot_to_mass, leg_mass, hip_mass, radius, inertia=0.0):
    """Masses, levers, inertias, foot levers and bodies of two straight legs."""
    levers = np.zeros((3, 2, 2))
    levers[0, 0, 1] = levers[1, 1, 1] = foot_to_mass - leg
    feet = np.zeros((2, 2, 2))
    feet[0, 0, 1] = feet[1, 1, 1] = radius - leg
    return (
        np.array([leg_mass, leg_mass, hip_mass]), levers, np.full(2, inertia), feet, np.array([0, 1]), radius,
        np.zeros((0, 2), np.int64),
    )  # fmt: skip


def kneed_legs(thigh, thigh_mass_at, thigh_mass, shank, shank_mass_at, shank_mass, hip_mass, radius):
    """The same of two legs of thigh (bodies 0, 1) and shank (2, 3); masses at their distance below hip and knee."""
    levers, feet = np.zeros((5, 4, 2)), np.zeros((2, 4, 2))
    for k in range(2):
        levers[k, k, 1] = -thigh_mass_at
        levers[2 + k, k, 1], levers[2 + k, 2 + k, 1] = -thigh, -shank_mass_at
        feet[k, k, 1], feet[k, 2 + k, 1] = -thigh, radius - shank
    masses = np.array([thigh_mass, thigh_mass, shank_mass, shank_mass, hip_mass])
    return masses, levers, np.zeros(4), feet, np.array([2, 3]), radius, np.array([[0, 2], [1, 3]])


@njit
def cubic(x, x0, h0, x1, h1):
    """ADAMS's STEP."""
    s = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * s * s * (3.0 - 2.0 * s)


@njit
def turned(walker, levers, y, k):
    """One body's part of the way from the hip."""
    a, (ahead, up) = y[2 + k] + walker.slope, levers[k]
    return np.cos(a) * ahead - np.sin(a) * up, np.sin(a) * ahead + np.cos(a) * up


@njit
def foot_at(walker, foot, y):
    """Along, height, velocity of the contact point's material along, velocity of the height, of the contact point."""
    n = walker.inertias.size
    x, h, v, w = y[0], y[1] - walker.radius, y[2 + n], y[3 + n]
    for k in range(n):
        rx, rh = turned(walker, walker.foot_levers[foot], y, k)
        x, h, v, w = x + rx, h + rh, v - y[4 + n + k] * rh, w + y[4 + n + k] * rx
    return x, h, v + walker.radius * y[4 + n + walker.foot_bodies[foot]], w, v


@njit
def solve(A, b):
    """Gauss with pivots, in place."""
    size = b.size
    for k in range(size):
        pivot = k + np.argmax(np.abs(A[k:, k]))
        if pivot != k:
            for j in range(size):
                A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
            b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, size):
            f = A[i, k] / A[k, k]
            if f != 0.0:
                for j in range(k, size):
                    A[i, j] -= f * A[k, j]
                b[i] -= f * b[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
    return b


@njit
def matrices(walker, y, hinged, locked):
    """Mass matrix with the rows of what is held, and the forces of weight and turning; room for multipliers."""
    n, knees = walker.inertias.size, walker.knees.shape[0]
    size = 2 + n + (2 if hinged >= 0 else 0) + locked.sum()
    A, b = np.zeros((size, size)), np.zeros(size)
    weight_x, weight_h = walker.gravity * np.sin(walker.slope), -walker.gravity * np.cos(walker.slope)
    J = np.zeros((2, 2 + n))
    J[0, 0] = J[1, 1] = 1.0
    for i in range(walker.masses.size):
        m, bx, bh = walker.masses[i], 0.0, 0.0
        for k in range(n):
            rx, rh = turned(walker, walker.levers[i], y, k)
            J[0, 2 + k], J[1, 2 + k] = -rh, rx
            bx, bh = bx - y[4 + n + k] ** 2 * rx, bh - y[4 + n + k] ** 2 * rh
        for p in range(2 + n):
            b[p] += m * (J[0, p] * (weight_x - bx) + J[1, p] * (weight_h - bh))
            for q in range(2 + n):
                A[p, q] += m * (J[0, p] * J[0, q] + J[1, p] * J[1, q])
    for k in range(n):
        A[2 + k, 2 + k] += walker.inertias[k]
    row = 2 + n
    if hinged >= 0:
        for k in range(n):
            rx, rh = turned(walker, walker.foot_levers[hinged], y, k)
            A[row, 2 + k], A[row + 1, 2 + k] = -rh, rx
            b[row] += y[4 + n + k] ** 2 * rx
            b[row + 1] += y[4 + n + k] ** 2 * rh
        A[row, 0] = A[row + 1, 1] = 1.0
        row += 2
    for knee in range(knees):
        if locked[knee]:
            A[row, 2 + walker.knees[knee, 1]], A[row, 2 + walker.knees[knee, 0]] = 1.0, -1.0
            row += 1
    for i in range(2 + n, size):
        for j in range(2 + n):
            A[j, i] = A[i, j]
    return A, b


@njit
def rate(walker, y, hinged, locked, carried):
    """dy/dt."""
    n = walker.inertias.size
    A, b = matrices(walker, y, hinged, locked)
    for foot in range(2):
        _, h, slip, climb, _ = foot_at(walker, foot, y)
        if h < 0.0 and carried[foot] and foot != hinged:
            c = walker.damping * cubic(-h, 0.0, 0.0, walker.full, 1.0)
            normal = max(0.0, walker.stiffness * (-h) ** walker.exponent - c * climb)
            if abs(slip) < walker.stiction:
                mu = -cubic(slip, -walker.stiction, -walker.static, walker.stiction, walker.static)
            else:
                mu = -np.sign(slip) * cubic(abs(slip), walker.stiction, walker.static, walker.sliding, walker.dynamic)
            push = mu * normal
            b[0] += push
            b[1] += normal
            for k in range(n):
                rx, rh = turned(walker, walker.foot_levers[foot], y, k)
                b[2 + k] += rx * normal - rh * push
            b[2 + walker.foot_bodies[foot]] += walker.radius * push
    dy = np.zeros_like(y)
    dy[: 2 + n] = y[2 + n :]
    dy[2 + n :] = solve(A, b)[: 2 + n]
    return dy


@njit
def runge_kutta(walker, y, h, hinged, locked, carried):
    """One step of the classical method."""
    k1 = rate(walker, y, hinged, locked, carried)
    k2 = rate(walker, y + 0.5 * h * k1, hinged, locked, carried)
    k3 = rate(walker, y + 0.5 * h * k2, hinged, locked, carried)
    k4 = rate(walker, y + h * k3, hinged, locked, carried)
    return y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@njit
def struck(walker, y, hinged, locked):
    """The state after a plastic impact: nothing but the hinge and what is locked takes an impulse."""
    n = walker.inertias.size
    A, b = matrices(walker, y, hinged, locked)
    b[:] = 0.0
    b[: 2 + n] = np.ascontiguousarray(A[: 2 + n, : 2 + n]) @ y[2 + n :]
    after = y.copy()
    after[2 + n :] = solve(A, b)[: 2 + n]
    return after


@njit
def material(walker, foot, y):
    """Where a foot would be had it not rolled."""
    return foot_at(walker, foot, y)[0] + walker.radius * y[2 + walker.foot_bodies[foot]]


@njit
def lane(walker, foot):
    """Where pad number 0 of a foot is centred: the swing foot starts a pitch behind the stance foot."""
    return 0.0 if foot == 1 else -walker.pitch


@njit
def event_values(walker, y, cells, stance, touched):
    """Every event function."""
    g = np.ones(EVENTS)
    x = np.zeros(2)
    for foot in range(2):
        x[foot], g[3 * foot], _, climb, _ = foot_at(walker, foot, y)
        if foot == stance:
            g[SINKING] = climb
        if walker.terrain == CHECKERBOARD:
            centre = lane(walker, foot) + cells[foot] * walker.pitch
            g[3 * foot + 1] = x[foot] - centre + 0.5 * walker.pitch
            g[3 * foot + 2] = centre + 0.5 * walker.pitch - x[foot]
    g[PASSING] = x[1] - x[0]
    g[FALL] = y[1] - 0.5 * walker.leg
    g[SLIDE] = 0.25 * walker.pitch - abs(material(walker, stance, y) - touched[stance])
    for knee in range(walker.knees.shape[0]):
        g[KNEES + knee] = y[2 + walker.knees[knee, 1]] - y[2 + walker.knees[knee, 0]]
    return g


@njit
def walk(walker, y, steps, h, hinged):
    """Walk up to `steps` steps from y = (hip, angles, their velocities), foot 1 standing, `hinged` or not (-1).

    Returns outcome, steps, times and places of touches, slips, rolling, time and state at the end, times of knee locks.
    The slip of the last step is taken where its foot lifts, after the end; it is left out if that foot does not.
    """
    end, leaving = np.zeros(1 + y.size), np.zeros(2, np.bool_)
    found = walk_to_lift(walker, y, steps, h, hinged, end, leaving)
    outcome, done, times, places, slips, rolled, t, y, locks = found
    if done == steps:
        outcome, t, y = WALKED, end[0], end[1:]
    lifted = done - 1 if leaving.any() else done
    return outcome, done, times, places, slips[:lifted], rolled[:lifted], t, y, locks


@njit
def walk_to_lift(walker, y, steps, h, hinged, end, leaving):
    """`walk` on to the lift of the foot of the last step; time and state at its touch into `end`.

    leaving  (2,) which feet are still to lift from the step that they carried
    """
    knees = walker.knees.shape[0]
    tau = np.sqrt(walker.leg / walker.gravity)
    times, places, slips, rolled = np.zeros(steps), np.zeros(steps), np.zeros(steps), np.zeros(steps)
    locks, lock_count = np.zeros(2 * steps + 2), 0
    stance, done, t, last, grounded_at, releasing = 1, 0, 0.0, 0.0, 0.0, False
    cells, left, carried = np.zeros(2, np.int64), np.zeros(2, np.int64), np.ones(2, np.bool_)
    foothold, touched = np.zeros(2), np.zeros(2)
    stood, armed = np.zeros((2, 2)), np.zeros(max(knees, 1), np.bool_)
    locked = np.zeros(knees, np.bool_)
    if knees:
        locked[1] = True
    side = np.ones(EVENTS)
    for foot in range(2):
        x, height, _, climb, _ = foot_at(walker, foot, y)
        foothold[foot], touched[foot] = x, material(walker, foot, y)
        if walker.terrain == CHECKERBOARD:
            cells[foot] = int(np.floor((x - lane(walker, foot)) / walker.pitch + 0.5))
            carried[foot] = cells[foot] % 2 == 0
        elif walker.terrain == AFTER_MID_SWING:
            carried[foot] = foot == stance
        left[foot] = cells[foot]
        inside = climb <= 1e-12 if abs(height) < 1e-13 else height < 0.0
        side[3 * foot] = -1.0 if inside else 1.0
    side[PASSING] = 1.0 if foot_at(walker, 1, y)[0] >= foot_at(walker, 0, y)[0] else -1.0
    while done < steps or leaving.any():
        both = side[0] < 0.0 and side[3] < 0.0 and carried[0] and carried[1] and hinged < 0
        aloft = grounded_at + 0.25 * tau - t
        dt = min(h / SHORTER if both else h, aloft)
        new = runge_kutta(walker, y, dt, hinged, locked, carried)
        g = event_values(walker, new, cells, stance, touched)
        low, high, event = 0.0, dt, -1
        for _ in range(HALVINGS):
            found = -1
            for i in range(EVENTS):
                if side[i] * g[i] < 0.0 and i != SINKING:
                    if i < 6 and i // 3 == hinged:
                        continue
                    if i == SLIDE and (side[3 * stance] > 0.0 or not carried[stance] or hinged == stance):
                        continue
                    if KNEES <= i < KNEES + 2 and (i - KNEES >= knees or locked[i - KNEES] or not armed[i - KNEES]):
                        continue
                    found = i
            if releasing and g[SINKING] > 0.0:
                found = SINKING
            if found < 0:
                if event < 0:
                    break
                low = dt
            else:
                event, high = found, dt
            if high - low < 1e-15:
                break
            dt = 0.5 * (low + high)
            new = runge_kutta(walker, y, dt, hinged, locked, carried)
            g = event_values(walker, new, cells, stance, touched)
        if event >= 0:
            dt = high
            new = runge_kutta(walker, y, dt, hinged, locked, carried)
        y = new
        t += dt
        for knee in range(knees):
            flexion = y[2 + walker.knees[knee, 0]] - y[2 + walker.knees[knee, 1]]
            armed[knee] = (armed[knee] or flexion > ARMED) and not locked[knee]
            side[KNEES + knee] = -1.0
        if hinged >= 0:
            grounded_at = t
        for foot in range(2):
            if side[3 * foot] < 0.0 and carried[foot]:
                grounded_at = t
        if t - last > 10.0 * tau:
            return NO_HEEL_STRIKE, done, times, places, slips, rolled, t, y, locks[:lock_count]
        if t - grounded_at > 0.25 * tau - ROUNDING:
            return LIFTED_OFF, done, times, places, slips, rolled, t, y, locks[:lock_count]
        if event < 0:
            continue
        if event == FALL:
            return FELL, done, times, places, slips, rolled, t, y, locks[:lock_count]
        if event == SLIDE:
            return SLID, done, times, places, slips, rolled, t, y, locks[:lock_count]
        if event == SINKING:
            releasing, locked[1 - stance], armed[1 - stance] = False, False, False
            continue
        if event == KNEES or event == KNEES + 1:
            locked[event - KNEES] = True
            y = struck(walker, y, hinged, locked)
            locks[lock_count] = t
            lock_count += 1
            continue
        x0, x1 = foot_at(walker, 0, y)[0], foot_at(walker, 1, y)[0]
        along = np.array([x0, x1])
        if event == PASSING:
            side[PASSING] = -side[PASSING]
            for foot in range(2):
                _, height, _, climb, _ = foot_at(walker, foot, y)
                # equal legs of a hinged step pass each other on the ground: rounding neither lifts a foot nor holds one
                above = height > ROUNDING or (height > -ROUNDING and climb > 0.0)
                if walker.terrain == AFTER_MID_SWING and above and foot != stance:
                    carried[foot] = (side[PASSING] > 0.0) == (foot == 1)
            continue
        foot, kind = event // 3, event % 3
        other = 1 - foot
        if kind > 0:
            cells[foot] += 1 if kind == 2 else -1
            if cells[foot] % 2 != 0:
                carried[foot] = False
            elif side[3 * foot] > 0.0:
                carried[foot] = True
            else:
                return OFF_PAD, done, times, places, slips, rolled, t, y, locks[:lock_count]
            continue
        side[event] = -side[event]
        slip = material(walker, foot, y) - touched[foot]
        if side[event] > 0.0:
            if foot == stance or leaving[foot]:
                stood[foot, 0], stood[foot, 1] = slip, along[foot] - foothold[foot] - slip
                if foot != stance:
                    slips[done - 1], rolled[done - 1] = stood[foot]
                leaving[foot] = False
            if walker.terrain == AFTER_MID_SWING and foot != stance:
                carried[foot] = (side[PASSING] > 0.0) == (foot == 1)
            continue
        if not carried[foot]:
            continue
        if foot == stance:
            if abs(slip) > 0.25 * walker.pitch:
                return SLID, done, times, places, slips, rolled, t, y, locks[:lock_count]
            continue
        if walker.terrain == CHECKERBOARD and cells[foot] == left[foot]:
            if abs(along[foot] - foothold[foot] - stood[foot, 1]) > 0.25 * walker.pitch:
                return OFF_PAD, done, times, places, slips, rolled, t, y, locks[:lock_count]
            continue
        if along[foot] - along[other] < 0.25 * walker.pitch:
            continue
        if knees and not locked[foot]:
            return BENT_KNEE, done, times, places, slips, rolled, t, y, locks[:lock_count]
        if side[3 * other] < 0.0 and hinged < 0:
            slip = material(walker, other, y) - touched[other]
            stood[other, 0], stood[other, 1] = slip, along[other] - foothold[other] - slip
        if hinged >= 0:
            touched[other], stood[other, 0], stood[other, 1] = material(walker, other, y), 0.0, 0.0
            side[3 * other] = -1.0
            hinged = -1
        leaving[other], leaving[foot] = side[3 * other] < 0.0, False
        times[done], places[done], slips[done], rolled[done] = t, along[foot], stood[other, 0], stood[other, 1]
        foothold[foot], touched[foot], left[foot] = along[foot], material(walker, foot, y), cells[foot]
        stance, last, done = foot, t, done + 1
        end[0], end[1:] = t, y
        if walker.terrain == AFTER_MID_SWING and side[3 * other] > 0.0:
            carried[other] = (side[PASSING] > 0.0) == (other == 1)
        if knees:
            if walker.release_at_touch:
                locked[other], armed[other] = False, False
            else:
                releasing = True
    return WALKED, done, times, places, slips, rolled, t, y, locks[:lock_count]


def start(walker, angles, rates, hinged=False):
    """The state with foot 1 just touching at the origin, at rest and rolling, or hinged at its centre."""
    n = walker.inertias.size
    y = np.concatenate([[0.0, 0.0], angles, [0.0, 0.0], rates]).astype(float)
    x, height, slip, climb, centre = foot_at(walker, 1, y)
    y[0], y[1] = -x, -height
    y[2 + n], y[3 + n] = -(centre if hinged else slip), -climb
    return y
