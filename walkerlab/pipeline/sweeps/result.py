"""Build the content of a sweep's file, with parameters as coordinates and the stage's quantities as variables over
them."""

import json
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.schema import Config
from walkerlab.labels import CONTACT_STAGE, ERROR_OF_EACH_STEP, axis_label, unit_by_name
from walkerlab.physics.solvers.system import Integers
from walkerlab.pipeline.headlines import headlines, last_step_values
from walkerlab.pipeline.store import artifact, files, hdf5
from walkerlab.pipeline.store.content import Content, Variable
from walkerlab.pipeline.sweeps.chunk import Chunk
from walkerlab.pipeline.sweeps.question import SweptStage, described
from walkerlab.scene.walk_outcomes import Pads, describe_endings

PAD_PITCH = "contact.pad_pitch"


STATUS_TEXTS: Final = {
    "outcome": "outcome of the stage if it has one, otherwise whether it has an answer",
    "status": "answered, no-answer, or failed: not computed",
    "reason": "why there is no answer",
}
"""Columns that every point has in addition to the stage's quantities."""
STATE_NAMES: Final = ("state", "start_state", "final_state")
MAX_REASON: Final = 500
"""Maximum length of a reason. Text in files has a fixed length, so one long reason would take up space at every point.
"""


class SweepVariable:
    """Column of results: a number, a list of numbers or a string for each of `size` results of a sweep."""

    def __init__(self, size: int, shape: tuple[int, ...], text: bool) -> None:
        """Start with missing values only. `shape` is the shape of one value."""
        self.kinds: set[type] = set()
        self.text = text
        self.values: NDArray[Any] = np.full((size, *shape), "" if text else np.nan, object if text else float)

    def put(self, places: Integers, values: Sequence[Any]) -> None:
        """Store values at the indices `places`. The column grows if a value has a larger shape."""
        if self.text:
            # Equal strings share one object to save memory.
            self.values[places] = [sys.intern(value) for value in values]
            return
        try:
            array = np.array(values)
        except ValueError:  # the lists have different lengths
            for k, value in enumerate(values):
                self.put(places[k : k + 1], [value])
            return
        if array.ndim != self.values.ndim:
            return  # lists cannot be stored in a column of numbers, nor numbers in one of lists
        # NumPy turns a list that mixes bools and integers into integers, so the types are read from the list.
        self.kinds.update(types_in(values) if array.dtype.kind == "i" else {array.dtype.type})
        shape = tuple(max(old, new) for old, new in zip(self.values.shape[1:], array.shape[1:], strict=True))
        if shape != self.values.shape[1:]:
            old = self.values
            self.values = np.full((len(old), *shape), np.nan)
            self.values[tuple(slice(0, length) for length in old.shape)] = old
        own: tuple[Any, ...] = (places, *(slice(0, length) for length in array.shape[1:]))
        self.values[own] = array

    def typed(self) -> NDArray[Any]:
        """Return the values in their own type, or as floats with NaN if some are missing."""
        if self.text or np.isnan(self.values).any():
            return self.values
        if self.kinds == {np.bool_}:
            return self.values.astype(bool)
        return self.values.astype(np.int64) if self.kinds == {int} else self.values


def types_in(values: Sequence[Any]) -> set[type]:
    """Return the types of the numbers in a nested list."""
    inner = [item for value in values if isinstance(value, list) for item in value]
    types = {type(value) for value in values if not isinstance(value, list)}
    return types | types_in(inner) if inner else types


