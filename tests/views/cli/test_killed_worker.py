"""Check that a command whose workers are killed ends without an answer, but does not report a bug."""

import contextlib
import os
import signal
import time

import pytest
from process_table import THERE, workers_below

DEADLINE_S = 60.0
ASKED = ("-c", "slope-3deg", "--set", "robustness.model=rigid", "--set", "robustness.to=[slope_deg]")
LONG = ("--set", "robustness.walks=4000", "--set", "robustness.roughness_m=[0.0001]")


@pytest.mark.skipif(not THERE, reason="needs the kernel's table of processes")
@pytest.mark.parametrize("command", ["robustness", "report"])
def test_command_with_killed_workers_ends_without_an_answer(walker, command):
    """Kill all workers, because another worker could take over the work of a killed one."""
    process = walker.start(command, *ASKED, *LONG, "--jobs", "2")
    deadline, killed = time.monotonic() + DEADLINE_S, 0
    while process.poll() is None and time.monotonic() < deadline:
        for worker in workers_below(process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
                killed += 1
        time.sleep(0.01)
    _, said = process.communicate(timeout=DEADLINE_S)
    assert killed
    assert process.returncode == 4, said
    assert "a worker process ended before it had answered (SIGKILL)." in said
    assert "Traceback" not in said
