"""Linear model of a disturbed walk: whitening, restricted likelihood of its standard deviations, and information.

The walk is disturbed by floor heights and by kicks that change the rates at heel strikes, its measurement by noise.
The values of each quantity are first reduced to as many rows as there are derivatives, so the cost of a likelihood does
not depend on the number of samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.solvers.system import Floats

NOISE_FACTORS: Final = (1e-3, 1e-2, 0.1, 1.0, 10.0)
DISTURBANCES: Final = (1e-5, 1e-4, 1e-3, 1e-2)
"""Starts of the search: measurement noises as multiples of the current one, roughness as fractions of the leg length,
and kicks as fractions of the rates.
"""
# bounds on roughness and kicks, as fractions of the same quantities
DISTURBANCE_BOUNDS: Final = (1e-8, 0.2)
# fraction below which a disturbance cannot be distinguished from none
NEGLIGIBLE_DISTURBANCE: Final = 1e-5
NOISE_RATIO: Final = 1.0
"""Prior standard deviation of the logarithms of the relative noises of the quantities.

Without this prior, the floor could explain one quantity of a short walk exactly, with a noise of zero. A single
quantity has no ratio. The prior density of its noise is then proportional to the noise, which keeps the estimate about
one standard error away from zero if noise and floor cannot be separated.

Source: Chung et al., A nondegenerate penalized likelihood estimator for variance parameters in multilevel models,
Psychometrika 78 (2013).
"""
NOISE_SEARCH: Final = {"ftol": 1e-7, "gtol": 1e-2}
"""The search ends when the likelihood changes by less than `ftol` (relative), or when its slope is below `gtol`."""
# maximum number of entries in the matrices of the noise levels that are evaluated together, which limits the memory
MAX_MATRIX_ENTRIES: Final = 4_000_000
ROUNDING: Final = 1e-14  # relative rounding error of a covariance
MIN_GAINS: Final = (1e-6, 0.5)
"""A disturbance model is kept only if it raises the log-likelihood by more than this. The first value is for heights
alone, the second for models with kicks.
"""
# eigenvalues of the scaled information are rounding errors if they are below this fraction of the largest
LOST_INFORMATION: Final = 1e-13


class Noise(NamedTuple):
    """Standard deviations of the measurement by quantity, of the floor's heights (m), and of kicks."""

    measurement: Floats  # (quantities,)
    roughness_m: Any  # a float, or an array (...,) for several sets of standard deviations
    kick: Any = 0.0  # as a fraction of the rates, a float or an array like `roughness_m`

    @property
    def process(self) -> Floats:
        """Standard deviations (..., 2) of heights and kicks."""
        return np.stack(np.broadcast_arrays(self.roughness_m, self.kick), axis=-1)

    def spread(self, disturbances: int, kicks: int) -> Floats:
        """Return the standard deviation of each disturbance (disturbances,): heights first, then `kicks` kicks."""
        return np.repeat(self.process, (disturbances - kicks, kicks))


@dataclass(frozen=True, eq=False)
class Linearised:
    """Measured minus predicted values of a walk, and derivatives of the predicted values."""

    residuals: Floats  # (values,) differences from the walk over even ground without kicks
    J: Floats  # (values, unknowns) derivatives with respect to the scaled unknowns
    G: Floats  # (values, heights + kicks) derivatives with respect to the heights, 1/m, and to kicks
    quantity: NDArray[np.int64]  # (values,) index of the quantity of each value
    prior: Floats  # (priors, 1 + unknowns) whitened residuals and derivatives of priors
    sizes: Floats  # (quantities,) typical size of each quantity
    # (values,) parts of the measured values that a robust loss has cut off from the residuals
    trimmed: Floats | float = 0.0
    kicks: int = 0  # number of kicks

    def spread(self, noise: Noise) -> Floats:
        """Return the standard deviations (heights + kicks,) of the disturbances."""
        return noise.spread(self.G.shape[1], self.kicks)


class Evaluation(NamedTuple):
    """Likelihoods and the most likely unknowns. For several sets of standard deviations, all arrays have
    leading axes.
    """

    restricted: Any  # log-likelihood of the standard deviations with their prior, from the data alone
    likelihood: Any  # log-likelihood of the data
    information: Floats  # (unknowns, unknowns)
    move: Floats  # (unknowns,) step to the most likely unknowns
    squares: Any  # sum of squares of whitened residuals


