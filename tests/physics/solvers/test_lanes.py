"""Check that code compiled for lanes computes in each lane what it computes for a float."""

import math
import subprocess
import sys

import numpy as np
import pytest

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.physics.hybrid.rigid_lanes import two_legs
from walkerlab.physics.kernels import kernel
from walkerlab.physics.mechanics.rigid_model import STRAIGHT, Mode
from walkerlab.physics.mechanics.trigonometry import sine_cosine
from walkerlab.physics.solvers import system
from walkerlab.physics.solvers.lanes import (
    WIDTH,
    any_positive,
    choose,
    derivative,
    fused,
    load,
    nearest,
    store,
    teach_arithmetic,
)

MODEL = assembled(RigidWalker(1.0, 0.4, 5.0, 10.0, 0.1, 9.81, 0.05, CORRECTED))
WALKER = two_legs(MODEL)
teach_arithmetic()


@kernel
def arithmetic(x, out):
    a, b = load(x, 0), load(x, 1)
    store(2.0 * a - b / a + 1, out, 0)
    store(fused(a, -b, 3.0), out, 1)
    store(max(a, b, 0.5) * min(a, -b), out, 2)
    store(math.sqrt(abs(a)) + nearest(b), out, 3)
    store(choose(a - b, a, 7.0), out, 4)
    return any_positive(a - 10.0), any_positive(a)


@kernel
def sines(x, out):
    sine, cosine = sine_cosine(load(x, 0))
    store(sine, out, 0)
    store(cosine, out, 1)


@kernel
def rates(system, y, out):
    rate = derivative(system, 0.0, (load(y, 0), load(y, 1), load(y, 2), load(y, 3)))
    for i in range(4):
        store(rate[i], out, i)


IMPORT_ALL = """
from collections import Counter
import numba
from numba.core.imputils import builtin_registry as code
from numba.core.typing.templates import builtin_registry as types
import numba.np.arrayobj, numba.extending
numba.njit(lambda x: x + 1.0)(1.0)

def theirs():
    templates = [function for function, _ in types.globals] + [template.key for template in types.functions]
    known = templates + [function for _, function, _ in code.functions]
    return Counter(str(function) for function in known if "walkerlab" not in str(getattr(function, "__module__", "")))

before = theirs()
import walkerlab.physics.orbits.basin, walkerlab.physics.hybrid.rigid_lanes, walkerlab.pipeline.stages.basin
added = theirs() - before
assert not added, added
from walkerlab.physics.solvers.lanes import teach_arithmetic
teach_arithmetic()
print((theirs() - before)["<built-in function add>"])
"""


def test_importing_lanes_registers_no_global_operators():
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0  # makes sure that the script looked at some operators


def test_lane_arithmetic_equals_float_arithmetic():
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


def test_comparisons_with_nan_are_false_in_lanes():
    x = np.full((2, WIDTH), np.nan)
    out = np.zeros((5, WIDTH))
    assert arithmetic(x, out) == (False, False)
    assert (out[4] == 7.0).all()


@pytest.mark.parametrize("largest", [0.5, 1.57, 4.0, 1000.0])
def test_sines_and_cosines_have_sixteen_digits(largest):
    out = np.zeros((2, WIDTH))
    generator = np.random.default_rng(1)
    for _ in range(50):
        x = generator.uniform(-largest, largest, (1, WIDTH))
        sines(x, out)
        np.testing.assert_allclose(out, [np.sin(x[0]), np.cos(x[0])], rtol=0, atol=4e-16)


def test_lanes_do_not_influence_each_other():
    alone, beside = np.zeros((2, WIDTH)), np.zeros((2, WIDTH))
    sines(np.full((1, WIDTH), 0.3), alone)
    sines(np.array([[0.3, *np.linspace(-9.0, 9.0, WIDTH - 1)]]), beside)
    assert (alone[:, 0] == beside[:, 0]).all()


def test_equations_of_motion_in_a_lane_equal_those_of_one_walker():
    y = np.random.default_rng(2).uniform(-2.0, 2.0, (4, WIDTH))
    out = np.zeros((4, WIDTH))
    rates(WALKER, y, out)

    @kernel
    def alone(system, y):
        return derivative(system, 0.0, y)

    expected = np.transpose([alone(WALKER, tuple(column)) for column in y.T.tolist()])
    np.testing.assert_allclose(out, expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_written_out_equations_of_two_legs_equal_the_rigid_model(radius):
    model = MODEL.changed(radius=radius)
    y = np.random.default_rng(3).uniform(-2.0, 2.0, (4, WIDTH))
    out, expected = np.zeros((4, WIDTH)), np.zeros((4, WIDTH))
    rates(two_legs(model), y, out)
    for lane in range(WIDTH):
        f = np.zeros(4)
        system.derivative(Mode(model, STRAIGHT), 0.0, y[:, lane].copy(), f)
        expected[:, lane] = f
    np.testing.assert_allclose(out, expected, rtol=1e-12, atol=1e-12)
