"""Fixtures that run the command lines of the real pipeline and of the toy pipeline in separate processes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from forks import forks

import walkerlab

TOY = Path(__file__).parents[2] / "pipeline" / "toy"
ROOT = Path(walkerlab.__file__).parent.parent


class Program:
    """A program that can be run on a folder of runs."""

    def __init__(self, module, folder, *paths):
        self.module, self.command = module, [sys.executable, "-m", module]
        self.folder = folder
        self.environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*paths, ROOT]))}

    def __call__(self, *arguments, environment=None):
        return forks().run(self.module, arguments, self.folder, {**self.environment, **(environment or {})})

    def alone(self, *arguments):
        """Run the program in one process, because starting more would take longer than the stages of the toy."""
        return self(*arguments, "--jobs", "1")

    def start(self, *arguments, environment=None, **options):
        """Start the program as a terminal does: background jobs of a script ignore Ctrl-C."""
        return subprocess.Popen(
            [*self.command, *map(str, arguments)],
            cwd=self.folder,
            env={**self.environment, **(environment or {})},
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
        )


@pytest.fixture
def toy(tmp_path):
    """Return the command line of the toy pipeline in an empty folder."""
    shutil.copytree(TOY, tmp_path / "source" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "work").mkdir()
    return Program("toy", tmp_path / "work", tmp_path / "source")


@pytest.fixture
def walker(tmp_path):
    """Return the real command line in an empty folder."""
    return Program("walkerlab", tmp_path)


@pytest.fixture(scope="module")
def edited(tmp_path_factory):
    """Return the real command line in a folder with a run whose config file was edited afterwards."""
    walker = Program("walkerlab", tmp_path_factory.mktemp("edited"))
    file = walker.folder / "light.yaml"
    file.write_text("extends: paper\nstrides: 1\n")
    walker("compare", "-c", "light.yaml")
    file.write_text("extends: paper\nstrides: 1\nwalker: {hip_mass_kg: 15}\n")
    return walker


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Return the command line of the toy pipeline in a folder with one sweep, and the output of that sweep."""
    folder = tmp_path_factory.mktemp("sweep")
    shutil.copytree(TOY, folder / "source" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "work").mkdir()
    toy = Program("toy", folder / "work", folder / "source")
    over = ("--over", "gravity_m_s2=1:9:3", "--over", "slope_rad=[0.1, 1.2]")
    done = toy("sweep", "--stage", "drop", "--jobs", "1", *over, "--json", "--csv")
    assert done.returncode == 0, done.stderr
    return toy, json.loads(done.stdout)
