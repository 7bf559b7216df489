"""Compare the likelihood of a linear model with random heights with dense linear algebra."""

from dataclasses import replace

import numpy as np
import pytest

from walkerlab.physics.estimation.mixed_model import (
    NOISE_RATIO,
    Linearised,
    Noise,
    estimate_noise,
    evaluate,
    most_probable_disturbances,
    noise_at,
    reduce,
    restricted_likelihood_and_slope,
    whitening,
)

NOISE = Noise(np.array([0.3, 0.5]), 0.2)


@pytest.fixture
def data():
    draw = np.random.default_rng(3)
    quantity = np.repeat([0, 1], [9, 7])
    J, G = draw.normal(size=(16, 3)), draw.normal(size=(16, 5))
    return Linearised(draw.normal(size=16), J, G, quantity, draw.normal(size=(1, 4)), np.ones(2))


def covariance(data, noise):
    return np.diag(noise.measurement[data.quantity] ** 2) + noise.roughness_m**2 * data.G @ data.G.T


def test_likelihood_equals_a_multivariate_normal_density(data):
    # Imported here: it takes a second, in each process that collects the tests.
    from scipy.stats import multivariate_normal

    no_prior = data.__class__(data.residuals, data.J, data.G, data.quantity, np.zeros((0, 4)), data.sizes)
    S = covariance(data, NOISE)
    inverse = np.linalg.inv(S)
    information = data.J.T @ inverse @ data.J
    move = np.linalg.solve(information, data.J.T @ inverse @ data.residuals)
    left = data.residuals - data.J @ move
    answer = evaluate(reduce(no_prior), NOISE)
    assert answer.information == pytest.approx(information, rel=1e-12)
    assert answer.move == pytest.approx(move, rel=1e-9)
    assert answer.likelihood == pytest.approx(multivariate_normal(np.zeros(16), S).logpdf(left), rel=1e-12)
    restricted = -0.5 * (np.linalg.slogdet(S)[1] + left @ inverse @ left + np.linalg.slogdet(information)[1])
    ratio = 0.5 * np.var(np.log(NOISE.measurement)) / NOISE_RATIO**2
    assert answer.restricted == pytest.approx(restricted - ratio, rel=1e-12)
    heights = NOISE.roughness_m**2 * data.G.T @ inverse @ left
    assert most_probable_disturbances(reduce(no_prior), NOISE, answer.move) == pytest.approx(heights, rel=1e-9)


@pytest.mark.parametrize("kicks", [0, 2])
def test_likelihood_gradient_equals_its_difference_quotient(data, kicks):
    rows, logs = reduce(replace(data, kicks=kicks)), np.log([0.3, 0.5, 0.2, 0.1])
    noise = noise_at(logs, (0, 1))
    likelihood, slope = restricted_likelihood_and_slope(rows, noise)
    assert likelihood == pytest.approx(float(evaluate(rows, noise).restricted), rel=1e-12)
    for place, unit in enumerate(np.eye(4)):
        ends = [float(evaluate(rows, noise_at(logs + sign * 1e-5 * unit, (0, 1))).restricted) for sign in (1, -1)]
        assert slope[place] == pytest.approx((ends[0] - ends[1]) / 2e-5, abs=1e-7)


def test_roughness_and_kicks_are_separated():
    draw = np.random.default_rng(2)
    J, G, quantity = draw.normal(size=(600, 2)), draw.normal(size=(600, 80)), np.zeros(600, int)
    noise, disturbances = draw.normal(0.0, 0.3, 600), draw.normal(size=80)
    for floor, kick in ((0.1, 0.0), (0.0, 0.05), (0.1, 0.05)):
        spread = np.repeat([floor, kick], 40)
        data = Linearised(noise + G @ (spread * disturbances), J, G, quantity, np.zeros((0, 3)), np.ones(1), 0.0, 40)
        found, _ = estimate_noise(reduce(data), np.full(1, 1e-6), 1.0, Noise(np.ones(1), 0.0))
        assert found.process == pytest.approx([floor, kick], abs=0.02)


def test_prior_acts_like_one_more_measurement(data):
    weighed = np.vstack((data.J, data.prior[:, 1:]))
    residuals = np.append(data.residuals, data.prior[:, 0])
    S = np.eye(17)
    S[:16, :16] = covariance(data, NOISE)
    information = weighed.T @ np.linalg.solve(S, weighed)
    answer = evaluate(reduce(data), NOISE)
    assert answer.information == pytest.approx(information, rel=1e-12)
    assert answer.move == pytest.approx(
        np.linalg.solve(information, weighed.T @ np.linalg.solve(S, residuals)), rel=1e-9
    )


@pytest.mark.parametrize("roughness", [0.0, 0.2])
def test_whitening_makes_values_independent(data, roughness):
    noise = NOISE._replace(roughness_m=roughness)
    whiten = whitening(data, noise)
    root = whiten(np.eye(16))
    assert root @ covariance(data, noise) @ root.T == pytest.approx(np.eye(16), abs=1e-12)


def test_noise_and_roughness_are_recovered_from_many_values():
    draw = np.random.default_rng(5)
    quantity = np.repeat([0, 1], 4000)
    J, G = draw.normal(size=(8000, 2)), draw.normal(size=(8000, 60))
    noise = np.array([0.3, 0.6])[quantity] * draw.normal(size=8000)
    residuals = J @ [1.0, -2.0] + 0.1 * G @ draw.normal(size=60) + noise
    products = reduce(Linearised(residuals, J, G, quantity, np.zeros((0, 3)), np.ones(2)))
    found, _ = estimate_noise(products, np.full(2, 1e-6), 1.0, Noise(np.ones(2), 0.0))
    assert found.measurement == pytest.approx([0.3, 0.6], rel=0.04)
    assert found.roughness_m == pytest.approx(0.1, rel=0.3)


def test_even_floor_is_estimated_as_even():
    draw = np.random.default_rng(6)
    G = draw.normal(size=(400, 20))
    products = reduce(
        Linearised(draw.normal(size=400), np.ones((400, 1)), G, np.zeros(400, int), np.zeros((0, 2)), np.ones(1))
    )
    found, _ = estimate_noise(products, np.array([1e-6]), 1.0, Noise(np.ones(1), 0.0))
    assert found.roughness_m < 0.03


def test_indistinguishable_heights_on_a_rough_floor_have_a_finite_likelihood():
    rng = np.random.default_rng(5)
    G = np.outer(rng.normal(size=400), np.ones(6))
    values = rng.normal(0.0, 1e-9, 400)
    data = Linearised(values, np.ones((400, 1)), G, np.zeros(400, int), np.zeros((0, 2)), np.ones(1))
    products, noise = reduce(data), Noise(np.array([1e-9]), 10.0)
    answer = evaluate(products, noise)
    assert np.isfinite(answer.restricted)
    assert np.isfinite(most_probable_disturbances(products, noise, answer.move)).all()
