"""Check that a long walk is stored with fewer samples in its middle, but with every heel strike."""

import numpy as np

from walkerlab.physics.hybrid.recorded_walk import Samples
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages.walk import FIRST_STEPS, LAST_STEPS, MAX_BETWEEN, thin_samples


def walk(steps, per_step=50):
    """Return a walk with heel strikes at whole numbers. Each has a sample one rounding before it and one at it."""
    ends = np.arange(1.0, steps + 1.0)
    grid = np.arange(steps * per_step) / per_step
    time = np.unique(np.concatenate((grid, ends, np.nextafter(ends, 0.0))))
    state, step = np.sin(time)[:, None], np.searchsorted(ends, time, side="right")
    return Samples(time, state, step, np.zeros(time.size, bool)), ends


def test_short_walk_is_stored_completely():
    samples, ends = walk(FIRST_STEPS + LAST_STEPS)
    assert thin_samples(samples, ends, Silent()) is samples


def test_thinned_walk_keeps_both_sides_of_every_heel_strike():
    samples, ends = walk(20_000)
    kept = thin_samples(samples, ends, Silent())
    assert np.isin(ends[:-1], kept.time_s).all()
    assert np.isin(np.nextafter(ends, 0.0), kept.time_s).all()
    assert kept.state[:, 0].tolist() == np.sin(kept.time_s).tolist()


def test_thinned_walk_has_complete_ends_and_a_bounded_middle():
    samples, ends = walk(20_000)
    kept = thin_samples(samples, ends, Silent())
    first, last = samples.time_s < FIRST_STEPS, samples.time_s >= ends.size - LAST_STEPS
    assert np.isin(samples.time_s[first | last], kept.time_s).all()
    assert kept.time_s.size <= MAX_BETWEEN + 2 * ends.size + (first | last).sum()
    assert kept.time_s.size < samples.time_s.size / 8


def test_thinning_is_reported():
    told = []
    progress = Silent()
    progress.note = told.append
    samples, ends = walk(1000)
    thin_samples(samples, ends, progress)
    assert told[0].startswith("Of 51001 samples in 1000 steps, ")
