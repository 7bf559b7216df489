"""A sweep's one file: parameters as coordinates, the stage's numbers as variables over them."""

from __future__ import annotations

import hashlib
import io
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.canonical import canonical_json
from walkerlab.config.schema import Config
from walkerlab.report.headlines import LAST_OF, headlines
from walkerlab.scene.endings import Pads, endings
from walkerlab.stages.numerical_error import OF_EACH_STEP
from walkerlab.store.artifact import InTurn
from walkerlab.store.content import Content, Variable
from walkerlab.store.runfolder import RunFolder
from walkerlab.sweeps.chunk import Chunk
from walkerlab.sweeps.columns import OWN, TEXT_BYTES, Columns
from walkerlab.sweeps.question import Question, described

CONTACT, PAD_PITCH = "contact-sim", "contact.pad_pitch"
OUTCOMES = {"answered": "answered", "no-answer": "no-answer", "failed": "failed"}
MEANINGS = {
    "outcome": "how it ended: the stage's own outcome, else whether it has an answer",
    "status": "answered, no-answer, or failed: not computed",
    "said": "why there is no answer",
}


class Merge:
    """The rows of a sweep's results put together.

    size  number of different results
    """

    def __init__(self, size: int) -> None:
        """There are no rows yet."""
        self.columns = Columns(size)
        self.own = {name: np.full(size, "", object) for name in OWN}
        self.there = np.zeros(size, bool)

    def put(self, chunk: Chunk, places: Mapping[str, int]) -> None:
        """Take the rows of a chunk that have a place."""
        self.columns.label(chunk.labels)
        wanted = [row for row in chunk.rows if row.key in places]
        at = [places[row.key] for row in wanted]
        said = [json.loads(row.numbers) for row in wanted]
        for place, row, numbers in zip(at, wanted, said, strict=True):
            outcome = numbers.pop("outcome", None) or OUTCOMES[row.status]
            for name, text in (("outcome", outcome), ("status", row.status), ("said", row.said)):
                self.own[name][place] = sys.intern(text)
        self.there[at] = True
        self.columns.put(at, said)

    def content(self, question: Question, points: Any, inverse: NDArray[np.int64]) -> InTurn:
        """What is stored of the sweep; to be asked for once.

        points   the sweep's `Points`
        inverse  which result each point has
        """
        parameters = dict(coordinates(question, points.loaded.config))
        statuses = self.own["status"][inverse]
        summary = {
            "of": question.stage,
            "parameters": {name: parameter_values(question, place) for place, name in enumerate(question.names)},
            "layout": question.layout,
            "points": len(question),
            "done": int(np.sum(statuses != "failed")),
            "failed": int(np.sum(statuses == "failed")),
            "outcomes": counted(self.own["outcome"][inverse]),
            **numerical_error(self.columns, inverse),
        }
        ended = self.endings(question, points.loaded.config, inverse)
        summary |= {"endings": ended} if ended else {}
        attrs = {"coordinates": " ".join(question.names)} if question.layout == "list" else {}
        scales = {name: one for name, one in parameters.items() if one.dims == (name,)}
        size = self.columns.size_bytes + 8 * TEXT_BYTES * len(OWN) * len(question)
        return InTurn(summary, attrs, scales, self._variables(question, parameters, inverse), size)

    def endings(self, question: Question, config: Config, inverse: NDArray[np.int64]) -> list[dict[str, Any]]:
        """What ended the walks and what the ground has to do with it; nothing of a stage that does not walk."""
        outcomes = self.own["outcome"][inverse]
        pads, pitch = None, self.columns.of("pitch_m")
        off, lengths = outcomes == "off-pad", self.columns.of("step_lengths_m")
        if pitch is not None and off.any():
            steps = np.zeros(0) if lengths is None else last_of_each(lengths[inverse][off])
            laid = "" if config.contact is None or PAD_PITCH in parameters_of(question) else config.contact.pad_pitch
            pads = Pads(ends_of(pitch[inverse][off]), ends_of(steps) if steps.size else None, str(laid))
        return endings(counted(outcomes), config, question.stage == CONTACT, pads)

    def _variables(
        self, question: Question, parameters: Mapping[str, Variable], inverse: NDArray[np.int64]
    ) -> Iterator[tuple[str, Variable]]:
        """Every variable by name; a number that is a parameter as well is its coordinate."""
        shape, dims = question.shape, question.dims
        for name in sorted({*parameters, *OWN, *self.columns.names}):
            if name in parameters:
                yield name, parameters[name]
            elif name in OWN:
                yield name, Variable(self.own[name][inverse].reshape(shape), dims, "", MEANINGS[name])
            else:
                yield name, self.columns.variable(name, inverse, shape, dims)


def parameters_of(question: Question) -> set[str]:
    """The keys that a question goes over."""
    return {axis.key for axis in question.axes}


