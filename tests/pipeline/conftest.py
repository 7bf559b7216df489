"""Fixtures that give each test a copy of the toy pipeline, which this and other processes can import."""

import importlib
import os
import shutil
import sys
from pathlib import Path

import pytest

import walkerlab
from walkerlab.config.loader import load
from walkerlab.pipeline.plan.planner import Planner
from walkerlab.pipeline.plan.results import FolderResults
from walkerlab.pipeline.run.runner import Options, execute
from walkerlab.pipeline.store.runs import RunFolder

HERE = Path(__file__).parent


class Toy:
    """The toy pipeline on a folder of runs."""

    def __init__(self, source, runs):
        self.source = source
        self.runs = runs
        self.graph = importlib.import_module("toy.pipeline").GRAPH
        self.environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(source), str(Path(walkerlab.__file__).parent.parent)]),
        }

    def loaded(self, *sets, config=None):
        loaded = load(Path(config) if config else None, sets)
        return loaded.config, RunFolder(self.runs, loaded.run_name)

    def execute(self, target, *sets, config=None, reporter=None, **options):
        loaded, folder = self.loaded(*sets, config=config)
        return execute(loaded, target, folder, Options(**options), reporter, self.graph)

    def plan(self, target, *sets, config=None, force=False):
        loaded, folder = self.loaded(*sets, config=config)
        stages = self.graph.needed_for(target, loaded)
        return Planner(loaded, FolderResults(folder, self.graph), stages, force=force).plan()

    def preview(self, target, *sets, config=None, **options):
        loaded, folder = self.loaded(*sets, config=config)
        return execute(loaded, target, folder, Options(**options, dry=True), graph=self.graph)

    def edit(self, module, old, new):
        """Change the source of a toy stage. This process keeps using the version that it has imported."""
        path = self.source / "toy" / f"{module}.py"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))


@pytest.fixture
def toy(tmp_path, monkeypatch):
    shutil.copytree(HERE / "toy", tmp_path / "source" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.syspath_prepend(tmp_path / "source")
    for name in [name for name in sys.modules if name.partition(".")[0] == "toy"]:
        monkeypatch.delitem(sys.modules, name)
    return Toy(tmp_path / "source", tmp_path / "runs")


class Listener:
    """A reporter that records the events of all stages."""

    def __init__(self):
        self.notes, self.warnings, self.started, self.begun, self.ended, self.pages = [], [], [], [], [], []

    def begin(self, stage, place, expected_s=None):
        self.begun.append((stage, place, expected_s))
        return self

    def end(self, said):
        self.ended.append(said)

    def announce_page(self, summary, folder):
        if "html" in summary:
            self.pages.append((folder / summary["html"]).read_text())

    def start(self, label, total=None):
        self.started.append((label, total))

    def advance(self, n=1):
        pass

    def note(self, text):
        self.notes.append(text)

    def warn(self, text):
        self.warnings.append(text)


@pytest.fixture
def listener():
    return Listener()
