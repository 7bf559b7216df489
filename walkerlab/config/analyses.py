"""The blocks that configure the analyses: continuation, basin, robustness, design, plan, stability and sweep."""

import operator
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_args

from pydantic import Field, ValidationInfo, create_model, field_validator

from walkerlab.config.fields import Block, check_against, check_entries, check_value, key, meaning_error, why_not_rising
from walkerlab.outcome import Outcome

Coordinate = Literal["theta_2", "dtheta_1", "dtheta_2"]
COORDINATES: Final[tuple[Coordinate, ...]] = get_args(Coordinate)
MAX_BOUND: Final = 1e6  # largest magnitude of the window's bounds

_COORDINATE_UNITS: Final = "rad, rad/s"
_WIDTH: Final = "the gait by 0.15 rad and 0.25 sqrt(g/L)"
_Bound = Annotated[float, Field(ge=-MAX_BOUND, le=MAX_BOUND)]
_Bounds = tuple[_Bound, ...]  # empty for the default window


def why_no_plane(coordinates: tuple[Coordinate, ...]) -> str:
    """Explain why coordinates do not span a grid, or return '' if they do."""
    fits = len(coordinates) in (2, 3) and len({*coordinates}) == len(coordinates)
    return "" if fits else "must be two or three coordinates, each once"


class Basin(Block):
    """Grid of starts just after heel strike. A coordinate that the grid does not vary keeps its value in the gait."""

    model: Literal["rigid", "contact"] = key("rigid", "", "model that is simulated")
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
        4, "1", "parts per axis into which cells at basin boundaries are divided; 1 leaves them whole", ge=1, le=32
    )
    steps: int = key(300, "1", "number of steps in which a rigid walk must reach an attractor", ge=1, le=1_000_000)
    contact_steps: int = key(12, "1", "maximum number of steps of a walk of the contact model", ge=2, le=10_000)

    _plane = check_value("plane", why=why_no_plane)

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


FollowedModel = Literal["rigid", "contact", "both"]
_UNIT: Final = "unit of the key"


if TYPE_CHECKING:

    class _Span(Block):
        """Declaration of the key `from`."""

else:
    # `from` is a Python keyword, so a class body cannot declare a key of this name.
    _FROM = key(1.0e-4, _UNIT, "start of the range", bounds="a number below `to`")
    _Span = create_model("_Span", __base__=Block, **{"from": (float, _FROM)})


class Span(_Span):
    """Config key and the range over which it varies."""

    to: float = key(0.1, _UNIT, "end of the range", bounds="a number above `from`")
    over: str = key(
        "slope_rad",
        "",
        "parameter to vary, such as slope_deg or walker.hip_mass_kg",
        bounds="dotted path of a config key",
        pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$",
    )

    _above = check_against("to", "from", lambda to, least: "" if to > least else f"must be above `from`, {least:g}")

    @property
    def least(self) -> float:
        return float(getattr(self, "from"))


class Continuation(Span):
    """Options of `walkerlab continuation`."""

    model: FollowedModel = key("rigid", "", "model whose gaits are followed: rigid, contact, or both in one figure")
    periods: int = key(16, "1", "period-doubling cascades are followed up to gaits of this many steps", ge=1, le=64)
    points: int = key(400, "1", "maximum number of points on one branch", ge=2, le=100_000)
    second: Span | None = key(None, "", "second parameter, for fold and flip curves in the plane of both")


Quantity = Literal[
    "period_s",
    "step_length_m",
    "speed_m_s",
    "spectral_radius",
    "gait_sensitivity_norm",
    "gait_sensitivity_norm_scaled",
    "cost_of_transport",
    "largest_step_down_m",
    "largest_step_up_m",
    "largest_push_forward_N_s",
    "largest_push_backward_N_s",
]
_QUANTITY_NAMES: Final = ", ".join(get_args(Quantity))
Bounds = dict[str, list[float]]


def why_no_quantity(name: str, _bounds: list[float]) -> str:
    """Explain that a name is not a gait quantity, or return '' if it is one."""
    text = f"names {name}, which is not a gait quantity; choose from {_QUANTITY_NAMES}"
    return "" if name in get_args(Quantity) else text


class Design(Block):
    """Optimisation problem of `walkerlab design`."""

    minimise: Quantity | None = key(None, "", "gait quantity to minimise")
    maximise: Quantity | None = key(None, "", "gait quantity to maximise")
    over: Bounds = key(
        dict, "", "parameters that may vary, with bounds in the key's unit", bounds="[A, B] for each key, A below B"
    )
    keep: Bounds = key(dict, "", "gait quantities to constrain", bounds=f"[A, B] for each of {_QUANTITY_NAMES}")
    model: Literal["rigid", "contact"] = key("rigid", "", "model whose gait is optimised")
    starts: int = key(
        5, "1", "starting points of the search: first the config's values, then random ones", ge=1, le=1000
    )

    _single_goal = check_against(
        "maximise", "minimise", lambda value, _: "cannot be combined with minimise: remove one of them" if value else ""
    )

    _rising = check_entries("over", "keep", why=why_not_rising)

    _of_a_gait = check_entries("keep", why=why_no_quantity)


