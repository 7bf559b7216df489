"""The law of friction: mu tanh(v / v_0)."""

import math
from typing import NamedTuple

from walkerlab.physics.ground.friction import friction_coefficient


class Tanh(NamedTuple):
    """Parameters of the law, SI."""

    largest: float  # [mu] coefficient at high slip
    velocity: float  # [v_0] m/s
    rising_until: float  # m/s, slip velocity beyond which friction grows by less than half a per cent
    sliding_from: float  # m/s, slip velocity above which the coefficient is constant, to half a per cent

    @classmethod
    def from_contact(cls, contact):
        v = contact.stiction_velocity
        return cls(contact.dynamic_friction, v, 3 * v, 3 * v)

    def scale_creep(self, factor):
        return Tanh(self.largest, factor * self.velocity, factor * self.rising_until, factor * self.sliding_from)

    def describe(self):
        return f"friction of {self.largest:g} tanh(v / {self.velocity:g} m/s)"


@friction_coefficient.case(Tanh)
def coefficient(law, slip):
    """Compute the signed coefficient and its derivative (s/m)."""
    t = math.tanh(slip / law.velocity)
    return -law.largest * t, -law.largest * (1 - t * t) / law.velocity
