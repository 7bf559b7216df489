"""Largest multiplier of a walk from its steps alone, corrected for noise."""

from __future__ import annotations

import numpy as np

from walkerlab.physics.estimation.fit import Fitted
from walkerlab.physics.estimation.result import MeasuredRadius
from walkerlab.physics.solvers.system import Floats

MIN_STEPS = 8
REPLICATES = 400


def spectral_radius(steps: Floats, stride: int = 1) -> Floats:
    """Return the largest multiplier (...,) of the linear map that takes each step's values to the next step's.

    The map is that of least squares, as in the literature, so it is biased by noise.

    steps   (..., steps, quantities)
    stride  number of steps after which a gait repeats, each with its own mean
    """
    before, after = steps[..., :-1, :].copy(), steps[..., 1:, :].copy()
    for each in (before, after):
        for first in range(stride):
            each[..., first::stride, :] -= each[..., first::stride, :].mean(axis=-2, keepdims=True)
    # In units of its own scatter, no quantity is lost in the pseudo-inverse, whatever its unit.
    scale = np.sqrt(np.mean(before**2, axis=-2, keepdims=True))
    before, after = before / scale, after / scale
    products = np.swapaxes(before, -1, -2) @ before
    step = np.linalg.pinv(products, hermitian=True) @ np.swapaxes(before, -1, -2) @ after
    return np.asarray(np.abs(np.linalg.eigvals(step)).max(axis=-1))


def measure_radius(fitted: Fitted, fitted_radius: float) -> MeasuredRadius | None:
    """Measure the spectral radius from periods, lengths and angles of successive steps, or None for fewer than 8 steps.

    Bias and standard error are those of the same estimate for walks of the fitted model, with its disturbances and its
    noise, whose spectral radius is known.

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
