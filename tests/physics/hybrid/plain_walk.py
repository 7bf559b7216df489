"""Walk on compliant ground by the rules of docs/theory.md, in the simplest possible code.

Masses on levers from the hip, Newton's equations with multipliers for whatever is held, Runge-Kutta's classical method
with one step for everything, shorter the faster the ground reacts, events by halving that step. It knows nothing of the
package: what the two agree on is in the rules. Angles are absolute, from the vertical; positions are along and over the
slope. A state is (hip, angles, their velocities, work lost to damping, work lost to friction).
"""

from functools import partial
from typing import NamedTuple

import numba
import numpy as np

# All code is in one file: numba finds out by its time and size whether compiled code is stale.
njit = partial(numba.njit, cache=True, error_model="numpy", no_cfunc_wrapper=True)
inner = partial(njit, no_cpython_wrapper=True)  # for functions that only compiled code calls

CHECKERBOARD, AFTER_MID_SWING, PLANE = 0, 1, 2
WALKED, FELL, OFF_PAD, LIFTED_OFF, SLID, NO_HEEL_STRIKE, BENT_KNEE, STUBBED = 0, 1, 2, 3, 4, 5, 9, 10
# order of the events: for both feet (height, left edge, right edge), then feet passing, hip, slide, two knees, sinking
PASSING, FALL, SLIDE, KNEES, SINKING, EVENTS = 6, 7, 8, 9, 11, 12
ARMED = 0.01  # rad; a knee can lock after it was flexed by more than this
ROUNDING = 1e-12  # s, m
HALVINGS = 60
REACTION = 2e-4  # s; if the ground reacts at a rate r (1/s), a step is 1 + r * REACTION times shorter
CHANNELS = ("damping", "friction", "edges", "knee strikes")  # where energy is lost
DAMPING, FRICTION, EDGES, KNEE_STRIKES = 0, 1, 2, 3
STEPS, SLIPS, LOCKS, ROUNDS = 0, 1, 2, 3  # indices of the counts in a diary


class Plain(NamedTuple):
    """A walker and its ground, SI."""

    masses: np.ndarray  # (m,)
    levers: np.ndarray  # (m, n, 2) ahead and up in the bodies' frames, summed from the hip
    inertias: np.ndarray  # (n,)
    foot_levers: np.ndarray  # (2, n, 2) to the centres of the balls
    foot_bodies: np.ndarray  # (2,)
    radii: np.ndarray  # (2,) m, of the balls
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
    # N m/rad, N m s/rad, N m: spring, damper, and a torque that swings the free leg forward
    hip: np.ndarray = np.zeros(3)
    push_offs: np.ndarray = np.zeros(2)  # (2,) N s, of each foot
    push_off_duration: float = 1.0  # s
    # (footholds,) m above the slope, beginning with the start's; footholds beyond the list have the last height
    heights: np.ndarray = np.zeros(1)


class Now(NamedTuple):
    """What currently holds and pushes the walker: pinned foot, locked knees, pulses."""

    stance: int
    pinned: int  # foot, or -1
    locked: np.ndarray  # (knees,)
    has_ground: np.ndarray  # (2,)
    levels: np.ndarray  # (2,) m, height of the ground for each foot
    pushed_at: float  # s, when a push-off began


class Walked(NamedTuple):
    """A walk: its steps, and how and where it ended."""

    outcome: int
    times: np.ndarray  # (steps,) s of touches
    places: np.ndarray  # (steps,) m
    slips: np.ndarray  # (steps,) m, or one fewer if the last foot did not lift
    rolled: np.ndarray  # (steps,) m, or one fewer
    locks: np.ndarray  # s, of knees
    end_s: float
    end: np.ndarray
    ground: np.ndarray  # (2,) whether each foot had ground there
    levels: np.ndarray  # (2,) m, how high
    lost: np.ndarray  # (4,) J
    rounds: int  # number of steps of the method


class Diary(NamedTuple):
    """Records that the walk writes as it goes."""

    times: np.ndarray
    places: np.ndarray
    slips: np.ndarray
    rolled: np.ndarray
    locks: np.ndarray
    counts: np.ndarray  # steps, slips known, locks, steps of the method
    lost: np.ndarray  # J at edges and knees' strikes


