"""What compiled functions may do, and what they may not."""

import gc
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from walkerlab.kernels import by_type, kernel, uncompiled


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
    assert uncompiled(allocating)(3) == 0.0


@pytest.mark.parametrize("shape", [Circle(2.0), Square(3.0)])
def test_the_body_is_chosen_by_type_in_python_and_compiled(shape):
    assert compiled_area(shape) == area(shape) == uncompiled(compiled_area)(shape)


def test_a_type_without_a_body_is_refused_while_compiling():
    with pytest.raises(TypingError):
        compiled_area((1.0, 2.0))