class Plan(Block):
    """Measurements to plan, with their assumed noise."""

    steps: int = key(20, "1", "standard errors are reported for a walk of this many steps", ge=2, le=500)
    max_steps: int = key(50, "1", "longest walk to consider, in steps", ge=2, le=500)
    errors: dict[str, float] = key(
        dict, "", "standard errors to reach, in the key's unit", bounds="a number above 0 for each key of identify.fit"
    )
    period_noise_s: float = key(2e-3, "s", "standard deviation of a measured period", gt=0.0, le=1.0)
    length_noise_m: float = key(2e-3, "m", "standard deviation of a measured step length", gt=0.0, le=1.0)
    angle_noise_rad: float = key(2e-3, "rad", "standard deviation of a measured angle", gt=0.0, le=1.0)
    rate_hz: float = key(100.0, "Hz", "sampling rate of angles over time", ge=1.0, le=10_000.0)
    roughness_m: float = key(1e-4, "m", "standard deviation of the floor's heights", ge=0.0, le=0.1)
    start_change: float = key(
        0.02, "1", "relative change of the start's coordinates, for walks that do not start on the gait", gt=0.0, le=0.5
    )

    _positive = check_entries(
        "errors", why=lambda name, error: "" if error > 0.0 else f"has {error:g} for {name}, not a number above 0"
    )


_DEFAULT_ROUGHNESS_M: Final = (0.0005, 0.001, 0.002)
Roughness = Annotated[float, Field(gt=0.0, le=1e3)]


class Robustness(Block):
    """Disturbances that `walkerlab robustness` tries, and parameters that it varies."""

    model: Literal["rigid", "contact", "both"] | None = key(
        None, "", "model that is simulated", default_in_words="both, or rigid if there is no contact block"
    )
    to: tuple[str, ...] | None = key(
        None,
        "",
        "parameters with respect to which the gait is differentiated; an empty list leaves the derivatives out",
        bounds="a list of dotted paths of config keys",
        default_in_words="every parameter that the model reads",
        sequence=True,
    )
    steps: int = key(50, "1", "steps that a walk must take after a single disturbance", ge=1, le=10_000)
    roughness_m: tuple[Roughness, ...] = key(
        _DEFAULT_ROUGHNESS_M,
        "m",
        "standard deviations of the footholds' heights; an empty list leaves rough ground out",
        bounds="a list of numbers above 0",
    )
    walks: int = key(400, "1", "walks per roughness", ge=2, le=1_000_000)
    max_steps: int = key(20_000, "1", "maximum number of steps of a walk on rough ground", ge=1, le=10_000_000)


FATES: Final = tuple(outcome.label for outcome in Outcome)
if TYPE_CHECKING:
    Fate = str
else:
    Fate = Literal[FATES]
CASE_NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9._+-]{0,63}$"


class Case(Block):
    """Test case: changes of the paper config, and the outcomes that are expected with them."""

    name: str = key(
        ..., "", "name of the case", bounds="up to 64 letters, digits, '.', '_', '+' or '-'", pattern=CASE_NAME
    )
    family: str = key("own", "", "group of the case in tables", bounds="same as for name", pattern=CASE_NAME)
    model: Literal["contact", "rigid"] = key("contact", "", "model that is simulated")
    config: dict[str, Any] = key(dict, "", "config keys that replace the paper's", bounds="a block of keys")
    steps: int = key(4, "1", "steps to walk", ge=1, le=2_000_000)
    lowered_m: float = key(0.0, "m", "depth of the start below the ground, negative if it is above", ge=-1e3, le=1e3)
    expected: tuple[Fate, ...] = key(
        ..., "", "expected outcomes", bounds=f"a list of {', '.join(FATES)}", sequence=True
    )
    reason: str = key(..., "", "why these outcomes are expected", bounds="a sentence")
    budget: int = key(400_000, "1", "maximum number of right-hand sides evaluated in the walk", ge=1, le=100_000_000)
    balance: float = key(1e-6, "1", "largest residual of the energy balance, relative to the walker's energy", gt=0.0)
    agreement: float = key(
        1e-4,
        "1",
        "maximum difference between the times of a walk and of its repeats (other tolerance, method or size), in "
        "pendulum times",
        gt=0.0,
    )
    compared_steps: int = key(20, "1", "steps whose times are compared; use fewer where small errors grow", ge=1)
    twin: bool = key(False, "", "whether a twin, the walker scaled to another size, must take the same steps")

    _some_outcome_is_right = check_value("expected", why=lambda outcomes: "" if outcomes else "must name an outcome")


class Stability(Block):
    """Cases that `walkerlab stability` judges in addition to the catalogue."""

    cases: tuple[Case, ...] = key(
        (), "", "your own cases, as a list or as a file that holds the list", bounds="a list of cases, or a file"
    )
    map_cells: int = key(25, "1", "cells along each axis of the maps that --full computes", ge=2, le=201)


Values = str | list[float | int | bool | str]


class Sweep(Block):
    """Defaults of the options of `walkerlab sweep`."""

    stage: str = key("fixedpoint", "", "stage to run", bounds="any stage that draws no figures")
    over: dict[str, Values] = key(
        dict,
        "",
        "config keys to sweep, with values in the key's unit; the last key changes fastest",
        bounds="FROM:TO:N, FROM:TO:N:log or a list, for each key",
    )
    zip: bool = key(False, "", "the n-th values of all keys make the n-th point, instead of the full grid")
    sample: str = key(
        "",
        "",
        "how many points to draw from the intervals, and by which method, instead of using a grid",
        bounds="latin-hypercube:N, sobol:N, random:N, or empty",
        default_in_words="empty",
    )
    seed: int = key(1, "1", "seed of the sampled points", ge=0, le=2**32 - 1)