class Reduced(NamedTuple):
    """Values of a walk, reduced to rows with the same sums of squares and products."""

    fixed: Floats  # (rows, 1 + unknowns) residuals, and derivatives with respect to the unknowns
    G: Floats  # (rows, heights + kicks)
    # (2, rows, rows) covariances of the rows due to heights of unit variance, and due to kicks of unit variance
    covariance: Floats
    quantity: NDArray[np.int64]  # (rows,)
    counts: NDArray[np.int64]  # (quantities,) number of values
    prior: Floats  # (1 + unknowns, 1 + unknowns)
    priors: int
    sizes: Floats  # (quantities,) typical size of each quantity
    kicks: int

    @property
    def unknowns(self) -> int:
        return int(self.fixed.shape[1]) - 1

    def disturbance_sets(self) -> tuple[tuple[int, ...], ...]:
        """Return the possible disturbances, beginning with the simplest: none, heights (0), kicks (1), or both."""
        return ((), (0,), (1,), (0, 1)) if self.kicks else ((), (0,))


def reduce(data: Linearised) -> Reduced:
    # In this order of columns, the triangular factors separate what only noise can explain from what disturbances can.
    columns = np.column_stack((data.G, data.J, data.residuals))
    parts = [columns[data.quantity == q] for q in range(data.sizes.size)]
    rows = [part if len(part) <= part.shape[1] else np.linalg.qr(part, mode="r") for part in parts]
    whole = np.concatenate(rows)
    disturbances = data.G.shape[1]
    G = whole[:, :disturbances]
    heights = disturbances - data.kicks
    return Reduced(
        fixed=np.column_stack((whole[:, -1], whole[:, disturbances:-1])),
        G=G,
        covariance=np.array([part @ part.T for part in (G[:, :heights], G[:, heights:])]),
        quantity=np.repeat(np.arange(data.sizes.size), [len(part) for part in rows]),
        counts=np.array([len(part) for part in parts]),
        prior=data.prior.T @ data.prior,
        priors=len(data.prior),
        sizes=data.sizes,
        kicks=data.kicks,
    )


def evaluate(rows: Reduced, noise: Noise) -> Evaluation:
    """Evaluate the likelihoods for one or more noise levels. `noise.measurement` has shape (..., quantities)."""
    deviations = np.asarray(noise.measurement)
    process = noise.process
    fixed = 1 + rows.unknowns
    count = len(rows.fixed)
    sets = np.broadcast_shapes(deviations.shape[:-1], process.shape[:-1])
    if sets and sets[0] > 1 and sets[0] * (count + fixed) ** 2 > MAX_MATRIX_ENTRIES:
        both = [np.broadcast_to(each, (*sets, each.shape[-1])) for each in (deviations, process)]
        pairs = zip(*map(np.array_split, both, (2, 2)), strict=True)
        halves = (evaluate(rows, Noise(measured, *disturbances.T)) for measured, disturbances in pairs)
        return Evaluation(*map(np.concatenate, zip(*halves, strict=True)))
    scaled = rows.fixed / deviations[..., rows.quantity][..., None]
    # The Cholesky factor of [[V, F], [F^T, F^T F + large]], with V the covariance of the rows in units of their noise
    # and F the fixed part, holds the determinant of V and V^-1/2 F.
    joint = np.empty((*sets, count + fixed, count + fixed))
    joint[..., :count, :count] = covariance_in_noise(rows, noise)
    joint[..., count:, :count] = np.swapaxes(scaled, -1, -2)
    squares = np.swapaxes(scaled, -1, -2) @ scaled
    # `large` only keeps the lower right block positive definite. That part of the factor is not used.
    large = 1.0 + np.trace(squares, axis1=-2, axis2=-1)
    joint[..., count:, count:] = squares + large[..., None, None] * np.eye(fixed)
    factor = np.linalg.cholesky(joint)
    white = factor[..., count:, :count]
    diagonal = np.diagonal(factor, axis1=-2, axis2=-1)[..., :count]
    # A reduced row stands for several values, each of which contributes the logarithm of its noise.
    log_determinant = 2.0 * (np.log(deviations) @ rows.counts + np.log(diagonal).sum(axis=-1))
    by_data = white @ white.swapaxes(-1, -2)
    # Leave out the priors, because a prior that contradicts the data says nothing about the noise.
    _, _, squares, log_information = most_likely(by_data)
    restricted = prior_of_noise(rows, deviations)[0] - 0.5 * (log_determinant + squares + log_information)
    whole = by_data + rows.prior
    _, move, squares, _ = most_likely(whole)
    values = int(rows.counts.sum()) + rows.priors
    likelihood = -0.5 * (log_determinant + squares + values * math.log(2.0 * math.pi))
    return Evaluation(restricted, likelihood, whole[..., 1:, 1:], move, squares)


