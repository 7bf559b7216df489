"""Run programs in forks of a process that has loaded the libraries. The forks are separate processes, but each saves a
second of imports. Run as a script, this module is the process that is forked: once for every line of JSON that it
reads. It answers with the exit code.
"""

import atexit
import gc
import importlib
import json
import os
import pkgutil
import runpy
import signal
import subprocess
import sys
import tempfile
import traceback
from functools import cache
from pathlib import Path

LIBRARIES = [
    "email.parser", "filelock", "h5py", "jinja2", "numba", "numpy", "pydantic.type_adapter", "ruamel.yaml",
    "scipy.integrate", "scipy.optimize", "typer",
]  # fmt: skip
PACKAGES = ["views.cli", "config", "views.report", "pipeline.run", "pipeline.plan", "pipeline.store", "pipeline.sweeps"]
LONGEST_S = 120


class Forks:
    """Handle of the process that is forked."""

    def __init__(self):
        # Threads of libraries would not exist in the fork.
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, text=True
        )
        atexit.register(self.process.communicate)

    def run(self, module, arguments, folder, environment):
        """Run `python -m module arguments` in a folder, and wait until it ends."""
        with tempfile.TemporaryDirectory() as place:
            said = [Path(place, name) for name in ("stdout", "stderr")]
            asked = (module, [str(one) for one in arguments], str(folder), environment, [str(path) for path in said])
            self.process.stdin.write(json.dumps(asked) + "\n")
            self.process.stdin.flush()
            code = int(self.process.stdout.readline())
            texts = [path.read_text(encoding="utf-8") for path in said]
        return subprocess.CompletedProcess([module, *arguments], code, *texts)


@cache
def forks():
    """Return the server of this process."""
    return Forks()


def loaded_with_the_package():
    """List the modules of the package that most commands load."""
    for name in PACKAGES:
        package = importlib.import_module(f"walkerlab.{name}")
        yield from (
            f"{package.__name__}.{found.name}" for found in pkgutil.iter_modules(getattr(package, "__path__", []))
        )


def serve():
    """Fork for each request. In the child, return the request to run. In the parent, return None when there are no more
    requests.
    """
    for line in sys.stdin:
        if not (child := os.fork()):
            return json.loads(line)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    return None


def become(module, arguments, folder, environment, said):
    """Turn this process into `python -m module`, run in a folder."""
    signal.alarm(LONGEST_S)
    for number, path in enumerate((os.devnull, *said)):
        file = os.open(path, os.O_RDWR | os.O_CREAT)
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.path[0:1] = [folder, *environment.get("PYTHONPATH", "").split(os.pathsep)]
    sys.argv[1:] = arguments
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def to_the_end(asked):
    """Run the request, then exit without unloading the libraries, because this would take longer than most runs."""
    code = 0
    try:
        become(*asked)
    except SystemExit as end:
        code = end.code or 0
    except BaseException:
        traceback.print_exc()
        code = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(code)


if __name__ == "__main__":
    for module in (*LIBRARIES, *loaded_with_the_package()):
        importlib.import_module(module)
    gc.freeze()
    if (request := serve()) is not None:
        to_the_end(request)
