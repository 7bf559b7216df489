"""Fit of the most likely parameters, start and noise to a measured walk."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.estimation import mixed_model
from walkerlab.physics.estimation.mixed_model import Evaluation, Linearised, Noise, Reduced, evaluate, reduce
from walkerlab.physics.estimation.prediction import Forecast, Prediction
from walkerlab.physics.solvers.system import Floats

Loss = Literal["linear", "soft_l1"]
MAX_ROUNDS: Final = 25
# From this round on, heights are averaged with those of the previous round, and the noise changes only if the
# likelihood rises by at least MIN_LIKELIHOOD_GAIN. Otherwise two estimates could lead to each other forever.
FREE_ROUNDS: Final = 10
MIN_LIKELIHOOD_GAIN: Final = 3.0
# A standard deviation has converged when it changes by less than this (relative), or when the restricted
# log-likelihood rises by less than LIKELIHOOD_TOLERANCE.
NOISE_TOLERANCE: Final = 1e-2
LIKELIHOOD_TOLERANCE: Final = 1e-2
# largest change of a converged unknown, in standard errors
MOVE_TOLERANCE: Final = 0.1
FIRST_NOISE: Final = 0.02  # noise before the first fit, as a fraction of a quantity's typical size
# smallest noise, as a fraction of a quantity's typical size; also used for measurements without noise
NOISE_FLOOR: Final = 1e-6
NO_WALK: Final = 1e3  # whitened residual if the walk cannot be predicted
HEIGHT_SHARES: Final = (1.0, 0.5, 0.0)
EVALUATIONS: Final = 12  # maximum number of evaluations per round
# a round ends when the cost or the unknowns change by less than this (relative)
FIT_TOLERANCE: Final = 1e-6
SAME_DERIVATIVES: Final = 1e-2  # derivatives are kept until a scaled unknown has changed by this much
BOUND_MARGIN: Final = 1e-9  # minimum distance of a scaled unknown from its bounds at the start of a round
# standard deviation of a weak prior on each scaled unknown, which keeps undetermined combinations near the start
WEAK_PRIOR: Final = 1.0
# efficiency of the soft_l1 loss for normal noise: E[psi']^2 / E[psi^2] with psi(x) = x / sqrt(1 + x^2)
SOFT_EFFICIENCY: Final = 0.9268


@dataclass(frozen=True, eq=False)
class FitProblem:
    forecast: Forecast
    leg_length_m: float
    start: tuple[float, ...]  # initial values of the parameters, in their units
    bounds: Sequence[Sequence[float]]  # (low, high) of each parameter, infinite where unbounded
    # prior knowledge: (value, standard deviation) by index of the parameter, in its unit
    priors: Mapping[int, Sequence[float]] = field(default_factory=dict)
    loss: Loss = "linear"
    max_walks: int = 10_000  # number of predicted walks after which the search ends

    @cached_property
    def floors(self) -> Floats:
        """Lower bound (quantities,) on each quantity's noise: rounding of its values, or a fraction of its size."""
        sizes = typical_sizes(self.forecast)
        resolution = self.forecast.measured.resolution
        # Rounding errors are uniformly distributed over one resolution, so this is their standard deviation.
        rounding = [resolution.get(name, 0.0) / math.sqrt(12.0) for name in self.forecast.quantities]
        return np.maximum(NOISE_FLOOR * sizes, rounding)

    def initial_unknowns(self) -> Floats:
        """Return the scaled unknowns (unknowns,) at the start."""
        u = np.zeros(self.forecast.unknowns)
        u[: self.forecast.scales.size] = np.array(self.start) / self.forecast.scales
        return u

    def limits(self) -> tuple[Floats, Floats]:
        """Return lower and upper bounds (unknowns,) of the scaled unknowns."""
        low, high = (np.full(self.forecast.unknowns, sign * np.inf) for sign in (-1.0, 1.0))
        for index, (lowest, highest) in enumerate(self.bounds):
            low[index], high[index] = np.array((lowest, highest)) / self.forecast.scales[index]
        return low, high

    def prior_rows(self, u: Floats) -> Floats:
        """Return whitened residuals and derivatives (priors, 1 + unknowns) of the priors."""
        rows = np.zeros((len(self.priors), 1 + u.size))
        for row, (index, (value, sigma)) in zip(rows, self.priors.items(), strict=True):
            scale = self.forecast.scales[index]
            row[0] = (value - u[index] * scale) / sigma
            row[1 + index] = scale / sigma
        return rows


