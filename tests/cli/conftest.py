"""The command line in processes of its own: of the real pipeline and of the toy one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import walkerlab

TOY = Path(__file__).parent.parent / "stages" / "toy"
ROOT = Path(walkerlab.__file__).parent.parent


class Program:
    """A program to be run on a folder of runs."""

    def __init__(self, module, folder, *paths):
        self.command = [sys.executable, "-m", module]
        self.folder = folder
        self.environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*paths, ROOT]))}

    def __call__(self, *arguments, **options):
        return subprocess.run(
            [*self.command, *map(str, arguments)],
            cwd=self.folder,
            env={**self.environment, **options.pop("environment", {})},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
            **options,
        )

    def start(self, *arguments, environment=None, **options):
        return subprocess.Popen(
            [*self.command, *map(str, arguments)],
            cwd=self.folder,
            env={**self.environment, **(environment or {})},
            text=True,
            **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
        )


@pytest.fixture
def toy(tmp_path):
    """The command line of the toy pipeline, in an empty folder."""
    shutil.copytree(TOY, tmp_path / "source" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "work").mkdir()
    return Program("toy", tmp_path / "work", tmp_path / "source")


@pytest.fixture
def walker(tmp_path):
    """The real command line, in an empty folder."""
    return Program("walkerlab", tmp_path)