def straight_legs(leg, foot_to_mass, leg_mass, hip_mass, radius, inertia=0.0):
    """Return masses, levers, inertias, foot levers and bodies of two straight legs."""
    levers = np.zeros((3, 2, 2))
    levers[0, 0, 1] = levers[1, 1, 1] = foot_to_mass - leg
    feet = np.zeros((2, 2, 2))
    feet[0, 0, 1] = feet[1, 1, 1] = radius - leg
    return (
        np.array([leg_mass, leg_mass, hip_mass]), levers, np.full(2, inertia), feet, np.array([0, 1]),
        np.full(2, radius), np.zeros((0, 2), np.int64),
    )  # fmt: skip


def kneed_legs(thigh, thigh_mass_at, thigh_mass, shank, shank_mass_at, shank_mass, hip_mass, radius):
    """Return the same for two legs of thigh (bodies 0, 1) and shank (2, 3). Masses are given below hip and knee."""
    levers, feet = np.zeros((5, 4, 2)), np.zeros((2, 4, 2))
    for k in range(2):
        levers[k, k, 1] = -thigh_mass_at
        levers[2 + k, k, 1], levers[2 + k, 2 + k, 1] = -thigh, -shank_mass_at
        feet[k, k, 1], feet[k, 2 + k, 1] = -thigh, radius - shank
    masses = np.array([thigh_mass, thigh_mass, shank_mass, shank_mass, hip_mass])
    return masses, levers, np.zeros(4), feet, np.array([2, 3]), np.full(2, radius), np.array([[0, 2], [1, 3]])


def replace_second_leg(first, second):
    """Return the same for the first leg of one pair and the second leg of another pair on the same hip."""
    # In all arrays, entries of the two legs take turns.
    turns = [np.arange(len(own)) % 2 == 1 for own in first[:6]]
    legs = [
        np.where(odd.reshape(-1, *[1] * (own.ndim - 1)), other, own)
        for own, other, odd in zip(first[:6], second[:6], turns, strict=True)
    ]
    return *legs, first[6]


@inner
def cubic(x, x0, h0, x1, h1):
    """ADAMS's STEP."""
    s = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * s * s * (3.0 - 2.0 * s)


@njit
def turned(slope, levers, i, y, k):
    """Return the contribution of one body to the lever from the hip to a mass or foot."""
    a, ahead, up = y[2 + k] + slope, levers[i, k, 0], levers[i, k, 1]
    if ahead == 0.0 and up == 0.0:
        return 0.0, 0.0  # Most masses depend on few bodies, so this saves much time.
    return np.cos(a) * ahead - np.sin(a) * up, np.sin(a) * ahead + np.cos(a) * up


@njit
def foot_at(walker, foot, y):
    """Return the contact point's position and height, the foot material's velocity along the ground, the height's rate,
    and the contact point's velocity.
    """
    n = walker.inertias.size
    x, h, v, w = y[0], y[1] - walker.radii[foot], y[2 + n], y[3 + n]
    for k in range(n):
        rx, rh = turned(walker.slope, walker.foot_levers, foot, y, k)
        x, h, v, w = x + rx, h + rh, v - y[4 + n + k] * rh, w + y[4 + n + k] * rx
    return x, h, v + walker.radii[foot] * y[4 + n + walker.foot_bodies[foot]], w, v


@inner
def solve(A, b):
    """Solve linear equations in place by Gaussian elimination with pivots."""
    size = b.size
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(A[i, k]) > abs(A[pivot, k]):
                pivot = i
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


