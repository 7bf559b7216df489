"""What compiled functions may do, and what they may not."""

import gc
import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import typeof
from numba.core.errors import TypingError
from numba.core.itanium_mangler import mangle_type

from walkerlab.physics import compiler
from walkerlab.physics.compiler import compiling
from walkerlab.physics.kernel_cache import watch_compilation
from walkerlab.physics.kernels import (
    by_reference,
    by_type,
    by_type_or_default,
    forced_inline,
    kernel,
    kernel_part,
    matrix,
    uncompiled,
    vector,
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
    assert gc.get_threshold() == thresholds
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
    assert str(said.value) == "area has no case for Blob: register one with @area.case(...)"
    with pytest.raises(TypeError, match=r"^area has no case for .*[Tt]uple.*: register one"):
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


@by_reference
class Lid(NamedTuple):
    """A part of a record."""

    open: bool
    weights: np.ndarray


@by_reference
class Box(NamedTuple):
    """A record with arrays and a record in it."""

    sides: np.ndarray
    depth: float
    lid: Lid


@kernel_part
def filled(box, share):
    """What is in the box, which is written down in it."""
    box.sides[0] += share
    return box.depth * box.sides[0] * box.sides[1] + (box.lid.weights[-1] if box.lid.open else 0.0)


@kernel
def filled_twice(box, share):
    return filled(box, share) + filled(box, 2.0 * share)


def test_a_record_handed_on_by_its_address_is_the_callers_own():
    """If a new numba breaks this, see `Reference`."""
    for run in (filled_twice, uncompiled(filled_twice)):
        box = Box(np.array([1.0, 2.0]), 3.0, Lid(True, np.array([5.0, 7.0])))
        assert run(box, 1.0) == 6.0 * 2.0 + 7.0 + 6.0 * 4.0 + 7.0
        assert box.sides[0] == 4.0
        assert run(box._replace(lid=Lid(False, np.zeros(1))), 0.0) == 48.0


@kernel_part
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


def test_the_installed_numba_has_the_inner_parts_that_are_leant_on():
    assert compiler.absent == []


WITHOUT = """
import sys
import numba.core.caching, numba.core.codegen
if sys.argv[1] == "class":
    del numba.core.codegen.JITCodeLibrary
elif sys.argv[1] == "method":
    del numba.core.caching.IndexDataCacheFile._load_index
    numba.core.caching.IndexDataCacheFile.load = lambda self, key: None
    numba.core.caching.IndexDataCacheFile.save = lambda self, key, data: None
import numba
import walkerlab.physics.kernels
from walkerlab.physics.kernel_cache import cache_folder
own = numba.config.CACHE_DIR
sys.path.insert(0, sys.argv[2])
import chosen_kernels
thing = chosen_kernels.Thing(2.0)
print(chosen_kernels.measured(thing).hex(), own == numba.config.CACHE_DIR, cache_folder())
"""
CHOSEN = """
from typing import NamedTuple
from walkerlab.physics import compiler
from walkerlab.physics.compiler import compiling
from walkerlab.physics.kernel_cache import watch_compilation
from walkerlab.physics.kernels import by_type, by_type_or_default, kernel_part, kernel, vector, forced_inline


class Thing(NamedTuple):
    size: float


@by_type
def measure(thing):
    pass


@measure.case(Thing)
def size(thing):
    return thing.size


@by_type_or_default
def factor(thing):
    return 1.0 / 3.0


@forced_inline
def scaled(x, by):
    return x * by


@kernel_part
def summed(thing):
    scratch = vector((0.0, 0.0, 0.0))
    for i in range(3):
        scratch[i] = scaled(measure(thing), factor(thing))
    return scratch[0] + scratch[1] + scratch[2]


@kernel
def measured(thing):
    return summed(thing) + 0.1
"""


def run_without(part, tmp_path):
    file = tmp_path / "chosen_kernels.py"
    if not file.exists():  # numba itself may go by its time
        file.write_text(CHOSEN)
    environment = {**os.environ, "WALKERLAB_CACHE": str(tmp_path / part)}
    command = [sys.executable, "-c", WITHOUT, part, str(tmp_path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    number, untouched, folder = done.stdout.split()
    assert untouched == "True"
    return number, Path(folder), done.stderr


@pytest.mark.parametrize(
    ("part", "named"),
    [("class", "numba.core.codegen.JITCodeLibrary"), ("method", "numba.core.caching.IndexDataCacheFile._load_index")],
)
def test_without_numbas_inner_parts_kernels_are_compiled_as_numba_does_it_and_it_is_told_once(part, named, tmp_path):
    number, folder, told = run_without(part, tmp_path)
    expected, _, silent = run_without("nothing", tmp_path)
    assert number == expected
    assert told.count("RuntimeWarning") == 1
    assert f"lacks {named}: compiling takes longer" in told
    assert silent == ""
    if part == "class":
        stored = {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")}
        assert stored  # in the folder of this state of the sources, from which the next process takes it
        run_without(part, tmp_path)
        assert {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")} == stored


@forced_inline
def squared(x):
    return (lambda y: y * y)(x)


@kernel
def squared_twice(x):
    return (lambda y: squared(y))(squared(x))


def test_a_function_inside_a_kernel_is_compiled_with_it():
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


def test_a_kernel_is_told_of_until_it_is_compiled_itself_and_not_only_what_it_calls(tmp_path):
    path = tmp_path / "nested_kernels.py"
    path.write_text(NESTED)
    spec = importlib.util.spec_from_file_location("nested_kernels", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    told = []
    with watch_compilation(told.append):
        assert module.outer(1.0) == 4.0
    assert told == ["outer", "inner", "outer", ""]


@pytest.mark.parametrize("stops", [KeyboardInterrupt, TypeError])
def test_a_kernel_whose_compiling_is_stopped_gives_its_lock_back(stops, tmp_path, monkeypatch):
    path = tmp_path / "stopped_kernels.py"
    path.write_text(NESTED)
    spec = importlib.util.spec_from_file_location("stopped_kernels", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def stop(*_):
        raise stops

    monkeypatch.setattr(compiler.Compiler, "compile_extra", stop)
    with pytest.raises(stops):
        module.inner(1.0)
    assert compiling == []
    monkeypatch.undo()
    assert module.inner(1.0) == 2.0


def test_machine_code_names_records_by_their_layout_so_that_processes_agree(monkeypatch):
    two, three = (typeof(np.zeros((), [("numbers", float, (n,))])).dtype for n in (2, 3))
    named = mangle_type(two)
    assert named != mangle_type(three)
    monkeypatch.setattr(two, "_code", three._code)  # numba's own number, counted up in each process
    assert mangle_type(two) == named


def test_numba_multiplies_matrices_after_kernels_are_loaded():
    """For whoever calls both: numba looks for the linear algebra that loading kernels leaves out."""
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
