"""The numbers of many summaries as arrays: one variable for each thing that a summary says."""

import sys
from collections.abc import Collection, Mapping, Sequence
from itertools import chain
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.labels import in_words, unit_by_name
from walkerlab.store.content import Variable

OWN: Final = {
    "outcome": "how it ended: the stage's own outcome, else whether it has an answer",
    "status": "answered, no-answer, or failed: not computed",
    "reason": "why there is no answer",
}
"""What is told of every result, beside what its stage says."""
STATES: Final = ("state", "start_state", "final_state")
TEXT_BYTES: Final = 6
"""What a text of some words takes in a file, in units of what it takes here."""


class SweepVariable:
    """One variable: a number, a list of numbers, or a text, for each of `size` results."""

    def __init__(self, size: int, shape: tuple[int, ...], text: bool) -> None:
        """Nothing is known of any result; `shape` is that of one value."""
        self.kinds: set[type] = set()
        self.text = text
        self.values: NDArray[Any] = np.full((size, *shape), "" if text else np.nan, object if text else float)

    def put(self, places: NDArray[np.int64], values: Sequence[Any]) -> None:
        """Take some results' values; those that have another shape than others make room for themselves."""
        if self.text:
            # of many equal texts one is kept
            self.values[places] = [sys.intern(value) for value in values]
            return
        try:
            array = np.array(values)
        except ValueError:  # lists of different lengths
            for k, value in enumerate(values):
                self.put(places[k : k + 1], [value])
            return
        if array.ndim != self.values.ndim:
            return  # a list where others have a number says something else
        self.kinds.update(types_in(values) if array.dtype.kind == "i" else {array.dtype.type})
        shape = tuple(max(old, new) for old, new in zip(self.values.shape[1:], array.shape[1:], strict=True))
        if shape != self.values.shape[1:]:
            old = self.values
            self.values = np.full((len(old), *shape), np.nan)
            self.values[tuple(slice(0, length) for length in old.shape)] = old
        own: tuple[Any, ...] = (places, *(slice(0, length) for length in array.shape[1:]))
        self.values[own] = array

    def typed(self) -> NDArray[Any]:
        """The values in the type that they had, where every result has one; else numbers with gaps."""
        if self.text or np.isnan(self.values).any():
            return self.values
        if self.kinds == {np.bool_}:
            return self.values.astype(bool)
        return self.values.astype(np.int64) if self.kinds == {int} else self.values


def types_in(values: Sequence[Any]) -> set[type]:
    """The types of the numbers in a list, or in lists in it."""
    inner = [item for value in values if isinstance(value, list) for item in value]
    own = {type(value) for value in values if not isinstance(value, list)}
    return own | types_in(inner) if inner else own


class Columns:
    """All variables of the results of one sweep."""

    def __init__(self, size: int) -> None:
        """Nothing is known of `size` results."""
        self.size = size
        self.labels: dict[str, tuple[str, str]] = {}
        self._columns: dict[str, SweepVariable] = {}

    def put(self, places: Sequence[int], rows: Sequence[Mapping[str, Any]]) -> None:
        """Take what some results say, each by name as `chunk.by_name` has it."""
        for name in dict.fromkeys(chain.from_iterable(rows)):
            there = [k for k, row in enumerate(rows) if name in row]
            first = rows[there[0]][name]
            text = isinstance(first, str)
            if name not in self._columns:
                self._columns[name] = SweepVariable(self.size, () if text else np.shape(first), text)
            column = self._columns[name]
            there = [k for k in there if isinstance(rows[k][name], str) == column.text]
            column.put(np.array([places[k] for k in there], int), [rows[k][name] for k in there])

    @property
    def names(self) -> Collection[str]:
        """Of the variables."""
        return self._columns.keys()

    @property
    def numbers(self) -> Collection[str]:
        """Of the variables that are one number for each result."""
        return [name for name, column in self._columns.items() if not column.text and column.values.ndim == 1]

    def of(self, name: str) -> NDArray[Any] | None:
        """What the results have under a name, nan or an empty text for a gap; None if none of them has it."""
        return self._columns[name].values if name in self._columns else None

    @property
    def size_bytes(self) -> int:
        """About what all take in a file."""
        return sum(column.values.nbytes * (TEXT_BYTES if column.text else 1) for column in self._columns.values())

    def variable(
        self, name: str, inverse: NDArray[np.int64], shape: tuple[int, ...], dims: tuple[str, ...]
    ) -> Variable:
        """A variable over the points; it is handed over, so that no two copies are held of all.

        inverse      which result each point has
        shape, dims  of the points
        """
        column = self._columns.pop(name)
        values = column.typed()[inverse]
        extra = values.shape[1:]
        own = tuple(f"{name}_index{axis if len(extra) > 1 else ''}" for axis in range(len(extra)))
        last = name.rpartition(".")[2]
        if column.text:
            unit, text = "", OWN.get(name, name)
        elif last in STATES:
            unit, text = "rad, rad/s", last.replace("_", " ")
        elif last in self.labels:
            unit, text = self.labels[last]
        else:
            unit, text = unit_by_name(last), in_words(name)
        gaps = values.dtype.kind == "f" and bool(np.isnan(values).any())
        return Variable(values.reshape(shape + extra), dims + own, unit, text, missing=gaps)
