"""Check that the ground acts on the swing foot of a pinned walker as on that of a free one."""

from typing import NamedTuple

import numpy as np
import plain_walk
import pytest
from contact_walks import scene_of, settings

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.scene.contact import start_state

MEASURE = 0.5  # m, length by which steps are judged, and pitch of pads
TERRAINS = {
    "checkerboard": plain_walk.CHECKERBOARD,
    "after-mid-swing": plain_walk.AFTER_MID_SWING,
    "plane": plain_walk.PLANE,
}


class Walk(NamedTuple):
    """Pinned start of the paper's walker on the paper's ground."""

    terrain: str
    slope_deg: float
    angle: float  # rad, of the stance leg from the slope's normal
    rates: tuple[float, float]  # rad/s, of swing and stance leg
    radius: float = 0.001  # m
    steps: int = 2

    @property
    def state(self):
        slope = np.radians(self.slope_deg)
        return (-self.angle - slope, self.angle - slope, *self.rates)


# the rigid gait on 3 degrees, whose swing foot dips into the ground
SCUFFS_AND_FALLS = Walk("plane", 3.0, 0.2710286, (-0.3773739, -1.0923836))
# The swing foot starts moving towards its pad, which pushes it back.
PUSHED_OFF_ITS_PAD = Walk("checkerboard", 1.0, 0.187, (-0.2, -0.95))
# Equal legs with point feet pass each other on the ground. The foot comes down there and continues below the plane,
# because it has not been above it ahead of the stance foot.
COMES_DOWN_IN_PASSING = Walk("after-mid-swing", 4.0, 0.3332, (-1.0869, -1.6862), radius=0.0)


def walked(walk, tolerance=1e-7):
    scene = scene_of(
        f"slope_deg={walk.slope_deg}", "contact.stance=pinned", f"contact.terrain={walk.terrain}",
        f"walker.foot_radius_m={walk.radius}", f"contact.pad_pitch={MEASURE}", step=MEASURE,
    )  # fmt: skip
    start = start_state(scene, walk.state)
    return scene.walk(start, walk.steps, settings(tolerance))


def plainly(walk, step_s=1e-5):
    ground = plain_walk.Plain(
        *plain_walk.straight_legs(1.0, 0.5, 5.0, 10.0, walk.radius), 1.0, 9.81, np.radians(walk.slope_deg),
        1e5 * 1000.0**2.2, 2.2, 9e4, 1e-4, 0.9, 0.7, 0.1, 1.0, TERRAINS[walk.terrain], MEASURE, False,
    )  # fmt: skip
    start = plain_walk.start(ground, np.array(walk.state[:2]), np.array(walk.state[2:]), pinned=True)
    other = plain_walk.walk(ground, start, walk.steps, step_s, STANCE_FOOT)
    return Outcome(other.outcome), other.times, other.end_s


@pytest.mark.parametrize(
    "walk", [SCUFFS_AND_FALLS, PUSHED_OFF_ITS_PAD, COMES_DOWN_IN_PASSING], ids=["scuffs", "pad", "passing"]
)
def test_pinned_walk_agrees_with_an_independent_integration(walk):
    found = walked(walk, tolerance=1e-9)
    outcome, touches, end = plainly(walk)
    assert found.outcome is outcome
    np.testing.assert_allclose([*found.touch_time_s, found.end_time_s], [*touches, end], atol=1e-6)


@pytest.mark.parametrize("walk", [SCUFFS_AND_FALLS, PUSHED_OFF_ITS_PAD], ids=["scuffs", "pad"])
def test_ground_losses_of_a_pinned_walk_equal_the_energy_drop(walk):
    found = walked(walk)
    assert found.dissipated_J[:2].sum() > 1e-3
    assert found.energy_balance_residual_J < 1e-6