def prior_of_noise(rows: Reduced, deviations: Floats) -> tuple[Any, Floats]:
    """Return the log prior density (...,) of noise levels, and its derivatives with respect to their logarithms.

    deviations  (..., quantities) standard deviations of the measurement
    """
    relative = np.log(deviations / rows.sizes)
    alone = rows.sizes.size == 1
    centred = relative - relative.mean(axis=-1, keepdims=True)
    density = -0.5 * np.mean(centred**2, axis=-1) / NOISE_RATIO**2
    return density + alone * relative[..., 0], alone - centred / (rows.sizes.size * NOISE_RATIO**2)


def restricted_likelihood_and_slope(rows: Reduced, noise: Noise) -> tuple[float, Floats]:
    """Return the restricted log-likelihood of one noise level, and its slope (quantities + 2,).

    The slope is with respect to the logarithms of the standard deviations.

    Source: Lindstrom and Bates, J. Am. Stat. Assoc. 83 (1988), with P = V^-1 - V^-1 J (J^T V^-1 J)^-1 J^T V^-1.
    """
    scale = 1.0 / noise.measurement[rows.quantity]
    quantities = np.eye(rows.sizes.size)[rows.quantity]
    V = covariance_in_noise(rows, noise)
    fixed = rows.fixed * scale[:, None]
    inverse = np.linalg.inv(V)
    solved = inverse @ fixed
    covariance, move, squares, log_information = most_likely(fixed.T @ solved)
    left = solved @ np.append(1.0, -move)
    P = inverse - solved[:, 1:] @ covariance @ solved[:, 1:].T
    unexplained = P - np.outer(left, left)
    density, slope = prior_of_noise(rows, noise.measurement)
    log_determinant = 2.0 * np.log(noise.measurement) @ rows.counts + np.linalg.slogdet(V)[1]
    by_noise = slope - np.diag(unexplained) @ quantities - (rows.counts - quantities.sum(axis=0))
    scaled = unexplained * scale * scale[:, None]
    by_process = -(noise.process**2) * np.einsum("ij,sij->s", scaled, rows.covariance)
    restricted = density - 0.5 * (log_determinant + squares + log_information)
    return float(restricted), np.append(by_noise, by_process)


def covariance_in_noise(rows: Reduced, noise: Noise) -> Floats:
    """Return the covariance (..., rows, rows) of the rows in units of their measurement noise."""
    scale = 1.0 / np.asarray(noise.measurement)[..., rows.quantity]
    disturbed = np.einsum("...s,sij->...ij", noise.process**2, rows.covariance)
    covariance = disturbed * scale[..., None, :] * scale[..., :, None]
    # Add rounding errors to the noise. Otherwise large disturbances would hide the noise, and the matrix would be
    # singular.
    rounding = ROUNDING * np.trace(covariance, axis1=-2, axis2=-1)[..., None]
    np.einsum("...ii->...i", covariance)[...] += 1.0 + rounding
    return np.asarray(covariance)


