"""Bodies that do not turn on their own: a torso on the legs' bisector, the shank below a locked knee.

With absolute angles such a body's angular velocity is a weighted sum of others', omega = E z with constant E. The
equations of the walker become E'ME dz = E'r, and are solved in place: what acts on a held body is handed to those it
follows, and its own row becomes the identity. Which bodies are held may change while the walker walks. A shank that an
ideal lock holds is no body of its own once both feet are free: see merged.py.
"""

from typing import Any, NamedTuple

from walkerlab.ground.normal_force import NormalLaw, elastic_energy, impact_normal_force
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.mechanics.tree import Tree
from walkerlab.mechanics.tuples import Vector, factored, put, solve_factored, solve_symmetric
from walkerlab.solvers.system import State

# what a knee is doing
RELEASED, BENT, STOPPING, LOCKED = 0, 1, 2, 3
FLEXED = 0.01  # rad of flexion from which on a knee that straightens is caught

Flags = tuple[bool, ...]


class NoneHeld(NamedTuple):
    """Every body turns on its own."""


class Held(NamedTuple):
    """Some bodies follow others, at times or always."""

    weights: Vector  # (n n) row c: by what share body c follows each of the others
    always: Flags  # (n) which do at all times


class NoKnees(NamedTuple):
    """Straight legs."""


class IdealLock(NamedTuple):
    """The knee is straight and locks at once: a plastic impact."""


class Knees(NamedTuple):
    """A knee in each leg; knee k is that of foot k."""

    thighs: tuple[int, int]  # bodies
    shanks: tuple[int, int]
    stop: Any  # IdealLock, or the NormalLaw of a one-sided stop in N m and rad, which latches when it turns back
    release_at_touch: bool  # of the trailing knee: at the other foot's touch, not when that foot stops sinking in


class OneBends(NamedTuple):
    """Of two knees that lock at once, one is locked, and its thigh and shank are one body."""

    thighs: tuple[int, int]  # bodies; those of the locked knee are the same one
    shanks: tuple[int, int]
    release_at_touch: bool


class NoneBends(NamedTuple):
    """Both knees are locked, and thigh and shank of either leg are one body."""

    release_at_touch: bool


@by_type_or_default
def always_held(held: Any) -> Flags:
    """Which bodies follow others at all times: none but where some are held."""
    return ()


@by_type_or_default
def held_flags(held: Any, knees: Any, knee: Any) -> Flags:
    """Which bodies follow others now: (n) as flags, from what each knee is doing, (2,) in memory."""
    return ()


@by_type_or_default
def gathered_matrix(held: Any, flags: Flags, M: Vector) -> Vector:
    """E'ME (n n), with the identity for the bodies that follow."""
    return M


@by_type_or_default
def gathered(held: Any, flags: Flags, torques: Vector) -> Vector:
    """E'r (n), with zero for the bodies that follow."""
    return torques


@by_type_or_default
def followed(held: Any, flags: Flags, rates: Vector) -> Vector:
    """E z (n): what follows gets its share."""
    return rates


@always_held.case(Held)
def held_always(held: Held) -> Flags:
    """Those of couplings."""
    return held.always


@held_flags.case(Held)
def held_now(held: Held, knees: Any, knee: Any) -> Flags:
    """Those of couplings, and shanks below locked knees."""
    return below_locked_knees(knees, knee, held.always)


@gathered_matrix.case(Held)
def smaller_matrix(held: Held, flags: Flags, M: Vector) -> Vector:
    """Rows and columns of what follows are added to those of what it follows."""
    n = len(flags)
    for c in range(n):
        if flags[c]:
            for p in range(n):
                weight = held.weights[c * n + p]
                if weight != 0.0:
                    for j in range(n):
                        M = put(M, p * n + j, M[p * n + j] + weight * M[c * n + j])
                    for j in range(n):
                        M = put(M, j * n + p, M[j * n + p] + weight * M[j * n + c])
            for j in range(n):
                M = put(M, c * n + j, 0.0)
                M = put(M, j * n + c, 0.0)
            M = put(M, c * n + c, 1.0)
    return M


