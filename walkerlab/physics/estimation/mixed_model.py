"""Linear model with random heights: whitening, restricted likelihood of its standard deviations, and information.

All results follow from the sums of squares and products of each quantity's residuals and derivatives, so the cost of a
likelihood does not depend on the number of samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.solvers.system import Floats

NOISE_STARTS: Final = tuple(product((1e-3, 1e-2, 0.1, 1.0, 10.0), (1e-5, 1e-4, 1e-3, 1e-2)))
"""Candidate starts of the search: factor on the measurement noise so far, roughness as a fraction of the leg length."""
ROUGHNESS_BOUNDS: Final = (1e-8, 0.2)  # fractions of the leg length
NEARLY_EVEN: Final = 1e-5  # fraction of the leg length; a smaller roughness may be no roughness
NOISE_RATIO: Final = 1.0
"""Prior standard deviation of the logarithm of the quantities' relative noises.

Without this prior, the floor could explain one quantity of a short walk exactly, with a noise of zero. A single
quantity has no ratio: there, the prior density of its noise is proportional to the noise, which keeps the estimate
about one standard error away from zero where noise and floor cannot be separated.

Source: Chung et al., A nondegenerate penalized likelihood estimator for variance parameters in multilevel models,
Psychometrika 78 (2013).
"""
MOST_NUMBERS: Final = 4_000_000  # of the matrices of all noise levels that are evaluated together
ROUNDING: Final = 1e-14  # relative rounding error of sums of products
# difference step in the logarithms of the standard deviations, for derivatives of the restricted likelihood
LOG_STEP: Final = 1e-4
# eigenvalues of scaled information below this fraction of the largest are rounding errors
LOST_INFORMATION: Final = 1e-13


class Noise(NamedTuple):
    """Standard deviations of the measurement by quantity, and of the floor's heights (m)."""

    measurement: Floats  # (quantities,)
    roughness_m: Any  # a float, or an array (...,) for several sets of standard deviations


@dataclass(frozen=True, eq=False)
class Linearised:
    """Measured minus predicted values of a walk, and derivatives of the predicted values."""

    residuals: Floats  # (values,) relative to the walk over even ground
    J: Floats  # (values, unknowns) derivatives with respect to the scaled unknowns
    G: Floats  # (values, heights) derivatives with respect to the heights, 1/m
    quantity: NDArray[np.int64]  # (values,) index of the quantity of each value
    prior: Floats  # (priors, 1 + unknowns) whitened residuals and derivatives of priors
    sizes: Floats  # (quantities,) typical size of each quantity
    trimmed: Floats | float = (
        0.0  # (values,) parts of the measured values that a robust loss leaves out of the residuals
    )


class Evaluation(NamedTuple):
    """Likelihoods and the most likely unknowns; several sets of standard deviations add leading axes."""

    restricted: Any  # log-likelihood of the standard deviations with their prior, from the data alone
    likelihood: Any  # log-likelihood of the data
    information: Floats  # (unknowns, unknowns)
    move: Floats  # (unknowns,) step to the most likely unknowns
    squares: Any  # sum of squares of whitened residuals


class Products(NamedTuple):
    """Sums of squares and products of [residual, J, G], by quantity."""

    sums: Floats  # (quantities, k, k)
    counts: NDArray[np.int64]  # (quantities,) number of values
    prior: Floats  # (1 + unknowns, 1 + unknowns)
    priors: int
    unknowns: int
    sizes: Floats  # (quantities,) typical size of each quantity


def products_of(data: Linearised) -> Products:
    columns = np.column_stack((data.residuals, data.J, data.G))
    parts = [columns[data.quantity == q] for q in range(data.sizes.size)]
    sums = np.array([part.T @ part for part in parts])
    counts = np.array([len(part) for part in parts])
    return Products(sums, counts, data.prior.T @ data.prior, len(data.prior), data.J.shape[1], data.sizes)