@inner
def matrices(walker, now, y):
    """Return the mass matrix with the rows of the constraints, and the gravity and velocity forces, with room for
    multipliers.
    """
    n, knees = walker.inertias.size, walker.knees.shape[0]
    pinned, locked = now.pinned, now.locked
    size = 2 + n + (2 if pinned >= 0 else 0) + locked.sum()
    A, b = np.zeros((size, size)), np.zeros(size)
    weight_x, weight_h = walker.gravity * np.sin(walker.slope), -walker.gravity * np.cos(walker.slope)
    J = np.zeros((2, 2 + n))
    J[0, 0] = J[1, 1] = 1.0
    for i in range(walker.masses.size):
        m, bx, bh = walker.masses[i], 0.0, 0.0
        for k in range(n):
            rx, rh = turned(walker.slope, walker.levers, i, y, k)
            J[0, 2 + k], J[1, 2 + k] = -rh, rx
            bx, bh = bx - y[4 + n + k] ** 2 * rx, bh - y[4 + n + k] ** 2 * rh
        for p in range(2 + n):
            b[p] += m * (J[0, p] * (weight_x - bx) + J[1, p] * (weight_h - bh))
            for q in range(p + 1):
                A[p, q] += m * (J[0, p] * J[0, q] + J[1, p] * J[1, q])
    for k in range(n):
        A[2 + k, 2 + k] += walker.inertias[k]
    row = 2 + n
    if pinned >= 0:
        for k in range(n):
            rx, rh = turned(walker.slope, walker.foot_levers, pinned, y, k)
            A[row, 2 + k], A[row + 1, 2 + k] = -rh, rx
            b[row] += y[4 + n + k] ** 2 * rx
            b[row + 1] += y[4 + n + k] ** 2 * rh
        A[row, 0] = A[row + 1, 1] = 1.0
        row += 2
    for knee in range(knees):
        if locked[knee]:
            A[row, 2 + walker.knees[knee, 1]], A[row, 2 + walker.knees[knee, 0]] = 1.0, -1.0
            row += 1
    for i in range(size):
        for j in range(i):
            A[j, i] = A[i, j]
    return A, b


@inner
def push(walker, foot, y, b, along, upward):
    """Apply a force (N) at a foot's contact point."""
    b[0] += along
    b[1] += upward
    for k in range(walker.inertias.size):
        rx, rh = turned(walker.slope, walker.foot_levers, foot, y, k)
        b[2 + k] += rx * upward - rh * along
    b[2 + walker.foot_bodies[foot]] += walker.radii[foot] * along


@inner
def push_off(walker, now, t, y, b):
    """Add the pulse of the trailing leg, which acts along the line from the contact point of its foot to the hip."""
    u, foot = (t - now.pushed_at) / walker.push_off_duration, 1 - now.stance
    if not 0.0 < u < 1.0 or walker.push_offs[foot] == 0.0:
        return
    x, h = foot_at(walker, foot, y)[:2]
    force = 30.0 * (u * (1.0 - u)) ** 2 * walker.push_offs[foot] / walker.push_off_duration
    force /= np.hypot(y[0] - x, y[1] - h)
    push(walker, foot, y, b, force * (y[0] - x), force * (y[1] - h))


@inner
def rate(walker, now, t, y):
    """Return dy/dt."""
    n = walker.inertias.size
    A, b = matrices(walker, now, y)
    dy = np.zeros_like(y)
    stance, swing = now.stance, 1 - now.stance
    ahead, faster = y[2 + swing] - y[2 + stance], y[4 + n + swing] - y[4 + n + stance]
    torque = walker.hip[2] - walker.hip[0] * ahead - walker.hip[1] * faster
    b[2 + swing] += torque
    b[2 + stance] -= torque
    push_off(walker, now, t, y, b)
    for foot in range(2):
        _, h, slip, vertical_velocity, _ = foot_at(walker, foot, y)
        h -= now.levels[foot]
        if h < 0.0 and now.has_ground[foot] and foot != now.pinned:
            c = walker.damping * cubic(-h, 0.0, 0.0, walker.full, 1.0)
            spring = walker.stiffness * (-h) ** walker.exponent
            normal = max(0.0, spring - c * vertical_velocity)
            if abs(slip) < walker.stiction:
                mu = -cubic(slip, -walker.stiction, -walker.static, walker.stiction, walker.static)
            else:
                mu = -np.sign(slip) * cubic(abs(slip), walker.stiction, walker.static, walker.sliding, walker.dynamic)
            push(walker, foot, y, b, mu * normal, normal)
            dy[4 + 2 * n + DAMPING] += (spring - normal) * vertical_velocity
            dy[4 + 2 * n + FRICTION] -= mu * normal * slip
    dy[: 2 + n] = y[2 + n : 4 + 2 * n]
    dy[2 + n : 4 + 2 * n] = solve(A, b)[: 2 + n]
    return dy


