import numpy as np
import pytest

from walkerlab.physics.ground.resting import resting_foot


def test_resting_foot_carries_its_weight():
    foot = resting_foot(weight=196.2, mass=20.0, stiffness=3e7, exponent=1.5, damping=500.0)
    assert 3e7 * foot.depth**1.5 == pytest.approx(196.2)
    assert foot.damping_ratio == pytest.approx(500.0 / (2 * np.sqrt(1.5 * 196.2 / foot.depth * 20.0)))
