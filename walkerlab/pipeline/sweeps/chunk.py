"""Points of a sweep, which any process can compute, and chunks: files that store several points."""

import hashlib
import json
import re
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from walkerlab.config.schema import Config
from walkerlab.errors import WalkerlabError
from walkerlab.extensions import refuse_other_versions
from walkerlab.labels import Label, labels_of
from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.plan.stage import STRIDES
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged, Identity, OtherLayout
from walkerlab.pipeline.store.content import Content, remove_timings, rows_group
from walkerlab.pipeline.store.provenance import Provenance
from walkerlab.pipeline.store.runs import CHUNKS, RunFolder

Status = Literal["answered", "no-answer", "failed"]
Labels = Mapping[str, tuple[str, str]]

OMITTED_KEYS: Final = ("left_out", "no_answer")
MEMORIES: Final = 2
"""Maximum number of caches of stage inputs that a process keeps, see `input_cache`."""
UNFIT: Final = re.compile(r"[^A-Za-z0-9_.+-]")


@dataclass(frozen=True)
class PointResult:
    """Result of one point."""

    key: Annotated[str, Label("", "key of the stage's result, hex")]
    status: Annotated[
        Status, Label("", "answered; no-answer: the stage found none; failed: the computation was not completed")
    ]
    reason: Annotated[str, Label("", "why there is no answer; empty if there is one")]
    numbers: Annotated[str, Label("", "the stage's summary by name, as JSON and without run times")] = "{}"
    wall_s: Annotated[float, Label("s", "computation time", timing=True)] = 0.0
    bug: str = ""
    """Traceback of a bug that stopped the computation, or '' if there was none."""


@dataclass(frozen=True)
class Chunk:
    """Results of some points, with units and meanings of the quantities that the stage labels."""

    rows: tuple[PointResult, ...]
    labels: Labels


@lru_cache(maxsize=MEMORIES)
def input_cache(graph: Graph, forced: str) -> MemoryResults:  # noqa: ARG001 - one cache for each forced sweep
    """Return this process's cache of stage inputs, which lasts longer than a chunk. Arguments are as in
    `compute_point`."""
    return MemoryResults(graph)


def compute_point(
    config: Config, key: str, graph: Graph, target: str, again: bool, forced: str = "", expected: str | None = None
) -> Chunk:
    """Compute one point in this process. If that fails, the result contains the error.

    key       stage key of the point's result
    again     whether to repeat the walk of the point to measure the numerical error
    forced    identifies a sweep that reuses no earlier result; empty for other sweeps
    expected  versions of extensions in the calling process, which must be the same in this process; None skips the
              comparison
    """
    memory = input_cache(graph, forced)
    try:
        if expected is not None:
            refuse_other_versions(expected)
        config = omit_outputs(config, target, graph)
        answer = answer_in_memory(config, target, memory, again=again or STRIDES not in graph[target].options)
    except WalkerlabError as error:
        return Chunk((PointResult(key, "failed", error.message),), {})
    except Exception as error:
        reason = f"a bug: {type(error).__name__}: {error}"
        return Chunk((PointResult(key, "failed", reason, bug=traceback.format_exc()),), {})
    return chunk_of(key, answer)


def join_points(points: Sequence[tuple[Chunk, float]]) -> Chunk:
    """Join chunks of one point each, and record each point's run time (s)."""
    rows = tuple(replace(row, wall_s=wall_s) for point, wall_s in points for row in point.rows)
    return Chunk(rows, {name: label for point, _ in points for name, label in point.labels.items()})


def chunk_of(key: str, answer: Content) -> Chunk:
    """Convert a stage's answer to a chunk of one point."""
    summary = flatten_summary(remove_timings(answer.summary, answer.timed))
    numbers = json.dumps(summary, allow_nan=False, separators=(",", ":"))
    status: Status = "answered" if answer.no_answer is None else "no-answer"
    reason = "" if answer.no_answer is None else answer.no_answer.message
    return Chunk((PointResult(key, status, reason, numbers),), labels_in(answer))


