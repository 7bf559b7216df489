"""What ground there is for each foot: pads laid in one lane a leg, a plane that lets scuffing feet through, a plane.

Straight legs scuff, so the paper walks on a checkerboard: in the plane, one lane of raised pads for each leg. A lane is
cut into cells, pads (even numbers) and gaps (odd); a plane is one endless cell. Feet that clear the ground need no
pads.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.kernels import kernel_part

FAR = 1e9  # m, an edge out of reach
STANCE_FOOT = 1  # which carries the first step
EVEN = np.zeros(1)  # not read-only: pickled, it would come back as another type, for which kernels are compiled anew


class Terrain(NamedTuple):
    """The ground, as `checkerboard`, `after_mid_swing` or `plane` makes it."""

    stride_measure: float  # [S] m, by which a step ahead and a slide are judged; pads are as long
    lanes: tuple[float, float]  # m, where each foot's pad number 0 is centred
    has_pads: bool  # with edges, which a foot can trip over; else it is a plane
    order_matters: bool  # a foot can touch only once it has been above the ground ahead of the other foot
    heights: Any  # (footholds,) m over the slope, the start's first; those beyond lie at the last


def checkerboard(pitch: float, lanes: tuple[float, float]) -> Terrain:
    """Pads of the length of a step, `pitch` (m), for either leg in turn; nothing between them."""
    return Terrain(pitch, lanes, True, False, EVEN)


def after_mid_swing(stride_measure: float) -> Terrain:
    """A plane that a foot can touch only once it has been above the ground ahead of the other foot."""
    return Terrain(stride_measure, (0.0, 0.0), False, True, EVEN)


def plane(stride_measure: float) -> Terrain:
    """Ordinary ground: it carries any foot that touches it."""
    return Terrain(stride_measure, (0.0, 0.0), False, False, EVEN)


@kernel_part
def is_uneven(terrain: Terrain) -> bool:
    """Whether footholds have heights of their own."""
    return terrain.heights.size > 1


@kernel_part
def foothold_height(terrain: Terrain, foothold: int) -> float:
    """Height (m) of a foothold over the slope; the start's is number 0, and what lies behind it is level."""
    return float(terrain.heights[min(max(foothold, 0), terrain.heights.size - 1)])


@kernel_part
def height_of_pad(terrain: Terrain, foot: int, cell: int) -> float:
    """Height (m) of the pad that is a cell of a foot's lane."""
    apart = (terrain.lanes[foot] - terrain.lanes[STANCE_FOOT]) / terrain.stride_measure
    return foothold_height(terrain, cell + math.floor(apart + 0.5))


@kernel_part
def cell_at(terrain: Terrain, foot: int, along: float) -> int:
    """Number of the cell of a foot's lane at `along` (m); pad 2 j is centred 2 j S from the lane's first."""
    if not terrain.has_pads:
        return 0
    return math.floor((along - terrain.lanes[foot]) / terrain.stride_measure + 0.5)


@kernel_part
def cell_edges(terrain: Terrain, foot: int, cell: int) -> tuple[float, float]:
    """Where a cell begins and ends (m)."""
    if not terrain.has_pads:
        return -FAR, FAR
    centre = terrain.lanes[foot] + cell * terrain.stride_measure
    return centre - 0.5 * terrain.stride_measure, centre + 0.5 * terrain.stride_measure


@kernel_part
def has_ground_in_cell(cell: int) -> bool:
    """Whether a foot that comes into a cell from above is carried there: pads have even numbers."""
    return cell % 2 == 0


@kernel_part
def starts_with_ground(terrain: Terrain, is_stance: bool) -> bool:
    """Whether a foot that starts on the ground is carried by it; one about to swing has not been ahead yet."""
    return is_stance or not terrain.order_matters


@kernel_part
def has_ground_in_air(terrain: Terrain, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """Whether ground would carry a foot that is above it.

    has_ground  whether it would have until now
    stands      whether it is the stance foot
    ahead       whether it is ahead of the other foot
    """
    if terrain.has_pads:
        return has_ground
    return stands or ahead or not terrain.order_matters
