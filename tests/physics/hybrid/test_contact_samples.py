"""Check that samples of a walk on compliant ground agree with the walk and do not change it."""

import numpy as np
import pytest
from contact_walks import scene_of, walked

from walkerlab.physics.hybrid.contact_result import sample_feet


def test_samples_do_not_change_the_walk():
    seen, unseen = walked(interval=0.01), walked()
    np.testing.assert_array_equal(seen.touch_time_s, unseen.touch_time_s)
    assert unseen.samples is None
    assert seen.samples.time_s[-1] <= seen.end_time_s < seen.samples.time_s[-1] + 0.011


def test_samples_include_the_touches():
    walk, scene = walked(interval=0.001, steps=4), scene_of()
    samples = walk.samples
    feet = sample_feet(scene.walker, samples)
    for step, (time, along) in enumerate(zip(walk.touch_time_s, walk.touch_along_m, strict=True)):
        foot = step % 2  # leg 1 (foot 0) swings first
        before, after = np.searchsorted(samples.time_s, time) - 1, np.searchsorted(samples.time_s, time)
        assert feet[before, foot, 1] > 0.0
        assert feet[before, foot, 0] == pytest.approx(along, abs=2e-3)
        if after < samples.time_s.size:
            assert feet[after, foot, 1] < 0.0
    assert np.abs(np.diff(samples.stance)).sum() in (3, 4)
    supporting = feet[:, :, 2].sum(axis=1)
    assert np.median(supporting) == pytest.approx(20.0 * 9.81, rel=0.05)


def test_deepest_penetration_agrees_with_the_samples():
    walk, scene = walked(interval=0.001, steps=4), scene_of()
    feet = sample_feet(scene.walker, walk.samples)
    depth = np.where(walk.samples.has_ground > 0, -feet[:, :, 1], 0.0).max()
    assert 0.8 * walk.max_penetration_m < depth <= walk.max_penetration_m * (1.0 + 1e-9)
