"""What compiled functions may do, and what they may not."""

import gc
import importlib.util
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from walkerlab.kernels import (
    by_type,
    by_type_or_default,
    compiling,
    inlined,
    kernel,
    matrix,
    uncompiled,
    vector,
    watched,
)


class Circle(NamedTuple):
    """A round thing."""

    radius: float


class Square(NamedTuple):
    """A thing with corners."""

    side: float


@by_type
def area(shape):
    """Area of a shape."""


@area.case(Circle)
def circle_area(shape):
    return 3.0 * shape.radius**2


@area.case(Square)
def square_area(shape):
    return shape.side**2


@kernel
def compiled_area(shape):
    return area(shape)


@kernel
def allocating(n):
    return np.zeros(n).sum()


def test_memory_comes_with_the_arguments():
    """Code that allocates would count references, which takes as long as its arithmetic."""
    thresholds = gc.get_threshold()
    with pytest.raises(TypingError):
        allocating(3)
    assert gc.get_threshold() == thresholds  # as before, also where nothing could be compiled
    assert not compiling
    assert uncompiled(allocating)(3) == 0.0


@pytest.mark.parametrize("shape", [Circle(2.0), Square(3.0)])
def test_the_body_is_chosen_by_type_in_python_and_compiled(shape):
    assert compiled_area(shape) == area(shape) == uncompiled(compiled_area)(shape)


class Blob(NamedTuple):
    """A thing without an area."""

    size: float


@pytest.mark.parametrize("call", [area, compiled_area], ids=["python", "compiled"])
def test_a_type_without_a_body_is_refused_in_one_line_that_names_it(call):
    with pytest.raises(TypeError) as said:
        call(Blob(1.0))
    assert str(said.value) == "area has no body for Blob: register one with @area.case(...)"
    with pytest.raises(TypeError, match=r"^area has no body for .*[Tt]uple.*: register one"):
        call((1.0, 2.0))


@by_type_or_default
def corners(shape):
    """How many corners a shape has."""
    return 0


@corners.case(Square)
def four(shape):
    return 4


@kernel
def compiled_corners(shape):
    return corners(shape)


def test_types_without_a_body_of_their_own_have_the_default():
    for shape, expected in ((Circle(1.0), 0), (Square(1.0), 4)):
        assert compiled_corners(shape) == corners(shape) == expected
    assert Square in corners
    assert Circle not in corners


@inlined
def powers_summed(like, x):
    """x + x^2 + ..., as many powers as `like` is long, by scratch of its own."""
    powers, products = vector(like), matrix(like)
    for i in range(len(powers)):
        powers[i] = x if i == 0 else powers[i - 1] * x
        for j in range(len(powers)):
            products[i, j] = powers[i] if i == j else 0.0
    total = 0.0
    for i in range(len(powers)):
        for j in range(len(powers)):
            total += products[i, j]
    return total


@kernel
def scratch_beside_scratch(like, out):
    """What a called function writes into its scratch does not reach the caller's."""
    mine = vector(like)
    for i in range(len(mine)):
        mine[i] = i
    for i in range(len(mine)):
        out[i] = mine[i] + powers_summed(like, 2.0)
    return len(mine)


@pytest.mark.parametrize("like", [(0.0, 0.0, 0.0), np.rec.array([((1.0, 2.0, 3.0),)], dtype=[("n", "f8", (3,))])[0]])
def test_scratch_is_as_long_as_its_type_says_and_its_functions_own(like):
    """If a new numba breaks this, what kernels compute is wrong: see `_on_the_stack`."""
    function = scratch_beside_scratch if isinstance(like, tuple) else scratch_like_a_field
    for run in (function, uncompiled(function)):
        out = np.zeros(3)
        assert run(like, out) == 3
        assert out.tolist() == [14.0, 15.0, 16.0]


@kernel
def scratch_like_a_field(record, out):
    mine = vector(record.n)
    for i in range(len(mine)):
        mine[i] = i
    for i in range(len(mine)):
        out[i] = mine[i] + powers_summed(record.n, 2.0)
    return len(mine)


def test_scratch_that_is_read_unwritten_shows_in_python():
    assert np.isnan(vector((0.0, 0.0))).all()
    assert np.isnan(matrix((0.0, 0.0))).all()


NESTED = """
from walkerlab.kernels import kernel


@kernel
def inner(x):
    return x + 1.0


@kernel
def outer(x):
    return 2.0 * inner(x)
"""


def test_a_kernel_is_told_of_until_it_is_compiled_itself_and_not_only_what_it_calls(tmp_path):
    path = tmp_path / "nested_kernels.py"
    path.write_text(NESTED)
    spec = importlib.util.spec_from_file_location("nested_kernels", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    told = []
    with watched(told.append):
        assert module.outer(1.0) == 4.0
    assert told == ["outer", "inner", "outer", ""]