@gathered.case(Held)
def fewer_torques(held: Held, flags: Flags, torques: Vector) -> Vector:
    """What acts on a body that follows acts on those it follows."""
    n = len(flags)
    for c in range(n):
        if flags[c]:
            for p in range(n):
                torques = put(torques, p, torques[p] + held.weights[c * n + p] * torques[c])
            torques = put(torques, c, 0.0)
    return torques


@followed.case(Held)
def some_follow(held: Held, flags: Flags, rates: Vector) -> Vector:
    """The weighted sum of those it follows."""
    n = len(flags)
    for c in range(n):
        if flags[c]:
            total = 0.0
            for p in range(n):
                total += held.weights[c * n + p] * rates[p]
            rates = put(rates, c, total)
    return rates


@inlined
def turned_by(held: Any, flags: Flags, M: Vector, torques: Vector) -> Vector:
    """Angular accelerations (n) under torques, or velocities of angular momenta, with what follows following."""
    return followed(held, flags, solve_symmetric(gathered_matrix(held, flags, M), gathered(held, flags, torques)))


@inlined
def divide_by_held_mass(held: Any, flags: Flags, tree: Tree, M: Vector, J: Any) -> None:
    """Torques' derivatives, the last n rows of J, become those of angular accelerations."""
    size, column = J.shape[0], tree.arm_x
    n = len(column)
    factors = factored(gathered_matrix(held, flags, M), n)
    for j in range(size):
        for k in range(n):
            column = put(column, k, J[size - n + k, j])
        column = followed(held, flags, solve_factored(factors, gathered(held, flags, column)))
        for k in range(n):
            J[size - n + k, j] = column[k]


@by_type_or_default
def below_locked_knees(knees: Any, knee: Any, flags: Flags) -> Flags:
    """The flags, with those of the shanks that follow their thighs now: bodies of their own in `Knees` alone."""
    return flags


@below_locked_knees.case(Knees)
def locked_shanks(knees: Knees, knee: Any, flags: Flags) -> Flags:
    """One, or both."""
    for k in range(2):
        if knee[k] == LOCKED:
            flags = put(flags, knees.shanks[k], True)  # type: ignore[assignment]
    return flags


@by_type_or_default
def bends_otherwise(knees: Any, knee: Any) -> bool:
    """Whether the walker has to go on with other bodies, since a knee locked or was released.

    knee  (2,) what each knee is doing
    """
    return False


@bends_otherwise.case(OneBends)
def none_bends(knees: OneBends, knee: Any) -> bool:
    """The other one has locked too."""
    return bool(knee[0] == LOCKED and knee[1] == LOCKED)


@bends_otherwise.case(NoneBends)
def one_bends(knees: NoneBends, knee: Any) -> bool:
    """One has been released."""
    return bool(knee[0] != LOCKED or knee[1] != LOCKED)


# ---- the stop of a knee ----------------------------------------------------------------------------------------------


@by_type_or_default
def no_stops(knees: Any) -> Flags:
    """No knee is in its stop; only `Knees` have any."""
    return ()


@by_type_or_default
def stop_flags(knees: Any, now: Any) -> Flags:
    """Which knees are in their stops: from what each is doing, (2,) in memory."""
    return ()


@by_type_or_default
def knee_torques(knees: Any, stops: Flags, y: State, first: int, torques: Vector) -> Vector:
    """Add the torques (N m) of the stops; the bodies' angles are y[first], ..., the last n of y their velocities."""
    return torques


@by_type_or_default
def knee_gradients(knees: Any, stops: Flags, y: State, first: int, J: Any) -> None:
    """Add the derivatives of those torques to the last n rows of J."""


@by_type_or_default
def knee_energy(knees: Any, stops: Flags, y: State, first: int) -> float:
    """Elastic energy (J) in the stops."""
    return 0.0


