"""Rows of results as labelled arrays: names, units and meanings come from the labels of their fields."""

from collections.abc import Mapping, Sequence
from operator import getitem
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from walkerlab.labels import Label
from walkerlab.store.content import Group, Variable


def labelled(values: ArrayLike, label: Label, *dims: str, gaps: bool = False) -> Variable:
    """Values of many rows as a variable; the label's own dimensions come last."""
    return Variable(np.asarray(values), (*dims, *label.dims), label.unit, label.text, label.timing, gaps)


def columns(rows: Sequence[Any], labels: Mapping[str, Label], dim: str) -> dict[str, Variable]:
    """A variable for each label, of what the rows have under its name: as a field, a property or a key."""
    of: Any = getitem if rows and isinstance(rows[0], Mapping) else getattr
    return {label.name or name: column([of(row, name) for row in rows], label, dim) for name, label in labels.items()}


def printed(row: Any, labels: Mapping[str, Label]) -> dict[str, Any]:
    """The labelled fields of one row, under the names that their columns have."""
    return {label.name or name: getattr(row, name) for name, label in labels.items()}


def column(values: Sequence[Any], label: Label, dim: str) -> Variable:
    """One value a row; None is a gap, or what the label has instead."""
    if not any(value is None for value in values):
        return labelled(values, label, dim)
    absent = np.nan if label.absent is None else label.absent
    return labelled([absent if value is None else value for value in values], label, dim, gaps=label.absent is None)


def numbered(count: int, dim: str, text: str) -> dict[str, Variable]:
    """The coordinate of a dimension that counts."""
    return {dim: Variable(np.arange(count), (dim,), "1", text)}


def real_and_imaginary(name: str, values: Any, dims: tuple[str, ...], text: str) -> dict[str, Variable]:
    """Complex numbers as two variables."""
    parts = (("real", "real part", np.real(values)), ("imag", "imaginary part", np.imag(values)))
    return {f"{name}_{ending}": Variable(part, dims, "1", f"{text}, {words}") for ending, words, part in parts}


def rows_group(rows: Sequence[Any], labels: Mapping[str, Label], dim: str = "row", text: str = "row") -> Group:
    """Numbered rows as a group."""
    return Group({**numbered(len(rows), dim, text), **columns(rows, labels, dim)})