class FitEnd(Enum):
    """How a fit ended. If it did not converge, the value states the reason, with {} for the maximum number of walks."""

    CONVERGED = ""
    STILL_CHANGES = "standard deviations still change"
    WALK_FAILS = "the predicted walk, or one with slightly changed parameters, ends before the last measured step"
    OUT_OF_WALKS = "the budget of {} predicted walks is exhausted (identify.max_walks)"


@dataclass(frozen=True, eq=False)
class Fitted:
    problem: FitProblem
    u: Floats  # (unknowns,) scaled unknowns
    disturbances: Floats  # (heights + kicks,) most probable floor heights (m) and kicks
    noise: Noise
    noises: tuple[Noise, ...]  # likeliest noise for each set of disturbances, see `Reduced.disturbance_sets`
    evaluation: Evaluation
    data: Linearised
    predicted: Prediction  # walk over even ground, from the most probable start
    end: FitEnd = FitEnd.CONVERGED

    @property
    def reason(self) -> str:
        """Reason why the fit did not converge, or '' if it did."""
        return self.end.value.format(self.problem.max_walks)

    @property
    def forecast(self) -> Forecast:
        return self.problem.forecast

    @cached_property
    def rows(self) -> Reduced:
        return reduce(self.data)

    @property
    def heights_m(self) -> Floats:
        """Most probable floor heights (heights,)."""
        return self.disturbances[: self.forecast.heights]

    @property
    def residuals(self) -> Floats:
        """Measured minus predicted values (values,) over the most probable floor, with the most probable kicks."""
        return np.asarray(self.data.residuals + self.data.trimmed - self.data.G @ self.disturbances)

    @property
    def scatter(self) -> Floats:
        """Standard deviation (quantities,) of the measurement without outliers."""
        return self.noise.measurement * (math.sqrt(SOFT_EFFICIENCY) if self.problem.loss == "soft_l1" else 1.0)


def fit(
    problem: FitProblem, start: Floats, on_round: Callable[[], None] = lambda: None, rounds: int = MAX_ROUNDS
) -> Fitted | None:
    """Fit the unknowns from a start (unknowns,), or return None if no walk near the start can be predicted.

    Each of at most `rounds` rounds fits the unknowns by least squares on whitened residuals, then the standard
    deviations.
    """
    forecast = problem.forecast
    u = start.copy()
    even = np.zeros(forecast.heights)
    heights = even
    disturbances = even
    noise = Noise(FIRST_NOISE * typical_sizes(forecast), 0.0)
    end = FitEnd.STILL_CHANGES
    data = linearise(problem, u, heights)
    if data is None:
        return None
    robust = None
    noises: tuple[Noise, ...] = ()
    for done in range(rounds):
        on_round()
        before = u
        u = least_squares_fit(problem, u, start, heights, data, noise)
        data = None if forecast.predict(u, even) is None else linearise(problem, u, disturbances, robust=robust)
        if data is None:
            # The data pull the walker out of its basin of attraction, so judge the last walk that was completed.
            u = before
            end = FitEnd.WALK_FAILS
            data = linearise(problem, u, disturbances, robust=robust)
        if data is None:
            return None
        rows = reduce(data)
        earlier = noise
        noise, noises = mixed_model.estimate_noise(rows, problem.floors, problem.leg_length_m, noise, noises)
        if done >= FREE_ROUNDS and gain_of(rows, earlier, noise) < MIN_LIKELIHOOD_GAIN:
            noise = average_noise(earlier, noise) if done == FREE_ROUNDS else earlier
        evaluation = evaluate(rows, noise)
        robust = robust_scatter(rows, noise)
        disturbances = mixed_model.most_probable_disturbances(rows, noise, evaluation.move)
        likeliest = disturbances[: heights.size]
        heights = reduce_heights(problem, u, likeliest if done < FREE_ROUNDS else 0.5 * (heights + likeliest))
        disturbances[: heights.size] = heights
        if end is FitEnd.WALK_FAILS:
            break
        errors = np.sqrt(np.maximum(np.diag(np.linalg.pinv(evaluation.information, hermitian=True)), 1e-300))
        # The next round would start with this move. It may stop at a bound.
        ahead = np.clip(u + evaluation.move, *problem.limits()) - u
        moved = min(float(np.max(np.abs(each) / errors)) for each in (u - before, ahead))
        if moved < MOVE_TOLERANCE and noise_has_converged(rows, earlier, noise, problem.leg_length_m):
            end = FitEnd.CONVERGED
            break
        if forecast.walks_taken > problem.max_walks:
            end = FitEnd.OUT_OF_WALKS
            break
    # The errors follow from these derivatives, so compute them accurately, unless a slightly changed walk ends early.
    data = linearise(problem, u, disturbances, True, robust) or linearise(problem, u, disturbances, robust=robust)
    predicted = forecast.predict(u, even)
    if data is None or predicted is None:
        return None
    return Fitted(problem, u, disturbances, noise, noises, evaluate(reduce(data), noise), data, predicted, end)


