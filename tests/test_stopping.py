"""Check that a request to stop ends the process cleanly, even while LLVM runs a callback."""

import os
import subprocess
import sys

import pytest

STOPPED = """
import os, signal, sys, time
import numba.core.codegen as codegen

compiled_so_far = []
usual = codegen.CPUCodeLibrary._object_compiled_hook

def hook(cls, module, compiled):
    if not compiled_so_far:
        os.kill(os.getpid(), int(sys.argv[1]))
    compiled_so_far.append(module)
    return usual.__func__(cls, module, compiled)

codegen.CPUCodeLibrary._object_compiled_hook = classmethod(hook)

import typer
from walkerlab.views.cli.request import exit_on_failure
from walkerlab.views.cli.request import Request
from walkerlab.physics.kernels import kernel

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it

@kernel
def added(x):
    return x + 1.0

try:
    with exit_on_failure(Request("trial")):
        added(1.0)
        time.sleep(60.0)
except typer.Exit as end:
    sys.exit(end.exit_code)
"""


@pytest.mark.parametrize("number", ["2", "15"])
def test_interrupting_compilation_prints_two_lines(number, tmp_path):
    (tmp_path / "stopped.py").write_text(STOPPED)
    environment = {**os.environ, "WALKERLAB_CACHE": str(tmp_path / "cache")}
    command = [sys.executable, "stopped.py", number]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stdout == ""
    said, advice = done.stderr.splitlines()
    assert said == "interrupted"
    assert advice.startswith("advice: ")
