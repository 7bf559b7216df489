"""Tests of workers: calls return their results, failures are reported, and no worker is left."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
import worker_calls as calls
from process_table import THERE, is_alive, workers_below

from walkerlab.errors import NoAnswer
from walkerlab.pipeline.run.workers import Worker, WorkerDiedError, WorkerPool, WorkerTimeoutError, map_in_order

DEADLINE_S = 60.0


def until(condition):
    """Wait until a condition becomes true."""
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def pool():
    with WorkerPool(2) as two:
        yield two


def test_results_come_in_the_order_of_the_calls():
    assert list(map_in_order([partial(calls.square, n) for n in range(7)], jobs=3)) == [n * n for n in range(7)]


def test_calls_run_in_this_process_if_there_is_one_job_or_they_are_listed_as_first():
    assert set(map_in_order([calls.own_id] * 3, jobs=1)) == {os.getpid()}
    ids = list(map_in_order([calls.own_id] * 3, jobs=2, first=(1,)))
    assert ids[1] == os.getpid()
    assert os.getpid() not in (ids[0], ids[2])


def test_calls_of_lowest_rank_start_first():
    begun = list(map_in_order([calls.begun_at] * 3, jobs=2, rank=lambda place: -place))
    assert begun[0] == max(begun)


LOADS_SLOWLY = """
import pathlib, time


class Slow:
    def __set_name__(self, owner, name):
        pathlib.Path(__file__).with_suffix(".begun").touch()
        time.sleep(60.0)


class Holder:
    slow = Slow()
"""


def test_worker_terminated_while_loading_prints_nothing(tmp_path, monkeypatch, capfd):
    (tmp_path / "loads_slowly.py").write_text(LOADS_SLOWLY)
    monkeypatch.syspath_prepend(str(tmp_path))
    with WorkerPool(1, ("loads_slowly",)) as one:
        one.start_all()
        until((tmp_path / "loads_slowly.begun").exists)
    assert capfd.readouterr().err == ""


def test_worker_terminated_twice_prints_nothing(capfd):
    with WorkerPool(1) as one, pytest.raises(WorkerDiedError, match="SIGTERM"):
        one.start(calls.be_told_to_end_twice).result()
    assert capfd.readouterr().err == ""


def test_error_is_returned_with_its_traceback(pool):
    with pytest.raises(ZeroDivisionError) as caught:
        pool.start(calls.divide_by_zero).result()
    assert "divide_by_zero" in caught.value.__notes__[0]
    with pytest.raises(NoAnswer) as unanswered:
        pool.start(calls.no_answer).result()
    assert (unanswered.value.advice, unanswered.value.partial) == ("look elsewhere", {"partial": 1})


@pytest.mark.parametrize(
    ("call", "said"),
    [(calls.raise_what_cannot_be_sent, "NeedsTwoError: 1 and 2"), (calls.return_what_cannot_be_sent, "pickle")],
)
def test_unpicklable_result_gets_an_explanation(pool, call, said):
    with pytest.raises(Exception, match=said):
        pool.start(call).result()
    assert pool.submit(calls.square, 3).result() == 9


@pytest.mark.parametrize(("call", "how"), [(calls.kill_itself, "SIGKILL"), (calls.leave_with_3, "exit code 3")])
def test_dead_worker_is_reported_and_replaced(pool, call, how):
    others = [pool.submit(calls.square, number) for number in range(4)]
    with pytest.raises(WorkerDiedError, match=how):
        pool.start(call).result()
    assert [future.result() for future in [*others, pool.submit(calls.square, 5)]] == [0, 1, 4, 9, 25]


def test_no_call_is_lost_when_an_idle_worker_dies():
    with WorkerPool(1) as pool:
        first = pool.start(calls.own_id).result()
        os.kill(first, signal.SIGKILL)
        until(lambda: not is_alive(first))
        assert pool.start(calls.own_id).result() != first


def test_messages_of_a_call_arrive_in_order(pool):
    heard = []
    assert pool.start(partial(calls.count_to, 5), heard.append).result() == "done"
    assert heard == [0, 1, 2, 3, 4]


def test_call_that_takes_too_long_can_be_abandoned():
    worker = Worker()
    with pytest.raises(WorkerTimeoutError):
        worker.do(calls.sleep, timeout_s=0.01)
    worker.close()
    assert not worker.alive


def test_terminated_workers_clean_up(tmp_path):
    with WorkerPool(1) as pool:
        pool.start(partial(calls.clean_up_at_the_end, tmp_path / "ended"))
        until((tmp_path / "ended.begun").exists)
    assert (tmp_path / "ended").exists()


def test_workers_may_start_workers(pool):
    assert pool.start(partial(calls.squares_of_workers_own, 3)).result() == [0, 1, 4]


def test_workers_ignore_keyboard_interrupts(pool):
    assert pool.start(calls.interrupt_handler).result() is signal.SIG_IGN


def test_pool_starts_no_more_workers_than_needed(pool):
    assert len({pool.start(calls.own_id).result() for _ in range(5)}) <= 2


WAITS = """
import worker_calls as calls
from walkerlab.pipeline.run.workers import WorkerPool
with WorkerPool(2) as pool:
    pool.start_all()
    futures = [pool.start(calls.sleep) for _ in range(3)]
    print("begun", flush=True)
    futures[0].result()
"""


@pytest.mark.skipif(not THERE, reason="needs the kernel's table of processes")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
def test_workers_end_with_their_parent_process(number):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        [sys.executable, "-c", WAITS],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout.readline() == b"begun\n"
        below = workers_below(process.pid)
        process.send_signal(number)
        process.wait(DEADLINE_S)
    assert len(below) == 2
    until(lambda: not any(is_alive(pid) for pid in below))


UNGUARDED = """
import sys
print("the script runs")
from functools import partial
import worker_calls as calls
from walkerlab.pipeline.run.workers import map_in_order
print(list(map_in_order([partial(calls.square, n) for n in range(4)], 2)))
"""


@pytest.mark.parametrize("how", ["script", "stdin", "command"])
def test_script_without_a_main_guard_runs_once_with_workers(tmp_path, how):
    path = tmp_path / "unguarded.py"
    path.write_text(UNGUARDED)
    arguments = {"script": [str(path)], "stdin": ["-"], "command": ["-c", UNGUARDED]}[how]
    done = subprocess.run(
        [sys.executable, *arguments],
        input=UNGUARDED if how == "stdin" else "",
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
    )
    assert done.stdout.splitlines() == ["the script runs", "[0, 1, 4, 9]"], done.stderr


def test_modules_next_to_the_script_are_found_from_any_folder(tmp_path):
    (tmp_path / "beside.py").write_text("def answer():\n    return 42\n")
    script = tmp_path / "script.py"
    script.write_text(
        "import beside\nfrom walkerlab.pipeline.run.workers import WorkerPool\n"
        "with WorkerPool(1) as pool:\n    print(pool.start(beside.answer).result())\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run([sys.executable, str(script)], env=environment, cwd="/", capture_output=True, text=True)
    assert done.stdout == "42\n", done.stderr
