"""A chunk of a sweep: some points computed in one go, anywhere, and kept as one file named by what is in it."""

from __future__ import annotations

import hashlib
import importlib
import os
import platform
import time
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from walkerlab.config.schema import Config
from walkerlab.errors import WalkerlabError
from walkerlab.stages.graph import Graph
from walkerlab.store import artifact
from walkerlab.store.artifact import Damaged
from walkerlab.store.content import Content, Group, Variable, untimed
from walkerlab.store.key import Identity
from walkerlab.store.provenance import Provenance
from walkerlab.store.runfolder import RunFolder
from walkerlab.sweeps.flat import flat_text

Status = Literal["answered", "no-answer", "failed"]
Labels = Mapping[str, tuple[str, str]]

FOLDER: Final = "sweep-chunks"
TEXTS: Final = ("key", "status", "said", "numbers")


@dataclass(frozen=True)
class PointResult:
    """What became of one point.

    key      of the stage's result, hex
    status   answered; no-answer: the stage found none and says why; failed: the computation was not completed
    said     why there is no answer; empty if there is one
    numbers  of the stage's summary, flat, as JSON and without run times; some or none if there is no answer
    wall_s   time it took, s
    bug      the traceback of the bug that stopped it; empty if none did
    """

    key: str
    status: Status
    said: str
    numbers: str = "{}"
    wall_s: float = 0.0
    bug: str = ""


@dataclass(frozen=True)
class ChunkTask:
    """What a worker is sent.

    graph    where the pipeline is, as module:NAME
    target   the stage
    configs  of the points
    keys     of each point's result and of the results it needs, by stage
    again    whether each point's walk is taken a second time for its numerical error
    host     the machine that sends it
    """

    graph: str
    target: str
    configs: tuple[Config, ...]
    keys: tuple[dict[str, str], ...]
    again: tuple[bool, ...]
    host: str = ""

    def split(self) -> tuple[ChunkTask, ChunkTask]:
        """Both halves of a chunk of at least two points."""
        middle = len(self.configs) // 2
        first, second = slice(None, middle), slice(middle, None)
        return (
            replace(self, configs=self.configs[first], keys=self.keys[first], again=self.again[first]),
            replace(self, configs=self.configs[second], keys=self.keys[second], again=self.again[second]),
        )


@dataclass(frozen=True)
class Chunk:
    """Some points' rows, with unit and meaning of the numbers that the stage itself has labelled."""

    rows: tuple[PointResult, ...]
    labels: Labels


def compute(task: ChunkTask) -> Chunk:
    """Compute a chunk's points in this process; what goes wrong with one does not end the others."""
    keep_compiled_code_apart(task.host)
    graph = graph_at(task.graph)
    worker = worker_for(task.graph, graph)
    labels: dict[str, tuple[str, str]] = {}
    rows = []
    for config, keys, again in zip(task.configs, task.keys, task.again, strict=True):
        started = time.perf_counter()
        row, content = row_of(worker, config, task.target, keys, again)
        rows.append(replace(row, wall_s=time.perf_counter() - started))
        labels.update(labels_in(content, labels))
    return Chunk(tuple(rows), labels)


def keep_compiled_code_apart(sender: str) -> None:
    """On another machine than the sender's, use a folder of this machine's own for compiled code."""
    if sender and platform.node() != sender and "WALKERLAB_SWEEP_HOST" not in os.environ:
        os.environ["WALKERLAB_SWEEP_HOST"] = platform.node()
        shared = os.environ.get("WALKERLAB_CACHE") or str(Path("~/.cache/walkerlab").expanduser())
        os.environ["WALKERLAB_CACHE"] = str(Path(shared) / f"{platform.node()}-{platform.machine()}")


def graph_at(where: str) -> Graph:
    """The pipeline at module:NAME."""
    module, _, name = where.partition(":")
    graph = getattr(importlib.import_module(module), name)
    assert isinstance(graph, Graph)
    return graph


_WORKERS: dict[str, Any] = {}


def worker_for(where: str, graph: Graph) -> Any:
    """This process's memory of what points need, kept from chunk to chunk."""
    from walkerlab.stages.in_memory import InMemory

    return _WORKERS.setdefault(where, InMemory(graph))


