"""The stability block: user-defined cases in addition to the package's catalogue."""

from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import field_validator

from walkerlab.config.fields import Block, key, meaning_error
from walkerlab.outcome import Outcome

FATES: Final = tuple(outcome.label for outcome in Outcome)
if TYPE_CHECKING:
    Fate = str
else:
    Fate = Literal[FATES]
NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9._+-]{0,63}$"


class Case(Block):
    """Test case: changes to the paper config, and the expected outcomes."""

    name: str = key(..., "", "name of the case", bounds="up to 64 letters, digits, '.', '_', '+' or '-'", pattern=NAME)
    family: str = key("own", "", "group of the case in tables", bounds="same as for name", pattern=NAME)
    model: Literal["contact", "rigid"] = key("contact", "", "which model walks")
    config: dict[str, Any] = key(dict, "", "config keys that replace the paper's", bounds="a block of keys")
    steps: int = key(4, "1", "steps to walk", ge=1, le=2_000_000)
    lowered_m: float = key(0.0, "m", "depth of the start below the ground; negative: above it", ge=-1e3, le=1e3)
    expected: tuple[Fate, ...] = key(
        ..., "", "expected outcomes", bounds=f"a list of {', '.join(FATES)}", sequence=True
    )
    reason: str = key(..., "", "why these outcomes are expected", bounds="a sentence")
    budget: int = key(400_000, "1", "maximum number of right-hand sides evaluated in the walk", ge=1, le=100_000_000)
    balance: float = key(1e-6, "1", "largest residual of the energy balance, relative to the walker's energy", gt=0.0)
    agreement: float = key(
        1e-4,
        "1",
        "largest difference of times from the walk with a ten times tighter tolerance or the twin, in pendulum times",
        gt=0.0,
    )
    compared_steps: int = key(20, "1", "steps whose times are compared; use fewer where small errors grow", ge=1)
    twin: bool = key(False, "", "whether the same walker in another size must walk alike")

    @field_validator("expected")
    @classmethod
    def _some_outcome_is_right(cls, value: tuple[Fate, ...]) -> tuple[Fate, ...]:
        if not value:
            raise meaning_error("must name an outcome")
        return value


class Stability(Block):
    """Cases that `walkerlab stability` judges in addition to the catalogue."""

    cases: tuple[Case, ...] = key(
        (), "", "your own cases, as a list or as a file that holds the list", bounds="a list of cases, or a file"
    )
    map_cells: int = key(25, "1", "cells along each axis of the maps that --full makes", ge=2, le=201)
