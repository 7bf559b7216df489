"""Ground under each foot: lanes of pads, a plane that scuffing feet pass through, or an ordinary plane.

Straight legs scuff, so the paper's walker needs a checkerboard, which in a planar model is a lane of raised pads for
each leg. A lane is divided into cells: pads (even numbers) and gaps (odd). A plane is one endless cell, and suffices
for feet that clear the ground.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from walkerlab.physics.kernels import kernel_part

REMOTE_EDGE = 1e9  # m, further than any walk gets
STANCE_FOOT = 1  # foot that carries the first step
# writable, like unpickled arrays, because kernels would be compiled again for a read-only array
EVEN = np.zeros(1)


class Terrain(NamedTuple):
    """Ground, as created by `checkerboard`, `after_mid_swing` or `plane`."""

    pitch: float  # [S] m, length of a pad, and scale of the criteria for steps and slides
    lanes: tuple[float, float]  # m, where the centre of pad 0 in each foot's lane lies along the slope
    has_pads: bool  # whether the ground consists of pads, over whose edges a foot can trip; if not, it is a plane
    order_matters: bool  # whether a foot can touch only once it has been above the ground ahead of the other foot
    heights: Any  # (footholds,) m above the slope, from the start on; all further footholds have the last height


def checkerboard(pitch: float, lanes: tuple[float, float]) -> Terrain:
    """Create a lane of pads for each leg. Pads and the gaps between them have the length `pitch` (m) of a step."""
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
    """Return the height (m) of a foothold above the slope.

    Footholds before number 0, at which a walk starts, have the height of number 0.
    """
    return float(terrain.heights[min(max(foothold, 0), terrain.heights.size - 1)])


@kernel_part
def height_of_pad(terrain: Terrain, foot: int, cell: int) -> float:
    # Footholds are counted from pad 0 of the stance foot's lane. The other lane's pad 0 is `apart` footholds further.
    apart = (terrain.lanes[foot] - terrain.lanes[STANCE_FOOT]) / terrain.pitch
    return foothold_height(terrain, cell + math.floor(apart + 0.5))


@kernel_part
def cell_at(terrain: Terrain, foot: int, along: float) -> int:
    """Return the number of the cell at `along` (m) in a foot's lane. The centre of cell j is j S from that of pad 0."""
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
    """Whether a cell is a pad (even number), which carries a foot that comes from above."""
    return cell % 2 == 0


@kernel_part
def starts_with_ground(terrain: Terrain, is_stance: bool) -> bool:
    """Whether a foot has ground below it at the start. If `order_matters`, only the stance foot has."""
    return is_stance or not terrain.order_matters


@kernel_part
def has_ground_in_air(terrain: Terrain, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """Whether a foot in the air has ground below it.

    On a plane where the order of the feet matters, this can change while the foot is in the air.
    """
    if terrain.has_pads:
        return has_ground
    return stands or ahead or not terrain.order_matters
