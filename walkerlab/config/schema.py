"""All config keys with type, unit, bounds, default, meaning and source. The defaults are the paper's values."""

import math
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import BaseModel, Discriminator, Field, Tag, ValidationInfo, field_validator

from walkerlab.config import walkers
from walkerlab.config.analyses import Basin, Continuation, Design, Plan, Robustness, Stability, Sweep
from walkerlab.config.check import Check
from walkerlab.config.contact import Contact, Footholds
from walkerlab.config.drives import PushOff, drives_and_springs_of, push_offs
from walkerlab.config.fields import Block, Text, check_against, check_value, key, meaning_error
from walkerlab.config.identify import Identify
from walkerlab.config.recording import RecordedFile
from walkerlab.extensions import words

Equations = str
Output = Literal["states", "energies", "forces"]
Method = Literal[
    "dop853",
    "radau5",
    "scipy-rk45",
    "scipy-dop853",
    "scipy-lsoda",
    "scipy-radau",
    "scipy-bdf",
    "cvode-bdf",
    "cvode-adams",
]

OUTPUTS: Final[tuple[Output, ...]] = get_args(Output)
METHODS: Final[tuple[Method, ...]] = get_args(Method)

RIGHT_ANGLE: Final = math.pi / 2
CVODE_PACKAGE: Final = "sksundae"


class SlopeInDegrees(Block):
    """Slope in degrees, allowed in a file or `--set` instead of slope_rad. The resolved config has only slope_rad."""

    slope_deg: float = key(
        ...,
        "deg",
        "slope in degrees; give either slope_rad or slope_deg",
        bounds="between -90 and 90, both excluded",
        gt=-90.0,
        lt=90.0,
    )


SwingAngle = Annotated[float, Field(ge=-10.0, le=10.0)]  # if null, -2 phi - theta_2 (both feet on the slope phi)
StanceAngle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi)]
Rate = Annotated[float, Field(ge=-1e6, le=1e6)]
# An angle or rate that can be computed from the others may be null.
State = tuple[SwingAngle | None, StanceAngle, Rate, Rate]
LongState = tuple[Rate | None, ...]  # states of walkers with more than two bodies


MID_STEP: Final = "mid-step"


class MidStep(BaseModel):
    """Start between two heel strikes. Its state is used as it is, without computing any value."""

    model_config = Block.model_config

    instant: Literal["mid-step"]
    state: tuple[Rate, ...] = Field(strict=False)

    def __len__(self) -> int:
        return len(self.state)


def state_of(start: Any) -> tuple[float, ...]:
    """Return the state of a start that is not the fixed point."""
    return start.state if isinstance(start, MidStep) else tuple(start)


def replace_state(start: Any, state: tuple[float, ...]) -> Any:
    """Return a start at the same instant with another state."""
    return MidStep(instant=MID_STEP, state=state) if isinstance(start, MidStep) else state


def kind_of_start(value: Any) -> str:
    """Return the tag by which pydantic chooses the type of a `start` value, which is a state or a word."""
    if isinstance(value, list | tuple):
        return "state" if len(value) <= 4 else "long"
    return MID_STEP if isinstance(value, dict | MidStep) else "word"


Start = Annotated[
    Annotated[Literal["fixed-point"], Tag("word")]
    | Annotated[State, Field(strict=False), Tag("state")]
    | Annotated[LongState, Field(strict=False), Tag("long")]
    | Annotated[MidStep, Tag(MID_STEP)],
    Discriminator(kind_of_start),
]


Factor = Annotated[float, Field(ge=-10.0, le=10.0)]
Factors = tuple[Factor, Factor]

_MEASURED: Final = "the measured error against run time"


def method(default: Method) -> Any:
    bounds = "dop853, radau5, or a method of SciPy or CVODE to check them (docs/numerics.md)"
    return key(default, "", "integration method", _MEASURED, bounds=bounds)


def relative(default: float) -> Any:
    return key(default, "1", "relative tolerance", _MEASURED, ge=1e-14, le=0.1)


def absolute(default: float) -> Any:
    return key(default, "rad, rad/s, m, m/s", "absolute tolerance", _MEASURED, gt=0.0, le=1.0)


def why_not_installed(method: Method) -> str:
    """Explain why a method cannot be used here, or return '' if it can."""
    missing = method.startswith("cvode") and find_spec(CVODE_PACKAGE) is None
    return "needs CVODE, which is not installed: pip install scikit-sundae" if missing else ""


class SolverSettings(Block):
    """Integration settings of one model."""

    method: Method = method("dop853")
    rtol: float = relative(1.0e-10)
    atol: float = absolute(1.0e-12)

    _installed = check_value("method", why=why_not_installed)


class RigidSolver(SolverSettings):
    """Integration settings of the rigid model."""


class ContactSolver(SolverSettings):
    """Integration settings of the contact model."""

    method: Method = method("radau5")
    rtol: float = relative(1.0e-7)
    atol: float = absolute(1.0e-9)


class Solvers(Block):
    """Integration settings of each model."""

    rigid: RigidSolver = RigidSolver()
    contact: ContactSolver = ContactSolver()


def factors(least: float, most: float, velocity: str) -> Any:
    bounds = "two numbers from -10 to 10, the first below the second"
    return key((least, most), "1", f"smallest and largest factor by which the {velocity} is multiplied", bounds=bounds)


def why_not_upwards(pair: Factors) -> str:
    return "" if pair[0] < pair[1] else "the first must be below the second"


