"""The basin block: a grid of starts, each of which is followed to an attractor or a fall."""

import operator
from typing import Annotated, Final, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator

from walkerlab.config.fields import Block, check_against, key, meaning_error

Coordinate = Literal["theta_2", "dtheta_1", "dtheta_2"]
COORDINATES: Final[tuple[Coordinate, ...]] = get_args(Coordinate)
MAX_BOUND: Final = 1e6  # limit of the window's bounds

_COORDINATE_UNITS: Final = "rad, rad/s"
_WIDTH: Final = "the gait by 0.15 rad and 0.25 sqrt(g/L)"
_Bound = Annotated[float, Field(ge=-MAX_BOUND, le=MAX_BOUND)]
_Bounds = tuple[_Bound, ...]  # empty for the default window


class Basin(Block):
    """Grid of starts just after heel strike. Coordinates that the grid does not vary have the gait's values."""

    model: Literal["rigid", "contact"] = key("rigid", "", "which model walks")
    plane: tuple[Coordinate, ...] = key(
        ("theta_2", "dtheta_2"),
        "",
        "coordinates of the grid: two for a plane through the gait, or all three; theta_1 follows from the slope",
        "stance angle and its rate, as in Schwab and Wisse 2001",
        bounds=f"two or three of {', '.join(COORDINATES)}, each once",
    )
    cells: tuple[Annotated[int, Field(ge=2, le=4000)], ...] = key(
        (400, 400), "1", "cells along each coordinate", bounds="one number from 2 to 4000 per coordinate"
    )
    lower: _Bounds = key(
        (),
        _COORDINATE_UNITS,
        "lower bounds of the window",
        bounds="one number per coordinate",
        default_in_words=f"below {_WIDTH}",
    )
    upper: _Bounds = key(
        (),
        _COORDINATE_UNITS,
        "upper bounds of the window",
        bounds="one number per coordinate, above `lower`",
        default_in_words=f"above {_WIDTH}",
    )
    refine: int = key(
        4, "1", "parts into which cells at basin boundaries are divided along each axis; 1: no refinement", ge=1, le=32
    )
    steps: int = key(300, "1", "steps of the rigid model after which a walk is called unsettled", ge=1, le=1_000_000)
    contact_steps: int = key(12, "1", "steps that the contact model walks", ge=2, le=10_000)

    @field_validator("plane")
    @classmethod
    def _two_or_three_coordinates(cls, value: tuple[Coordinate, ...]) -> tuple[Coordinate, ...]:
        if len(value) not in (2, 3) or len(set(value)) != len(value):
            raise meaning_error("must be two or three coordinates, each once")
        return value

    @field_validator("cells", "lower", "upper")
    @classmethod
    def _one_for_each_coordinate(cls, value: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        plane = info.data.get("plane")
        usual = not value and info.field_name != "cells"
        if plane is not None and not usual and len(value) != len(plane):
            raise meaning_error(f"must have {len(plane)} numbers, one for each coordinate in plane")
        return value

    _above = check_against(
        "upper", "lower", lambda upper, lower: "must be above lower" if any(map(operator.le, upper, lower)) else ""
    )