@inner
def reaction(walker, now, y):
    """Return the largest rate (1/s) at which the ground reacts to the velocity of a foot, or at which a foot crosses
    the depth where damping sets in.
    """
    n, fastest = walker.inertias.size, 0.0
    for foot in range(2):
        _, h, _, vertical_velocity, _ = foot_at(walker, foot, y)
        h -= now.levels[foot]
        if h < 0.0 and now.has_ground[foot] and foot != now.pinned:
            c = walker.damping * cubic(-h, 0.0, 0.0, walker.full, 1.0)
            normal = max(0.0, walker.stiffness * (-h) ** walker.exponent - c * vertical_velocity)
            gives, (A, J) = np.zeros(2), matrices(walker, now, y)
            for axis in range(2):
                J[:] = 0.0
                J[axis] = 1.0
                for k in range(n):
                    rx, rh = turned(walker.slope, walker.foot_levers, foot, y, k)
                    J[2 + k] = rx if axis == 1 else -rh
                if axis == 0:
                    J[2 + walker.foot_bodies[foot]] += walker.radii[foot]
                gives[axis] = J @ solve(A.copy(), J.copy())
            grip = 1.5 * walker.static * normal / walker.stiction
            fastest = max(fastest, grip * gives[0], c * gives[1], abs(vertical_velocity) / walker.full)
    return fastest


@inner
def runge_kutta(walker, now, t, y, h):
    """Take one step of the classical method."""
    k1 = rate(walker, now, t, y)
    k2 = rate(walker, now, t + 0.5 * h, y + 0.5 * h * k1)
    k3 = rate(walker, now, t + 0.5 * h, y + 0.5 * h * k2)
    k4 = rate(walker, now, t + h, y + h * k3)
    return y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@inner
def struck(walker, now, y):
    """Return the state after a plastic impact, in which only the hinge and locked joints transmit impulses."""
    n = walker.inertias.size
    A, b = matrices(walker, now, y)
    b[:] = 0.0
    b[: 2 + n] = np.ascontiguousarray(A[: 2 + n, : 2 + n]) @ y[2 + n : 4 + 2 * n]
    after = y.copy()
    after[2 + n : 4 + 2 * n] = solve(A, b)[: 2 + n]
    return after


@inner
def stored(walker, foot, level, y):
    """Return the energy (J) stored in the ground under a foot. The surface is at `level` (m)."""
    depth = max(0.0, level - foot_at(walker, foot, y)[1])
    return walker.stiffness * depth ** (walker.exponent + 1.0) / (walker.exponent + 1.0)


@njit
def energy(walker, has_ground, levels, y):
    """Return the sum (J) of kinetic energy, potential energy above the first foothold, and energy in the ground."""
    n = walker.inertias.size
    total = 0.0
    for i in range(walker.masses.size):
        x, h, v, w = y[0], y[1], y[2 + n], y[3 + n]
        for k in range(n):
            rx, rh = turned(walker.slope, walker.levers, i, y, k)
            x, h, v, w = x + rx, h + rh, v - y[4 + n + k] * rh, w + y[4 + n + k] * rx
        height = np.cos(walker.slope) * h - np.sin(walker.slope) * x
        total += walker.masses[i] * (0.5 * (v * v + w * w) + walker.gravity * height)
    for k in range(n):
        total += 0.5 * walker.inertias[k] * y[4 + n + k] ** 2
    for foot in range(2):
        if has_ground[foot]:
            total += stored(walker, foot, levels[foot], y)
    return total + 0.5 * walker.hip[0] * (y[2] - y[3]) ** 2


@inner
def material(walker, foot, y):
    """Return where along the slope a foot would be if it had not rolled."""
    return foot_at(walker, foot, y)[0] + walker.radii[foot] * y[2 + walker.foot_bodies[foot]]


@inner
def lane(walker, foot):
    """Return the centre of a foot's pad number 0. The swing foot starts a pitch behind the stance foot."""
    return 0.0 if foot == 1 else -walker.pitch


@inner
def event_values(walker, now, y, cells, touched):
    """Return the values of all event functions."""
    g = np.ones(EVENTS)
    x = np.zeros(2)
    for foot in range(2):
        x[foot], height, _, vertical_velocity, _ = foot_at(walker, foot, y)
        g[3 * foot] = height - now.levels[foot]
        if foot == now.stance:
            g[SINKING] = vertical_velocity
        if walker.terrain == CHECKERBOARD:
            centre = lane(walker, foot) + cells[foot] * walker.pitch
            g[3 * foot + 1] = x[foot] - centre + 0.5 * walker.pitch
            g[3 * foot + 2] = centre + 0.5 * walker.pitch - x[foot]
    g[PASSING] = x[1] - x[0]
    g[FALL] = y[1] - now.levels[now.stance] - 0.5 * walker.leg
    g[SLIDE] = 0.25 * walker.pitch - abs(material(walker, now.stance, y) - touched[now.stance])
    for knee in range(walker.knees.shape[0]):
        g[KNEES + knee] = y[2 + walker.knees[knee, 1]] - y[2 + walker.knees[knee, 0]]
    return g