@by_type_or_default
def knee_power(knees: Any, stops: Flags, y: State, first: int) -> float:
    """Power (W) that the stops dissipate."""
    return 0.0


@no_stops.case(Knees)
def out_of_stops(knees: Knees) -> Flags:
    """Neither."""
    return (False, False)


@stop_flags.case(Knees)
def in_stops_now(knees: Knees, now: Any) -> Flags:
    """Those that are stopping."""
    return (now[0] == STOPPING, now[1] == STOPPING)


@inlined
def extension(knees: Knees, knee: int, y: State, first: int) -> float:
    """How far a knee is beyond straight (rad): negative while it is bent."""
    return y[first + knees.shanks[knee]] - y[first + knees.thighs[knee]]


@inlined
def extension_rate(knees: Knees, knee: int, y: State, first: int) -> float:
    """How fast a knee straightens (rad/s)."""
    rates = len(y) // 2 + first
    return y[rates + knees.shanks[knee]] - y[rates + knees.thighs[knee]]


@by_type_or_default
def stop_torque(stop: Any, angle: float, rate: float) -> tuple[float, float, float, float]:
    """Torque (N m) against the extension, its elastic part, and its derivatives along angle and rate.

    An ideal lock acts in no time.
    """
    return 0.0, 0.0, 0.0, 0.0


@stop_torque.case(NormalLaw)
def impact_torque(stop: NormalLaw, angle: float, rate: float) -> tuple[float, float, float, float]:
    """The IMPACT law, in N m and rad."""
    if angle <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    torque = impact_normal_force(angle, rate, stop)
    return torque.force, torque.spring, torque.by_penetration, torque.by_rate


@by_type_or_default
def stop_energy(stop: Any, angle: float) -> float:
    """Elastic energy (J) of a stop."""
    return 0.0


@stop_energy.case(NormalLaw)
def spring_energy(stop: NormalLaw, angle: float) -> float:
    """That of its spring."""
    return elastic_energy(angle, stop)


@knee_torques.case(Knees)
def with_stops(knees: Knees, stops: Flags, y: State, first: int, torques: Vector) -> Vector:
    """A stop pushes the shank back and the thigh forward."""
    for knee in range(2):
        if stops[knee]:
            rate = extension_rate(knees, knee, y, first)
            torque = stop_torque(knees.stop, extension(knees, knee, y, first), rate)[0]
            shank, thigh = knees.shanks[knee], knees.thighs[knee]
            torques = put(torques, shank, torques[shank] - torque)
            torques = put(torques, thigh, torques[thigh] + torque)
    return torques


@knee_gradients.case(Knees)
def with_stops_gradients(knees: Knees, stops: Flags, y: State, first: int, J: Any) -> None:
    """Along both angles and both rates."""
    rates = len(y) // 2 + first
    for knee in range(2):
        if stops[knee]:
            rate = extension_rate(knees, knee, y, first)
            torque = stop_torque(knees.stop, extension(knees, knee, y, first), rate)
            shank, thigh = knees.shanks[knee], knees.thighs[knee]
            for row, sign in ((rates + thigh, 1.0), (rates + shank, -1.0)):
                J[row, first + shank] += sign * torque[2]
                J[row, first + thigh] -= sign * torque[2]
                J[row, rates + shank] += sign * torque[3]
                J[row, rates + thigh] -= sign * torque[3]


@knee_energy.case(Knees)
def energy_in_stops(knees: Knees, stops: Flags, y: State, first: int) -> float:
    """That of both."""
    total = 0.0
    for knee in range(2):
        if stops[knee]:
            total += stop_energy(knees.stop, extension(knees, knee, y, first))
    return total


@knee_power.case(Knees)
def power_in_stops(knees: Knees, stops: Flags, y: State, first: int) -> float:
    """That of both."""
    total = 0.0
    for knee in range(2):
        if stops[knee]:
            rate = extension_rate(knees, knee, y, first)
            torque = stop_torque(knees.stop, extension(knees, knee, y, first), rate)
            total += (torque[0] - torque[1]) * rate
    return total
