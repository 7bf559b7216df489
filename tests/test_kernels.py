"""Tests of compiled functions: dispatch by type, records, scratch memory, and stored machine code."""

import importlib
import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba import typeof
from numba.core.errors import TypingError
from numba.core.itanium_mangler import mangle_type

from walkerlab.physics import kernel_cache
from walkerlab.physics.compiler import read_code, strip_bitcode
from walkerlab.physics.kernel_cache import watch_compilation
from walkerlab.physics.kernels import (
    dispatch_by_type,
    dispatch_by_type_or_default,
    forced_inline,
    kernel,
    kernel_part,
    matrix,
    pass_by_reference,
    uncompiled,
    vector,
)


class Circle(NamedTuple):
    """Shape without corners."""

    radius: float


class Square(NamedTuple):
    """Shape with corners."""

    side: float


@dispatch_by_type
def area(shape):
    """Return the area of a shape."""


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


def test_kernels_cannot_allocate_memory():
    """Code that allocates memory has to count references, which takes as long as its arithmetic."""
    with pytest.raises(TypingError):
        allocating(3)
    assert uncompiled(allocating)(3) == 0.0


@pytest.mark.parametrize("shape", [Circle(2.0), Square(3.0)])
def test_dispatch_by_type_works_in_python_and_compiled(shape):
    assert compiled_area(shape) == area(shape) == uncompiled(compiled_area)(shape)


class Blob(NamedTuple):
    """Shape for which `area` has no case."""

    size: float


@pytest.mark.parametrize("call", [area, compiled_area], ids=["python", "compiled"])
def test_type_without_a_case_is_named_in_one_line(call):
    with pytest.raises(TypeError) as said:
        call(Blob(1.0))
    assert str(said.value) == "area has no case for Blob: register one with @area.case(...)"
    with pytest.raises(TypeError, match=r"^area has no case for .*[Tt]uple.*: register one"):
        call((1.0, 2.0))


@dispatch_by_type_or_default
def corners(shape):
    """Return the number of corners of a shape."""
    return 0


@corners.case(Square)
def four(shape):
    return 4


@kernel
def compiled_corners(shape):
    return corners(shape)


def test_types_without_a_case_use_the_default():
    for shape, expected in ((Circle(1.0), 0), (Square(1.0), 4)):
        assert compiled_corners(shape) == corners(shape) == expected
    assert Square in corners
    assert Circle not in corners


@pass_by_reference
class Lid(NamedTuple):
    """Record inside another record."""

    open: bool
    weights: np.ndarray


@pass_by_reference
class Box(NamedTuple):
    """Record with arrays and another record."""

    sides: np.ndarray
    depth: float
    lid: Lid


@kernel_part
def filled(box, share):
    """Add `share` to the first side, and return the volume of the box plus the weight on an open lid."""
    box.sides[0] += share
    return box.depth * box.sides[0] * box.sides[1] + (box.lid.weights[-1] if box.lid.open else 0.0)


@kernel
def filled_twice(box, share):
    return filled(box, share) + filled(box, 2.0 * share)


def test_record_passed_by_reference_is_not_copied():
    """If a new version of numba breaks this, see `Reference`."""
    for run in (filled_twice, uncompiled(filled_twice)):
        box = Box(np.array([1.0, 2.0]), 3.0, Lid(True, np.array([5.0, 7.0])))
        assert run(box, 1.0) == 6.0 * 2.0 + 7.0 + 6.0 * 4.0 + 7.0
        assert box.sides[0] == 4.0
        assert run(box._replace(lid=Lid(False, np.zeros(1))), 0.0) == 48.0


@kernel_part
def powers_summed(like, x):
    """Return x + x^2 + ..., with as many powers as `like` has elements, computed in scratch memory."""
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
    """Fill scratch memory, and add the result of a function that has other scratch memory."""
    mine = vector(like)
    for i in range(len(mine)):
        mine[i] = i
    for i in range(len(mine)):
        out[i] = mine[i] + powers_summed(like, 2.0)
    return len(mine)


@pytest.mark.parametrize("like", [(0.0, 0.0, 0.0), np.rec.array([((1.0, 2.0, 3.0),)], dtype=[("n", "f8", (3,))])[0]])
def test_scratch_arrays_have_the_length_of_their_type_and_are_not_shared(like):
    """If a new version of numba breaks this, kernels compute wrong results, see `_stack_memory`."""
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


