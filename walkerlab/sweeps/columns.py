"""The numbers of many summaries as arrays: one variable for each thing that a summary says."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.labels import unit_by_name, unit_ending
from walkerlab.store.content import Variable
from walkerlab.sweeps.chunk import Labels

NOT_OF_THE_POINT: Final = ("left_out", "no_answer")
OWN: Final = ("outcome", "status", "said")
STATES: Final = ("state", "start_state", "final_state")
UNFIT: Final = re.compile(r"[^A-Za-z0-9_.+-]")


class Column:
    """One variable: a number, a list of numbers, or a text, for each of `size` results."""

    def __init__(self, size: int, shape: tuple[int, ...], text: bool) -> None:
        """Nothing is known of any result; `shape` is that of one value."""
        self.kinds: set[type] = set()
        self.text = text
        self.values: NDArray[Any] = np.full((size, *shape), "" if text else np.nan, object if text else float)

    def put(self, place: int, value: Any) -> None:
        """Take one result's value; one that has another shape than those so far makes room for itself."""
        if self.text:
            # of many equal texts one is kept
            self.values[place] = sys.intern(value)
            return
        array = np.asarray(value, float)
        self.kinds.update(types_in(value))
        if array.ndim != self.values.ndim - 1:
            return  # a list where others have a number says something else
        self._make_room(array.shape)
        own: tuple[Any, ...] = (place, *(slice(0, length) for length in array.shape))
        self.values[own] = array

    def _make_room(self, shape: tuple[int, ...]) -> None:
        grown = tuple(max(old, new) for old, new in zip(self.values.shape[1:], shape, strict=True))
        if grown != self.values.shape[1:]:
            old = self.values
            self.values = np.full((len(old), *grown), np.nan)
            self.values[tuple(slice(0, length) for length in old.shape)] = old

    def typed(self) -> NDArray[Any]:
        """The values in the type that they had, where every result has one; else numbers with gaps."""
        if self.text or np.isnan(self.values).any():
            return self.values
        if self.kinds == {bool}:
            return self.values.astype(bool)
        return self.values.astype(np.int64) if self.kinds == {int} else self.values


def types_in(value: Any) -> set[type]:
    """The types of a number or of the numbers in a list."""
    return set().union(*map(types_in, value)) if isinstance(value, list) else {type(value)}


class Columns:
    """All variables of the results of one sweep."""

    def __init__(self, size: int) -> None:
        """Nothing is known of `size` results."""
        self.size = size
        self.labels: dict[str, tuple[str, str]] = {}
        self._columns: dict[str, Column] = {}

    def put(self, place: int, summary: Mapping[str, Any]) -> None:
        """Take what one result's summary says."""
        for name, value in said_in(summary):
            column = self._columns.get(name)
            if column is None:
                text = isinstance(value, str)
                shape = () if text else np.shape(value)
                column = self._columns[name] = Column(self.size, shape, text)
            if column.text == isinstance(value, str):
                column.put(place, value)

    def label(self, labels: Labels) -> None:
        """Take units and meanings."""
        self.labels.update(labels)

    def variables(
        self, inverse: NDArray[np.int64], shape: tuple[int, ...], dims: tuple[str, ...]
    ) -> Iterator[tuple[str, Variable]]:
        """The variables over the points, by name; each is handed over, so that no two copies are held of all.

        inverse      which result each point has
        shape, dims  of the points
        """
        for name in sorted(self._columns):
            column = self._columns.pop(name)
            values = column.typed()[inverse]
            extra = values.shape[1:]
            own = tuple(f"{name}_index{axis if len(extra) > 1 else ''}" for axis in range(len(extra)))
            unit, text = ("", name) if column.text else self._label(name)
            gaps = values.dtype.kind == "f" and bool(np.isnan(values).any())
            yield name, Variable(values.reshape(shape + extra), dims + own, unit, text, missing=gaps)

    def _label(self, name: str) -> tuple[str, str]:
        """Unit and meaning of a number: as the stage labelled it, else by how its name ends."""
        last = name.rpartition(".")[2]
        if last in STATES:
            return "rad, rad/s", last.replace("_", " ")
        if last in self.labels:
            return self.labels[last]
        return unit_by_name(last), in_words(name)


def in_words(name: str) -> str:
    """A name as words, without its unit."""
    ending = unit_ending(name)
    return name.removesuffix(f"_{ending}" if ending else "").replace("_", " ")


def said_in(summary: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Name and value of everything in a summary: a number, a text, or a list of numbers in a regular shape.

    What is nested has the names above it in front, with points between: `dissipated_J.friction`, `gaits.0.period_s`.
    """
    for key, value in summary.items():
        if prefix or key not in NOT_OF_THE_POINT:
            yield from said_of(f"{prefix}{UNFIT.sub('_', key)}", value)


def said_of(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The same of one value."""
    if isinstance(value, Mapping):
        yield from said_in(value, f"{name}.")
    elif isinstance(value, bool | int | float | str):
        yield name, value
    elif isinstance(value, list) and value:
        if all(isinstance(item, str) for item in value):
            yield name, "; ".join(value)
        elif is_regular(value):
            yield name, value
        else:
            yield from said_in({str(number): item for number, item in enumerate(value)}, f"{name}.")


def is_regular(value: list[Any]) -> bool:
    """Whether a list holds numbers, or lists of them that are equally long."""
    if all(isinstance(item, bool | int | float) for item in value):
        return True
    lists = [item for item in value if isinstance(item, list) and item]
    return len(lists) == len(value) and len({len(item) for item in lists}) == 1 and all(map(is_regular, lists))
