"""Compare the ground's losses and the depth of feet with closed forms and with dense samples."""

import numpy as np
import pytest
from contact_walks import scene_of, walked

from walkerlab.evidence.verification.known_problems import (
    ALONG_RATE,
    BODY_HEIGHT,
    EARTH_GRAVITY,
    HEIGHT_RATE,
    rig,
    rig_state,
    run_until,
)
from walkerlab.physics.ground.friction import Coulomb
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.hybrid.contact_result import sample_feet

MASS, DROP = 2.0, 0.1
DAMPED = Impact(2e5, 1.5, 40.0, 1e-4)  # The force of this law vanishes before the ball has left the ground.


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-11])
def test_damping_loss_of_a_bounce_equals_the_lost_height(rtol):
    """When the ball is in the air again, all missing energy went into damping, because the force vanishes before the
    ball leaves.
    """
    ball = rig(MASS, 1.0, DAMPED, Coulomb(0.0, 0.0, 0.1, 1.0))
    run = run_until(ball, rig_state((0.0, DROP), (0.0, 0.0)), 0.25, rtol=rtol, atol=1e-3 * rtol)
    end = np.array(run.end)
    assert end[BODY_HEIGHT] > 0.0
    left = MASS * (EARTH_GRAVITY * end[BODY_HEIGHT] + 0.5 * (end[HEIGHT_RATE] ** 2 + end[ALONG_RATE] ** 2))
    missing = MASS * EARTH_GRAVITY * DROP - left
    assert missing > 0.1
    # The contact takes about a hundred solver steps, each with an error of the tolerance.
    assert run.dissipated[0] == pytest.approx(missing, abs=max(1e3 * rtol, 1e-11))


def test_maximum_penetration_is_found_between_samples():
    walk, scene = walked(interval=2e-5, steps=2), scene_of()
    feet = sample_feet(scene.walker, walk.samples)
    seen = np.where(walk.samples.has_ground > 0, -feet[:, :, 1], 0.0).max()
    assert seen <= walk.max_penetration_m * (1.0 + 1e-12)
    # error of a parabola through samples 20 us apart, in a contact of a millisecond
    assert walk.max_penetration_m == pytest.approx(seen, rel=1e-3)
