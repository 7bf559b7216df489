"""Compare the likelihood of a walk with a bootstrap particle filter over exact walks on rough ground.

Gordon, Salmond, Smith, Novel approach to nonlinear/non-Gaussian Bayesian state estimation, IEE Proc. F 140 (1993).
"""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.physics.estimation.fit import linearise
from walkerlab.physics.estimation.measurements import MeasuredWalk
from walkerlab.physics.estimation.mixed_model import Linearised, Noise, evaluate, most_probable_disturbances, reduce
from walkerlab.scene.identification import problem_of
from walkerlab.scene.subject import find_model_gait

SLOPES_DEG = (2.96, 3.0, 3.02)
STEPS, PARTICLES, ROUGHNESS_M, NOISE = 4, 1000, 2e-4, np.array([1e-3, 1e-3])
"""Steps; particles; standard deviations of the floor (m), of periods (s) and of lengths (m)."""


@pytest.fixture(scope="module")
def problem():
    config = load(Path("slope-3deg")).config
    subject = find_model_gait("rigid", config, run_in_memory("fixedpoint", config).summary, print)
    question = Identify(fit={"slope_deg": None})
    rng = np.random.default_rng(5)
    planned = MeasuredWalk(np.ones(STEPS), np.ones(STEPS))
    walks = problem_of(subject, planned, question).forecast.walks
    heights = rng.normal(0.0, ROUGHNESS_M, STEPS + 1)
    walk = walks.take_disturbed_walk(subject.z, (3.0,), heights)
    periods, lengths = (values + rng.normal(0.0, 1e-3, STEPS) for values in (walk.durations_s, walk.lengths_m))
    return problem_of(subject, MeasuredWalk(periods, lengths), question)


def likelihood(problem, u):
    """Log-likelihood of the linear model about the most probable floor, with all unknowns known."""
    heights = np.zeros(STEPS + 1)
    for _ in range(3):
        data = linearise(problem, u, heights)
        known = Linearised(data.residuals, data.J[:, :0], data.G, data.quantity, np.zeros((0, 1)), data.sizes)
        products, noise = reduce(known), Noise(NOISE, ROUGHNESS_M)
        evaluation = evaluate(products, noise)
        heights = most_probable_disturbances(products, noise, evaluation.move)
    return float(evaluation.likelihood)


def filtered(problem, u, rng):
    """Log-likelihood by particles, each a floor over which the walker walks from the start."""
    forecast = problem.forecast
    measured = np.column_stack((forecast.measured.periods_s, forecast.measured.lengths_m))
    floors, total = rng.normal(0.0, ROUGHNESS_M, (PARTICLES, 1)), 0.0
    for step in range(STEPS):
        floors = np.column_stack((floors, rng.normal(0.0, ROUGHNESS_M, PARTICLES)))
        walks = [
            forecast.walks.take_disturbed_walk(forecast.start(u), forecast.parameters(u), floor) for floor in floors
        ]
        predicted = np.array([(walk.durations_s[step], walk.lengths_m[step]) for walk in walks])
        logs = -0.5 * (((measured[step] - predicted) / NOISE) ** 2 + np.log(2.0 * np.pi * NOISE**2)).sum(axis=1)
        weights = np.exp(logs - logs.max())
        total += logs.max() + np.log(weights.mean())
        floors = floors[rng.choice(PARTICLES, PARTICLES, p=weights / weights.sum())]
    return total


def test_likelihood_agrees_with_a_particle_filter(problem):
    """Filters estimate the likelihood without bias and scatter by 0.2 to 0.7 in its logarithm; three are averaged."""
    rng, values = np.random.default_rng(1), []
    for slope in SLOPES_DEG:
        u = np.zeros(problem.forecast.unknowns)
        u[0] = slope / problem.forecast.scales[0]
        filters = [filtered(problem, u, rng) for _ in range(3)]
        values.append((likelihood(problem, u), np.log(np.mean(np.exp(filters)))))
    linear, particles = np.array(values).T
    np.testing.assert_allclose(linear, particles, atol=0.5)
    assert np.ptp(linear) > 2.0