class Tune(Block):
    """Settings for adjusting the two initial angular velocities until the contact model walks."""

    cells: int | None = key(
        None,
        "1",
        "cells along each axis of the map; the axes are the factors of the two velocities",
        default_in_words="61 for the paper's compass, 21 for other walkers",
        ge=2,
        le=501,
    )
    swing_factors: Factors = factors(0.0, 2.0, "swing leg's initial angular velocity dtheta_1")
    stance_factors: Factors = factors(0.85, 1.3, "stance leg's initial angular velocity dtheta_2")
    rigid_limit: bool = key(
        True, "", "whether to also stiffen the contact towards the rigid limit, to find where deviations fall to 1e-4"
    )

    _rising = check_value("swing_factors", "stance_factors", why=why_not_upwards)


QUESTIONS: Final = (
    "recording", "stability", "tune", "continuation", "basin", "robustness", "design", "identify", "plan", "sweep",
    "check",
)  # fmt: skip
"""Blocks that configure a stage or a sweep rather than the scene."""


class Source(Block):
    """Study that a config reproduces, as named in the report."""

    title: Text = key(..., "", "title of the study", bounds="any non-empty text", min_length=1)
    authors: Text | None = key(None, "", "its authors", bounds="any text")
    published: Text | None = key(None, "", "where and when it was published", bounds="any text")
    url: str | None = key(
        None,
        "",
        "web address of the study",
        bounds="an address that begins with http:// or https://",
        pattern=r"^https?://\S+$",
    )


class Config(Block):
    """A scene, and settings of the computations on it."""

    name: str = key(
        "paper",
        "",
        "name of the run folder",
        default_in_words="the file's own name",
        bounds="1 to 64 letters, digits, '.', '_' or '-', not starting with '-' or '.' and not ending with '.'",
        pattern=r"^[A-Za-z0-9_]([A-Za-z0-9._-]{0,62}[A-Za-z0-9_-])?$",
    )
    source: Source | None = None
    walker: walkers.Walker = key(walkers.CompassWalker(), "", "the walker; its keys depend on its type", "Fig. 1")
    gravity_m_s2: float = key(9.81, "m/s^2", "g, gravity", "Table 1", ge=1e-6, le=1e4)
    slope_rad: float = key(
        0.0174,
        "rad",
        "slope, positive where it descends in the walking direction",
        "not stated in the paper; follows from x_p (eq. 11), with both feet on the slope",
        bounds="between -pi/2 and pi/2, both excluded",
        gt=-RIGHT_ANGLE,
        lt=RIGHT_ANGLE,
    )
    push_off: PushOff = PushOff()
    equations: Literal[words("equations")] = key(  # type: ignore[valid-type]
        "corrected",
        "",
        "corrected, or as-printed: Appendix A as the paper prints it",
        "Appendix A, eq. A.5: the sign of C_21",
    )
    start: Start = key(
        "fixed-point",
        "rad, rad, rad/s, rad/s",
        "fixed-point, the state just after a heel strike, or a state in mid-step. After a heel strike: [theta_1, "
        "theta_2, dtheta_1, dtheta_2], where leg 1 swings and leg 2 stands. If theta_1 is null, it is computed so that "
        "both feet stand on the slope.",
        "eq. 11",
        bounds="fixed-point, four numbers (angles up to 2 pi, velocities up to 1e6), or "
        "{instant: mid-step, state: [...]}",
    )
    strides: int = key(5, "1", "strides to walk, of two steps each", ge=1, le=10_000)
    ground: Footholds = Footholds()
    contact: Contact | None = None
    solver: Solvers = Solvers()
    stability: Stability = Stability()
    tune: Tune = Tune()
    continuation: Continuation = Continuation()
    basin: Basin = Basin()
    robustness: Robustness = Robustness()
    design: Design | None = None
    recording: RecordedFile | None = None
    identify: Identify | None = None
    plan: Plan | None = None
    sweep: Sweep | None = None
    check: Check | None = None
    outputs: tuple[Output, ...] = key(OUTPUTS, "", "arrays to store", bounds="a list of states, energies, forces")
    seed: int = key(0, "1", "seed of all random numbers", ge=0, le=2**32 - 1)

    _fits = check_against("start", "walker", walkers.explain_wrong_state)
    _pushes = check_against(
        "push_off", "walker", lambda value, walker: walkers.why_no_push_off(walker) if any(push_offs(value)) else ""
    )
    _stands = check_against("contact", "walker", lambda value, walker: walkers.why_no_contact(walker) if value else "")

    @field_validator("start", mode="before")
    @classmethod
    def _mid_step_has_both_keys(cls, value: Any) -> Any:
        if isinstance(value, dict) and value.keys() != MidStep.model_fields.keys():
            raise meaning_error("needs the keys instant: mid-step and state: [...], and no others")
        return value

    @field_validator("equations")
    @classmethod
    def _appendix_a_is_a_compass(cls, value: Equations, info: ValidationInfo) -> Equations:
        if value == "as-printed" and {"walker", "push_off"} <= info.data.keys():
            values = SimpleNamespace(**info.data)
            if acting := drives_and_springs_of(values):
                raise meaning_error(f"is for a passive compass, but this walker has {', '.join(acting)}")
            if not walkers.is_passive_compass(values):
                raise meaning_error("is for a compass, which this walker is not")
        return value

    @field_validator("outputs")
    @classmethod
    def _outputs_once_and_in_order(cls, value: tuple[Output, ...]) -> tuple[Output, ...]:
        return tuple(output for output in OUTPUTS if output in value)