def last_of_each(rows: NDArray[Any]) -> NDArray[Any]:
    """The last number of each row (rows, numbers), gaps at its end; nothing of rows without any."""
    known = np.isfinite(rows).sum(axis=1)
    return np.asarray(rows[known > 0, known[known > 0] - 1])


def ends_of(values: NDArray[Any]) -> tuple[float, float]:
    """The least and the largest."""
    return float(values.min()), float(values.max())


def numerical_error(columns: Columns, inverse: NDArray[np.int64]) -> dict[str, Any]:
    """The largest numerical errors of the walks that were taken again, how many those are, and of how many.

    `ended_otherwise` counts those that came to another end, whose error is unknown. Nothing for a stage that walks not.

    inverse  which result each point has
    """
    found = {key: columns.of(f"numerical_error.{key}") for key in ("end_time_s", *OF_EACH_STEP)}
    reasons, ends = columns.of("numerical_error.reason"), found["end_time_s"]
    otherwise = 0 if reasons is None else int(np.sum(reasons[inverse] != ""))
    known = 0 if ends is None else int(np.sum(np.isfinite(ends[inverse])))
    if otherwise + known == 0:
        return {}
    largest = {key: float(np.nanmax(values)) for key, values in found.items() if values is not None}
    told = {"walked_again": known + otherwise, "of": len(inverse), "ended_otherwise": otherwise, **largest}
    return {"numerical_error": told}


def coordinates(question: Question, config: Any) -> Iterable[tuple[str, Variable]]:
    """The parameters as variables."""
    for place, (name, axis) in enumerate(zip(question.names, question.axes, strict=True)):
        unit, text = described(config, axis.key)
        values = parameter_values(question, place)
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        array = np.array(values, float) if numbers else np.array([str(value) for value in values], object)
        dims = question.dims if question.layout == "list" else (name,)
        yield name, Variable(array, dims, unit if numbers else "", text)


def parameter_values(question: Question, place: int) -> list[Any]:
    """The values of one parameter, in order."""
    return list(question.axes[place].values)


def counted(texts: NDArray[Any]) -> dict[str, int]:
    """How often each text occurs."""
    names, counts = np.unique(texts.astype(str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def question_slice(question: Question, base: Mapping[str, Any]) -> dict[str, Any]:
    """What a sweep's result is determined by, beside the code: the question and the config that it varies."""
    over = {axis.key: list(axis.values) for axis in question.axes}
    return {"of": question.stage, "over": over, "layout": question.layout, "config": dict(base)}


def result_name(question: Question, part: Mapping[str, Any]) -> str:
    """The name of a sweep's file without its ending: what was asked, and a digest that tells questions apart."""
    digest = hashlib.sha256(canonical_json(dict(part)).encode()).hexdigest()[:8]
    names = "-".join(question.names)[:60]
    return f"sweep-{question.stage}-{names}-{digest}"


def result_path(folder: RunFolder, name: str) -> Path:
    """The file of a sweep's result."""
    return folder.path / f"{name}.h5"


def as_csv(content: Content, question: Question, every: bool = False) -> str:
    """A table with a row for each point: its parameters, how it ended, and the stage's headline numbers.

    every  all numbers and texts instead; lists take columns
    """
    import csv

    group, dimensions = content[""], len(question.shape)
    columns: dict[str, list[Any]] = {}
    for place, name in enumerate(question.names):
        values = parameter_values(question, place)
        columns[name] = [values[question.places(index)[place]] for index in range(len(question))]
    variables = dict(group.variables)
    if not every:
        variables |= last_of_lists(variables, dimensions)
        found = headlines(question.stage, (name for name, one in variables.items() if len(one.dims) == dimensions))
        variables = {name: variables[name] for name in dict.fromkeys(("outcome", *found, "said"))}
    for name, variable in variables.items():
        if name not in columns:
            columns.update(flat_columns(name, variable, dimensions))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def last_of_lists(variables: Mapping[str, Variable], dimensions: int) -> dict[str, Variable]:
    """The last value of each list that has a headline of its own, a gap where a point has none."""
    found = {}
    for name, whole in LAST_OF.items():
        if whole in variables:
            values = np.asarray(variables[whole].values, float)
            there = np.isfinite(values).sum(axis=-1, keepdims=True)
            last = np.where(there > 0, np.take_along_axis(values, np.maximum(there - 1, 0), axis=-1), np.nan)
            found[name] = Variable(
                last[..., 0], variables[whole].dims[:dimensions], variables[whole].units, name, missing=True
            )
    return found


def flat_columns(name: str, variable: Variable, dimensions: int) -> Iterable[tuple[str, list[Any]]]:
    """A variable as columns, one for each place of a list; a gap is empty."""
    values = variable.values
    points, own = values.shape[:dimensions], values.shape[dimensions:]
    rows = values.reshape((int(np.prod(points)), *own))
    for place in np.ndindex(own):
        column = rows[(slice(None), *place)].tolist()
        ending = "".join(f"_{number}" for number in place)
        yield f"{name}{ending}", ["" if value != value else value for value in column]