def flatten_summary(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Flatten a summary to numbers, strings and lists of numbers with dotted names, such as `dissipated_J.friction`."""
    flat: dict[str, Any] = {}

    def take(name: str, value: Any) -> None:
        if isinstance(value, bool | int | float | str):
            flat[name] = value
        elif isinstance(value, Mapping):
            for key, inner in value.items():
                take(f"{name}.{UNFIT.sub('_', key)}", inner)
        elif isinstance(value, list) and value:
            if all(isinstance(item, str) for item in value):
                flat[name] = "; ".join(value)
            elif is_regular(value):
                flat[name] = value
            else:
                take(name, {str(number): item for number, item in enumerate(value)})

    for key, value in summary.items():
        if key not in OMITTED_KEYS:
            take(UNFIT.sub("_", key), value)
    return flat


def is_regular(value: list[Any]) -> bool:
    if all(isinstance(item, bool | int | float) for item in value):
        return True
    lists = [item for item in value if isinstance(item, list) and item]
    return len(lists) == len(value) and len({len(item) for item in lists}) == 1 and all(map(is_regular, lists))


def omit_outputs(config: Config, target: str, graph: Graph) -> Config:
    """Return a config that stores no time series of the target's walk, unless another stage needs them."""
    asking = [stage.name for stage in graph.needed_for(target, config) if "outputs" in stage.reads(config)]
    return config.model_copy(update={"outputs": ()}) if asking == [target] else config


def labels_in(content: Content) -> dict[str, tuple[str, str]]:
    """Return unit and meaning of each quantity of the summary that is also a variable in a group."""
    labels = {}
    for group in content.groups.values():
        for name in content.summary.keys() & group.variables.keys():
            labels[name] = (group.variables[name].units, group.variables[name].long_name)
    return labels


def store(folder: RunFolder, stage: str, code_digest: str, chunk: Chunk, provenance: Provenance) -> None:
    """Store a chunk without its failed points.

    Raises StorageError if that fails.
    """
    # Failed points are not stored, so that the next run tries them again.
    rows = [row for row in chunk.rows if row.status != "failed"]
    if not rows:
        return
    points = rows_group(rows, labels_of(PointResult), "point", "point of the chunk")
    content = Content({"points": points}, {"labels": {name: list(label) for name, label in chunk.labels.items()}})
    # Chunks of the same points have the same name, so that a repeated chunk replaces the old file.
    inside = hashlib.sha256("\n".join(row.key for row in rows).encode()).hexdigest()
    name = f"{stage}-{code_digest[:8]}-{inside[:16]}.h5"
    identity = Identity("sweep-chunk", {"of": stage, "name": name}, {}, code_digest)
    path = folder.path / CHUNKS / name
    path.parent.mkdir(exist_ok=True)
    artifact.write(path, content, identity, provenance.finish())


def stored_chunks(
    runs_dir: Path, stage: str, code_digest: str, keys: Mapping[str, Any], warn: Callable[[str], None]
) -> Iterator[Chunk]:
    """Yield the stored results of a stage that the current code has computed, from all run folders.

    keys  stage keys of the sweep. Chunks are always included, results of single runs only if their keys are among these
    warn  called with a message about each damaged chunk
    """
    for path in sorted(runs_dir.glob(f"*/{CHUNKS}/{stage}-{code_digest[:8]}-*.h5")):
        try:
            content = artifact.read(path)
            columns = [content["points"][name].tolist() for name in labels_of(PointResult)]
        except (FileNotFoundError, OtherLayout):
            continue
        except (Damaged, KeyError) as error:
            warn(f"{path} is damaged: {error}; its points are computed again")
            continue
        labels = {name: (unit, text) for name, (unit, text) in content.summary["labels"].items()}
        yield Chunk(tuple(PointResult(*row) for row in zip(*columns, strict=True)), labels)
    for path in sorted(runs_dir.glob(f"*/{stage}.h5")):
        try:
            stored = artifact.read(path)
        except (OSError, Damaged):
            continue
        if stored.identity.key in keys:
            yield chunk_of(stored.identity.key, stored)
