"""Torques at hinges, for both models, from the angle between two bodies and its rate.

A law is a type registered with `hinge_torque` and `hinge_energy`. The resistance of a law turns the first body back and
the second one forward. The law dissipates the power (resistance - elastic part) times the rate.

Each hinge is a row of two arrays in both models: `hinges` holds its two bodies, `laws` the parameters of its law, a
SpringDamper or a law derived from it. The first row is the hip; the others are the knees that can bend: the swing knee
in the rigid model, both knees on compliant ground, where each also has a stop. All rows have the same law. The record
type of a model names this law, just as it fixes the number of bodies, so each kernel is compiled for one law.
"""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, Final, NamedTuple

from walkerlab.physics import kernels
from walkerlab.physics.kernels import LawKind, compile_as, dispatch_by_type_or_default, forced_inline, kernel_part


@dispatch_by_type_or_default
def legs_apart(system: Any, y: Any) -> tuple[float, float]:
    """Return the angle (rad) by which the swing leg is ahead of the stance leg, and its rate (rad/s)."""
    return 0.0, 0.0


class HingeTorque(NamedTuple):
    """Torque at a hinge, and its derivatives with respect to the angle between the bodies and to the angle's rate."""

    resistance: float  # N m, turns the first body back and the second forward; the opposite of `SpringDamper.torque`
    elastic: float  # N m, the part that stores energy
    by_angle: float  # N m/rad
    by_rate: float  # N m s/rad


@dispatch_by_type_or_default
def hinge_torque(law: Any, angle: float, rate: float) -> HingeTorque:
    """Compute the torque of a law at an angle (rad) and rate (rad/s).

    It is zero for laws that act in an instant, such as IdealLock.
    """
    return HingeTorque(0.0, 0.0, 0.0, 0.0)


@dispatch_by_type_or_default
def hinge_energy(law: Any, angle: float) -> float:
    """Compute the elastic energy (J) of a law at an angle (rad)."""
    return 0.0


class SpringDamper(NamedTuple):
    """A spring, relaxed at zero angle, with a damper and a constant torque. Other laws derive from this class."""

    stiffness: float  # N m/rad
    damping: float  # N m s/rad; if this is 0, the law dissipates no energy
    torque: float  # N m, turns the first body forward and the second back; a law's only source of energy

    @classmethod
    def units(cls, energy: float, time: float) -> "SpringDamper":
        """Return the units of the parameters, composed of those of energy and time. Angles have no unit."""
        return cls(energy, energy * time, energy)


@hinge_torque.case(SpringDamper, forced_inline=True)
def spring_damper_torque(law: SpringDamper, angle: float, rate: float) -> HingeTorque:
    elastic = law.stiffness * angle
    return HingeTorque(elastic + law.damping * rate - law.torque, elastic, law.stiffness, law.damping)


@hinge_energy.case(SpringDamper, forced_inline=True)
def spring_energy(law: SpringDamper, angle: float) -> float:
    return 0.5 * law.stiffness * angle * angle


HINGE_LAWS: Final = LawKind(
    "hinge_law", {"linear": SpringDamper}, SpringDamper, (hinge_torque, hinge_energy), derived=True
)
"""Hinge laws by their names in `walker.hip.hinge_law` of a config."""
LAW_NUMBERS = len(SpringDamper._fields)
DAMPING, TORQUE = (SpringDamper._fields.index(name) for name in ("damping", "torque"))
HIP_ROW = 0  # row of the hinge between the legs
HINGE_ROWS = {"hip": slice(HIP_ROW, HIP_ROW + 1), "knees": slice(HIP_ROW + 1, None)}


def law_named_by(fields: Iterable[str]) -> Any:
    """Return the hinge law named by one of a record type's fields, or SpringDamper if none names a law."""
    return next(kernels.classes_named_by(fields), SpringDamper)


@cache
def law_reader(law: Any) -> Callable[[Any, int], SpringDamper]:
    return lambda model, row: law(model.laws[row, 0], model.laws[row, 1], model.laws[row, 2])


def hinge_law(model: Any, row: int) -> SpringDamper:
    """Return the law at a hinge: spring, damper and constant torque."""
    return law_reader(law_named_by(model.dtype.names))(model, row)


compile_as(hinge_law, lambda model, _: (law_reader(law_named_by(model.fields)), kernels.ALWAYS_INLINE_FLAGS))


@forced_inline
def is_sprung(model: Any, row: int) -> bool:
    sprung = False
    for column in range(LAW_NUMBERS):
        sprung |= model.laws[row, column] != 0.0
    return sprung


@forced_inline
def add_hinge_torque(now: HingeTorque, body: int, other: int, r: Any) -> None:
    r[body] -= now.resistance
    r[other] += now.resistance


@kernel_part
def add_hinge_gradients(now: HingeTorque, body: int, other: int, by_angle: Any, by_rate: Any) -> None:
    """Add the derivatives of a hinge's torques on its two bodies to by_angle and by_rate (n, n)."""
    # The two torques are opposite and depend only on the difference of the angles, so all terms differ only in sign.
    for row, sign in ((other, 1.0), (body, -1.0)):
        by_angle[row, body] += sign * now.by_angle
        by_angle[row, other] -= sign * now.by_angle
        by_rate[row, body] += sign * now.by_rate
        by_rate[row, other] -= sign * now.by_rate
