"""Result of an identification: estimates with errors, and how well the walk determines them."""

from dataclasses import dataclass, field
from typing import Final, Literal

from walkerlab.physics.estimation.fit import Fitted
from walkerlab.physics.estimation.measurements import MeasuredWalk
from walkerlab.physics.orbits.step_map import DisturbedWalk
from walkerlab.physics.solvers.system import Floats

Fit = Literal["fits", "fits-but", "misfit", "not-converged"]
USABLE: Final = ("fits", "fits-but")
"""Verdicts that mean that the model explains the walk, best first."""


@dataclass(frozen=True)
class Uncertain:
    """A value with its standard error, which is None if the walk does not determine the value."""

    value: float
    standard_error: float | None


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter, in the unit of its key."""

    key: str
    value: float
    standard_error: float | None
    unit: str
    start: float
    at_bound: bool


@dataclass(frozen=True)
class LegDifference:
    """Difference of an estimated key between the legs: value of leg 2 minus that of leg 1, in the unit of the key."""

    key: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class FirstLeg:
    """Leg that swings in the first step, and how certain that is."""

    leg: int
    # how the leg is known: stated by file or config, decided by the data, or only guessed
    by: Literal["statement", "likelihood", "guess"]
    likelihood_gain: float | None  # log-likelihood minus that with the other leg first, or None unless both were fitted


@dataclass(frozen=True)
class Pull:
    """How hard the data pull an estimate against a bound, or against a prior."""

    key: str
    against: Literal["bound", "prior"]
    value: float  # bound or prior value, in the unit of the key
    standard_deviations: float


@dataclass(frozen=True)
class Unidentifiable:
    """A combination of parameters that the walk does not determine, and why."""

    combination: str
    reason: str


@dataclass(frozen=True, eq=False)
class Information:
    """Information in a walk about the fitted parameters."""

    keys: tuple[str, ...]
    # (parameters,) singular values of the data's sensitivity to the scaled parameters, in standard deviations of the
    # data; the start and the nuisances are free
    singular_values: Floats
    directions: Floats  # (parameters, parameters) one row per singular value: components of the scaled parameters
    covariance: Floats  # (parameters, parameters) along determined directions, in the units of the parameters
    correlations: Floats  # (parameters, parameters) correlations of the estimates
    scales: Floats  # (parameters,) typical changes, in the units of the parameters
    freedom: float  # degrees of freedom of Student's t distribution for the errors
    # fraction of the information due to each measured quantity, averaged over determined directions
    contributions: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class EstimateSensitivity:
    """Change of an estimate if a fixed parameter is 1 % larger."""

    estimate: str  # key of the estimate
    to: str  # key of the fixed parameter
    per_percent: float  # change of the estimate, in its unit
    unit: str
    # change of the fixed parameter, in its unit: 1 % of it, or of the leg's length or inertia if it is zero
    change: float


@dataclass(frozen=True)
class MeasuredRadius:
    """Spectral radius from the steps alone."""

    plain: float  # estimate by least squares, as in the literature
    value: float  # estimate without the bias that noise causes
    standard_error: float


@dataclass(frozen=True)
class ModelFit:
    model: str
    log_likelihood: float | None
    fit: Fit
    reasons: tuple[str, ...] = ()  # why a model does not fit, or why its errors are doubtful

    @property
    def usable(self) -> bool:
        return self.fit in USABLE


@dataclass(frozen=True, eq=False)
class StepTable:
    """Measured and predicted values (steps,) of a quantity, and the standard deviation of their difference."""

    quantity: str
    measured: Floats
    predicted: Floats
    deviation: Floats


@dataclass(frozen=True, eq=False)
class Identification:
    model: str
    estimates: tuple[Estimate, ...]
    pulls: tuple[Pull, ...]
    not_identifiable: tuple[Unidentifiable, ...]
    information: Information
    process: dict[str, float | bool | None]  # roughness_m, share_of_leg, standard_error, at_bound
    measurement: dict[str, float]  # standard deviation of each quantity
    rms_residual: dict[str, float]
    chi_square_per_dof: float
    gait: dict[str, Uncertain]
    models: tuple[ModelFit, ...]
    tables: tuple[StepTable, ...]
    fitted: Fitted = field(repr=False)
    walk: DisturbedWalk = field(repr=False)  # walk over the most probable floor
    nuisances: dict[str, Uncertain]  # estimated properties of clock and sensors
    sensitivities: tuple[EstimateSensitivity, ...]  # sensitivities to parameters that are not estimated
    measured_radius: MeasuredRadius | None  # None if there are few steps or no gait
    leg_differences: tuple[LegDifference, ...] = ()  # one for each estimated key of leg 2
    first_leg: FirstLeg | None = None  # None for equal legs
    # the same differences if the other leg swings first; empty if the data decide which leg does
    other_differences: tuple[LegDifference, ...] = ()

    @property
    def verdict(self) -> ModelFit:
        return next(model for model in self.models if model.model == self.model)

    @property
    def measured(self) -> MeasuredWalk:
        return self.fitted.forecast.measured

    @property
    def sensors(self) -> dict[str, float]:
        """Properties of clock and sensors, named as in `prediction.NUISANCES`."""
        return self.fitted.forecast.sensors(self.fitted.u)