@inner
def set_level(walker, levels, side, foot, level, y):
    """Move the ground under a foot to another level, which may be above the foot. Return the energy (J) that its spring
    held.
    """
    held = stored(walker, foot, levels[foot], y) if side[3 * foot] < 0.0 else 0.0
    if level == levels[foot]:
        return 0.0
    levels[foot] = level
    side[3 * foot] = 1.0 if foot_at(walker, foot, y)[1] > level else -1.0
    return held


@inner
def next_level(walker, done):
    """Return the height (m) of the next foothold of the swing foot."""
    return walker.heights[min(done + 1, walker.heights.size - 1)]


@inner
def changes_level(walker, levels, done, foot):
    """Whether the ground still has to take the height of the next foothold of a foot that gets ahead on a plane."""
    return walker.terrain != CHECKERBOARD and levels[foot] != next_level(walker, done)


@njit
def take_steps(walker, y, h, pinned, diary):
    """Walk from y until the diary is full or the walk ends. Foot 1 stands first, and `pinned` is the pinned foot or -1.

    Then walk on until the last step's foot lifts, if it does: a slip is from touch to lift. Returns outcome, time and
    state at the end, and whether each foot had ground there and at which level.
    """
    knees = walker.knees.shape[0]
    tau = np.sqrt(walker.leg / walker.gravity)
    times, places, slips, rolled, locks, counts, lost = diary
    steps = times.size
    outcome, end_s, end, ground, end_levels = WALKED, 0.0, y, np.ones(2, np.bool_), np.zeros(2)
    stance, done, t, last, grounded_at, releasing, owed = 1, 0, 0.0, 0.0, 0.0, False, False
    levels, uneven, pushed_at = np.zeros(2), walker.heights.size > 1, np.inf
    cells, left, has_ground = np.zeros(2, np.int64), np.zeros(2, np.int64), np.ones(2, np.bool_)
    foothold, touched = np.zeros(2), np.zeros(2)
    stood, leaving, armed = np.zeros((2, 2)), np.zeros(2, np.bool_), np.zeros(max(knees, 1), np.bool_)
    locked = np.zeros(knees, np.bool_)
    if knees:
        locked[1] = True
    side = np.ones(EVENTS)
    for foot in range(2):
        x, height, _, vertical_velocity, _ = foot_at(walker, foot, y)
        foothold[foot], touched[foot] = x, material(walker, foot, y)
        if walker.terrain == CHECKERBOARD:
            cells[foot] = int(np.floor((x - lane(walker, foot)) / walker.pitch + 0.5))
            has_ground[foot] = cells[foot] % 2 == 0
        elif walker.terrain == AFTER_MID_SWING:
            has_ground[foot] = foot == stance
        left[foot] = cells[foot]
        inside = vertical_velocity <= 1e-12 if abs(height) < 1e-13 else height < 0.0
        side[3 * foot] = -1.0 if inside else 1.0
    side[PASSING] = 1.0 if foothold[1] >= foothold[0] else -1.0
    while done < steps or leaving[0] or leaving[1]:
        counts[ROUNDS] += 1
        deadline = min(grounded_at + 0.25 * tau, last + 10.0 * tau) - t
        now = Now(stance, pinned, locked, has_ground, levels, pushed_at)
        left_of_push = pushed_at + walker.push_off_duration - t
        pushes = walker.push_offs.max() != 0.0 and ROUNDING < left_of_push < np.inf
        if pushes:
            deadline = min(deadline, left_of_push)
        elif owed:
            owed, locked[1 - stance], armed[1 - stance] = False, False, False
        dt = min(h / (1.0 + REACTION * reaction(walker, now, y)), deadline)
        new = runge_kutta(walker, now, t, y, dt)
        g = event_values(walker, now, new, cells, touched)
        low, high, event = 0.0, dt, -1
        for _ in range(HALVINGS):
            found = -1
            for i in range(EVENTS):
                if side[i] * g[i] < 0.0 and i != SINKING:
                    if i < 6 and i // 3 == pinned:
                        continue
                    if i == SLIDE and (side[3 * stance] > 0.0 or not has_ground[stance] or pinned == stance):
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
            new = runge_kutta(walker, now, t, y, dt)
            g = event_values(walker, now, new, cells, touched)
        if event >= 0:
            dt = high
            new = runge_kutta(walker, now, t, y, dt)
        y = new
        t += dt
        for knee in range(knees):
            flexion = y[2 + walker.knees[knee, 0]] - y[2 + walker.knees[knee, 1]]
            armed[knee] = (armed[knee] or flexion > ARMED) and not locked[knee]
            side[KNEES + knee] = -1.0
        if pinned >= 0:
            grounded_at = t
        for foot in range(2):
            if side[3 * foot] < 0.0 and has_ground[foot]:
                grounded_at = t
        if t - last > 10.0 * tau - ROUNDING:
            outcome = NO_HEEL_STRIKE
            break
        if t - grounded_at > 0.25 * tau - ROUNDING:
            outcome = LIFTED_OFF
            break
        if event < 0:
            continue
        if event == FALL:
            outcome = FELL
            break
        if event == SLIDE:
            outcome = SLID
            break
        if event == SINKING:
            releasing = False
            if pushes and dt < left_of_push - ROUNDING:
                owed = True
            else:
                locked[1 - stance], armed[1 - stance] = False, False
            continue
        if event == KNEES or event == KNEES + 1:
            locked[event - KNEES] = True
            before = energy(walker, has_ground, levels, y)
            y = struck(walker, now, y)
            if done < steps:
                lost[KNEE_STRIKES] += before - energy(walker, has_ground, levels, y)
                locks[counts[LOCKS]] = t
                counts[LOCKS] += 1
            continue
        along = np.zeros(2)
        for foot in range(2):
            along[foot] = foot_at(walker, foot, y)[0]
        if event == PASSING:
            side[PASSING] = -side[PASSING]
            swing, swing_above = 1 - stance, False
            for foot in range(2):
                _, height, _, vertical_velocity, _ = foot_at(walker, foot, y)
                height -= levels[foot]
                # Equal legs of a pinned step pass each other on the ground, where rounding must neither lift a foot nor
                # hold it.
                above = height > ROUNDING or (height > -ROUNDING and vertical_velocity > 0.0)
                if foot == swing:
                    swing_above = above
                if walker.terrain == AFTER_MID_SWING and above and foot != stance:
                    has_ground[foot] = (side[PASSING] > 0.0) == (foot == 1)
            ahead = (side[PASSING] > 0.0) == (swing == 1)
            # The next foothold counts unless the foot is still in the ground.
            if ahead and (swing_above or not has_ground[swing]) and changes_level(walker, levels, done, swing):
                set_level(walker, levels, side, swing, next_level(walker, done), y)
                has_ground[swing] = side[3 * swing] > 0.0
                if not has_ground[swing] and walker.terrain == PLANE:
                    outcome = STUBBED
                    break
            continue
        foot, kind = event // 3, event % 3
        other = 1 - foot
        if kind > 0:
            cells[foot] += 1 if kind == 2 else -1
            if cells[foot] % 2 != 0:
                if has_ground[foot] and done < steps:
                    lost[EDGES] += stored(walker, foot, levels[foot], y)
                has_ground[foot] = False
                continue
            if uneven:
                pad = cells[foot] - (0 if foot == 1 else 1)
                set_level(walker, levels, side, foot, walker.heights[max(0, min(pad, walker.heights.size - 1))], y)
            if side[3 * foot] > 0.0:
                has_ground[foot] = True
            else:
                outcome = OFF_PAD
                break
            continue
        side[event] = -side[event]
        slip = material(walker, foot, y) - touched[foot]
        if side[event] > 0.0:
            if foot == stance or leaving[foot]:
                stood[foot, 0], stood[foot, 1] = slip, along[foot] - foothold[foot] - slip
                if foot != stance:
                    slips[done - 1], rolled[done - 1] = stood[foot]
                    counts[SLIPS] = done
                leaving[foot] = False
            if walker.terrain == AFTER_MID_SWING and foot != stance:
                has_ground[foot] = (side[PASSING] > 0.0) == (foot == 1)
            if foot != stance and (side[PASSING] > 0.0) == (foot == 1) and changes_level(walker, levels, done, foot):
                set_level(walker, levels, side, foot, next_level(walker, done), y)
                has_ground[foot] = side[3 * foot] > 0.0
                if not has_ground[foot] and walker.terrain == PLANE:
                    outcome = STUBBED
                    break
            continue
        if not has_ground[foot]:
            continue
        if foot == stance:
            if abs(slip) > 0.25 * walker.pitch:
                outcome = SLID
                break
            continue
        if walker.terrain == CHECKERBOARD and cells[foot] == left[foot]:
            if abs(along[foot] - foothold[foot] - stood[foot, 1]) > 0.25 * walker.pitch:
                outcome = OFF_PAD
                break
            continue
        if along[foot] - along[other] < 0.25 * walker.pitch:
            continue
        if knees and not locked[foot]:
            outcome = BENT_KNEE
            break
        if pinned >= 0:
            touched[other], stood[other, 0], stood[other, 1] = material(walker, other, y), 0.0, 0.0
            side[3 * other] = -1.0
            pinned = -1
        leaving[other], leaving[foot] = side[3 * other] < 0.0, False
        times[done], places[done] = t, along[foot]
        if not leaving[other]:
            slips[done], rolled[done] = stood[other]
            counts[SLIPS] = done + 1
        foothold[foot], touched[foot], left[foot] = along[foot], material(walker, foot, y), cells[foot]
        stance, last, done, pushed_at = foot, t, done + 1, t
        counts[STEPS] = done
        if done == steps:
            end_s, end, ground, end_levels = t, y.copy(), has_ground.copy(), levels.copy()
        if walker.terrain == AFTER_MID_SWING and side[3 * other] > 0.0:
            has_ground[other] = (side[PASSING] > 0.0) == (other == 1)
        if knees:
            if walker.release_at_touch and walker.push_offs.max() != 0.0:
                owed = True
            elif walker.release_at_touch:
                locked[other], armed[other] = False, False
            else:
                releasing = True
    if done < steps:
        return outcome, t, y, has_ground, levels
    return WALKED, end_s, end, ground, end_levels


