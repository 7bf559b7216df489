"""Labelled arrays from rows of results. Names, units and meanings come from the labels of their fields."""

from collections.abc import Mapping, Sequence
from operator import getitem
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from walkerlab.labels import Label
from walkerlab.pipeline.store.content import Group, Variable


def labelled(values: ArrayLike, label: Label, *dims: str, gaps: bool = False) -> Variable:
    """Build a variable from values with dimensions `dims`, followed by those of the label."""
    return Variable(np.asarray(values), (*dims, *label.dims), label.unit, label.text, label.timing, gaps)


def columns(rows: Sequence[Any], labels: Mapping[str, Label], dim: str) -> dict[str, Variable]:
    """Build one variable per label, from the attribute or key of the same name in each row."""
    of: Any = getitem if rows and isinstance(rows[0], Mapping) else getattr
    return {label.name or name: column([of(row, name) for row in rows], label, dim) for name, label in labels.items()}


def values_by_column(row: Any, labels: Mapping[str, Label]) -> dict[str, Any]:
    """Return the labelled fields of one row, by column name."""
    return {label.name or name: getattr(row, name) for name, label in labels.items()}


def column(values: Sequence[Any], label: Label, dim: str) -> Variable:
    """Build a variable with one value per row. None becomes a gap or the `absent` value of the label."""
    if not any(value is None for value in values):
        return labelled(values, label, dim)
    absent = np.nan if label.absent is None else label.absent
    return labelled([absent if value is None else value for value in values], label, dim, gaps=label.absent is None)


def numbered(count: int, dim: str, text: str) -> dict[str, Variable]:
    """Build the coordinate 0, 1, 2, ... for a dimension."""
    return {dim: Variable(np.arange(count), (dim,), "1", text)}


def real_and_imaginary(name: str, values: Any, dims: tuple[str, ...], text: str) -> dict[str, Variable]:
    """Split complex numbers into two variables."""
    parts = (("real", "real part", np.real(values)), ("imag", "imaginary part", np.imag(values)))
    return {f"{name}_{ending}": Variable(part, dims, "1", f"{text}, {words}") for ending, words, part in parts}


def rows_group(rows: Sequence[Any], labels: Mapping[str, Label], dim: str = "row", text: str = "row") -> Group:
    return Group({**numbered(len(rows), dim, text), **columns(rows, labels, dim)})
