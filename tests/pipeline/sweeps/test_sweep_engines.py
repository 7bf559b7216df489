"""Kill workers on this machine, on Dask and in jobs. The other points must be computed, and the fatal one named."""

import contextlib
import os
import signal
import stat
import subprocess
import sys
import threading
import time
from asyncio import CancelledError
from concurrent.futures import Future
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from process_table import THERE, is_alive, processes_below

from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.pipeline.run import work
from walkerlab.pipeline.run.work import JobEndedError, Spread, WorkUnit, compute
from walkerlab.pipeline.run.workers import ONE_THREAD, WorkerDiedError, WorkerPool
from walkerlab.pipeline.sweeps import engines
from walkerlab.pipeline.sweeps.engines import (
    ENGINES,
    EngineOptions,
    JobExecutor,
    SlurmQueue,
    environment_of_workers,
    parse_engine,
    run_until_signalled,
)

LOCAL = ENGINES["local"]


def engine_options(workers=2, **more):
    return EngineOptions(workers, modules=("toy_sweep.deadly",), **more)


def seeds(swept):
    return dict(zip(swept.content[""]["seed"].tolist(), swept.content[""]["status"].tolist(), strict=True))


def test_point_that_kills_its_worker_is_marked_and_the_rest_finishes(toy):
    swept = toy.run("deadly", "seed=[5, 7, 13, 14]", engine=LOCAL, engine_options=engine_options())
    assert {seed for seed, status in seeds(swept).items() if status != "answered"} == {7, 13}
    said = dict(zip(swept.content[""]["seed"].tolist(), swept.content[""]["reason"].tolist(), strict=True))
    assert said[7] == "a bug: ZeroDivisionError: a bug"
    assert said[13].startswith("its worker died: WorkerDiedError")
    assert "SIGKILL" in said[13]
    error = swept.error()
    assert error.exit_code == 1
    assert error.message.startswith("2 of 4 points were not computed, at least one because of a bug")
    assert [note.splitlines()[-1] for note in error.__notes__] == ["ZeroDivisionError: a bug"]
    twice = swept.content[""]["twice"]
    assert np.nansum(twice) == 2 * 5 + 2 * 14


def test_local_workers_can_start_before_points_exist():
    with LOCAL.start_early(EngineOptions(workers=2)) as begun:
        workers = set(processes_below(os.getpid()))
        with begun.opened(EngineOptions(workers=2)) as pool:
            assert pool.submit(os.getpid).result() in workers


def test_only_a_forced_sweep_recomputes_cached_points(toy, marks, tmp_path):
    counts = []
    with LOCAL.start_early(EngineOptions(workers=1)) as begun:
        for first, force in ((2, False), (4, False), (4, True), (4, True)):
            toy.run(
                "roll", f"strides={first}:{first + 1}:2", engine=begun, engine_options=EngineOptions(1), force=force
            )
            counts.append(marks())
            for mark in (tmp_path / "marks").iterdir():
                mark.unlink()
    assert counts == [1, 0, 1, 1]


