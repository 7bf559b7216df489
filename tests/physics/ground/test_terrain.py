"""Tests of pads in lanes, and of the plane that scuffing feet pass through."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walkerlab.physics.ground.terrain import (
    after_mid_swing,
    cell_at,
    cell_edges,
    checkerboard,
    has_ground_in_air,
    has_ground_in_cell,
    starts_with_ground,
)

pitches = st.floats(0.05, 5.0)
places = st.floats(-100.0, 100.0)
feet = st.sampled_from([0, 1])


def walked_on(pitch):
    """Return lanes as a walk lays them. Foot 1, which stands first, is at 0, and the other foot one pitch behind it."""
    return checkerboard(pitch, (-pitch, 0.0))


@given(pitch=pitches, along=places, foot=feet)
def test_cell_contains_the_points_between_its_edges(pitch, along, foot):
    terrain = walked_on(pitch)
    begins, ends = cell_edges(terrain, foot, cell_at(terrain, foot, along))
    assert begins - 1e-9 <= along <= ends + 1e-9
    assert ends - begins == pytest.approx(pitch)


@given(pitch=pitches, foot=feet, cell=st.integers(-50, 50))
def test_cells_tile_the_ground_without_gap_or_overlap(pitch, foot, cell):
    terrain = walked_on(pitch)
    here, there = cell_edges(terrain, foot, cell), cell_edges(terrain, foot, cell + 1)
    assert here[1] == pytest.approx(there[0], abs=1e-9)
    assert cell_at(terrain, foot, 0.5 * (here[0] + here[1])) == cell
    assert has_ground_in_cell(cell) != has_ground_in_cell(cell + 1)


@given(pitch=pitches, j=st.integers(-20, 20))
def test_pads_of_each_leg_are_centred_on_its_footholds(pitch, j):
    """Pads of the first stance leg are at s = 2 j S, those of the other leg at s = (2 j + 1) S. Where one leg has a
    pad, the other has none.
    """
    terrain = walked_on(pitch)
    for foothold, foot in ((2 * j * pitch, 1), ((2 * j + 1) * pitch, 0)):
        cell = cell_at(terrain, foot, foothold)
        assert has_ground_in_cell(cell)
        assert not has_ground_in_cell(cell_at(terrain, 1 - foot, foothold))
        assert sum(cell_edges(terrain, foot, cell)) / 2 == pytest.approx(foothold, abs=1e-9)


@pytest.mark.parametrize("has_ground", [False, True])
@pytest.mark.parametrize("ahead", [False, True])
def test_on_pads_a_foot_keeps_or_lacks_ground_whichever_foot_is_ahead(has_ground, ahead):
    terrain = walked_on(0.4)
    for stands in (True, False):
        assert has_ground_in_air(terrain, has_ground, stands, ahead) == has_ground
    assert starts_with_ground(terrain, False)
    assert starts_with_ground(terrain, True)
    assert not terrain.order_matters
    assert terrain.pitch == 0.4


@given(along=places, foot=feet)
def test_plane_is_one_cell_with_edges_out_of_reach(along, foot):
    terrain = after_mid_swing(0.4)
    begins, ends = cell_edges(terrain, foot, cell_at(terrain, foot, along))
    assert begins < along - 1e6 < along + 1e6 < ends
    assert math.isfinite(begins)
    assert math.isfinite(ends)


def test_foot_on_a_plane_is_supported_only_after_swinging_ahead_in_the_air():
    terrain = after_mid_swing(0.4)
    assert terrain.order_matters
    assert starts_with_ground(terrain, True)
    assert not starts_with_ground(terrain, False)  # The foot is about to swing.
    # It leaves the ground behind the stance foot, so it swings through.
    assert not has_ground_in_air(terrain, True, False, False)
    assert has_ground_in_air(terrain, True, False, True)  # It bounces as it lands.
    assert not has_ground_in_air(terrain, False, False, False)  # It scuffs behind the stance foot.
    assert has_ground_in_air(terrain, False, False, True)  # It has passed the stance foot in the air.
    assert has_ground_in_air(terrain, True, True, False)  # The stance foot bounces.
