"""Information about parameters in a measured walk: errors, correlations, and undetermined combinations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.physics.estimation.fit import Fitted
from walkerlab.physics.estimation.mixed_model import (
    LOST_INFORMATION,
    Evaluation,
    Noise,
    evaluate,
    noise_at,
    whitening,
)
from walkerlab.physics.estimation.result import Information, Unidentifiable
from walkerlab.physics.solvers.system import Floats

OPEN: Final = 1.0
"""A parameter combination with a singular value below this is undetermined, because even a change as large as its
scale is lost in the noise.
"""
# A combination whose singular value is below this fraction of the largest one counts as having no effect at all.
LOST_SHARE: Final = 1e-7
NOISE_DRAWS: Final = 200
NOISE_LOG_STEP: Final = 0.05
# The noise is examined at most this far below and above its most likely value, in the logarithm of its standard
# deviation.
FARTHEST_NOISE: Final = (3.0, 1.5)
# A parameter is named if its component in an undetermined direction is at least this large, or if the direction moves
# it by more than its standard error.
LOADED: Final = 0.1


def information_on(fitted: Fitted, keys: tuple[str, ...]) -> Information:
    """Return the information that a fit gives about its parameters."""
    values_count = fitted.data.residuals.size + len(fitted.data.prior)
    scales = fitted.forecast.scales
    plain = information_from(fitted.evaluation.information, keys, scales, values_count)
    basis = plain.directions[~is_open(plain.singular_values)]
    likeliest = basis @ (plain.covariance / np.outer(scales, scales)) @ basis.T
    freedom = effective_freedom(fitted, plain.freedom, likeliest, basis)
    result = replace(plain, freedom=freedom, contributions=contributions(fitted, basis))
    groups = fitted.forecast.half_steps
    if not groups.size:
        # A short walk hardly shows whether the floor or kicks disturbed it, and the two affect the estimates
        # differently.
        average = average_covariance(fitted, likely_noises(fitted), basis)
        root = np.linalg.cholesky(likeliest)
        inverse = np.linalg.inv(root)
        return replace(result, **scale_covariance(widen(basis.T @ root, inverse @ average @ inverse.T), scales))
    determined = np.eye(fitted.u.size)
    determined[: len(keys), : len(keys)] = basis.T @ basis
    covariance = robust_covariance(fitted, determined)[: len(keys), : len(keys)]
    freedom = min(result.freedom, float(max(1, groups.max() + 1 - fitted.u.size)))
    return replace(result, freedom=freedom, **scale_covariance(covariance, scales))


def robust_covariance(fitted: Fitted, along: Floats) -> Floats:
    """Return the covariance (unknowns, unknowns) of unknowns that change only along the columns of `along`.

    along  (unknowns, n)

    Errors of successive angles may be correlated, so only those of different half steps or legs count as independent.
    The covariance is that of the sandwich estimator with jackknifed groups (CR3) in directions in which it is larger
    than the covariance of independent errors. Without angles over time, all errors are independent.

    Source: Bell and McCaffrey, Survey Methodology 28 (2002).
    """
    values, vectors = np.linalg.eigh(along.T @ fitted.evaluation.information @ along)
    kept = values > LOST_INFORMATION * values.max()
    root = along @ (vectors[:, kept] / np.sqrt(values[kept]))
    groups = fitted.forecast.half_steps
    if not groups.size:
        return np.asarray(root @ root.T)
    data = fitted.data
    whiten = whitening(data, fitted.noise)
    J = whiten(data.J @ root)
    residuals = whiten(data.residuals - data.J @ fitted.evaluation.move)
    meat = root.T @ fitted.rows.prior[1:, 1:] @ root
    count = groups.max() + 1
    for rows in (groups == group for group in range(count)):
        # The fit has adapted to the data of this group, so its residuals are too small. The matrix corrects this.
        score = np.linalg.solve(np.eye(len(meat)) - J[rows].T @ J[rows], J[rows].T @ residuals[rows])
        meat += (1.0 - 1.0 / count) * np.outer(score, score)
    return widen(root, meat)


def widen(root: Floats, meat: Floats) -> Floats:
    """Return the covariance `root @ meat @ root.T`, or `root @ root.T` in directions in which that is larger."""
    values, vectors = np.linalg.eigh(meat)
    root = root @ (vectors * np.sqrt(np.maximum(values, 1.0)))
    return np.asarray(root @ root.T)


def scale_covariance(covariance: Floats, scales: Floats) -> dict[str, Any]:
    """Convert the covariance of scaled parameters to that of the unscaled ones. Also return their correlations."""
    errors = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return {"covariance": covariance * np.outer(scales, scales), "correlations": covariance / np.outer(errors, errors)}


def information_from(whole: Floats, keys: tuple[str, ...], scales: Floats, values: int) -> Information:
    """Reduce the information matrix `whole` (unknowns, unknowns) to that of the parameters, which come first.

    The other unknowns are estimated as well, and noise levels count as known.

    values  number of measured values
    """
    reduced = marginalise(whole, len(keys))
    sizes, vectors = np.linalg.eigh(reduced)
    order = np.argsort(sizes)[::-1]
    singular = np.sqrt(np.maximum(sizes[order], 0.0))
    directions = vectors[:, order].T
    basis = directions[~is_open(singular)]
    covariance = basis.T @ np.linalg.pinv(basis @ reduced @ basis.T, hermitian=True) @ basis
    freedom = float(max(1, values - len(whole)))
    return Information(
        keys, singular, directions, scales=scales, freedom=freedom, **scale_covariance(covariance, scales)
    )


def effective_freedom(fitted: Fitted, largest: float, likeliest: Floats, basis: Floats) -> float:
    """Return the Satterthwaite degrees of freedom of Student's t for errors along the directions `basis`.

    largest    degrees of freedom if the standard deviations were known
    likeliest  covariance along the directions at the most likely standard deviations

    A short walk determines the standard deviations of the floor and of the measurements poorly. Averaged over their
    plausible values, the covariance is nu / (nu - 2) times as large as at the most likely values, for nu degrees of
    freedom.
    """
    if not len(basis):
        return largest
    ratio = float(np.trace(np.linalg.solve(likeliest, average_over_plausible_noise(fitted, basis)))) / len(basis)
    # ratio = nu / (nu - 2), solved for nu
    return min(largest, 2.0 * ratio / (ratio - 1.0)) if ratio > 1.0 else largest


def average_over_plausible_noise(fitted: Fitted, basis: Floats) -> Floats:
    """Average the covariance along directions `basis` (directions, parameters) over plausible standard deviations."""
    # The weights are the restricted likelihood with a flat prior on the logarithm of each standard deviation.
    noise = fitted.noise
    sources = tuple(np.flatnonzero(noise.process).tolist())
    centre = np.log(np.append(noise.measurement, noise.process[list(sources)]))

    def evaluate_at(logs: Floats) -> Evaluation:
        return evaluate(fitted.rows, noise_at(logs, sources))

    # The seed is fixed, so that the same walk always gives the same error.
    draws = np.random.default_rng(0).uniform(-1.0, 1.0, (NOISE_DRAWS, centre.size))
    logs = centre + np.where(draws < 0.0, *(draws * reach for reach in plausible_noise_range(evaluate_at, centre)))
    return average_covariance(fitted, noise_at(logs, sources), basis)


def likely_noises(fitted: Fitted) -> Noise:
    """Return the likeliest noise for each set of disturbances (none, one kind, both kinds), stacked in one `Noise`."""
    return Noise(*map(np.array, zip(*fitted.noises, strict=True)))


def average_covariance(fitted: Fitted, noises: Noise, basis: Floats) -> Floats:
    """Average the covariance along directions `basis` over noises (n,), weighted by their likelihoods.

    basis  (directions, parameters)
    """
    count = basis.shape[1]
    drawn = evaluate(fitted.rows, noises)
    inverses = np.linalg.pinv(basis @ marginalise(drawn.information, count) @ basis.T, hermitian=True)
    moved = (drawn.move - fitted.evaluation.move)[:, :count] @ basis.T
    # The estimate itself depends on the standard deviations, so add the variance of the estimates (law of total
    # variance).
    covariances = inverses + moved[:, :, None] * moved[:, None, :]
    weights = np.exp(drawn.restricted - drawn.restricted.max())
    return np.asarray(np.tensordot(weights / weights.sum(), covariances, 1))


def plausible_noise_range(evaluate_at: Callable[[Floats], Evaluation], centre: Floats) -> tuple[Floats, Floats]:
    """Return how far below and above `centre` the logarithms of the standard deviations plausibly lie.

    All have shape (deviations,).
    """
    moves = NOISE_LOG_STEP * np.vstack((np.zeros(centre.size), np.eye(centre.size), -np.eye(centre.size)))
    likelihoods = evaluate_at(centre + moves).restricted
    above = likelihoods[1 : 1 + centre.size]
    below = likelihoods[1 + centre.size :]
    curvatures = (2.0 * likelihoods[0] - above - below) / NOISE_LOG_STEP**2
    # Three standard deviations of a normal distribution with this curvature.
    spread = 3.0 / np.sqrt(np.maximum(curvatures, 1e-6))
    return np.minimum(spread, FARTHEST_NOISE[0]), np.minimum(spread, FARTHEST_NOISE[1])


def marginalise(information: Floats, count: int) -> Floats:
    """Return the information (..., count, count) on the first unknowns if the others are free (Schur complement)."""
    kept = information[..., :count, :count]
    cross = information[..., :count, count:]
    rest = information[..., count:, count:]
    return np.asarray(kept - cross @ np.linalg.pinv(rest, hermitian=True) @ cross.swapaxes(-1, -2))


def is_open(singular: Floats) -> NDArray[np.bool_]:
    return np.asarray((singular < OPEN) | (singular < LOST_SHARE * singular.max(initial=0.0)))


def open_combinations(information: Information) -> tuple[tuple[Unidentifiable, ...], set[str]]:
    """Describe the parameter combinations that the walk does not determine, and return the parameters in them."""
    named = []
    keys = set[str]()
    largest = information.singular_values.max(initial=0.0)
    errors = np.sqrt(np.diag(information.covariance))
    for value, direction in zip(information.singular_values, information.directions, strict=True):
        if not is_open(np.array([value, largest]))[0]:
            continue
        order = np.argsort(-np.abs(direction))
        # The sign of a singular vector is arbitrary, so make the largest component positive.
        signed = direction * np.sign(direction[order[0]])
        moved = (np.abs(direction) * information.scales > errors) & (errors > 0.0)
        parts = [(information.keys[k], float(signed[k])) for k in order if moved[k] or abs(signed[k]) >= LOADED]
        keys |= {key for key, _ in parts}
        named.append(Unidentifiable(describe_combination(parts), describe_reason(value, largest)))
    return tuple(named), keys


def describe_combination(parts: list[tuple[str, float]]) -> str:
    """Describe which parameters change together, and each change as a fraction of the scale of its parameter."""
    if len(parts) == 1:
        return parts[0][0]
    up = [f"{key} ({share:.2g})" for key, share in parts if share > 0.0]
    down = [f"{key} ({-share:.2g})" for key, share in parts if share < 0.0]
    return " and ".join(up) + (f" up, {' and '.join(down)} down" if down else " together")


def describe_reason(value: float, largest: float) -> str:
    if value <= LOST_SHARE * largest:
        return "the walk does not change with this combination"
    return f"even a 100 % change moves the walk by only {value:.2g} standard deviations of the data"


def contributions(fitted: Fitted, basis: Floats) -> dict[str, float]:
    """Return for each quantity the fraction of information along `basis` (directions, parameters) that is lost without
    it.
    """
    count = basis.shape[1]
    quantities = fitted.forecast.quantities
    if not len(basis):
        return dict.fromkeys(quantities, 0.0)
    whole = np.diag(basis @ marginalise(fitted.evaluation.information, count) @ basis.T)
    losses = []
    for index in range(len(quantities)):
        noise = fitted.noise.measurement.copy()
        # With so much noise, the quantity contributes nothing.
        noise[index] *= 1e6
        without = evaluate(fitted.rows, fitted.noise._replace(measurement=noise)).information
        remaining = np.diag(basis @ marginalise(without, count) @ basis.T)
        losses.append(float(np.mean(1.0 - np.clip(remaining / whole, 0.0, 1.0))))
    return dict(zip(quantities, losses, strict=True))