def row_of(
    worker: Any, config: Config, target: str, keys: dict[str, str], again: bool = True
) -> tuple[PointResult, Content]:
    """One point's row, and the content it is from; `again` as in `ChunkTask`."""
    key = keys[target]
    try:
        answer = worker.answer(without_outputs(config, target, worker.graph), target, keys, again=again)
    except WalkerlabError as error:
        return PointResult(key, "failed", error.message), Content()
    except Exception as error:
        said = f"a bug: {type(error).__name__}: {error}"
        return PointResult(key, "failed", said, bug=traceback.format_exc()), Content()
    content, no_answer = answer.content, answer.no_answer
    numbers = flat_text(untimed(content.summary, content.timed))
    if no_answer is None:
        return PointResult(key, "answered", "", numbers), content
    return PointResult(key, "no-answer", no_answer.message, numbers), content


def without_outputs(config: Config, target: str, graph: Graph) -> Config:
    """The config without the arrays in time that a walk is stored with: a row is the summary, which is the same.

    A stage that draws on another's arrays is left them.
    """
    asking = [stage.name for stage in graph.needed_for(target, config) if "outputs" in stage.reads]
    return config.model_copy(update={"outputs": ()}) if asking == [target] else config


def labels_in(content: Content, known: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the summary's numbers that are a variable in a group as well."""
    missing = [name for name in content.summary if name not in known]
    found = {}
    for group in content.groups.values() if missing else ():
        for name in missing:
            if name in group.variables:
                found[name] = (group.variables[name].units, group.variables[name].long_name)
    return found


def stored_name(stage: str, code_digest: str, keys: Iterable[str]) -> str:
    """The name of a chunk's file: its stage, the code it is of, and what is in it."""
    content = hashlib.sha256("\n".join(keys).encode()).hexdigest()
    return f"{stage}-{code_digest[:8]}-{content[:16]}.h5"


def store(folder: RunFolder, stage: str, code_digest: str, chunk: Chunk, begun: Provenance) -> Path | None:
    """Keep what was computed of a chunk; what failed is not kept. StorageError if the system refuses."""
    rows = [row for row in chunk.rows if row.status != "failed"]
    if not rows:
        return None
    texts = {
        "key": [row.key for row in rows],
        "status": [row.status for row in rows],
        "said": [row.said for row in rows],
        "numbers": [row.numbers for row in rows],
    }
    variables = {name: Variable(np.array(texts[name], object), ("point",), "", name) for name in TEXTS}
    walls = np.array([row.wall_s for row in rows])
    variables["wall_s"] = Variable(walls, ("point",), "s", "time it took", timing=True)
    labels = {name: list(label) for name, label in chunk.labels.items()}
    content = Content({"points": Group(variables)}, {"labels": labels})
    name = stored_name(stage, code_digest, [row.key for row in rows])
    identity = Identity("sweep-chunk", {"of": stage, "name": name}, {}, code_digest)
    path = folder.path / FOLDER / name
    path.parent.mkdir(exist_ok=True)
    artifact.write(path, content, identity, begun.until_now())
    return path


def stored_chunk(path: Path) -> Chunk:
    """The chunk in a file; FileNotFoundError if it is gone, Damaged for whatever is not intact."""
    content = artifact.read(path)
    try:
        points = content["points"]
        columns = [points[name].tolist() for name in (*TEXTS, "wall_s")]
    except KeyError as error:
        raise Damaged(f"it has no {error}") from error
    rows = tuple(PointResult(*row) for row in zip(*columns, strict=True))
    return Chunk(rows, {name: (unit, text) for name, (unit, text) in content.summary["labels"].items()})


def chunk_files(runs_dir: Path, stage: str, code_digest: str) -> Iterator[Path]:
    """The files of all chunks of a stage's present code, in all run folders."""
    yield from sorted(runs_dir.glob(f"*/{FOLDER}/{stage}-{code_digest[:8]}-*.h5"))


def rows_of_single_runs(
    runs_dir: Path, stage: str, wanted: Mapping[str, Any] | set[str]
) -> Iterator[tuple[PointResult, Labels]]:
    """The results of runs of a stage that have one of the wanted keys."""
    for path in sorted(runs_dir.glob(f"*/{stage}.h5")):
        try:
            stored = artifact.read(path)
        except (OSError, Damaged):
            continue
        if stored.identity.key in wanted:
            yield row_of_artifact(stored), labels_in(stored, {})


def row_of_artifact(stored: artifact.Stored) -> PointResult:
    """A single run's result as a row."""
    summary = untimed(stored.summary, stored.timed)
    said = summary.pop("no_answer", None)
    status: Status = "answered" if stored.complete else "no-answer"
    return PointResult(stored.identity.key, status, "" if said is None else str(said["message"]), flat_text(summary))


def median_wall_s(rows: Sequence[PointResult]) -> float | None:
    """What a point took, s; None if nothing is known."""
    walls = [row.wall_s for row in rows if row.wall_s > 0.0]
    return float(np.median(walls)) if walls else None
