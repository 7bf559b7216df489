"""Drives of a walker: keys of the blocks `walker.hip` and `push_off`."""

from collections.abc import Mapping
from typing import Any, Final, Literal

from walkerlab.config.fields import Block, key, short_number
from walkerlab.config.second_leg import SecondPushOff
from walkerlab.extensions import WORDS, origin_of, words

KUO: Final = "Kuo, Energetics of actively powered locomotion, J. Biomech. Eng. 124 (2002)"
STRONGEST: Final = 1e9
LINEAR: Final = WORDS["hinge_law"][0]
# rad/s. Hip torques that could swing a leg faster than this are refused, because integration would take forever.
MAX_LEG_SPEED: Final = 1e4


HINGE_PARAMETERS: Final = ("spring_N_m_per_rad", "damping_N_m_s_per_rad", "torque_N_m")
"""Keys with the parameters of a hinge law, at hip and knees, in the order of the law's arguments."""


class Hip(Block):
    """Torques between the legs, or between the thighs of a kneed walker."""

    spring_N_m_per_rad: float = key(
        0.0, "N m/rad", "stiffness of a spring that pulls the legs together", KUO, ge=0.0, le=STRONGEST
    )
    damping_N_m_s_per_rad: float = key(0.0, "N m s/rad", "damping of the angle between the legs", ge=0.0, le=STRONGEST)
    torque_N_m: float = key(
        0.0,
        "N m",
        "constant torque on the swing leg, with its reaction on the stance leg; above 0 it swings the free leg forward",
        ge=-STRONGEST,
        le=STRONGEST,
    )

    hinge_law: Literal[words("hinge_law")] = key(  # type: ignore[valid-type]
        LINEAR,
        "",
        "law of the hip and knee torques that these parameters belong to; extensions can add other laws",
        "this project" + origin_of("hinge_law"),
    )

    @property
    def parameters(self) -> tuple[float, float, float]:
        """Parameters of the hinge law, in the order in which the law takes them."""
        return self.spring_N_m_per_rad, self.damping_N_m_s_per_rad, self.torque_N_m

    def too_quick_for(self, inertia: float) -> bool:
        """Whether the torques would swing a leg of this `inertia` about the hip (kg m^2) too fast to integrate."""
        steady = max(self.spring_N_m_per_rad, abs(self.torque_N_m))
        return steady > MAX_LEG_SPEED**2 * inertia or self.damping_N_m_s_per_rad > MAX_LEG_SPEED * inertia


class PushOff(Block):
    """An impulse along the trailing leg, from foot to hip, just before the other foot lands."""

    impulse_N_s: float = key(0.0, "N s", "impulse at the trailing foot, 0 for none", KUO, ge=0.0, le=STRONGEST)
    duration_s: float = key(
        0.005, "s", "duration in the contact model; the push-off of the rigid model is instantaneous", ge=1e-9, le=10.0
    )
    leg_2: SecondPushOff | None = None


def push_offs(push_off: Any) -> tuple[float, float]:
    """Return the impulse (N s) of each leg's push-off."""
    second = None if push_off.leg_2 is None else push_off.leg_2.impulse_N_s
    return push_off.impulse_N_s, push_off.impulse_N_s if second is None else second


def drives_of(config: Any) -> tuple[str, ...]:
    """Describe the drives of a config that supply energy to its walker."""
    first, second = push_offs(config.push_off)
    push = f"{short_number(first)} N s{'' if first == second else f' by leg 1 and {short_number(second)} N s by leg 2'}"
    torque = config.walker.hip.torque_N_m
    return describe_nonzero(
        {f"a push-off of {push}": max(first, second), f"a hip torque of {short_number(torque)} N m": torque}
    )


def springs_of(config: Any) -> tuple[str, ...]:
    """Describe the spring and damper between a walker's legs, which supply no energy."""
    stiffness, damping, _ = config.walker.hip.parameters
    if config.walker.hip.hinge_law != LINEAR:
        return describe_nonzero({f"hinge torques of the law {config.walker.hip.hinge_law}": stiffness or damping})
    return describe_nonzero({
        f"a hip spring of {short_number(stiffness)} N m/rad": stiffness,
        f"a hip damper of {short_number(damping)} N m s/rad": damping,
    })  # fmt: skip


def describe_nonzero(acting: Mapping[str, float]) -> tuple[str, ...]:
    return tuple(words for words, value in acting.items() if value != 0.0)


def drives_and_springs_of(config: Any) -> tuple[str, ...]:
    """Describe the drives, hip spring and hip damper of a config's walker, or return () if it is passive."""
    return drives_of(config) + springs_of(config)
