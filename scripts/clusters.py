"""Run sweeps on a real Slurm of one node and on Dask, kill jobs and workers, and check the results.

    python scripts/clusters.py            # both; takes some minutes
    python scripts/clusters.py --only slurm

The script starts munge, slurmctld and slurmd on this machine's loopback interface, without accounting, in a temporary
folder, and ends them again. On Debian: apt-get install slurm-wlm munge; run as root. If they or one of the extras
`slurm` and `dask` are missing, the script says so and skips that part. It exits with 1 if a check fails.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
TOY = ROOT / "tests" / "pipeline" / "sweeps"
PROGRAMS = ("munged", "slurmctld", "slurmd", "squeue", "sbatch")
SLURM_CONF = """
ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
KillWait=5
ReturnToService=2
NodeName=node1 NodeHostname={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=all Nodes=node1 Default=YES MaxTime=INFINITE State=UP
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--only", choices=("slurm", "dask"))
    only = parser.parse_args().only
    # Other programs start the jobs. Only the environment reaches them.
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(TOY), os.environ.get("PYTHONPATH", ""))))
    sys.path.insert(0, str(TOY))
    warnings.simplefilter("ignore")
    failed = []
    if only != "dask":
        failed += checked_on_slurm()
    if only != "slurm":
        failed += checked_on_dask()
    for name in failed:
        print(f"FAILED: {name}")
    return 1 if failed else 0


def checked_on_slurm() -> list[str]:
    """Return the names of the checks that failed on Slurm."""
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing or os.geteuid() != 0:
        print(f"Slurm is left out: {f'no {missing[0]} (apt-get install slurm-wlm munge)' if missing else 'needs root'}")
        return []
    if importlib.util.find_spec("submitit") is None:
        print("Slurm is left out: no submitit (pip install 'walkerlab[slurm]')")
        return []
    checks = (
        a_sweep_is_that_of_this_machine,
        a_time_limit_loses_nothing,
        a_dead_job_is_noticed,
        a_cancelled_job_is_run_again,
    )
    with slurm_of_one_node():
        return [check.__name__ for check in checks if not passes(check)]


def checked_on_dask() -> list[str]:
    """Return the names of the checks that failed on Dask."""
    if importlib.util.find_spec("distributed") is None:
        print("Dask is left out: no distributed (pip install 'walkerlab[dask]')")
        return []
    return [] if passes(a_nanny_kills_only_the_greedy_point) else [a_nanny_kills_only_the_greedy_point.__name__]


def passes(check: Any) -> bool:
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        try:
            check(Path(folder))
        except AssertionError as error:
            print(f"{check.__name__}: {error}")
            return False
    print(f"{check.__name__}: passed in {time.monotonic() - began:.0f} s", flush=True)
    return True


@contextlib.contextmanager
def slurm_of_one_node() -> Iterator[None]:
    """Run Slurm on the loopback interface for the processes that a `with` block starts."""
    with tempfile.TemporaryDirectory(prefix="slurm-") as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        for below in ("state", "spool"):
            (folder / below).mkdir()
        key = folder / "munge.key"
        key.touch(0o600)
        key.write_bytes(os.urandom(64))
        conf = folder / "slurm.conf"
        host = socket.gethostname().partition(".")[0]
        conf.write_text(SLURM_CONF.format(host=host, ports=free_ports(), folder=folder, cores=os.cpu_count()))
        munge = {"key-file": key, "socket": folder / "munge.socket", "pid-file": folder / "munge.pid"}
        munge |= {"log-file": folder / "munge.log", "seed-file": folder / "munge.seed"}
        daemons = (
            ["munged", "--foreground", "--force", *(f"--{option}={path}" for option, path in munge.items())],
            ["slurmctld", "-D", "-f", str(conf)],
            ["slurmd", "-D", "-f", str(conf), "-N", "node1"],
        )
        os.environ["SLURM_CONF"] = str(conf)
        for command in daemons:
            daemon = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(end, daemon)
            time.sleep(1.0)
        deadline = time.monotonic() + 30.0
        while "idle" not in said("sinfo", "--noheader", "--format=%T"):
            if time.monotonic() > deadline:
                raise SystemExit(f"Slurm does not start:\n{(folder / 'slurmctld.log').read_text()[-2000:]}")
            time.sleep(0.5)
        yield
        said("scancel", "--user=root")


def end(daemon: subprocess.Popen[bytes]) -> None:
    daemon.terminate()
    try:
        daemon.wait(10.0)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()


