"""What ground there is for each foot: pads laid in one lane a leg, a plane that lets scuffing feet through, a plane.

Straight legs scuff, so the paper walks on a checkerboard: in the plane, one lane of raised pads for each leg. A lane is
cut into cells, pads (even numbers) and gaps (odd); a plane is one endless cell. Feet that clear the ground need no
pads.
"""

import math
from typing import Any, NamedTuple

from walkerlab.kernels import by_type

FAR = 1e9  # m, an edge out of reach


class Checkerboard(NamedTuple):
    """Pads of the length of a step, for either leg in turn; nothing between them."""

    pitch: float  # [S] m, step length the pads are laid for
    lanes: tuple[float, float]  # m, where each foot's pad number 0 is centred


class AfterMidSwing(NamedTuple):
    """A plane that a foot can touch only once it has been above the ground ahead of the other foot."""

    step_length: float  # [S] m, what a step ahead is measured by


class Plane(NamedTuple):
    """Ordinary ground: it carries any foot that touches it."""

    step_length: float  # [S] m, what a step ahead is measured by


@by_type
def has_pads(terrain: Any) -> bool:
    """Whether the ground has edges, and pads that a foot can trip over."""


@by_type
def cell_at(terrain: Any, foot: int, along: float) -> int:
    """Number of the cell of a foot's lane at `along` (m)."""


@by_type
def cell_edges(terrain: Any, foot: int, cell: int) -> tuple[float, float]:
    """Where a cell begins and ends (m)."""


@by_type
def stride_measure(terrain: Any) -> float:
    """Length (m) by which a step ahead and a slide are judged."""


@by_type
def starts_with_ground(terrain: Any, is_stance: bool) -> bool:
    """Whether a foot that starts on the ground is carried by it."""


@by_type
def has_ground_in_cell(terrain: Any, cell: int) -> bool:
    """Whether a foot that comes into a cell from above is carried there."""


@by_type
def has_ground_in_air(terrain: Any, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """Whether ground would carry a foot that is above it.

    has_ground  whether it would have until now
    stands   whether it is the stance foot
    ahead    whether it is ahead of the other foot
    """


@by_type
def order_matters(terrain: Any) -> bool:
    """Whether it matters which foot is ahead."""


@has_pads.case(Checkerboard)
def checkerboard_pads(terrain: Checkerboard) -> bool:
    """Yes."""
    return True


@cell_at.case(Checkerboard)
def checkerboard_cell(terrain: Checkerboard, foot: int, along: float) -> int:
    """Pads and gaps are S long; pad 2 j of a lane is centred 2 j S from the lane's first."""
    return math.floor((along - terrain.lanes[foot]) / terrain.pitch + 0.5)


@cell_edges.case(Checkerboard)
def checkerboard_edges(terrain: Checkerboard, foot: int, cell: int) -> tuple[float, float]:
    """Half a pitch to both sides of the cell's centre."""
    centre = terrain.lanes[foot] + cell * terrain.pitch
    return centre - 0.5 * terrain.pitch, centre + 0.5 * terrain.pitch


@stride_measure.case(Checkerboard)
def checkerboard_measure(terrain: Checkerboard) -> float:
    """The pads' pitch."""
    return terrain.pitch


@starts_with_ground.case(Checkerboard)
def checkerboard_start(terrain: Checkerboard, is_stance: bool) -> bool:
    """Both feet start on pads."""
    return True


@has_ground_in_cell.case(Checkerboard)
def checkerboard_carries(terrain: Checkerboard, cell: int) -> bool:
    """Pads have even numbers."""
    return cell % 2 == 0


@has_ground_in_air.case(Checkerboard)
def checkerboard_in_air(terrain: Checkerboard, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """A pad stays where it is."""
    return has_ground


@order_matters.case(Checkerboard)
def checkerboard_order(terrain: Checkerboard) -> bool:
    """No."""
    return False


@has_pads.case(AfterMidSwing)
@has_pads.case(Plane)
def plane_pads(terrain: Any) -> bool:
    """No."""
    return False


@cell_at.case(AfterMidSwing)
@cell_at.case(Plane)
def plane_cell(terrain: Any, foot: int, along: float) -> int:
    """One plane."""
    return 0


@cell_edges.case(AfterMidSwing)
@cell_edges.case(Plane)
def plane_edges(terrain: Any, foot: int, cell: int) -> tuple[float, float]:
    """None within reach."""
    return -FAR, FAR


@stride_measure.case(AfterMidSwing)
@stride_measure.case(Plane)
def plane_measure(terrain: Any) -> float:
    """The reference step length."""
    return terrain.step_length


@starts_with_ground.case(AfterMidSwing)
def plane_start(terrain: AfterMidSwing, is_stance: bool) -> bool:
    """The foot that is about to swing has not been ahead yet."""
    return is_stance


@has_ground_in_cell.case(AfterMidSwing)
@has_ground_in_cell.case(Plane)
def plane_carries(terrain: Any, cell: int) -> bool:
    """Never asked: the plane has no edges."""
    return True


@has_ground_in_air.case(AfterMidSwing)
def plane_in_air(terrain: AfterMidSwing, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """A swing foot above the ground can touch while it is ahead; the stance foot, when it bounces, anywhere."""
    return stands or ahead


@order_matters.case(AfterMidSwing)
def plane_order(terrain: AfterMidSwing) -> bool:
    """Yes."""
    return True


@starts_with_ground.case(Plane)
def any_start(terrain: Plane, is_stance: bool) -> bool:
    """Both are."""
    return True


@has_ground_in_air.case(Plane)
def any_in_air(terrain: Plane, has_ground: bool, stands: bool, ahead: bool) -> bool:
    """Wherever it is."""
    return True


@order_matters.case(Plane)
def any_order(terrain: Plane) -> bool:
    """No."""
    return False
