"""Run a sweep: reuse stored points, compute the others and write one file."""

import contextlib
import hashlib
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np

from walkerlab.config import loader, reads, schema
from walkerlab.config.problems import SHOWN_PROBLEMS
from walkerlab.errors import ConfigError, NoAnswer, WalkerlabError
from walkerlab.extensions import versions
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.results import Keys
from walkerlab.pipeline.progress import Progress, Reporter, Silent
from walkerlab.pipeline.run.work import Spread, WorkUnit
from walkerlab.pipeline.stages.walk import SAMPLE, evenly_spread
from walkerlab.pipeline.store import artifact, files, hdf5, provenance, runs
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.sweeps.chunk import Chunk, PointResult, compute_point, join_points, store, stored_chunks
from walkerlab.pipeline.sweeps.engines import ENGINES, EngineOptions, SweepEngine
from walkerlab.pipeline.sweeps.question import SweptStage
from walkerlab.pipeline.sweeps.result import Merge


@dataclass(frozen=True)
class SweepWork:
    """Options for computing a sweep."""

    engine: SweepEngine = ENGINES["local"]  # engine that computes the points
    engine_options: EngineOptions = field(default_factory=EngineOptions)
    chunk_s: float | None = None  # target duration of a chunk, s; None for the engine's default
    wait: bool = True  # wait for another process that works in the folder
    force: bool = False  # compute every point, stored or not
    # Called with the names of all quantities so far, after each chunk that contains an answer. To stop the sweep, it
    # raises an error.
    check: Callable[[Collection[str]], None] = lambda _names: None


@dataclass(frozen=True)
class Swept:
    """Result of a sweep."""

    question: SweptStage
    path: Path  # file of the sweep
    summary: Mapping[str, Any]  # summary stored in the file
    reused: int  # number of points whose stored result was reused
    wall_s: float  # total time
    bugs: tuple[str, ...] = ()  # tracebacks of bugs that stopped the computation of points

    @property
    def content(self) -> Content:
        return artifact.read(self.path)

    @property
    def group(self) -> Group:
        """Variables over the points, each read from the file on access."""
        return hdf5.GroupOnDisk(self.path)

    @property
    def failed(self) -> int:
        """Number of points whose computation failed."""
        return int(self.summary["failed"])

    def error(self) -> WalkerlabError:
        """Return the error for points that were not computed. All other points are stored."""
        message = f"{self.failed} of {len(self.question)} points were not computed"
        reason = f"`reason` in {self.path} says why."
        if not self.bugs:
            return NoAnswer(f"{message}; {reason}", "The same command tries them again and keeps the rest.")
        error = WalkerlabError(
            f"{message}, at least one because of a bug; {reason}", "Please report the traceback; the rest is stored."
        )
        for bug in self.bugs:
            error.add_note(bug)
        return error


@dataclass(frozen=True)
class Foreseen:
    """Plan of a sweep."""

    path: Path
    points: tuple[str, ...]  # descriptions of the first points
    count: int  # number of points
    there: int  # number of points whose result is already stored
    estimate_s: float | None  # expected time for the other points, s; None if no stored point has a run time