def free_ports() -> list[int]:
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(2)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def said(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def swept(folder: Path, seeds: str, engine: str = "slurm", chunk_s: float = 600.0, **order: Any) -> Any:
    """Sweep the toy stage, in which some points kill their own process."""
    from toy_sweep.sweep_pipeline import GRAPH

    from walkerlab.config.loader import load
    from walkerlab.pipeline.store.runs import RunFolder
    from walkerlab.pipeline.sweeps.engines import ENGINES, EngineOptions
    from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep
    from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork

    loaded = load()
    run = SweepRun(build_sweep("deadly", [axis_of_text(f"seed={seeds}")]), loaded, RunFolder(folder, "paper"), GRAPH)
    given = EngineOptions(modules=("toy_sweep.deadly",), folder=run.folder.path, **order)
    return run.run(SweepWork(ENGINES[engine], given, chunk_s))


def reasons(sweep: Any) -> dict[int, str]:
    """Return for each seed without a result the reason."""
    group = sweep.content[""]
    rows = zip(group["seed"].tolist(), group["status"].tolist(), group["reason"].tolist(), strict=True)
    return {seed: reason for seed, status, reason in rows if status != "answered"}


def a_sweep_is_that_of_this_machine(folder: Path) -> None:
    ours = swept(folder / "ours", "100:109:10", "local", workers=1)
    theirs = swept(folder / "theirs", "100:109:10", workers=2)
    assert theirs.content.digest() == ours.content.digest(), "the results differ"


def a_time_limit_loses_nothing(folder: Path) -> None:
    """Check that a sweep of two minutes survives a time limit of one minute per job, which ends half a minute early."""
    os.environ["TOY_SWEEP_PAUSE"] = "3"
    began = time.monotonic()
    try:
        sweep = swept(folder, "100:141:42", workers=1, options={"timeout_min": "1", "slurm_signal_delay_s": "20"})
    finally:
        del os.environ["TOY_SWEEP_PAUSE"]
    assert reasons(sweep) == {}, reasons(sweep)
    jobs = list((folder / "paper" / "jobs").glob("*_result.pkl"))
    assert len(jobs) > 2, "no job came to its limit"
    assert time.monotonic() - began < 42 * 3.0 * 1.6 + 60.0, "points were computed twice"


def a_dead_job_is_noticed(folder: Path) -> None:
    """Check that a job is reported as dead if seed 13 kills it, although Slurm keeps no accounts here."""
    from walkerlab.pipeline.sweeps import engines

    assert "disabled" in subprocess.run(["sacct"], capture_output=True, text=True, check=False).stderr
    vars(engines)["RESULT_S"] = 2.0  # the folder is on this machine
    sweep = swept(folder, "12:14:3", workers=2)
    why = reasons(sweep)
    assert set(why) == {13}, why
    assert "JobEndedError: Slurm job" in why[13], why
    assert "ended: FAILED, without a result; its output: " in why[13], why
    assert sweep.error().exit_code == 4


def a_cancelled_job_is_run_again(folder: Path) -> None:
    os.environ["TOY_SWEEP_PAUSE"] = "1"
    killer = threading.Timer(12.0, lambda: said("scancel", "--user=root"))
    killer.start()
    try:
        sweep = swept(folder, "100:119:20", workers=1)
    finally:
        del os.environ["TOY_SWEEP_PAUSE"]
    assert not killer.is_alive(), "the sweep ended before a job was cancelled"
    assert reasons(sweep) == {}, reasons(sweep)


def a_nanny_kills_only_the_greedy_point(folder: Path) -> None:
    """Check that only seed 29 fails: it needs more memory than its worker may have, so Dask's nanny kills it."""
    import dask

    # Dask divides this limit among its workers as if it were the machine's memory. Linux ignores it.
    resource.setrlimit(resource.RLIMIT_RSS, (1 << 30, 1 << 30))
    # A task fails as soon as its first worker dies. With Dask's default it would take four times as long.
    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    os.environ["TOY_SWEEP_GREED"] = str(2 << 30)
    try:
        sweep = swept(folder, "28:30:3", "dask", workers=1)
    finally:
        del os.environ["TOY_SWEEP_GREED"]
    why = reasons(sweep)
    assert set(why) == {29}, why
    assert "its worker died: KilledWorker" in why[29], why
    assert sweep.error().exit_code == 4


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
