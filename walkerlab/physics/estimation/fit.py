"""Fit of the most likely parameters, start and noise to a measured walk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np

from walkerlab.physics.estimation.mixed_model import (
    Evaluation,
    Linearised,
    Noise,
    Products,
    estimate_noise,
    evaluate,
    products_of,
    whitening,
)
from walkerlab.physics.estimation.prediction import Forecast, Prediction
from walkerlab.physics.solvers.system import Floats

Loss = Literal["linear", "soft_l1"]
MAX_ROUNDS: Final = 12
SETTLED_NOISE: Final = 1e-2  # largest relative change of a settled standard deviation
SETTLED_MOVE: Final = 0.1  # largest change of a settled unknown, in standard errors
FIRST_NOISE: Final = 0.02  # noise before the first fit, as a fraction of a quantity's typical size
# smallest noise, as a fraction of a quantity's typical size; noise-free measurements are given this noise
NOISE_FLOOR: Final = 1e-6
NO_WALK: Final = 1e3  # whitened residual if the walk cannot be predicted
NO_NEIGHBOURS: Final = "the predicted walk, or one with slightly changed parameters, ends before the last measured step"
HEIGHT_SHARES: Final = (1.0, 0.5, 0.0)
EVALUATIONS: Final = 12  # maximum number of evaluations per round
SETTLED_FIT: Final = 1e-6  # relative change of the cost, or of the unknowns, that ends a round
SAME_DERIVATIVES: Final = 1e-2  # derivatives are kept until a scaled unknown has changed by this much
INSIDE: Final = 1e-9  # minimum distance of a scaled unknown from its bounds at the start of a round
# prior standard deviation of each scaled unknown about its start, which keeps undetermined combinations there
WEAK_PRIOR: Final = 1.0


@dataclass(frozen=True, eq=False)
class FitProblem:
    forecast: Forecast
    leg_length_m: float
    start: tuple[float, ...]  # initial values of the parameters, in their units
    bounds: Sequence[Sequence[float]]  # (low, high) of each parameter, infinite where unbounded
    # (value, standard deviation) of parameters with prior knowledge, by index, in their units
    priors: Mapping[int, Sequence[float]] = field(default_factory=dict)
    loss: Loss = "linear"

    def first(self) -> Floats:
        """Return the scaled unknowns (unknowns,) at the start."""
        u = np.zeros(self.forecast.unknowns)
        u[: self.forecast.scales.size] = np.array(self.start) / self.forecast.scales
        return u

    def limits(self) -> tuple[Floats, Floats]:
        """Return lower and upper bounds (unknowns,) of the scaled unknowns."""
        low, high = (np.full(self.forecast.unknowns, sign * np.inf) for sign in (-1.0, 1.0))
        for place, (least, most) in enumerate(self.bounds):
            low[place], high[place] = np.array((least, most)) / self.forecast.scales[place]
        return low, high

    def prior_rows(self, u: Floats) -> Floats:
        """Return whitened residuals and derivatives (priors, 1 + unknowns) of the priors."""
        rows = np.zeros((len(self.priors), 1 + u.size))
        for row, (place, (value, sigma)) in zip(rows, self.priors.items(), strict=True):
            scale = self.forecast.scales[place]
            row[0], row[1 + place] = (value - u[place] * scale) / sigma, scale / sigma
        return rows


@dataclass(frozen=True, eq=False)
class Fitted:
    problem: FitProblem
    u: Floats  # (unknowns,) scaled unknowns
    heights_m: Floats  # (heights,) most probable floor heights
    noise: Noise
    evaluation: Evaluation
    data: Linearised
    predicted: Prediction  # walk over even ground, from the most probable start
    why: str = ""  # reason why it did not converge; empty if it did

    @property
    def forecast(self) -> Forecast:
        return self.problem.forecast

    @cached_property
    def products(self) -> Products:
        return products_of(self.data)

    @property
    def residuals(self) -> Floats:
        """Measured minus predicted values (values,) over the most probable floor."""
        return np.asarray(self.data.residuals - self.data.G @ self.heights_m)


def fit(problem: FitProblem, start: Floats) -> Fitted | str:
    """Fit the unknowns from a start (unknowns,); return the reason if no walk near the start can be predicted.

    Each round fits the unknowns by least squares on whitened residuals, then the standard deviations.
    """
    forecast, u = problem.forecast, start.copy()
    size, even = typical_sizes(forecast), np.zeros(forecast.heights)
    noise, heights, why = Noise(FIRST_NOISE * size, 0.0), even, "standard deviations still change"
    data = linearise(problem, u, heights)
    if data is None:
        return NO_NEIGHBOURS
    for _ in range(MAX_ROUNDS):
        before, u = u, least_squares_fit(problem, u, start, heights, data, noise)
        data = None if forecast.predict(u, even) is None else linearise(problem, u, heights)
        if data is None:
            # The data pull the walker out of its basin of attraction: judge the last walk that did not end early.
            u, why = before, NO_NEIGHBOURS
            data = linearise(problem, u, heights)
        if data is None:
            return NO_NEIGHBOURS
        products, earlier = products_of(data), noise
        noise = estimate_noise(products, NOISE_FLOOR * size, problem.leg_length_m, noise)
        evaluation = evaluate(products, noise)
        heights = passable(problem, u, evaluation.heights_m)
        if why == NO_NEIGHBOURS:
            break
        errors = np.sqrt(np.maximum(np.diag(np.linalg.pinv(evaluation.information, hermitian=True)), 1e-300))
        moved = float(np.max(np.abs(u - before) / errors))
        if settled(earlier, noise, problem.leg_length_m) and moved < SETTLED_MOVE:
            why = ""
            break
    data = linearise(problem, u, heights, exact=True) or linearise(problem, u, heights)
    predicted = forecast.predict(u, even)
    if data is None or predicted is None:
        return NO_NEIGHBOURS
    return Fitted(problem, u, heights, noise, evaluate(products_of(data), noise), data, predicted, why)


def evaluate_at(u: Floats, like: Fitted) -> Fitted | None:
    """Estimate the standard deviations at u (unknowns,), starting from another fit; None if a walk ends early."""
    problem, even = like.problem, np.zeros(like.forecast.heights)
    data, predicted = linearise(problem, u, even), problem.forecast.predict(u, even)
    if data is None or predicted is None:
        return None
    products = products_of(data)
    noise = estimate_noise(products, NOISE_FLOOR * data.sizes, problem.leg_length_m, like.noise)
    evaluation = evaluate(products, noise)
    return replace(
        like, u=u, heights_m=evaluation.heights_m, noise=noise, evaluation=evaluation, data=data, predicted=predicted
    )


def passable(problem: FitProblem, u: Floats, heights: Floats) -> Floats:
    """Return the heights, reduced if the walk over them ends early."""
    shares = (share for share in HEIGHT_SHARES if problem.forecast.predict(u, share * heights) is not None)
    return next(shares, 0.0) * heights


def settled(before: Noise, after: Noise, leg_length_m: float) -> bool:
    same = np.all(np.abs(np.log(after.measurement / before.measurement)) < SETTLED_NOISE)
    change = abs(after.roughness_m - before.roughness_m)
    return bool(same) and change < SETTLED_NOISE * max(after.roughness_m, 1e-7 * leg_length_m)


def typical_sizes(forecast: Forecast) -> Floats:
    """Return the r.m.s. value (quantities,) of each quantity as its typical size."""
    values, quantity = forecast.values, forecast.quantity
    return np.array([np.sqrt(np.mean(values[quantity == q] ** 2)) for q in range(len(forecast.quantities))])


def linearise(problem: FitProblem, u: Floats, heights: Floats, exact: bool = False) -> Linearised | None:
    forecast = problem.forecast
    prediction = forecast.predict(u, heights)
    derivatives = forecast.differentiate(u, heights, np.eye(heights.size), exact)
    if prediction is None or derivatives is None:
        return None
    J, G = derivatives
    residuals = forecast.values - prediction.values + G @ heights
    return Linearised(residuals, J, G, forecast.quantity, problem.prior_rows(u), typical_sizes(forecast))


def least_squares_fit(
    problem: FitProblem, u: Floats, start: Floats, heights: Floats, data: Linearised, noise: Noise
) -> Floats:
    """Minimise the whitened residuals over the unknowns, reusing the derivatives in `data` near u."""
    from scipy.optimize import least_squares  # takes a third of a second, only needed here

    forecast, low_high = problem.forecast, problem.limits()
    inside = np.clip(u, low_high[0] + INSIDE, low_high[1] - INSIDE)
    whiten, known = whitening(data.G, forecast.quantity, noise), (inside, data.J)
    offset = forecast.values + data.G @ heights

    def residuals(x: Floats) -> Floats:
        prediction = forecast.predict(x, heights)
        own = np.full(offset.size, NO_WALK) if prediction is None else whiten(offset - prediction.values)
        return np.concatenate((own, problem.prior_rows(x)[:, 0], (start - x) / WEAK_PRIOR))

    def jacobian(x: Floats) -> Floats:
        nonlocal known
        if np.abs(x - known[0]).max() > SAME_DERIVATIVES:
            derivatives = forecast.differentiate(x, heights, np.zeros((heights.size, 0)), exact=False)
            known = x.copy(), np.zeros((offset.size, x.size)) if derivatives is None else derivatives[0]
        own = -whiten(known[1])
        return np.vstack((own, -problem.prior_rows(x)[:, 1:], -np.eye(x.size) / WEAK_PRIOR))

    settings = {"loss": problem.loss, "max_nfev": EVALUATIONS, "xtol": SETTLED_FIT, "ftol": SETTLED_FIT}
    result = least_squares(residuals, inside, jacobian, low_high, **settings)
    return np.asarray(result.x)
