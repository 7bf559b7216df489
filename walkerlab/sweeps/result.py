"""A sweep's one file: parameters as coordinates, the stage's numbers as variables over them."""

import io
import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.schema import Config
from walkerlab.labels import ERROR_OF_EACH_STEP
from walkerlab.report.headlines import LAST_OF, headlines
from walkerlab.scene.endings import Pads, endings
from walkerlab.store.artifact import InTurn
from walkerlab.store.content import Content, Variable
from walkerlab.sweeps.chunk import Chunk
from walkerlab.sweeps.columns import Columns
from walkerlab.sweeps.question import SweptStage, described

CONTACT, PAD_PITCH = "contact-sim", "contact.pad_pitch"


class Merge:
    """The rows of a sweep's results put together.

    size  number of different results
    """

    def __init__(self, size: int) -> None:
        """There are no rows yet."""
        self.columns = Columns(size)
        self.there = np.zeros(size, bool)

    def put(self, chunk: Chunk, places: Mapping[str, int]) -> None:
        """Take the rows of a chunk that have a place."""
        self.columns.label(chunk.labels)
        wanted = [row for row in chunk.rows if row.key in places]
        at = [places[row.key] for row in wanted]
        rows = []
        for row in wanted:
            numbers = json.loads(row.numbers)
            own = {"outcome": numbers.get("outcome") or row.status, "status": row.status, "reason": row.reason}
            last = {name: numbers[whole][-1] for name, whole in LAST_OF.items() if whole in numbers}
            rows.append({**numbers, **last, **own})
        self.there[at] = True
        self.columns.put(at, rows)

    def of(self, name: str, inverse: NDArray[np.int64]) -> NDArray[Any]:
        """A text of every point: one of those that are told of every result."""
        texts = self.columns.of(name)
        assert texts is not None, "a sweep has results"
        return texts[inverse]

    def content(self, question: SweptStage, config: Config, inverse: NDArray[np.int64]) -> InTurn:
        """What is stored of the sweep; to be asked for once.

        config   the one that is varied
        inverse  which result each point has
        """
        parameters = dict(coordinates(question, config))
        statuses = self.of("status", inverse)
        summary = {
            "of": question.stage,
            "parameters": {name: list(axis.values) for name, axis in zip(question.names, question.axes, strict=True)},
            "layout": question.layout,
            "points": len(question),
            "done": int(np.sum(statuses != "failed")),
            "failed": int(np.sum(statuses == "failed")),
            "outcomes": counted(self.of("outcome", inverse)),
            **numerical_error(self.columns, inverse),
        }
        ended = self.endings(question, config, inverse)
        summary |= {"endings": ended} if ended else {}
        attrs = {"coordinates": " ".join(question.names)} if question.layout == "list" else {}
        scales = {name: one for name, one in parameters.items() if one.dims == (name,)}
        return InTurn(summary, attrs, scales, self._variables(question, parameters, inverse), self.columns.size_bytes)

    def endings(self, question: SweptStage, config: Config, inverse: NDArray[np.int64]) -> list[dict[str, Any]]:
        """What ended the walks and what the ground has to do with it; nothing of a stage that does not walk."""
        outcomes = self.of("outcome", inverse)
        pads, pitch = None, self.columns.of("pitch_m")
        off, lengths = outcomes == "off-pad", self.columns.of("step_lengths_m")
        if pitch is not None and off.any():
            last = np.zeros(0) if lengths is None else last_of_each(lengths[inverse][off])
            steps = last[np.isfinite(last)]
            varied = PAD_PITCH in (axis.key for axis in question.axes)
            laid = "" if config.contact is None or varied else config.contact.pad_pitch
            pads = Pads(ends_of(pitch[inverse][off]), ends_of(steps) if steps.size else None, str(laid))
        return endings(counted(outcomes), config, question.stage == CONTACT, pads)

    def _variables(
        self, question: SweptStage, parameters: Mapping[str, Variable], inverse: NDArray[np.int64]
    ) -> Iterator[tuple[str, Variable]]:
        """Every variable by name; a number that is a parameter as well is its coordinate."""
        shape, dims = question.shape, question.dims
        for name in sorted({*parameters, *self.columns.names}):
            if name in parameters:
                yield name, parameters[name]
            else:
                yield name, self.columns.variable(name, inverse, shape, dims)


