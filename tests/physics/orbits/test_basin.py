"""Tests of basins: attractors found by simulated walks, edges, windows, and cells that agree with single walks."""

import numpy as np
import pytest

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_lanes import two_legs
from walkerlab.physics.orbits.basin import (
    CAPTURE,
    UNREACHED,
    Attractors,
    PeriodicAttractor,
    Window,
    edge_cells,
    find_attractors,
    subcell_centres,
    walk_to_attractor,
)
from walkerlab.physics.orbits.rigid_map import state_on_section
from walkerlab.physics.solvers.registry import Tolerances


def at_slope(degrees):
    return two_legs(assembled(RigidWalker(1.0, 0.5, 0.25, 0.5, 0.0, 1.0, np.deg2rad(degrees), CORRECTED)))


UNIT, STEEPER, STEEPEST = at_slope(1.0), at_slope(4.7), at_slope(5.15)
RATE = np.sqrt(9.81)
# published states of the paper's walker at one degree, and a state near its gait at 4.7 degrees
GAIT = np.array([0.1695390, -0.6057394 / RATE, -0.8617140 / RATE])
STEEP_GAIT = np.array([0.2335, -0.07, -0.366])


def around(z, n=1500):
    half = np.array([0.1, 0.15, 0.15])
    return np.random.default_rng(0).uniform(z - half, z + half, (n, 3))


@pytest.fixture(scope="module")
def gentle():
    return find_attractors(UNIT, around(GAIT), seed=0)


def walked(walker, z, steps):
    tolerances = Tolerances("dop853", 1e-12, 1e-14, 10**7)
    return take_walk(walker.model, tolerances, state_on_section(walker.model, z), steps)


def test_only_attractor_on_a_gentle_slope_is_the_gait(gentle):
    assert [cycle.period for cycle in gentle.cycles] == [1]
    assert not gentle.aperiodic
    assert gentle.cycles[0].points[0] == pytest.approx(GAIT, abs=1e-6)
    assert 0.0 < gentle.cycles[0].reach <= CAPTURE


def test_steps_repeat_in_pairs_past_the_first_flip():
    found = find_attractors(STEEPER, around(STEEP_GAIT), seed=0)
    assert [cycle.period for cycle in found.cycles] == [2]
    walk = walked(STEEPER, found.cycles[0].points[0], 2)
    assert walk.after[1, 1:] == pytest.approx(found.cycles[0].points[0], abs=1e-6)
    assert np.abs(walk.after[0, 1:] - found.cycles[0].points[0]).max() > 0.01


def test_aperiodic_walk_has_no_cycle():
    found = find_attractors(STEEPEST, around(STEEP_GAIT), seed=0)
    assert found.aperiodic
    assert found.cycles == ()


def test_single_walks_agree_with_lanes_except_at_basin_edges(gentle):
    window = Window((0, 2), (0.15, -0.33), (0.2, -0.25), (12, 12), tuple(GAIT))
    starts = window.starts(np.arange(window.size))
    lanes, alone = (walk_to_attractor(walker, gentle, starts, 40) for walker in (UNIT, UNIT.model))
    inner = np.setdiff1d(np.arange(window.size), edge_cells(lanes.outcome.reshape(window.cells)))
    for name in ("outcome", "attractor"):
        np.testing.assert_array_equal(getattr(alone, name)[inner], getattr(lanes, name)[inner])
    walked = inner[lanes.outcome[inner] == Outcome.WALKED]
    assert np.abs(alone.steps[walked] - lanes.steps[walked]).max() <= 1
    np.testing.assert_allclose(alone.last[walked], lanes.last[walked], atol=2.0 * CAPTURE)


def test_cells_agree_with_single_walks_except_at_basin_edges(gentle):
    window = Window((0, 2), (0.15, -0.33), (0.2, -0.25), (32, 32), tuple(GAIT))
    found = walk_to_attractor(UNIT, gentle, window.starts(np.arange(window.size)), 100)
    inner = np.setdiff1d(np.arange(window.size), edge_cells(found.outcome.reshape(window.cells)))
    chosen = np.random.default_rng(1).choice(inner, 60, replace=False)
    near = gentle.cycles[0].points[0]
    for cell in chosen:
        walk = walked(UNIT, window.starts(np.array([cell]))[0], 30)
        if found.attractor[cell] == UNREACHED:
            assert (walk.outcome, walk.steps) == (found.outcome[cell], found.steps[cell])
        else:
            assert walk.steps == 30
            away = np.linalg.norm(walk.after[:, 1:] - near, axis=1)
            assert int(np.argmax(away < gentle.cycles[0].reach)) + 1 == found.steps[cell]
    assert 10 < np.count_nonzero(found.attractor[chosen] == 0) < 50


def test_walk_that_reaches_no_attractor_ends_after_max_steps():
    found = walk_to_attractor(UNIT, Attractors(), GAIT[None, :], 7)
    assert (found.outcome[0], found.steps[0], found.attractor[0]) == (Outcome.WALKED, 7, UNREACHED)
    assert found.last[0] == pytest.approx(GAIT, abs=1e-6)


def test_nearest_attractor_is_chosen():
    far, near = PeriodicAttractor(np.array([[1.0, 0.0, 0.0]]), 0.5), PeriodicAttractor(GAIT[None, :], 1e-3)
    found = walk_to_attractor(UNIT, Attractors((far, near)), GAIT[None, :], 7)
    assert (found.steps[0], found.attractor[0]) == (1, 1)


def test_window_lists_cell_centres_row_by_row():
    window = Window((2, 0), (0.0, 10.0), (1.0, 14.0), (2, 4), (7.0, 8.0, 9.0))
    z = window.starts(np.arange(window.size))
    assert z[:, 1].tolist() == [8.0] * 8
    assert z[:, 2].tolist() == [0.25] * 4 + [0.75] * 4
    assert z[:4, 0].tolist() == window.cell_centres(1).tolist() == [10.5, 11.5, 12.5, 13.5]
    parts = window.starts(np.zeros(4, int), subcell_centres(2, 2))
    assert parts[:, [2, 0]].tolist() == [[0.125, 10.25], [0.125, 10.75], [0.375, 10.25], [0.375, 10.75]]


def test_edge_cells_are_on_both_sides_of_a_change():
    classes = np.zeros((4, 4), int)
    classes[1, 1] = 1
    assert edge_cells(classes).tolist() == [1, 4, 5, 6, 9]
    assert edge_cells(np.zeros((3, 3, 3))).size == 0