class Merge:
    """Merges the rows of a sweep's results into one column per quantity.

    config   base config of the sweep
    inverse  for each point, the index of its result
    """

    def __init__(self, question: SweptStage, config: Config, inverse: Integers) -> None:
        """Start without rows."""
        self.question = question
        self.config = config
        self.inverse = inverse
        self.has_row = np.zeros(int(inverse.max()) + 1, bool)
        self.labels: dict[str, tuple[str, str]] = {}
        self.columns: dict[str, SweepVariable] = {}

    def put(self, chunk: Chunk, places: Mapping[str, int]) -> None:
        """Store the rows of a chunk that belong to this sweep."""
        self.labels.update(chunk.labels)
        rows_of_sweep = [row for row in chunk.rows if row.key in places]
        indices = [places[row.key] for row in rows_of_sweep]
        rows = []
        for row in rows_of_sweep:
            numbers = json.loads(row.numbers)
            reason = row.reason if len(row.reason) <= MAX_REASON else f"{row.reason[: MAX_REASON - 1]}…"
            own = {"outcome": numbers.get("outcome") or row.status, "status": row.status, "reason": reason}
            rows.append({**numbers, **last_step_values(numbers), **own})
        self.has_row[indices] = True
        for name in dict.fromkeys(chain.from_iterable(rows)):
            have = [k for k, row in enumerate(rows) if name in row]
            first = rows[have[0]][name]
            text = isinstance(first, str)
            if name not in self.columns:
                self.columns[name] = SweepVariable(self.has_row.size, () if text else np.shape(first), text)
            column = self.columns[name]
            # A column holds either texts or numbers. Its first value decides.
            have = [k for k in have if isinstance(rows[k][name], str) == column.text]
            column.put(np.array([indices[k] for k in have], int), [rows[k][name] for k in have])

    @property
    def numbers(self) -> Collection[str]:
        """Names of the quantities that have a single number per result."""
        return [name for name, column in self.columns.items() if not column.text and column.values.ndim == 1]

    def values_of(self, name: str) -> NDArray[Any] | None:
        """Return a quantity at the points, with NaN or '' where it is missing, or None if no point has it."""
        return self.columns[name].values[self.inverse] if name in self.columns else None

    def content(self) -> artifact.InTurn:
        """Return the content to store. Call this only once, because it removes the columns."""
        question = self.question
        parameters = dict(coordinates(question, self.config))
        statuses = self.columns["status"].values[self.inverse]
        summary = {
            "of": question.stage,
            "parameters": {name: list(axis.values) for name, axis in zip(question.names, question.axes, strict=True)},
            "layout": question.layout,
            "points": len(question),
            "done": int(np.sum(statuses != "failed")),
            "failed": int(np.sum(statuses == "failed")),
            "outcomes": count_texts(self.columns["outcome"].values[self.inverse]),
            **self.numerical_error(),
        }
        ended = self.endings()
        summary |= {"endings": ended} if ended else {}
        attrs = {"coordinates": " ".join(question.names)} if question.layout == "list" else {}
        scales = {name: column for name, column in parameters.items() if column.dims == (name,)}
        size = sum(hdf5.stored_bytes(column.values) for column in self.columns.values())
        # A quantity that is also a parameter is stored only as the coordinate of that parameter.
        names = sorted({*parameters, *self.columns})
        variables = ((name, parameters[name] if name in parameters else self.variable(name)) for name in names)
        return artifact.InTurn(summary, attrs, scales, variables, size)

    def endings(self) -> list[dict[str, Any]]:
        """Describe how walks ended and whether the ground was the cause. Return [] if the stage simulates no walk."""
        outcomes = self.columns["outcome"].values[self.inverse]
        pads = None
        pitch = self.values_of("pitch_m")
        off = outcomes == "off-pad"
        lengths = self.values_of("step_lengths_m")
        if pitch is not None and off.any():
            last = np.zeros(0) if lengths is None else last_numbers(lengths[off])
            steps = last[np.isfinite(last)]
            varied = PAD_PITCH in (axis.key for axis in self.question.axes)
            laid = "" if self.config.contact is None or varied else self.config.contact.pad_pitch
            pads = Pads(ends_of(pitch[off]), ends_of(steps) if steps.size else None, str(laid))
        return describe_endings(count_texts(outcomes), self.config, self.question.stage == CONTACT_STAGE, pads)

    def numerical_error(self) -> dict[str, Any]:
        """Return the largest errors of the repeated walks, and under `ended_otherwise`, how many of them ended
        differently."""
        errors = {key: self.values_of(f"numerical_error.{key}") for key in ("end_time_s", *ERROR_OF_EACH_STEP.values())}
        reasons = self.values_of("numerical_error.reason")
        ends = errors["end_time_s"]
        otherwise = 0 if reasons is None else int(np.sum(reasons != ""))
        measured = 0 if ends is None else int(np.sum(np.isfinite(ends)))
        if otherwise + measured == 0:
            return {}
        largest = {key: float(np.nanmax(values)) for key, values in errors.items() if values is not None}
        counts = {"walked_again": measured + otherwise, "of": len(self.inverse), "ended_otherwise": otherwise}
        return {"numerical_error": counts | largest}

    def variable(self, name: str) -> Variable:
        """Return a variable over the points and remove its column, because a second copy would take a lot of memory."""
        column = self.columns.pop(name)
        values = column.typed()[self.inverse]
        extra = values.shape[1:]
        own = tuple(f"{name}_index{axis if len(extra) > 1 else ''}" for axis in range(len(extra)))
        last = name.rpartition(".")[2]
        if column.text:
            unit = ""
            text = STATUS_TEXTS.get(name, name)
        elif last in STATE_NAMES:
            unit = "rad, rad/s"
            text = last.replace("_", " ")
        elif last in self.labels:
            unit, text = self.labels[last]
        else:
            unit = unit_by_name(name)
            text = axis_label(name)
        gaps = values.dtype.kind == "f" and bool(np.isnan(values).any())
        return Variable(values.reshape(self.question.shape + extra), self.question.dims + own, unit, text, missing=gaps)