def refit(problem: FitProblem, start: Floats, like: Fitted) -> Fitted | None:
    """Fit another problem to the walk that `like` was fitted to, from a start (unknowns,).

    First the unknowns are fitted with the noise of `like`, then the standard deviations. Returns None if a walk ends
    early.
    """
    data = linearise(problem, start, like.disturbances, robust=robust_scatter(like.rows, like.noise))
    if data is None:
        return None
    u = least_squares_fit(problem, start, start, like.heights_m, data, like.noise)
    return evaluate_at(u, replace(like, problem=problem))


def evaluate_at(u: Floats, like: Fitted) -> Fitted | None:
    """Estimate the standard deviations at u (unknowns,), starting from those of the fit `like`.

    Returns None if a walk ends early.
    """
    problem = like.problem
    data = linearise(problem, u, like.disturbances, robust=robust_scatter(like.rows, like.noise))
    predicted = problem.forecast.predict(u, np.zeros(like.forecast.heights))
    if data is None or predicted is None:
        return None
    rows = reduce(data)
    noise, noises = mixed_model.estimate_noise(rows, problem.floors, problem.leg_length_m, like.noise, like.noises)
    evaluation = evaluate(rows, noise)
    disturbances = mixed_model.most_probable_disturbances(rows, noise, evaluation.move)
    return Fitted(problem, u, disturbances, noise, noises, evaluation, data, predicted, like.end)


def reduce_heights(problem: FitProblem, u: Floats, heights: Floats) -> Floats:
    """Return the heights, scaled down if the walk over the full heights ends early."""
    shares = (share for share in HEIGHT_SHARES if problem.forecast.predict(u, share * heights) is not None)
    return next(shares, 0.0) * heights


def average_noise(before: Noise, after: Noise) -> Noise:
    """Return the geometric mean of two measurement noises and the arithmetic mean of two process noises."""
    measurement = np.sqrt(before.measurement * after.measurement)
    # A disturbance may have a standard deviation of zero, and a geometric mean would then stay at zero.
    return Noise(measurement, *(0.5 * (before.process + after.process)).tolist())


def noise_has_converged(rows: Reduced, before: Noise, after: Noise, leg_length_m: float) -> bool:
    """Whether the standard deviations have stopped changing, or still change but hardly raise the likelihood."""
    same = np.all(np.abs(np.log(after.measurement / before.measurement)) < NOISE_TOLERANCE)
    change = np.abs(after.process - before.process)
    negligible = 1e-7 * np.array((leg_length_m, 1.0))
    settled = same and np.all(change < NOISE_TOLERANCE * np.maximum(after.process, negligible))
    return bool(settled) or gain_of(rows, before, after) < LIKELIHOOD_TOLERANCE


def gain_of(rows: Reduced, before: Noise, after: Noise) -> float:
    """Return how much the restricted log-likelihood rises from one noise to another."""
    return float(evaluate(rows, after).restricted - evaluate(rows, before).restricted)


def typical_sizes(forecast: Forecast) -> Floats:
    """Return the r.m.s. value (quantities,) of each quantity as its typical size."""
    groups = (forecast.values[forecast.quantity == q] for q in range(len(forecast.quantities)))
    return np.array([np.sqrt(np.mean(values**2)) for values in groups])


def linearise(
    problem: FitProblem, u: Floats, disturbances: Floats, exact: bool = False, robust: Robust | None = None
) -> Linearised | None:
    """Linearise the prediction at u (unknowns,) and the disturbances, or return None if a walk ends early.

    disturbances  heights (m), followed by the kicks if they are known. The prediction uses only the heights
    robust        scatter with which a robust loss trims the residuals, or None to leave them unchanged
    """
    forecast = problem.forecast
    heights = disturbances[: problem.forecast.heights]
    prediction = forecast.predict(u, heights)
    derivatives = forecast.differentiate(u, heights, exact)
    if prediction is None or derivatives is None:
        return None
    J, G = derivatives
    from_even = forecast.values - prediction.values + G[:, : heights.size] @ heights
    trimmed = np.zeros_like(from_even)
    if problem.loss == "soft_l1" and robust is not None:
        residuals = from_even - G[:, : disturbances.size] @ disturbances
        trimmed = residuals - compute_pseudo_residuals(residuals, forecast.quantity, robust)
    rows = problem.prior_rows(u)
    sizes = typical_sizes(forecast)
    kicks = G.shape[1] - heights.size
    return Linearised(from_even - trimmed, J, G, forecast.quantity, rows, sizes, trimmed, kicks)


