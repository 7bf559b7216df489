"""How well a measured walk determines parameters: errors, correlations, and combinations that it leaves open."""

from __future__ import annotations

from typing import Final

import numpy as np

from walkerlab.physics.estimation.fit import Fitted
from walkerlab.physics.estimation.mixed_model import evaluate, products_of
from walkerlab.physics.estimation.result import Information, Unidentifiable
from walkerlab.physics.solvers.system import Floats

OPEN: Final = 1.0
"""Singular value below which a combination is open: a change by its whole scale stays within the data's noise."""
ROUNDING: Final = 1e-7  # share of the largest singular value, below which a combination has no effect at all
LOADED: Final = 0.1  # share of a parameter in an open direction, from which the parameter itself is open


def information_on(fitted: Fitted, keys: tuple[str, ...], scales: Floats, quantities: tuple[str, ...]) -> Information:
    """Reduce the information of a fit to its parameters; `scales` (parameters,) are their typical changes."""
    count = len(keys)
    reduced = free_the_rest(fitted.evaluation.information, count)
    values, vectors = np.linalg.eigh(reduced)
    order = np.argsort(values)[::-1]
    singular, directions = np.sqrt(np.maximum(values[order], 0.0)), vectors[:, order].T
    kept = ~is_open(singular)
    basis = directions[kept]
    covariance = basis.T @ (basis / singular[kept, None] ** 2) if kept.any() else np.zeros((count, count))
    errors = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values_count = fitted.data.residuals.size + len(fitted.data.prior)
    return Information(
        keys,
        covariance / np.outer(errors, errors),
        singular,
        directions,
        covariance * np.outer(scales, scales),
        max(1, values_count - fitted.u.size),
        contributions(fitted, quantities, count, basis),
    )


def free_the_rest(information: Floats, count: int) -> Floats:
    """Return the information on the first unknowns while the others are free (Schur complement)."""
    own, cross, rest = information[:count, :count], information[:count, count:], information[count:, count:]
    return np.asarray(own - cross @ np.linalg.pinv(rest, hermitian=True) @ cross.T)


def is_open(singular: Floats) -> Floats:
    return np.asarray((singular < OPEN) | (singular < ROUNDING * singular.max(initial=0.0)))


def open_combinations(information: Information) -> tuple[tuple[Unidentifiable, ...], set[str]]:
    """Name the combinations that the walk leaves open, and the parameters in them."""
    named, keys = [], set[str]()
    largest = information.singular_values.max(initial=0.0)
    for value, direction in zip(information.singular_values, information.directions, strict=True):
        if not is_open(np.array([value, largest]))[0]:
            continue
        order = np.argsort(-np.abs(direction))
        signed = direction * np.sign(direction[order[0]])
        parts = [(information.keys[k], float(signed[k])) for k in order if abs(signed[k]) >= LOADED]
        keys |= {key for key, _ in parts}
        named.append(Unidentifiable(combination_in_words(parts), reason_in_words(value, largest)))
    return tuple(named), keys


def combination_in_words(parts: list[tuple[str, float]]) -> str:
    """Write which parameters change together, with their shares of a change by their scale."""
    if len(parts) == 1:
        return parts[0][0]
    up = [f"{key} ({share:.2g})" for key, share in parts if share > 0.0]
    down = [f"{key} ({-share:.2g})" for key, share in parts if share < 0.0]
    return " and ".join(up) + (f" up, {' and '.join(down)} down" if down else " together")


def reason_in_words(value: float, largest: float) -> str:
    if value <= ROUNDING * largest:
        return "the walk does not change with this combination"
    return f"a change of it by its whole size moves the walk by {value:.2g} standard deviations of the data"


def contributions(fitted: Fitted, quantities: tuple[str, ...], count: int, basis: Floats) -> dict[str, float]:
    """Return the share of each quantity in the information on the determined directions `basis` (directions, count).

    A quantity's share is the information that would be lost without it.
    """
    if not len(basis):
        return dict.fromkeys(quantities, 0.0)
    whole = np.diag(basis @ free_the_rest(fitted.evaluation.information, count) @ basis.T)
    products, losses = products_of(fitted.data), []
    for place in range(len(quantities)):
        noise = fitted.noise.measurement.copy()
        noise[place] *= 1e6
        without = evaluate(products, fitted.noise._replace(measurement=noise)).information
        left = np.diag(basis @ free_the_rest(without, count) @ basis.T)
        losses.append(float(np.mean(1.0 - np.clip(left / whole, 0.0, 1.0))))
    return dict(zip(quantities, losses, strict=True))