def evaluate(products: Products, noise: Noise) -> Evaluation:
    """Evaluate the likelihoods for one or more noise levels; `noise.measurement` has shape (..., quantities)."""
    deviations, rough = np.asarray(noise.measurement), np.asarray(noise.roughness_m)
    fixed, size = 1 + products.unknowns, products.sums.shape[-1]
    sets = np.broadcast_shapes(deviations.shape[:-1], rough.shape)
    if sets and sets[0] > 1 and sets[0] * size**2 > MOST_NUMBERS:
        both = np.broadcast_to(deviations, (*sets, deviations.shape[-1])), np.broadcast_to(rough, sets)
        halves = zip(*(np.array_split(values, 2) for values in both), strict=True)
        return Evaluation(
            *map(np.concatenate, zip(*(evaluate(products, Noise(*half)) for half in halves), strict=True))
        )
    total = np.einsum("qij,...q->...ij", products.sums, deviations**-2.0)
    # The Cholesky factor of [[K, R^T], [R, large]], with R the rows of the fixed part, holds the determinant of K and
    # R K^-1 R^T, which the heights explain.
    joint = np.empty((*sets, size, size))
    joint[..., : size - fixed, : size - fixed] = matrix_of_heights(total, rough, fixed)
    joint[..., size - fixed :, : size - fixed] = rough[..., None, None] * total[..., :fixed, fixed:]
    large = 1.0 + np.trace(total, axis1=-2, axis2=-1)
    joint[..., size - fixed :, size - fixed :] = large[..., None, None] * np.eye(fixed)
    joint[..., size - fixed :, size - fixed :] += total[..., :fixed, :fixed]
    factor = np.linalg.cholesky(joint)
    explained = factor[..., size - fixed :, : size - fixed]
    diagonal = np.diagonal(factor, axis1=-2, axis2=-1)[..., : size - fixed]
    log_determinant = 2.0 * (np.log(deviations) @ products.counts + np.log(diagonal).sum(axis=-1))
    by_data = total[..., :fixed, :fixed] - explained @ explained.swapaxes(-1, -2)
    # Without priors: a prior that contradicts the data says nothing about the noise.
    _, _, squares, log_information = most_likely(by_data)
    restricted = -0.5 * (log_determinant + squares + log_information)
    relative = np.log(deviations / products.sizes)
    if products.sizes.size == 1:
        restricted = restricted + relative[..., 0]
    restricted -= 0.5 * np.var(relative, axis=-1) / NOISE_RATIO**2
    information, move, squares, _ = most_likely(by_data + products.prior)
    count = int(products.counts.sum()) + products.priors
    likelihood = -0.5 * (log_determinant + squares + count * math.log(2.0 * math.pi))
    return Evaluation(restricted, likelihood, information, move, squares)


def matrix_of_heights(total: Floats, rough: Any, fixed: int) -> Floats:
    """Return K (..., heights, heights): the identity plus the information on heights relative to their roughness."""
    random, rho2 = total[..., fixed:, fixed:], (rough**2)[..., None, None]
    # On a very rough floor, rounding errors of the products would make K singular.
    rounding = ROUNDING * np.trace(random, axis1=-2, axis2=-1)[..., None]
    matrix = rho2 * random
    np.einsum("...ii->...i", matrix)[...] += 1.0 + rho2[..., 0] * rounding
    return np.asarray(matrix)


def most_likely(reduced: Floats) -> tuple[Floats, Floats, Any, Any]:
    """Return information, step to the most likely unknowns, sum of squares there, and the information's determinant.

    reduced  (..., 1 + unknowns, 1 + unknowns) products of residuals and derivatives, without what the heights explain

    The determinant is returned as its logarithm, over those eigenvalues that exceed rounding errors.
    """
    information, score = reduced[..., 1:, 1:], reduced[..., 1:, 0]
    values, vectors = np.linalg.eigh(information)
    kept = values > LOST_INFORMATION * values.max(axis=-1, initial=0.0)[..., None]
    sizes = np.where(kept, values, 1.0)
    parts = np.einsum("...ij,...i->...j", vectors, score) * kept / sizes
    move = np.einsum("...ij,...j->...i", vectors, parts)
    squares = reduced[..., 0, 0] - np.einsum("...i,...i->...", score, move)
    return information, move, squares, np.log(sizes).sum(axis=-1)


