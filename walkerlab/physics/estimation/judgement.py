"""Judge whether a fitted model explains a measured walk. Also measure the largest multiplier of a walk from its steps
alone, corrected for noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.special import chdtrc, ndtri, stdtr

from walkerlab.physics.estimation.fit import Fitted
from walkerlab.physics.estimation.measurements import LEG_ANGLE
from walkerlab.physics.estimation.mixed_model import whitening
from walkerlab.physics.estimation.result import Fit, MeasuredRadius
from walkerlab.physics.solvers.system import Floats

LARGEST_SHARE: Final = 0.05  # largest noise or systematic difference, as a fraction of a quantity's size
MAX_ROUGHNESS: Final = 0.02  # largest roughness, as a fraction of the leg length
OUTLIER: Final = 6.0  # standard deviations; larger residuals are outliers
# Residuals below this fraction of a quantity's size are never outliers. A missed heel strike leaves a far larger one.
SMALLEST_OUTLIER: Final = 0.01
ALTERNATION: Final = 5.0  # largest acceptable difference between odd and even steps, in standard deviations
NOTABLE_ALTERNATION: Final = 3.0  # smallest such difference for which the answer suggests fitting a key of leg 2
PHASE_BINS: Final = 20
# fraction of the leg length; about 0.001 for a laboratory floor
UNUSUALLY_ROUGH: Final = 0.003
# Larger changes of the rates at a heel strike, as a fraction of the rates, are unusual.
UNUSUAL_KICK: Final = 0.05
# Largest acceptable scatter of averaged residuals, as a normal deviate. Of the walks that the model explains, 0.8 %
# exceed it.
MAX_DEPENDENCE: Final = 2.4


def judge(fitted: Fitted) -> tuple[Fit, tuple[str, ...]]:
    """Decide whether a model fits. Also return the reasons if it does not, or if its errors are doubtful."""
    fit, reason = judge_fit(fitted)
    reasons = (reason,) if reason else (*implausible_disturbances(fitted), *dependent_residuals(fitted))
    return ("fits-but" if reasons and fit == "fits" else fit), reasons


def judge_fit(fitted: Fitted) -> tuple[Fit, str]:
    forecast = fitted.forecast
    sizes = fitted.data.sizes
    limp = describe_limp(fitted)
    for quantity, noise, size in zip(forecast.quantities, fitted.noise.measurement, sizes, strict=True):
        if noise > LARGEST_SHARE * size:
            (name, unit), share = name_and_unit(quantity), 100.0 * noise / size
            reason = f"the {name} differs from the model by {noise:.2g} {unit} (r.m.s.), {share:.0f} % of its size"
            return "misfit", limp or reason
    if fitted.reason:
        return "not-converged", fitted.reason
    if fitted.noise.roughness_m > MAX_ROUGHNESS * fitted.problem.leg_length_m:
        return "misfit", f"only a floor {1e3 * fitted.noise.roughness_m:.3g} mm rough could explain the steps"
    white = whitening(fitted.data, fitted.noise)(fitted.data.residuals)
    steps = forecast.measured.count
    for index, quantity in enumerate(forecast.channels):
        residuals = white[index * steps : (index + 1) * steps]
        name = name_and_unit(quantity)[0]
        worst = int(np.argmax(np.abs(residuals)))
        # The median is robust: however large the outliers are, 1.4826 times the median is the standard deviation of
        # normal residuals.
        spread = float(np.median(np.abs(residuals))) * 1.4826 or 1.0
        large = abs(residuals[worst]) * fitted.noise.measurement[index] > SMALLEST_OUTLIER * sizes[index]
        if large and abs(residuals[worst]) > OUTLIER * max(spread, 0.3) and steps > 4:
            times = abs(residuals[worst]) / spread
            reason = f"the {name} of step {worst + 1} deviates by {times:.2g} times the scatter of the other steps"
            return "misfit", reason
    if limp:
        return "misfit", limp
    if forecast.measured.sampled:
        systematic = float(np.sqrt(np.nanmean(phase_means(fitted) ** 2)))
        if systematic > LARGEST_SHARE * sizes[forecast.quantities.index(LEG_ANGLE)]:
            return "misfit", f"the angles differ by {systematic:.3g} rad at the same phase of every step"
    return "fits", ""


def alternates(fitted: Fitted) -> bool:
    """Whether odd and even steps differ from the model by different amounts. A rough floor may explain that, too."""
    return any(each > NOTABLE_ALTERNATION for each in alternations(fitted, fitted.data.residuals).values())


def describe_limp(fitted: Fitted) -> str:
    """Describe a quantity whose residuals alternate from step to step, or return '' if none does."""
    white = whitening(fitted.data, fitted.noise)(fitted.data.residuals)
    for quantity, alternation in alternations(fitted, white).items():
        if alternation > ALTERNATION:
            name = name_and_unit(quantity)[0]
            return f"the {name} alternates from step to step by {alternation:.2g} standard deviations: a limp"
    return ""


def alternations(fitted: Fitted, residuals: Floats) -> dict[str, float]:
    """Return by how many standard deviations the residuals of odd and even steps differ, for each step quantity."""
    steps = fitted.forecast.measured.count
    channels = enumerate(fitted.forecast.channels)
    return {quantity: alternation_of(residuals[index * steps : (index + 1) * steps]) for index, quantity in channels}


def implausible_disturbances(fitted: Fitted) -> Iterator[str]:
    """Yield a reason to doubt the fit if the floor is implausibly rough, and another if kicks are large."""
    roughness = fitted.noise.roughness_m
    leg = fitted.problem.leg_length_m
    if roughness > UNUSUALLY_ROUGH * leg:
        yield (
            f"the floor would be {1e3 * roughness:.2g} mm rough, {100.0 * roughness / leg:.2g} % of the leg "
            "(a laboratory's: 0.1 %), so something else disturbs the walk, or a fixed parameter is wrong"
        )
    if fitted.noise.kick > UNUSUAL_KICK:
        yield (
            f"the rates would change at random by {100.0 * fitted.noise.kick:.2g} % at heel strikes, so something else "
            "disturbs the walk, or a fixed parameter is wrong"
        )


def dependent_residuals(fitted: Fitted) -> Iterator[str]:
    """Yield a reason to doubt the standard errors if half-step averages scatter more than independent noise would."""
    # Angles compared at fractions of steps inherit the errors of the measured heel strikes.
    groups = fitted.forecast.half_steps
    if not groups.size:
        return
    counts = np.bincount(groups)
    sums = np.bincount(groups, whitening(fitted.data, fitted.noise)(fitted.data.residuals))
    squares = float((sums**2 / counts).sum())
    freedom = max(1, counts.size - fitted.u.size)
    # Express the scatter as a normal deviate, so that the limit does not depend on the number of averages.
    if -float(ndtri(max(chdtrc(freedom, squares), 1e-300))) > MAX_DEPENDENCE:
        yield (
            f"residuals of successive angles are correlated (averages over half a step scatter "
            f"{math.sqrt(squares / freedom):.2g} times as much as independent noise allows)"
        )


def name_and_unit(quantity: str) -> tuple[str, str]:
    name, _, unit = quantity.rpartition("_")
    return name.replace("_", " "), unit


def alternation_of(residuals: Floats) -> float:
    """Test whether odd and even steps differ. Return the normal deviate whose tail probability is that of
    Student's t.
    """
    odd = residuals[::2]
    even = residuals[1::2]
    if min(odd.size, even.size) < 2:
        return 0.0
    scatter = math.sqrt(odd.var(ddof=1) / odd.size + even.var(ddof=1) / even.size)
    t = abs(float(odd.mean() - even.mean())) / (scatter or math.inf)
    return -float(ndtri(max(stdtr(residuals.size - 2, -t), 1e-300)))


def phase_means(fitted: Fitted) -> Floats:
    """Return the mean residual (phases, 2) of the angles at each phase, for a walk on the most probable floor.

    The swing leg is column 0.
    """
    measured = fitted.forecast.measured
    residuals = fitted.residuals[-measured.angles_rad.size :].reshape(-1, 2)
    # The legs exchange roles at every heel strike.
    swaps = measured.step % 2 == 1
    residuals = np.where(swaps[:, None], residuals[:, ::-1], residuals)
    bins = np.minimum((PHASE_BINS * measured.phase).astype(int), PHASE_BINS - 1)
    counts = np.bincount(bins, minlength=PHASE_BINS)
    sums = np.array([np.bincount(bins, residuals[:, leg], PHASE_BINS) for leg in range(2)]).T
    return np.asarray(sums[counts > 0] / counts[counts > 0, None])


MIN_STEPS = 8
REPLICATES = 400


def spectral_radius(steps: Floats, stride: int = 1) -> Floats:
    """Return the largest multiplier (...,) of the linear map that takes each step's values to the next step's.

    The map is fitted by least squares, as in the literature, so noise biases it.

    steps   (..., steps, quantities)
    stride  number of steps after which a gait repeats; each of these steps has its own mean
    """
    before, after = steps[..., :-1, :].copy(), steps[..., 1:, :].copy()
    for each in (before, after):
        for first in range(stride):
            each[..., first::stride, :] -= each[..., first::stride, :].mean(axis=-2, keepdims=True)
    # In units of their scatter, all quantities have the same size, so the pseudo-inverse drops only constant ones, such
    # as periods from a coarse clock.
    scale = np.sqrt(np.mean(before**2, axis=-2, keepdims=True))
    scale[scale == 0.0] = 1.0
    before, after = before / scale, after / scale
    products = np.swapaxes(before, -1, -2) @ before
    step = np.linalg.pinv(products, hermitian=True) @ np.swapaxes(before, -1, -2) @ after
    return np.asarray(np.abs(np.linalg.eigvals(step)).max(axis=-1))


def measure_radius(fitted: Fitted, fitted_radius: float) -> MeasuredRadius | None:
    """Measure the spectral radius from periods, lengths and angles of successive steps.

    The spectral radius of the fitted model is known. So bias and standard error of the estimate follow from simulated
    walks of this model with the fitted disturbances and noise. Returns None for fewer than 8 steps.

    fitted_radius  spectral radius of the fitted walker
    """
    forecast = fitted.forecast
    # The seed is fixed, so that the same walk always gives the same error.
    rng = np.random.default_rng(0)
    count = forecast.measured.count
    channels = len(forecast.channels)
    if count < MIN_STEPS or not channels:
        return None

    def reshape_by_step(values: Floats) -> Floats:
        return np.swapaxes(values[..., : count * channels].reshape(*values.shape[:-1], channels, count), -1, -2)

    spread = fitted.data.spread(fitted.noise)
    noise = fitted.noise.measurement[forecast.quantity]
    disturbed = (rng.normal(size=(REPLICATES, spread.size)) * spread) @ fitted.data.G.T
    replicates = fitted.predicted.values + disturbed + rng.normal(size=(REPLICATES, noise.size)) * noise
    stride = forecast.walks.stride
    plain = float(spectral_radius(reshape_by_step(forecast.values), stride))
    simulated = spectral_radius(reshape_by_step(replicates), stride)
    return MeasuredRadius(plain, plain + fitted_radius - float(simulated.mean()), float(simulated.std(ddof=1)))