def walk(walker, y, steps, h, pinned=-1):
    """Walk up to `steps` steps from y. The method takes steps of at most h (s), and foot `pinned` is pinned until the
    first touch.
    """
    locks, counts = np.zeros(2 * steps + 2), np.zeros(4, np.int64)
    diary = Diary(*np.zeros((4, steps)), locks, counts, np.zeros(4))
    outcome, end_s, end, ground, levels = take_steps(walker, y, h, pinned, diary)
    done, known = counts[STEPS], counts[SLIPS]
    diary.lost[[DAMPING, FRICTION]] = end[-2:]
    return Walked(
        outcome, diary.times[:done], diary.places[:done], diary.slips[:known], diary.rolled[:known],
        locks[: counts[LOCKS]], end_s, end, ground, levels, diary.lost, int(counts[ROUNDS]),
    )  # fmt: skip


def of_centre(walker, y):
    """Return a walker's state from the position and velocity of its centre of mass instead of the hip's."""
    n, mass = walker.inertias.size, walker.masses.sum()
    moved = np.append(y, [0.0, 0.0])
    for i, m in enumerate(walker.masses):
        for k in range(n):
            rx, rh = turned(walker.slope, walker.levers, i, y, k)
            moved[:2] -= m / mass * np.array([rx, rh])
            moved[2 + n : 4 + n] -= m / mass * y[4 + n + k] * np.array([-rh, rx])
    return moved


def start(walker, angles, rates, pinned=False):
    """Return the state in which foot 1 just touches at the origin and rolls, or is pinned at its centre."""
    n = walker.inertias.size
    y = np.concatenate([[0.0, 0.0], angles, [0.0, 0.0], rates, [0.0, 0.0]]).astype(float)
    x, height, slip, vertical_velocity, centre = foot_at(walker, 1, y)
    y[0], y[1] = -x, -height
    y[2 + n], y[3 + n] = -(centre if pinned else slip), -vertical_velocity
    return y
