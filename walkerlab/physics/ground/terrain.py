"""Ground under each foot: lanes of pads, a plane that scuffing feet pass through, or an ordinary plane.

Straight legs scuff, so the paper walks on a checkerboard: in the plane, one lane of raised pads for each leg. A lane is
divided into cells, pads (even numbers) and gaps (odd); a plane is one endless cell. Feet that clear the ground need no
pads.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.kernels import kernel_part

REMOTE_EDGE = 1e9  # m, out of reach
STANCE_FOOT = 1  # which carries the first step
EVEN = np.zeros(1)  # not read-only: pickled, it would come back as another type, for which kernels are compiled anew


class Terrain(NamedTuple):
    """Ground, as created by `checkerboard`, `after_mid_swing` or `plane`."""

    pitch: float  # [S] m, length of pads; scale for judging steps and slides
    lanes: tuple[float, float]  # m, centre of each foot's pad number 0
    has_pads: bool  # whose edges a foot can trip over; else it is a plane
    order_matters: bool  # a foot can touch only once it has been above the ground ahead of the other foot
    heights: Any  # (footholds,) m over the slope, the start's first; the last applies beyond


def checkerboard(pitch: float, lanes: tuple[float, float]) -> Terrain:
    """Lay pads of the length of a step, `pitch` (m), for each leg in turn, with gaps between them."""
    return Terrain(pitch, lanes, True, False, EVEN)


def after_mid_swing(pitch: float) -> Terrain:
    """Create a plane that a foot can touch only once it has been above the ground ahead of the other foot."""
    return Terrain(pitch, (0.0, 0.0), False, True, EVEN)


def plane(pitch: float) -> Terrain:
    """Create ordinary ground, which carries any foot that touches it."""
    return Terrain(pitch, (0.0, 0.0), False, False, EVEN)


@kernel_part
def is_uneven(terrain: Terrain) -> bool:
    return terrain.heights.size > 1


@kernel_part
def foothold_height(terrain: Terrain, foothold: int) -> float:
    """Return the height (m) of a foothold over the slope; the start's is number 0, with level ground before it."""
    return float(terrain.heights[min(max(foothold, 0), terrain.heights.size - 1)])


@kernel_part
def height_of_pad(terrain: Terrain, foot: int, cell: int) -> float:
    apart = (terrain.lanes[foot] - terrain.lanes[STANCE_FOOT]) / terrain.pitch
    return foothold_height(terrain, cell + math.floor(apart + 0.5))


@kernel_part
def cell_at(terrain: Terrain, foot: int, along: float) -> int:
    """Return the number of the cell of a foot's lane at `along` (m); pad 2 j is centred 2 j S from the lane's first."""
    if not terrain.has_pads:
        return 0
    return math.floor((along - terrain.lanes[foot]) / terrain.pitch + 0.5)


@kernel_part
def cell_edges(terrain: Terrain, foot: int, cell: int) -> tuple[float, float]:
    if not terrain.has_pads:
        return -REMOTE_EDGE, REMOTE_EDGE
    centre = terrain.lanes[foot] + cell * terrain.pitch
    return centre - 0.5 * terrain.pitch, centre + 0.5 * terrain.pitch


@kernel_part
def has_ground_in_cell(cell: int) -> bool:
    """Whether a foot that enters a cell from above is carried: pads have even numbers."""
    return cell % 2 == 0


@kernel_part
def starts_with_ground(terrain: Terrain, is_stance: bool) -> bool:
    """Whether ground carries a foot that starts on it; not one about to swing, which has yet to be ahead."""
    return is_stance or not terrain.order_matters


@kernel_part
def has_ground_in_air(terrain: Terrain, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """Whether there is ground under a foot in the air: on pads as before, on a plane if it `stands` or is `ahead`."""
    if terrain.has_pads:
        return has_ground
    return stands or ahead or not terrain.order_matters
