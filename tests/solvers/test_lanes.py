"""Numbers in lanes: what is compiled for floats means the same, lane by lane."""

import math

import numpy as np
import pytest

from walkerlab.kernels import kernel
from walkerlab.mechanics.fused import fused
from walkerlab.mechanics.rigid import standing
from walkerlab.mechanics.standing import Mode
from walkerlab.mechanics.trigonometry import sine_cosine
from walkerlab.mechanics.tuples import put
from walkerlab.mechanics.walkers import Arc, Limb, kneed_legs
from walkerlab.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.solvers.lanes import WIDTH, any_positive, choose, in_lanes, load_lanes, nearest, store_lanes
from walkerlab.solvers.system import blank, derivative

MODEL = assembled(RigidWalker(1.0, 0.4, 5.0, 10.0, 0.1, 9.81, 0.05, CORRECTED))
WALKER = Mode(MODEL, MODEL.bent)
KNEED = standing(kneed_legs(Limb(0.5, 0.5, 0.325), Limb(0.5, 0.05, 0.125), 0.5, Arc(0.2)), 9.81, 0.05)
BENT = Mode(KNEED, KNEED.bent)


@kernel
def arithmetic(x, out):
    a, b = load_lanes(x, 0), load_lanes(x, 1)
    store_lanes(2.0 * a - b / a + 1, out, 0)
    store_lanes(fused(a, -b, 3.0), out, 1)
    store_lanes(max(a, b, 0.5) * min(a, -b), out, 2)
    store_lanes(math.sqrt(abs(a)) + nearest(b), out, 3)
    store_lanes(choose(a - b, a, 7.0), out, 4)
    return any_positive(a - 10.0), any_positive(a)


@kernel
def sines(x, out):
    sine, cosine = sine_cosine(load_lanes(x, 0))
    store_lanes(sine, out, 0)
    store_lanes(cosine, out, 1)


@kernel
def rates(system, y, out):
    state = in_lanes(blank(system))
    for i in range(len(state)):
        state = put(state, i, load_lanes(y, i))
    rate = derivative(system, 0.0, state)
    for i in range(len(state)):
        store_lanes(rate[i], out, i)


def test_arithmetic_is_that_of_floats():
    a, b = x = np.random.default_rng(0).normal(size=(2, WIDTH))
    out = np.zeros((5, WIDTH))
    assert arithmetic(x, out) == (False, True)
    expected = (
        2 * a - b / a + 1,
        3 - a * b,
        np.maximum(np.maximum(a, b), 0.5) * np.minimum(a, -b),
        np.sqrt(np.abs(a)) + np.rint(b),
        np.where(a > b, a, 7.0),
    )
    np.testing.assert_allclose(out, expected, rtol=1e-15, atol=1e-15)


def test_what_is_not_a_number_is_not_chosen():
    x = np.full((2, WIDTH), np.nan)
    out = np.zeros((5, WIDTH))
    assert arithmetic(x, out) == (False, False)
    assert (out[4] == 7.0).all()


@pytest.mark.parametrize("largest", [0.5, 1.57, 4.0, 1000.0])
def test_sines_and_cosines_hold_sixteen_digits(largest):
    out = np.zeros((2, WIDTH))
    generator = np.random.default_rng(1)
    for _ in range(50):
        x = generator.uniform(-largest, largest, (1, WIDTH))
        sines(x, out)
        np.testing.assert_allclose(out, [np.sin(x[0]), np.cos(x[0])], rtol=0, atol=4e-16)


def test_a_lane_does_not_feel_its_neighbours():
    alone, beside = np.zeros((2, WIDTH)), np.zeros((2, WIDTH))
    sines(np.full((1, WIDTH), 0.3), alone)
    sines(np.array([[0.3, *np.linspace(-9.0, 9.0, WIDTH - 1)]]), beside)
    assert (alone[:, 0] == beside[:, 0]).all()


@pytest.mark.parametrize("system", [WALKER, BENT], ids=["straight legs", "knees"])
def test_equations_of_motion_are_those_of_a_walker_alone(system):
    y = np.random.default_rng(2).uniform(-2.0, 2.0, (len(blank(system)), WIDTH))
    out = np.zeros(y.shape)
    rates(system, y, out)

    @kernel
    def alone(system, y):
        return derivative(system, 0.0, y)

    expected = np.transpose([alone(system, tuple(column)) for column in y.T.tolist()])
    np.testing.assert_allclose(out, expected, rtol=1e-13, atol=1e-13)