def most_probable_heights(products: Products, noise: Noise, move: Floats) -> Floats:
    """Return the most probable floor heights (heights,) for one noise level, at a step (unknowns,) of the unknowns."""
    total = np.einsum("qij,q->ij", products.sums, noise.measurement**-2.0)
    fixed, rough = 1 + products.unknowns, np.asarray(noise.roughness_m)
    seen = total[fixed:, :fixed] @ np.append(1.0, -move)
    return np.asarray(rough**2 * np.linalg.solve(matrix_of_heights(total, rough, fixed), seen))


def noise_at(logs: Floats, rough: bool) -> Noise:
    """Return the standard deviations from their logarithms (..., quantities); if `rough`, the roughness comes last."""
    own = np.exp(logs)
    return Noise(own[..., :-1], own[..., -1]) if rough else Noise(own, np.zeros(own.shape[:-1]))


def estimate_noise(products: Products, floors: Floats, leg_length_m: float, start: Noise) -> Noise:
    """Maximise the restricted likelihood over standard deviations above `floors`.

    The search starts from the likeliest of `start` and several rough floors, and from even ground.
    """
    from scipy.optimize import minimize

    def costs(logs: Floats, rough: bool) -> tuple[float, Floats]:
        moves = LOG_STEP * np.vstack((np.zeros(logs.size), np.eye(logs.size), -np.eye(logs.size)))
        own = -evaluate(products, noise_at(logs + moves, rough)).restricted
        return own[0], (own[1 : 1 + logs.size] - own[1 + logs.size :]) / (2.0 * LOG_STEP)

    low, high = (math.log(share * leg_length_m) for share in ROUGHNESS_BOUNDS)
    widest = np.maximum(products.sizes, 2.0 * floors)
    bounds = [*zip(np.log(floors).tolist(), np.log(widest).tolist(), strict=True), (low, high)]
    middle = np.maximum(start.measurement, 2.0 * floors)
    pairs = [np.append(np.maximum(share * middle, floors), rough * leg_length_m) for share, rough in NOISE_STARTS]
    if start.roughness_m > NEARLY_EVEN * leg_length_m:
        pairs.append(np.append(middle, start.roughness_m))
    likelihoods = evaluate(products, noise_at(np.log(pairs), True)).restricted
    best, most = start, -math.inf
    for logs in (np.log(pairs[int(np.argmax(likelihoods))]), np.log(middle)):
        rough = logs.size > middle.size
        result = minimize(costs, logs, (rough,), "L-BFGS-B", jac=True, bounds=bounds[: logs.size])
        # Even ground is the simpler explanation, so it wins unless a roughness raises the likelihood.
        if -result.fun > most or (not rough and -result.fun > most - 1e-6):
            likeliest = noise_at(result.x, rough)
            best, most = Noise(likeliest.measurement, float(likeliest.roughness_m)), float(-result.fun)
    return best


def whitening(G: Floats, quantity: NDArray[np.int64], noise: Noise) -> Callable[[Floats], Floats]:
    """Return a function that whitens values (values,), or columns (values, n), of a walk with this noise.

    It makes values of covariance G G^T roughness^2 + noise^2 independent, of unit variance.
    """
    scale = 1.0 / noise.measurement[quantity]
    U, s, _ = np.linalg.svd(noise.roughness_m * G * scale[:, None], full_matrices=False)
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + s**2)

    def whiten(values: Floats) -> Floats:
        scaled = (values.T * scale).T
        return np.asarray(scaled - U @ (shrink * (U.T @ scaled).T).T)

    return whiten