def last_of_each(rows: NDArray[Any]) -> NDArray[Any]:
    """The last number of each row (..., numbers), gaps at its end; a gap of a row without any."""
    known = np.isfinite(rows).sum(axis=-1, keepdims=True)
    last = np.take_along_axis(rows, np.maximum(known - 1, 0), axis=-1)
    return np.asarray(np.where(known > 0, last, np.nan)[..., 0])


def ends_of(values: NDArray[Any]) -> tuple[float, float]:
    """The least and the largest."""
    return float(values.min()), float(values.max())


def numerical_error(columns: Columns, inverse: NDArray[np.int64]) -> dict[str, Any]:
    """The largest numerical errors of the walks that were taken again, how many those are, and of how many.

    `ended_otherwise` counts those that came to another end, whose error is unknown. Nothing for a stage that walks not.

    inverse  which result each point has
    """
    found = {key: columns.of(f"numerical_error.{key}") for key in ("end_time_s", *ERROR_OF_EACH_STEP.values())}
    reasons, ends = columns.of("numerical_error.reason"), found["end_time_s"]
    otherwise = 0 if reasons is None else int(np.sum(reasons[inverse] != ""))
    known = 0 if ends is None else int(np.sum(np.isfinite(ends[inverse])))
    if otherwise + known == 0:
        return {}
    largest = {key: float(np.nanmax(values)) for key, values in found.items() if values is not None}
    told = {"walked_again": known + otherwise, "of": len(inverse), "ended_otherwise": otherwise, **largest}
    return {"numerical_error": told}


def coordinates(question: SweptStage, config: Any) -> Iterable[tuple[str, Variable]]:
    """The parameters as variables."""
    for name, axis in zip(question.names, question.axes, strict=True):
        unit, text = described(config, axis.key)
        values = axis.values
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        array = np.array(values, float) if numbers else np.array([str(value) for value in values], object)
        dims = question.dims if question.layout == "list" else (name,)
        yield name, Variable(array, dims, unit if numbers else "", text)


def counted(texts: NDArray[Any]) -> dict[str, int]:
    """How often each text occurs."""
    names, counts = np.unique(texts.astype(str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def as_csv(content: Content, question: SweptStage, every: bool = False) -> str:
    """A table with a row for each point: its parameters, how it ended, and the stage's headline numbers.

    every  all numbers and texts instead; lists take columns
    """
    import csv

    group, dimensions = content[""], len(question.shape)
    columns: dict[str, list[Any]] = {}
    for place, (name, axis) in enumerate(zip(question.names, question.axes, strict=True)):
        columns[name] = [axis.values[question.places(index)[place]] for index in range(len(question))]
    variables = dict(group.variables)
    if not every:
        found = headlines(question.stage, (name for name, one in variables.items() if len(one.dims) == dimensions))
        variables = {name: variables[name] for name in dict.fromkeys(("outcome", *found, "reason"))}
    for name, variable in variables.items():
        if name not in columns:
            columns.update(flat_columns(name, variable, dimensions))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def flat_columns(name: str, variable: Variable, dimensions: int) -> Iterable[tuple[str, list[Any]]]:
    """A variable as columns, one for each place of a list; a gap is empty."""
    values = variable.values
    points, own = values.shape[:dimensions], values.shape[dimensions:]
    rows = values.reshape((int(np.prod(points)), *own))
    for place in np.ndindex(own):
        column = rows[(slice(None), *place)].tolist()
        ending = "".join(f"_{number}" for number in place)
        yield f"{name}{ending}", ["" if value != value else value for value in column]
