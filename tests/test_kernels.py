"""What compiled functions may do, and what they may not."""

import gc
import importlib.util
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from walkerlab.kernels import by_type, compiling, kernel, uncompiled, watched


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


def test_a_type_without_a_body_is_refused_while_compiling():
    with pytest.raises(TypingError):
        compiled_area((1.0, 2.0))


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