def test_uninitialised_scratch_is_nan_in_python():
    assert np.isnan(vector((0.0, 0.0))).all()
    assert np.isnan(matrix((0.0, 0.0))).all()


@forced_inline
def squared(x):
    return (lambda y: y * y)(x)


@kernel
def squared_twice(x):
    return (lambda y: squared(y))(squared(x))


def test_function_inside_a_kernel_is_compiled_with_it():
    assert squared_twice(3.0) == uncompiled(squared_twice)(3.0) == 81.0


NESTED = """
from walkerlab.physics.kernels import kernel


@kernel
def inner(x):
    return x + 1.0


@kernel
def outer(x):
    return 2.0 * inner(x)
"""


@pytest.fixture
def nested(tmp_path, monkeypatch):
    """Return a module with a kernel that calls another one. Neither is compiled yet."""
    (tmp_path / "nested_kernels.py").write_text(NESTED)
    monkeypatch.setenv("WALKERLAB_CACHE", str(tmp_path / "cache"))
    kernel_cache.cache_folder.cache_clear()
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("nested_kernels")
    del sys.modules["nested_kernels"]
    monkeypatch.undo()
    kernel_cache.cache_folder.cache_clear()


def test_kernel_called_by_a_kernel_is_compiled_into_it(nested, tmp_path):
    """This is necessary because stored machine code cannot be linked."""
    names = []
    with watch_compilation(names.append):
        assert nested.outer(1.0) == 4.0
    assert names == ["outer"]
    assert [path.name.partition("-")[0] for path in tmp_path.rglob("*.kernel")] == ["outer"]


def test_interrupted_compilation_releases_its_lock(nested):
    def interrupt(_):
        raise KeyboardInterrupt

    with watch_compilation(interrupt), pytest.raises(KeyboardInterrupt):
        nested.inner(1.0)
    assert nested.inner(1.0) == 2.0


@pytest.mark.parametrize(
    "damage", [lambda data: data[:-100], lambda data: data[:500] + b"x" + data[501:], lambda _: b""]
)
def test_damaged_machine_code_is_recompiled(nested, tmp_path, damage):
    assert nested.inner(1.0) == 2.0
    (stored,) = tmp_path.rglob("inner*.kernel")
    stored.write_bytes(damage(stored.read_bytes()))
    names = []
    with watch_compilation(names.append):
        assert nested.inner.__class__(nested.inner.py_func, targetoptions=nested.inner.targetoptions)(1.0) == 2.0
    assert names == ["inner"]
    assert read_code(stored) is not None


def test_machine_code_without_its_bitcode_runs(nested, tmp_path):
    assert nested.outer(1.0) == 4.0
    (stored,) = tmp_path.rglob("outer*.kernel")
    size = stored.stat().st_size
    stored.write_bytes(strip_bitcode(stored))
    assert stored.stat().st_size < size
    written = stored.stat().st_mtime_ns
    code = "import nested_kernels; print(nested_kernels.outer(1.0))"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.stdout == "4.0\n", done.stderr
    assert [path.stat().st_mtime_ns for path in tmp_path.rglob("*.kernel")] == [written]


def test_machine_code_names_records_by_their_layout(monkeypatch):
    two, three = (typeof(np.zeros((), [("numbers", float, (n,))])).dtype for n in (2, 3))
    named = mangle_type(two)
    assert named != mangle_type(three)
    monkeypatch.setattr(two, "_code", three._code)  # Numba gives each type a number, which depends on the process.
    assert mangle_type(two) == named


def test_numba_multiplies_matrices_after_kernels_are_loaded():
    """Loading kernels skips linear algebra, which numba then has to find when other code needs it."""
    code = """
import sys
import numba, numpy as np
from walkerlab.physics import kernels
assert not any(name.startswith("scipy.linalg") for name in sys.modules)
A = np.arange(4.0).reshape(2, 2)
print(np.array_equal(numba.njit(lambda a: a @ a)(A), A @ A), numba.njit(lambda a, b: np.convolve(a, b))(*A).tolist())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split(maxsplit=1) == ["True", "[0.0, 2.0, 3.0]\n"], done.stderr
