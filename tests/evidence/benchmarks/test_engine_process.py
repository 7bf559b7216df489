"""Check that a crash, an exception or an endless loop of an engine ends only its own task."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from crashing_tasks import Answers, Crashes, Raises, Sleeps

from walkerlab.evidence.benchmarks.engines import experiments
from walkerlab.evidence.benchmarks.engines.adapter import Stepping
from walkerlab.evidence.benchmarks.engines.experiments import EngineExperiment, OwnProcess, TaskLost


@pytest.fixture
def own():
    with OwnProcess() as one:
        yield one


def test_results_of_an_engine_do_not_contain_its_printed_output(own, capfd):
    assert [own.do(Answers(number).run, 30.0) for number in (1, 2)] == [1, 2]
    assert "engines talk" not in capfd.readouterr().out


def test_crash_is_reported_with_its_code_and_the_next_task_runs(own):
    lost = own.do(Crashes().run, 30.0)
    assert isinstance(lost, TaskLost)
    assert "-11" in lost.reason
    assert own.do(Answers(3).run, 30.0) == 3


def test_exception_is_reported_with_its_message(own):
    assert own.do(Raises().run, 30.0) == TaskLost("RuntimeError: bad model")


def test_endless_task_is_terminated(own, monkeypatch):
    assert own.do(Answers(1).run, 30.0) == 1
    lost = own.do(Sleeps().run, 0.2)
    assert isinstance(lost, TaskLost)
    assert lost.timed_out
    monkeypatch.setattr(experiments, "START_UP_S", 30.0)
    assert own.do(Answers(2).run, 1.0) == 2


def test_abandoned_task_is_terminated(own):
    assert own.do(Answers(1).run, 30.0) == 1
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(own.do, Sleeps().run, 60.0)
        own.abandon()
        assert isinstance(waiting.result(30.0), TaskLost)
    with pytest.raises(RuntimeError, match="the process was abandoned"):
        own.do(Answers(2).run, 1.0)


def test_failed_run_has_no_run_time_or_error():
    scene = SimpleNamespace(name="compass")
    experiment = EngineExperiment(scene, "engine", "1.0", "own-law")
    row = experiment.row("rule", Stepping("rule", 1e-4), TaskLost("it crashed"))
    assert row.wall_s is None
    assert row.error is None