def last_numbers(rows: NDArray[Any]) -> NDArray[Any]:
    """Return the last number other than NaN in each row (..., numbers), or NaN if there is none."""
    counts = np.isfinite(rows).sum(axis=-1, keepdims=True)
    last = np.take_along_axis(rows, np.maximum(counts - 1, 0), axis=-1)
    return np.asarray(np.where(counts > 0, last, np.nan)[..., 0])


def ends_of(values: NDArray[Any]) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def coordinates(question: SweptStage, config: Any) -> Iterable[tuple[str, Variable]]:
    for name, axis in zip(question.names, question.axes, strict=True):
        unit, text = described(config, axis.key)
        values = axis.values
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        array = np.array(values, float) if numbers else np.array([str(value) for value in values], object)
        dims = question.dims if question.layout == "list" else (name,)
        yield name, Variable(array, dims, unit if numbers else "", text)


def count_texts(texts: NDArray[Any]) -> dict[str, int]:
    names, counts = np.unique(texts.astype(str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def as_csv(content: Content, question: SweptStage, every: bool = False) -> str:
    """Format a CSV table of the points: parameters, outcome and headline quantities or, if `every` is true, all
    values."""
    dimensions = len(question.shape)
    columns: dict[str, list[Any]] = {}
    for place, (name, axis) in enumerate(zip(question.names, question.axes, strict=True)):
        columns[name] = [axis.values[question.places(index)[place]] for index in range(len(question))]
    variables = dict(content[""].variables)
    if not every:
        scalars = (name for name, variable in variables.items() if len(variable.dims) == dimensions)
        shown_names = ("outcome", *headlines(question.stage, scalars), "reason")
        variables = {name: variables[name] for name in dict.fromkeys(shown_names)}
    for name, variable in variables.items():
        if name not in columns:
            columns.update(flat_columns(name, variable, dimensions))
    return files.csv_text([*columns], zip(*columns.values(), strict=True)).decode()


def flat_columns(name: str, variable: Variable, dimensions: int) -> Iterable[tuple[str, list[Any]]]:
    """Split a variable into columns, one for each entry of a list. Missing values are ''."""
    values = variable.values
    inner_shape = values.shape[dimensions:]
    rows = values.reshape((int(np.prod(values.shape[:dimensions])), *inner_shape))
    for place in np.ndindex(inner_shape):
        column = rows[(slice(None), *place)].tolist()
        ending = "".join(f"_{number}" for number in place)
        # NaN is the only value that differs from itself.
        yield f"{name}{ending}", ["" if value != value else value for value in column]
