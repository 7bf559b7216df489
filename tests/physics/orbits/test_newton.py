"""Tests of Newton's method: when it halves its steps, when it stops, and what it reports if it finds nothing."""

import numpy as np
import pytest

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.newton import Effort, Evaluated, NotConverged, Solution, newton


class Counted:
    """Function of one variable with its derivative, which counts evaluations. It has no value where it is not
    finite.
    """

    def __init__(self, f, slope):
        self.f, self.slope, self.evaluations = f, slope, 0

    def __call__(self, x):
        self.evaluations += 1
        with np.errstate(invalid="ignore"):
            value = np.array([self.f(x[0])])
        if not np.isfinite(value[0]):
            return Evaluated(Outcome.FELL, np.zeros(1), np.eye(1), None)
        return Evaluated(Outcome.WALKED, value, np.array([[self.slope(x[0])]]), None)


def flat_arc():
    return Counted(np.arctan, lambda x: 1.0 / (1.0 + x * x))


def test_overshooting_newton_step_is_halved_on_request():
    # Beyond 1.39, Newton's method for the arc tangent diverges.
    damped = newton(flat_arc(), np.array([3.0]), Effort(1e-14, 60, 2.0**-8))
    assert isinstance(damped, Solution)
    assert damped.x[0] == pytest.approx(0.0, abs=1e-14)
    assert isinstance(newton(flat_arc(), np.array([3.0]), Effort(1e-14)), NotConverged)


def test_newton_step_out_of_the_domain_is_halved_or_reported():
    def root():
        return Counted(lambda x: np.sqrt(x) - 0.1, lambda x: 0.5 / np.sqrt(x))

    found = newton(root(), np.array([1.0]), Effort(1e-12, 60, 2.0**-8))
    assert found.x[0] == pytest.approx(0.01, abs=1e-11)
    assert newton(root(), np.array([1.0]), Effort(1e-12)) == NotConverged(Outcome.FELL)


def test_newton_stops_at_rounding_with_the_better_of_two_points():
    noise = iter([1e-3, 3e-13, 2e-13, 4e-13])
    found = newton(Counted(lambda _: next(noise), lambda _: 1.0), np.array([0.0]), Effort(1e-14))
    assert found.evaluated.value[0] == 2e-13


def test_singular_matrix_is_reported():
    assert newton(Counted(lambda _: 1.0, lambda _: 0.0), np.array([0.0]), Effort(1e-12)) == NotConverged(
        Outcome.WALKED, True
    )


def test_newton_respects_its_evaluation_limit():
    runaway = flat_arc()
    newton(runaway, np.array([3.0]), Effort(1e-14, 5, 1e-3, 1e9))
    assert runaway.evaluations == 5
