"""Fixtures for sweeps of the toy pipeline, in this process and in others."""

import contextlib
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import walkerlab
from walkerlab.config.loader import load
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.pipeline.sweeps.chunk import input_cache
from walkerlab.pipeline.sweeps.engines import EngineOptions, SweepEngine
from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep
from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork

HERE = Path(__file__).parent


@contextlib.contextmanager
def in_this_process(_order):
    with ThreadPoolExecutor(1) as executor:
        executor.size = 1
        yield executor


HERE_AND_NOW = SweepEngine(in_this_process, chunk_s=5.0)


class Toy:
    def __init__(self, runs):
        from toy_sweep.sweep_pipeline import GRAPH

        self.runs = runs
        self.graph = GRAPH

    def sweep(self, stage, *over, config=None, sets=(), **options):
        read = load(config, sets)
        question = build_sweep(stage, [axis_of_text(text) for text in over], **options)
        return SweepRun(question, read, RunFolder(self.runs, read.run_name), self.graph)

    def run(
        self,
        stage,
        *over,
        engine=HERE_AND_NOW,
        engine_options=None,
        chunk_s=None,
        reporter=None,
        force=False,
        **options,
    ):
        work = SweepWork(engine, engine_options or EngineOptions(), chunk_s, force=force)
        return self.sweep(stage, *over, **options).run(work, reporter)


@pytest.fixture
def toy(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(HERE)
    paths = [str(HERE), str(Path(walkerlab.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    return Toy(tmp_path / "runs")


@pytest.fixture
def marks(tmp_path, monkeypatch):
    """Let every computed point leave a mark, and return a function that counts the marks."""
    folder = tmp_path / "marks"
    folder.mkdir()
    input_cache.cache_clear()  # Forget the inputs that earlier sweeps in this process have cached.
    monkeypatch.setenv("TOY_SWEEP_MARKS", str(folder))
    return lambda: len(list(folder.iterdir()))
