"""A worker that is killed while a command waits for it: an answer that did not come, not a bug."""

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
def test_a_killed_worker_ends_a_command_without_an_answer(walker, command):
    process = walker.start(command, *ASKED, *LONG, "--jobs", "2")
    deadline = time.monotonic() + DEADLINE_S
    while not (below := workers_below(process.pid)) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert below
    os.kill(below[0], signal.SIGKILL)
    _, said = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 4, said
    assert "error: a worker process ended before it had answered (SIGKILL)." in said
    assert "Traceback" not in said