def compute_pseudo_residuals(residuals: Floats, quantity: NDArray[np.int64], robust: Robust) -> Floats:
    """Return pseudo-residuals (values,). Least squares on them gives the same result as soft_l1 on the residuals.

    The derivative of the loss is psi(x) = x / sqrt(1 + x^2), where x are residuals in units of their scatter. Least
    squares on psi / mean(psi') has the fixed point and the covariance of the robust fit. Another factor corrects for
    short walks. The noise of this fit, times the square root of the efficiency of the loss, is the scatter of values
    without outliers.

    Source: Huber, Robust Statistics, Wiley (1981), sections 7.4 to 7.8.
    """
    steepness = 1.0 / np.sqrt(1.0 + (residuals / robust.scatter[quantity]) ** 2)
    counts = np.bincount(quantity)
    # With x the residual in units of the scatter, psi' is (1 + x^2)^(-3/2), the third power of the steepness.
    mean, square = (np.bincount(quantity, steepness**power) / counts for power in (3, 6))
    # Huber's correction for the share that the fit absorbs: 1 + share times var(psi') / mean(psi')^2.
    factor = (1.0 + robust.absorbed * (square / mean**2 - 1.0)) / mean
    return np.asarray(residuals * steepness * factor[quantity])


class Robust(NamedTuple):
    """Scatter of each quantity, and the share of its noise that the fit absorbs, for a robust loss."""

    scatter: Floats  # (quantities,) standard deviation of values without outliers
    absorbed: Floats  # (quantities,) share of the variance of the noise that the fitted unknowns and floor absorb


def robust_scatter(rows: Reduced, noise: Noise) -> Robust:
    spread = noise.spread(rows.G.shape[1], rows.kicks)
    unknowns = rows.unknowns
    disturbed = spread > 0.0
    columns = np.column_stack((rows.fixed[:, 1:], rows.G[:, disturbed])) / noise.measurement[rows.quantity][:, None]
    blocks = [columns[rows.quantity == q] for q in range(rows.sizes.size)]
    informations = np.array([block.T @ block for block in blocks])
    whole = informations.sum(axis=0)
    whole[:unknowns, :unknowns] += rows.prior[1:, 1:]
    whole[unknowns:, unknowns:] += np.diag(spread[disturbed] ** -2.0)
    absorbed = np.einsum("qij,ji->q", informations, np.linalg.pinv(whole, hermitian=True)) / rows.counts
    return Robust(math.sqrt(SOFT_EFFICIENCY) * noise.measurement, absorbed)


def least_squares_fit(
    problem: FitProblem, u: Floats, start: Floats, heights: Floats, data: Linearised, noise: Noise
) -> Floats:
    """Minimise the whitened residuals over the unknowns, reusing the derivatives in `data` near u."""
    from scipy.optimize import least_squares  # This import takes a third of a second and is needed only here.

    forecast = problem.forecast
    low_high = problem.limits()
    # SciPy refuses a start on a bound, but the last round may have ended there.
    inside = np.clip(u, low_high[0] + BOUND_MARGIN, low_high[1] - BOUND_MARGIN)
    whiten = mixed_model.whitening(data, noise)
    # Derivatives cost one walk per parameter, so the last ones are reused while the unknowns have hardly moved.
    known = (inside, data.J)
    offset = forecast.values - data.trimmed + data.G[:, : heights.size] @ heights

    def residuals(x: Floats) -> Floats:
        prediction = forecast.predict(x, heights)
        data_rows = np.full(offset.size, NO_WALK) if prediction is None else whiten(offset - prediction.values)
        return np.concatenate((data_rows, problem.prior_rows(x)[:, 0], (start - x) / WEAK_PRIOR))

    def jacobian(x: Floats) -> Floats:
        nonlocal known
        if np.abs(x - known[0]).max() > SAME_DERIVATIVES:
            derivatives = forecast.differentiate(x, heights, exact=False, disturbed=False)
            known = x.copy(), np.zeros((offset.size, x.size)) if derivatives is None else derivatives[0]
        data_rows = -whiten(known[1])
        return np.vstack((data_rows, -problem.prior_rows(x)[:, 1:], -np.eye(x.size) / WEAK_PRIOR))

    settings = {"max_nfev": EVALUATIONS, "xtol": FIT_TOLERANCE, "ftol": FIT_TOLERANCE}
    return np.asarray(least_squares(residuals, inside, jacobian, low_high, **settings).x)
