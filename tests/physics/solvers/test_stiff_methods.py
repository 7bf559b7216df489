"""Solve published stiff problems with every method of the registry that is meant for them."""

import numpy as np
import pytest
from stiff_problems import (
    HIRES,
    HIRES_END,
    HIRES_START,
    ROBERTSON,
    ROBERTSON_END,
    ROBERTSON_START,
    STIFF,
    VDPOL_END,
    Kinetics,
    drive,
)

from walkerlab.physics.solvers.registry import METHODS
from walkerlab.physics.solvers.stepping import ACCEPTED, STEP_DONE, T, advance, begin

# system, start, time, published end, and absolute over relative tolerance
PROBLEMS = {
    "van der Pol, mu = 1e6": (STIFF, (2.0, 0.0), 2.0, VDPOL_END, 1.0),
    "Robertson": (Kinetics(ROBERTSON), ROBERTSON_START, 1e11, ROBERTSON_END, 1e-8),
    "HIRES": (Kinetics(HIRES), HIRES_START, 321.8122, HIRES_END, 1e-4),
}
STIFF_METHODS = [name for name, method in METHODS.items() if method.stiff]
each_problem = pytest.mark.parametrize("problem", PROBLEMS)
each_method = pytest.mark.parametrize("name", STIFF_METHODS)


def in_python(method, system, start, t_end):
    begin(method, system, 0.0, start, 0.0)
    while method.clock[T] < t_end:
        status = advance(method, system, t_end)
        if status != STEP_DONE:
            return status
    return STEP_DONE


def error_of(name, problem, tolerance):
    """Return the largest relative error at the end, and the number of steps."""
    system, start, t_end, end, absolute = PROBLEMS[problem]
    method = METHODS[name].new(len(start), tolerance, absolute * tolerance, 10**6)
    if METHODS[name].compiled:
        status = drive(method, system, 0.0, np.array(start), 0.0, t_end)
    else:
        status = in_python(method, system, np.array(start), t_end)
    assert status == STEP_DONE
    assert method.clock[T] == t_end
    return np.abs(method.y[: len(end)] / end - 1.0).max(), int(method.counts[ACCEPTED])


def test_stiff_methods_come_from_more_than_one_library():
    assert {"radau5", "scipy-lsoda", "scipy-radau", "scipy-bdf"} <= set(STIFF_METHODS)


@each_problem
@each_method
def test_stiff_method_reaches_the_published_end_state_in_few_steps(name, problem):
    """A step's error is at most the tolerance and dies on the way; multistep methods add up a few dozen of them.

    An explicit method is bound to steps of about 2 / |eigenvalue|: a million for van der Pol's.
    """
    for tolerance in (1e-5, 1e-8):
        error, steps = error_of(name, problem, tolerance)
        assert error < 100.0 * tolerance
        assert steps < 5000


@each_problem
@each_method
def test_error_of_a_stiff_method_falls_with_the_tolerance(name, problem):
    """The error must fall by at least half as many digits as the tolerance."""
    loose, tight = (error_of(name, problem, tolerance)[0] for tolerance in (1e-5, 1e-9))
    assert tight < 1e-2 * loose