def most_likely(reduced: Floats) -> tuple[Floats, Floats, Any, Any]:
    """Return the covariance, most likely change of the unknowns, sum of squares after this change, and log-determinant.

    reduced  (..., 1 + unknowns, 1 + unknowns) products of whitened residuals and derivatives

    The log-determinant is that of the information, from eigenvalues that exceed rounding errors.
    """
    score = reduced[..., 1:, 0]
    values, vectors = np.linalg.eigh(reduced[..., 1:, 1:])
    kept = values > LOST_INFORMATION * values.max(axis=-1, initial=0.0)[..., None]
    sizes = np.where(kept, values, 1.0)
    # The products are taken in this order because the covariance itself may be large and accurate to only a few digits.
    parts = np.einsum("...ij,...i->...j", vectors, score) * kept / sizes
    move = np.einsum("...ij,...j->...i", vectors, parts)
    covariance = (vectors * (kept / sizes)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    squares = reduced[..., 0, 0] - np.einsum("...i,...i->...", score, move)
    return covariance, move, squares, np.log(sizes).sum(axis=-1)


def most_probable_disturbances(rows: Reduced, noise: Noise, move: Floats) -> Floats:
    """Return the most probable heights (m) and kicks (heights + kicks,) after the unknowns change by `move`."""
    scale = 1.0 / noise.measurement[rows.quantity]
    left = scale * (rows.fixed @ np.append(1.0, -move))
    spread = noise.spread(rows.G.shape[1], rows.kicks)
    return np.asarray(spread**2 * (rows.G.T @ (scale * np.linalg.solve(covariance_in_noise(rows, noise), left))))


def estimate_noise(
    rows: Reduced, floors: Floats, leg_length_m: float, start: Noise, earlier: Sequence[Noise] = ()
) -> tuple[Noise, tuple[Noise, ...]]:
    """Maximise the restricted likelihood over standard deviations above `floors`.

    Returns the noise for the chosen set of disturbances, and the likeliest noise for each set. Fewer disturbances are a
    simpler explanation, so a larger set is chosen only if it raises the likelihood.

    earlier  likeliest noises for nearly the same rows; searches start from them if they are likelier than other starts
    """
    best = start
    best_likelihood = -math.inf
    noises = []
    units = np.array((leg_length_m, 1.0))
    widest = np.maximum(rows.sizes, 2.0 * floors)
    middle = np.maximum(start.measurement, 2.0 * floors)
    measured = np.log([np.clip(factor * middle, floors, widest) for factor in NOISE_FACTORS])
    levels = np.log(DISTURBANCES)
    logs: dict[tuple[int, ...], Floats] = {}
    for sources, known in zip_longest(rows.disturbance_sets(), earlier):
        starts = [np.append(row, level) for row in measured for level in levels] if sources else [np.log(middle)]
        if len(sources) == 2:
            # Start where one disturbance alone explains the walk best, and add the other one.
            starts = [np.insert(logs[(0,)], middle.size + 1, level) for level in levels]
            starts += [np.insert(logs[(1,)], middle.size, level) for level in levels]
        for before in filter(None, (start, known)):
            shares = (before.process / units)[list(sources)]
            if sources and shares.min() > NEGLIGIBLE_DISTURBANCE:
                starts.append(np.log(np.append(np.clip(before.measurement, floors, widest), shares)))
        ends = zip((floors, widest), DISTURBANCE_BOUNDS, strict=True)
        bounds = np.log([np.append(noise, [bound] * len(sources)) for noise, bound in ends]).T
        logs[sources], likelihood = climb(rows, starts, bounds, sources, leg_length_m)
        measurement, roughness, kick = noise_at(logs[sources], sources, leg_length_m)
        noises.append(Noise(measurement, float(roughness), float(kick)))
        if likelihood > best_likelihood + MIN_GAINS[bool(kick)]:
            best = noises[-1]
            best_likelihood = likelihood
    return best, tuple(noises)


def climb(
    rows: Reduced, starts: Sequence[Floats], bounds: Floats, sources: tuple[int, ...], leg_length_m: float
) -> tuple[Floats, float]:
    """Maximise the restricted likelihood over the logarithms of the standard deviations (see `noise_at`).

    The search starts from the likeliest of `starts`. Returns the logarithms at the maximum and the likelihood there.
    """
    from scipy.optimize import minimize

    free = [*range(rows.sizes.size), *(rows.sizes.size + source for source in sources)]

    def costs(logs: Floats) -> tuple[float, Floats]:
        restricted, slope = restricted_likelihood_and_slope(rows, noise_at(logs, sources, leg_length_m))
        return -restricted, -slope[free]

    likelihoods = evaluate(rows, noise_at(np.array(starts), sources, leg_length_m)).restricted
    start = starts[int(np.argmax(likelihoods))]
    result = minimize(costs, start, method="L-BFGS-B", jac=True, bounds=bounds, options=NOISE_SEARCH)
    return result.x, float(-result.fun)


def noise_at(logs: Floats, sources: tuple[int, ...], leg_length_m: float = 1.0) -> Noise:
    """Return the standard deviations from their logarithms (..., quantities + sources). Other disturbances are zero.

    leg_length_m  unit (m) of the standard deviation of the heights
    """
    deviations = np.exp(logs)
    count = logs.shape[-1] - len(sources)
    process = np.zeros((*logs.shape[:-1], 2))
    process[..., list(sources)] = deviations[..., count:]
    return Noise(deviations[..., :count], leg_length_m * process[..., 0], process[..., 1])


def whitening(data: Linearised, noise: Noise) -> Callable[[Floats], Floats]:
    """Return a function that whitens values (values,) of a walk with this noise, or columns (values, n) of values.

    If values have the covariance G D^2 G^T + noise^2, where D is the spread of the disturbances, whitening makes them
    independent with unit variance.
    """
    scale = 1.0 / noise.measurement[data.quantity]
    U, s, _ = np.linalg.svd(data.G * data.spread(noise) * scale[:, None], full_matrices=False)
    # (1 + U s^2 U^T)^(-1/2) = 1 - U (1 - 1 / sqrt(1 + s^2)) U^T
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + s**2)

    def whiten(values: Floats) -> Floats:
        scaled = (values.T * scale).T
        return np.asarray(scaled - U @ (shrink * (U.T @ scaled).T).T)

    return whiten