def test_accidental_death_of_a_worker_loses_nothing(toy, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_SWEEP_ONCE", str(tmp_path / "died"))
    swept = toy.run("deadly", "seed=18:24:7", engine=LOCAL, engine_options=engine_options())
    assert (tmp_path / "died").exists()
    assert set(seeds(swept).values()) == {"answered"}


def test_workers_that_cannot_start_are_reported_after_a_few_tries(toy, monkeypatch):
    monkeypatch.setattr(work, "MAX_DEATHS", 2)  # Each try takes as long as the imports of a worker.
    with pytest.raises(NoAnswer, match="all worker processes died"):
        toy.run("deadly", "seed=1:4:4", engine=LOCAL, engine_options=EngineOptions(1, modules=("no_such_module",)))


SWEEPER = """
import sys
from pathlib import Path
from walkerlab.config.loader import load
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.pipeline.sweeps.engines import EngineOptions
from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep
from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork
from toy_sweep.sweep_pipeline import GRAPH
read = load()
question = build_sweep("deadly", [axis_of_text("seed=100:179:80")])
sweep = SweepRun(question, read, RunFolder(Path(sys.argv[1]), "paper"), GRAPH)
engine_options = EngineOptions(2, modules=("toy_sweep.deadly",))
swept = sweep.run(SweepWork(engine_options=engine_options, chunk_s=0.05))
print(swept.content.digest(), swept.failed)
"""


@pytest.mark.skipif(not THERE, reason="needs the kernel's table of processes")
def test_killed_sweep_leaves_no_process_and_resumes(toy, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_SWEEP_PAUSE", "0.02")
    script = tmp_path / "sweeper.py"
    script.write_text(SWEEPER)
    command = [sys.executable, str(script), str(toy.runs)]
    chunks = toy.runs / "paper" / "sweep-chunks"
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 90.0
    while not (chunks.is_dir() and len(list(chunks.glob("*.h5"))) >= 3) and time.monotonic() < deadline:
        time.sleep(0.01)
    below = processes_below(process.pid)
    process.kill()
    process.wait()
    assert below
    while any(is_alive(pid) for pid in below) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [pid for pid in below if is_alive(pid)]
    monkeypatch.delenv("TOY_SWEEP_PAUSE")
    resumed = toy.run("deadly", "seed=100:179:80")
    assert resumed.failed == 0
    assert resumed.content.digest() == toy.run("deadly", "seed=100:179:80", force=True).content.digest()


def test_concurrent_sweeps_on_one_folder_give_equal_results(toy, tmp_path):
    script = tmp_path / "sweeper.py"
    script.write_text(SWEEPER)
    command = [sys.executable, str(script), str(toy.runs)]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate(timeout=120)[0].split() for process in both]
    assert said[0] == said[1] == [toy.run("deadly", "seed=100:179:80").content.digest(), "0"]


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_dask_gives_the_same_result_and_survives_dead_workers(toy, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    monkeypatch.setenv("TOY_SWEEP_PAUSE", "0.02")
    with (
        environment_of_workers(),  # Dask changes the environment of this process, so restore it afterwards.
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        killer = threading.Timer(0.5, lambda: [os.kill(pid, signal.SIGKILL) for pid in pids])
        killer.start()
        engine, _ = parse_engine("dask")
        swept = toy.run(
            "deadly",
            "seed=100:179:80",
            engine=engine,
            engine_options=engine_options(address=client.scheduler.address),
            chunk_s=0.2,
        )
        killer.join()
        assert set(client.run(os.getpid).values()).isdisjoint(pids)
    assert set(seeds(swept).values()) == {"answered"}
    monkeypatch.delenv("TOY_SWEEP_PAUSE")
    assert swept.content.digest() == toy.run("deadly", "seed=100:179:80", force=True).content.digest()


def test_cancelled_or_failed_job_is_reported_and_forgotten():
    class Job:
        def __init__(self, error):
            self.error = error

        def result(self):
            raise self.error

    executor = JobExecutor(Job, 1)
    # The first of these errors is not an Exception.
    for error in (CancelledError("its worker is gone"), ValueError("no result")):
        assert executor.submit(error).exception(timeout=10.0) is error
    deadline = time.monotonic() + 10.0
    while executor.jobs and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not executor.jobs


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_dask_starts_a_local_cluster(toy):
    pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    engine, address = parse_engine("dask")
    assert address == ""
    before = [os.environ.get(name) for name in ONE_THREAD]
    swept = toy.run("deadly", "seed=100:103:4", engine=engine, engine_options=engine_options(1))
    assert set(seeds(swept).values()) == {"answered"}
    assert [os.environ.get(name) for name in ONE_THREAD] == before


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_slurm_jobs_on_this_machine_mark_the_point_that_kills_its_worker(toy, tmp_path, monkeypatch):
    submitit = pytest.importorskip("submitit", reason="the extra `slurm` is not installed")
    # how long submitit waits for the result of a dead job on a slow network disk, and how often it checks for results
    monkeypatch.setattr(submitit.Job, "_results_timeout_s", 0)
    monkeypatch.setattr(submitit.core.core, "_time", SimpleNamespace(time=time.time, sleep=lambda _: time.sleep(0.05)))
    options = {"cluster": "local", "timeout_min": "5"}
    swept = toy.run(
        "deadly",
        "seed=11:13:3",
        engine=ENGINES["slurm"],
        engine_options=engine_options(2, folder=tmp_path, options=options),
    )
    assert {seed for seed, status in seeds(swept).items() if status != "answered"} == {13}
    assert "its worker died" in swept.content[""]["reason"][2]


@pytest.mark.parametrize("number", [signal.SIGUSR2, signal.SIGTERM])
def test_terminated_job_returns_its_finished_units(number):
    units = (WorkUnit("a", 1, int), WorkUnit("b", 1, partial(signal.raise_signal, number)), WorkUnit("c", 1, int))
    with WorkerPool(1) as pool:
        results = pool.submit(run_until_signalled, compute, units).result(timeout=60)
        assert [value for value, _ in results] == [0]
        assert pool.submit(run_until_signalled, compute, units[1:]).result(timeout=60) == []


class Cut(WorkerPool):
    """Workers whose jobs end after one unit, or before the unit `slow` is done."""

    def __init__(self, slow):
        super().__init__(1)
        self.slow = slow

    def submit(self, fn, batch):
        future = Future()
        future.set_result([] if batch[0].name == self.slow else compute(batch[:1]))
        return future


@pytest.mark.parametrize(("slow", "given_up"), [("", []), ("2", ["2"])])
def test_unfinished_units_of_a_job_are_computed_by_another(slow, given_up):
    names, lost, why = [], [], []

    def keep(batch, results):
        names.extend(unit.name for unit, _ in zip(batch, results, strict=True))

    def give_up(unit, error):
        lost.append(unit.name)
        why.append(str(error))

    units = [WorkUnit(str(number), 1, int) for number in range(6)]
    with Cut(slow) as cut:
        Spread(iter(units), 6, keep, give_up, 600.0, 1e-3).run(cut)
    assert lost == given_up
    assert sorted(names + lost) == [unit.name for unit in units]
    assert all("before it had computed one unit" in text for text in why)


class OneFate(WorkerPool):
    """A worker that loses all its units when it dies, as in Dask."""

    def __init__(self):
        super().__init__(1)
        self.waiting = []

    def submit(self, fn, batch):
        future = Future()
        self.waiting.append((future, batch))
        threading.Timer(0.02, self.work).start()
        return future

    def work(self):
        given, self.waiting = self.waiting, []
        dies = any(unit.name == "deadly" for _, batch in given for unit in batch)
        for future, batch in given:
            if dies:
                future.set_exception(WorkerDiedError(-signal.SIGKILL))
            else:
                future.set_result(compute(batch))


def test_unit_lost_because_another_killed_the_worker_is_retried_alone():
    names, lost = [], []
    units = [WorkUnit(name, 1, int) for name in ("deadly", "beside")]
    with OneFate() as worker:
        Spread(
            iter(units),
            2,
            lambda batch, _: names.extend(unit.name for unit in batch),
            lambda unit, _: lost.append(unit.name),
            0.0,
            1e-3,
        ).run(worker)
    assert (names, lost) == (["beside"], ["deadly"])


FAKE_SQUEUE = """#!/bin/sh
cat {folder}/answer 2>/dev/null
"""


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        ("41 RUNNING\n42 TIMEOUT\n", "Slurm job 42 reached its time limit (60 min; --engine-option timeout_min=N)"),
        ("42 OUT_OF_MEMORY\n", "needed more memory than it may have (--engine-option mem_gb=N)"),
        ("42 NODE_FAIL\n", "ended: NODE_FAIL"),
        ("41 RUNNING\n", "left the queue"),
        (None, "squeue has not answered"),
    ],
)
def test_slurm_job_without_a_result_is_detected_without_accounting(answer, expected, tmp_path, monkeypatch):
    for name, value in (("LISTING_S", 0.0), ("RESULT_S", 0.0), ("SILENT_WORKER_S", 0.1)):
        monkeypatch.setattr(engines, name, value)
    program = tmp_path / "squeue"
    program.write_text(FAKE_SQUEUE.format(folder=tmp_path))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    if answer is not None:
        (tmp_path / "answer").write_text(answer)
    paths = SimpleNamespace(result_pickle=tmp_path / "result", stderr=tmp_path / "log")
    with pytest.raises(JobEndedError) as ended:
        SlurmQueue("60").wait(SimpleNamespace(job_id="42", paths=paths))
    assert expected in ended.value.message
    assert ended.value.message.endswith(f"without a result; its output: {tmp_path / 'log'}")
    paths.result_pickle.touch()
    SlurmQueue("60").wait(SimpleNamespace(job_id="42", paths=paths))


def test_slurm_job_newer_than_the_last_listing_is_not_lost(tmp_path, monkeypatch):
    program = tmp_path / "squeue"
    program.write_text("#!/bin/sh\necho 41 RUNNING\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    queue = SlurmQueue("60")
    assert queue.state("42", time.monotonic() - 1.0) == "gone"
    assert queue.state("42", time.monotonic()) == "UNKNOWN"


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_sweep_workers_import_nothing_from_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cloudpickle.py").write_text("raise SystemExit('imported')")
    for name, options in (("slurm", {"cluster": "local"}), ("dask", {})):
        with ENGINES[name].opened(EngineOptions(1, folder=tmp_path, options=options)) as pool:
            assert pool.submit(os.getpid).result(timeout=60)


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_dask_cluster_without_workers_gets_new_ones(monkeypatch):
    monkeypatch.setattr(engines, "RESTART_S", 1.0)
    distributed = pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    with ENGINES["dask"].opened(EngineOptions(1)) as pool:
        client = distributed.get_client()
        client.retire_workers(list(client.nthreads()), close_workers=True)
        assert pool.submit(os.getpid).result(timeout=60)


FAKE_SBATCH = """#!/bin/sh
cp "$1" {folder}/submitted.sh
echo "Submitted batch job 42"
"""


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_slurm_job_requests_the_stated_resources(tmp_path, monkeypatch):
    pytest.importorskip("submitit", reason="the extra `slurm` is not installed")
    for name, text in (
        ("sbatch", FAKE_SBATCH.format(folder=tmp_path)),
        ("srun", "#!/bin/sh\n"),
        ("sacct", "#!/bin/sh\n"),
    ):
        program = tmp_path / name
        program.write_text(text)
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    options = {"slurm_partition": "short", "timeout_min": "30", "python": "/opt/python"}
    with ENGINES["slurm"].opened(EngineOptions(options=options, folder=tmp_path)) as pool:
        assert pool.size == 16
        pool.submit(os.getpid)
    job = (tmp_path / "submitted.sh").read_text()
    for line in ("--partition=short", "--time=30", "--cpus-per-task=1", "--job-name=walkerlab"):
        assert f"#SBATCH {line}" in job
    assert "/opt/python -u -m submitit" in job


@pytest.mark.filterwarnings("ignore")  # warnings from inside the library
def test_pickled_jobs_are_private(tmp_path):
    pytest.importorskip("submitit", reason="the extra `slurm` is not installed")
    run, jobs = tmp_path / "run", tmp_path / "run" / "jobs"
    local = {"cluster": "local"}
    jobs.mkdir(parents=True)
    for name, mode in (("earlier.pkl", 0o664), ("foreign.pkl", 0o666)):
        (jobs / name).touch()
        (jobs / name).chmod(mode)
    with ENGINES["slurm"].opened(EngineOptions(folder=run, options=local)) as pool:
        assert pool.submit(os.getpid).result(timeout=60)
    assert stat.S_IMODE(jobs.stat().st_mode) == 0o700
    assert stat.S_IMODE((jobs / "earlier.pkl").stat().st_mode) == 0o600
    assert not (jobs / "foreign.pkl").exists()
    run.chmod(0o777)
    with pytest.raises(ConfigError, match="is writable by others") as refused:
        ENGINES["slurm"].opened(EngineOptions(folder=run, options=local)).__enter__()
    assert f"chmod o-w {run}" in refused.value.advice


def test_unknown_or_uninstalled_sweep_engine_is_reported(monkeypatch):
    with pytest.raises(ConfigError, match="unknown engine; choose from local, dask, slurm"):
        parse_engine("cloud")
    assert parse_engine("dask=tcp://10.0.0.1:8786")[1] == "tcp://10.0.0.1:8786"
    with pytest.raises(ConfigError, match="takes no address"), LOCAL.opened(EngineOptions(address="x")):
        pass
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError) as caught, ENGINES["dask"].opened(EngineOptions()):
        pass
    assert caught.value.advice == "pip install 'walkerlab[dask]'"


def test_option_of_a_slurm_job_must_be_a_number(tmp_path):
    for text in ("1.5", "abc"):
        options = EngineOptions(folder=tmp_path, options={"cluster": "local", "mem_gb": text})
        with contextlib.ExitStack() as stack:
            if text == "abc":
                stack.enter_context(pytest.raises(ConfigError, match="mem_gb"))
            stack.enter_context(ENGINES["slurm"].opened(options))


def test_chunk_size_follows_measured_times_and_shrinks_at_the_end():
    spread = Spread(iter(()), 10_000, list, print, 5.0)
    assert spread._batch_size(2) == 2
    spread.unit_s = 0.01
    assert spread._batch_size(2) == 500
    spread.left = 60
    assert spread._batch_size(2) == 50  # A batch is half a second of work, however little is left.
    spread.unit_s = 20.0
    assert spread._batch_size(2) == 1