class SweepRun:
    """Sweep whose points are all valid."""

    def __init__(
        self, question: SweptStage, loaded: loader.LoadedConfig, folder: runs.RunFolder, graph: Graph = PIPELINE
    ) -> None:
        """Check every point against the schema.

        Raises ConfigError for invalid points and for a stage that cannot be swept.
        """
        refuse_unknown_stage(question.stage, graph)
        self.question = question
        self.folder = folder
        self.loaded = loaded
        self.keys = Keys(graph)
        keys = np.frombuffer(b"".join(checked_keys(self)), dtype="S32")
        unique, self.inverse = np.unique(keys, return_inverse=True)
        # NumPy drops zero bytes at the end of a byte string.
        self.places = {key.ljust(32, b"\0").hex(): index for index, key in enumerate(unique.tolist())}
        # For each distinct key, the index of the first point that has it.
        self.first = np.full(len(unique), len(keys))
        # Unlike an assignment, `minimum.at` counts every one of several equal indices.
        np.minimum.at(self.first, self.inverse, np.arange(len(keys)))
        over = {axis.key: list(axis.values) for axis in question.axes}
        base = loaded.config.model_dump(mode="json", exclude={"sweep"})
        self.slice = {"of": question.stage, "over": over, "layout": question.layout, "config": base}
        digest = hashlib.sha256(reads.canonical_json(self.slice).encode()).hexdigest()[:8]
        self.path = folder.path / f"sweep-{question.stage}-{'-'.join(question.names)[:60]}-{digest}.h5"

    def config(self, index: int) -> schema.Config:
        """Build the config of one point. It is not kept, because a sweep may have a million points."""
        return self.loaded.variant(self.question.settings(index))

    def foresee(self, workers: int, max_points: int) -> Foreseen:
        """Return what the sweep would do. This changes no file.

        Raises ConfigError if the folder holds results of another config.
        """
        runs.refuse_another_config(self.folder, self.loaded.config)
        stored = np.zeros(len(self.places), bool)
        rows: list[PointResult] = []
        for chunk in self._stored(Silent().warn):
            rows += chunk.rows
            stored[[self.places[row.key] for row in chunk.rows if row.key in self.places]] = True
        count = len(self.question)
        missing = int(np.sum(~stored))
        walls = [row.wall_s for row in rows if row.wall_s > 0.0]
        estimate: float | None = 0.0
        if missing:
            estimate = float(np.median(walls)) * missing / max(1, workers) if walls else None
        descriptions = tuple(self.question.describe_point(index) for index in range(min(max_points, count)))
        return Foreseen(self.path, descriptions, count, int(stored[self.inverse].sum()), estimate)

    def run(self, work: SweepWork, reporter: Reporter | None = None) -> Swept:
        """Compute the points without a stored result and write the sweep's file.

        Raises ConfigError if the folder holds results of another config, LockedError (only without `wait`),
        StorageError, and NoAnswer if workers keep dying.
        """
        started = time.perf_counter()
        count = len(self.question)
        reporter = reporter or Silent()
        for key in unread_keys(self):
            reporter.note(f"sweep: {self.question.stage} does not read {key}, so its results do not depend on it")
        files.make_folder(self.folder.path)
        with self.folder.locked(work.wait, reporter.note):
            runs.claim(self.folder, self.loaded.config)
            merge = Merge(self.question, self.loaded.config, self.inverse)
            for chunk in () if work.force else self._stored(reporter.warn):
                merge.put(chunk, self.places)
            reused = int(merge.has_row[self.inverse].sum())
            if reused:
                reporter.note(f"sweep: {reused} of {count} points exist already")
            origin = provenance.begin(self.loaded.config, {})
            progress = reporter.begin("sweep", f"{count - reused} of {count} points to compute")
            try:
                bugs = self._compute(merge, work, reporter, progress, origin)
            except KeyboardInterrupt:
                stored = int(merge.has_row[self.inverse].sum())
                reporter.note(f"sweep: interrupted; {stored} of {count} points are kept")
                raise
            finally:
                progress.end("")
            content = merge.content()
            identity = Identity("sweep", self.slice, {}, self.code_digest)
            complete = content.summary["failed"] == 0
            artifact.write_in_turn(self.path, content, identity, origin.finish(), complete)
        return Swept(self.question, self.path, content.summary, reused, time.perf_counter() - started, bugs)

    @property
    def code_digest(self) -> str:
        return self.keys.code_digest(self.question.stage)

    def _stored(self, warn: Callable[[str], None]) -> Iterator[Chunk]:
        return stored_chunks(self.folder.runs_dir, self.question.stage, self.code_digest, self.places, warn)

    def _compute(
        self, merge: Merge, work: SweepWork, reporter: Reporter, progress: Progress, origin: provenance.Provenance
    ) -> tuple[str, ...]:
        """Compute the missing points, and return the tracebacks of bugs, but only one for each line of code."""
        missing = np.sort(self.first[~merge.has_row])
        if not missing.size:
            return ()
        bugs: dict[str, str] = {}
        progress.start("sweep", int(missing.size))

        def keep(chunk: Chunk) -> None:
            store(self.folder, self.question.stage, self.code_digest, chunk, origin)
            merge.put(chunk, self.places)
            if any(row.status == "answered" for row in chunk.rows):
                work.check(merge.numbers)
            for bug in (row.bug for row in chunk.rows if row.bug):
                place = bug.rpartition("\n  ")[0]  # the message is left out, because it differs from point to point
                if place not in bugs:
                    reporter.warn(f"a bug stopped one point of the sweep; the others continue.\n{bug}")
                    bugs[place] = bug
            progress.advance(len(chunk.rows))

        def give_up(unit: WorkUnit, error: BaseException) -> None:
            reason = f"its worker died: {type(error).__name__}: {error}"
            keep(Chunk((PointResult(unit.name, "failed", reason),), {}))

        todo = self._units(missing.tolist(), work)
        chunk_s = work.chunk_s or work.engine.chunk_s
        spread = Spread(todo, int(missing.size), lambda _units, points: keep(join_points(points)), give_up, chunk_s)
        with work.engine.opened(work.engine_options) as pool:
            spread.run(pool)
        return tuple(bugs.values())

    def _units(self, indices: list[int], work: SweepWork) -> Iterator[WorkUnit]:
        """Yield the points to compute. The walks of a sample of them are repeated to measure the numerical error."""
        stage = self.question.stage
        # Workers keep inputs between chunks. Because of the new token, a forced sweep does not reuse those of earlier
        # sweeps.
        forced = token_hex() if work.force else ""
        sample = set(np.sort(self.first)[evenly_spread(self.first.size, SAMPLE)].tolist())
        for index in indices:
            config = self.config(index)
            key = self.keys.compute_keys(config, stage)[stage]
            run = partial(compute_point, config, key, self.keys.graph, stage, index in sample, forced, versions())
            yield WorkUnit(key, 1, run)


