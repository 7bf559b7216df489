"""Tests of units of work: each is stored as soon as it is complete, and none is computed twice or lost with a
worker.
"""

from functools import partial

import pytest
import worker_calls as calls

from walkerlab.errors import NoAnswer
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.work import WorkUnit, complete
from walkerlab.pipeline.run.workers import WorkerDiedError
from walkerlab.pipeline.store.files import Checkpoint


@pytest.fixture
def checkpoint(tmp_path):
    return Checkpoint(tmp_path / "x.parts", "key")


def done(units, checkpoint, jobs=1, **more):
    return complete([WorkUnit(*unit) for unit in units], checkpoint, "work", Silent(), jobs, **more)


def numbers_of(count):
    return [(f"unit {number}", 1, partial(calls.numbers, number)) for number in range(count)]


@pytest.mark.parametrize("jobs", [1, 2])
def test_unit_results_are_stored_in_order(checkpoint, jobs):
    expected = [[float(number)] for number in range(5)]
    assert done(numbers_of(5), checkpoint, jobs) == (expected, 5)
    assert Checkpoint(checkpoint.path, "key").kept == {f"unit {number}": [float(number)] for number in range(5)}


def test_only_missing_units_are_computed(checkpoint):
    checkpoint.keep("unit 1", [-1.0])
    assert done(numbers_of(3), checkpoint) == ([[0.0], [-1.0], [2.0]], 2)


def test_unit_is_stored_before_an_earlier_one_finishes(checkpoint):
    units = [("slow", 1, partial(calls.once_a_file_has, checkpoint.path, b"quick")), ("quick", 1, calls.numbers)]
    assert done(units, checkpoint, jobs=2, compiled=True) == ([[1.0], [0.0]], 2)


def test_unit_is_recomputed_after_an_accidental_death_of_its_worker(checkpoint, tmp_path):
    units = [*numbers_of(2), ("deadly", 1, partial(calls.kill_itself_once, tmp_path / "died"))]
    assert done(units, checkpoint, jobs=2) == ([[0.0], [1.0], [0.0]], 3)


def test_unit_that_always_kills_its_worker_stops_the_work_but_other_results_are_kept(checkpoint):
    with pytest.raises(WorkerDiedError, match="SIGKILL"):
        done([*numbers_of(2), ("deadly", 1, calls.kill_itself)], checkpoint, jobs=2)
    assert Checkpoint(checkpoint.path, "key").kept == {"unit 0": [0.0], "unit 1": [1.0]}


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(("call", "error"), [(calls.divide_by_zero, ZeroDivisionError), (calls.no_answer, NoAnswer)])
def test_error_of_a_unit_is_raised_and_earlier_results_kept(checkpoint, jobs, call, error):
    with pytest.raises(error):
        done([*numbers_of(1), ("wrong", 1, call)], checkpoint, jobs)
    assert Checkpoint(checkpoint.path, "key").kept == {"unit 0": [0.0]}