def checked_keys(run: SweepRun) -> list[bytes]:
    """Return the stage key of every point (32 bytes each), in order.

    Raises a ConfigError that names, for each reason, one invalid point with its values.
    """
    question = run.question
    keys: list[bytes] = []
    problems: dict[str, str] = {}
    for index in range(len(question)):
        try:
            keys.append(bytes.fromhex(run.keys.compute_keys(run.config(index), question.stage)[question.stage]))
        except ConfigError as error:
            prefix = f"at {question.describe_point(index)}: " if len(question.axes) > 1 else ""
            problems.setdefault(error.message, f"{prefix}{error.message}")
            if len(problems) == SHOWN_PROBLEMS:
                problems["more"] = "and perhaps more"
                break
    if problems:
        raise ConfigError("\n".join(problems.values()), "Nothing was run; leave these values out.")
    return keys


def unread_keys(run: SweepRun) -> Iterator[str]:
    """Yield the swept parameters that neither the stage nor its inputs read."""
    question = run.question
    base = run.keys.compute_keys(run.config(0), question.stage)
    for number, axis in enumerate(question.axes):
        settings = question.settings(0)
        settings[number] = axis.setting(len(axis.values) - 1)
        if axis.values[-1] != axis.values[0]:
            with contextlib.suppress(ConfigError):  # this combination of values may be invalid
                if run.keys.compute_keys(run.loaded.variant(settings), question.stage) == base:
                    yield axis.key


def refuse_unknown_stage(name: str, graph: Graph) -> None:
    """Raise ConfigError for a stage that cannot be swept."""
    can = [stage.name for stage in graph.stages if not stage.draws]
    if name not in can:
        raise ConfigError(f"--stage: {name} cannot be swept.", f"Stages that can be swept: {', '.join(can)}.")


def modules_of(stage: str, config: Any, graph: Graph) -> tuple[str, ...]:
    """Return the modules that are needed to compute a stage.

    Raises ConfigError if it cannot be swept.
    """
    refuse_unknown_stage(stage, graph)
    return tuple(needed.module for needed in graph.needed_for(stage, config))
