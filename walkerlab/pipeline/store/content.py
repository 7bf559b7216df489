"""Content of results: a summary, and labelled arrays in groups. It does not depend on files or HDF5."""

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import getitem
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from walkerlab.config.reads import canonical_json
from walkerlab.errors import NoAnswer
from walkerlab.labels import Label

Attribute = str | int | float | bool

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.+-]*")
"""Pattern of the names of groups, variables, dimensions and attributes that HDF5, netCDF and xarray accept."""


STORED_AS: dict[str, type] = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_}
"""Type in which an array is stored, by NumPy kind."""
TIMING = re.compile(r"(.*_)?wall_s", re.DOTALL)
"""Pattern of the summary keys that name measured run times."""


@dataclass(frozen=True, eq=False)
class Variable:
    """Labelled array.

    Raises ValueError or TypeError for values that cannot be stored faithfully.
    """

    values: NDArray[Any]  # finite numbers, bools or strings; they are copied, widened to 64 bits and frozen
    # Name of each axis. A variable that is named like its only dimension is the coordinate of that dimension.
    dims: tuple[str, ...]
    units: str  # 'rad', 'N', ...; '1' for a pure number, '' for text
    long_name: str  # meaning, as shown on axes and in tables
    timing: bool = False  # whether the values depend on run times; the digest omits such values
    missing: bool = False  # whether NaN is allowed, to mark missing values

    def __post_init__(self) -> None:
        """Convert the values to one of the four stored types and check the labels."""
        values = canonical(self.values)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "dims", tuple(self.dims))
        if values.ndim != len(self.dims) or len(set(self.dims)) != len(self.dims):
            raise ValueError(f"{self.long_name!r}: shape {values.shape} does not match dimensions {self.dims}")
        if values.dtype.kind == "f" and not self.missing and not np.isfinite(values).all():
            raise ValueError(
                f"{self.long_name!r} holds values that are not finite; leave out values that were not computed"
            )
        if values.dtype.kind != "O" and not self.units:
            raise ValueError(f"{self.long_name!r} has no unit; use '1' for a dimensionless quantity")
        check_text(self.units, self.long_name)


@dataclass(frozen=True, eq=False)
class Group:
    """Variables that share dimensions, with attributes: one dataset for xarray."""

    variables: Mapping[str, Variable]
    attrs: Mapping[str, Attribute] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check names, attributes and the lengths of dimensions."""
        object.__setattr__(self, "attrs", {name: plain(value) for name, value in self.attrs.items()})
        sizes = self.sizes
        for name in (*self.variables, *self.attrs, *sizes):
            check_name(name)
        for name, variable in self.variables.items():
            if name in sizes and variable.dims != (name,):
                raise ValueError(
                    f"{name!r} names both a dimension and a variable, but the variable has dimensions {variable.dims}"
                )
        for name, value in self.attrs.items():
            if not isinstance(value, Attribute):
                raise TypeError(f"attribute {name!r} must be text, a bool or a number, not {value!r}")

    @property
    def sizes(self) -> dict[str, int]:
        """Length of each dimension.

        Raises ValueError if two variables disagree.
        """
        sizes: dict[str, int] = {}
        for name, variable in self.variables.items():
            for dim, size in zip(variable.dims, variable.values.shape, strict=True):
                if sizes.setdefault(dim, size) != size:
                    raise ValueError(f"{name!r} has size {size} along {dim!r}, but other variables have {sizes[dim]}")
        return sizes

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.variables[name].values


@dataclass(frozen=True, eq=False)
class Content:
    """Result of a stage.

    Raises ValueError or TypeError for a summary that is not JSON or holds non-finite numbers, and for clashing names.
    """

    # Groups by path, such as 'corrected/gaits' ('' for the root of the file). Missing parent groups are added.
    groups: Mapping[str, Group] = field(default_factory=dict)
    # The values that `--json` prints, in SI units. 'wall_s' and keys that end in '_wall_s' count as timings.
    summary: Mapping[str, Any] = field(default_factory=dict)
    timed: tuple[str, ...] = ()  # further top-level keys of the summary that depend on timings, such as 'best'
    # False for partial results of a stage that found no answer, whose summary has the reason under `no_answer`.
    complete: bool = field(default=True, kw_only=True)

    def __post_init__(self) -> None:
        """Convert the summary to plain JSON types and check the paths."""
        object.__setattr__(self, "summary", {key: plain(value) for key, value in self.summary.items()})
        object.__setattr__(self, "timed", tuple(sorted(self.timed)))
        check_text(*self.summary, *self.timed)
        through = {path[:end] for path in self.groups for end, letter in enumerate(path) if letter == "/"}
        empty = {path: Group({}) for path in sorted(through.difference(self.groups))}
        object.__setattr__(self, "groups", {**self.groups, **empty})
        for path in filter(None, self.groups):
            above, _, name = path.rpartition("/")
            for part in path.split("/"):
                check_name(part)
            parent = self.groups.get(above, Group({}))
            if name in parent.variables or name in parent.sizes:
                raise ValueError(f"group {path!r} has the same name as a variable or dimension of its parent group")

    def __getitem__(self, path: str) -> Group:
        return self.groups[path]

    @property
    def no_answer(self) -> NoAnswer | None:
        """Error that says why the stage has no answer, with advice, or None if it has one."""
        reason = self.summary.get("no_answer", {})
        return None if self.complete else NoAnswer(reason.get("message", "no answer"), reason.get("advice", ""))

    @property
    def findings(self) -> dict[str, Any]:
        """Summary without the `no_answer` entry."""
        return {key: value for key, value in self.summary.items() if self.complete or key != "no_answer"}

    def digest(self) -> str:
        """Return the sha256 of everything except timings."""
        digest = Digest(self.summary, self.timed)
        for path, group in sorted(self.groups.items()):
            digest.enter(path, group.attrs)
            for name, variable in sorted(group.variables.items()):
                digest.add(name, variable)
        return digest.hex()


class Digest:
    """Digest of content that is added group by group and variable by variable, in order of names."""

    def __init__(self, summary: Mapping[str, Any], timed: tuple[str, ...]) -> None:
        self._sha256 = hashlib.sha256()
        self._take(canonical_json([remove_timings(summary, timed), timed]).encode())

    def enter(self, path: str, attrs: Mapping[str, Attribute]) -> None:
        self._take(canonical_json([path, dict(attrs)]).encode())

    def add(self, name: str, variable: Variable) -> None:
        """Add a variable: its labels, then its values in C order, little-endian."""
        if variable.timing:
            return
        values = variable.values
        label = [name, variable.dims, values.shape, values.dtype.kind, variable.units, variable.long_name]
        self._take(canonical_json([*label, variable.timing, variable.missing]).encode())
        if values.dtype.kind == "O":
            self._take(canonical_json(values.ravel().tolist()).encode())
        else:
            self._take(values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes())

    def hex(self) -> str:
        return self._sha256.hexdigest()

    def _take(self, part: bytes) -> None:
        self._sha256.update(len(part).to_bytes(8, "little"))
        self._sha256.update(part)


def canonical(values: ArrayLike) -> NDArray[Any]:
    """Return a read-only copy as float64, int64, bool or an object array of str.

    Raises TypeError for other types.
    """
    array: NDArray[Any] = np.asarray(values)
    kind = array.dtype.kind
    if kind in STORED_AS:
        array = array.astype(STORED_AS[kind], order="C", casting="safe")
    elif kind in "UTO" and all(isinstance(item, str) for item in array.ravel().tolist()):
        array = array.astype(object, order="C")
        check_text(*array.ravel().tolist())
    else:
        raise TypeError(f"cannot store values of type {array.dtype}: float, integer, bool or text only")
    array.setflags(write=False)
    return array


def check_text(*texts: str) -> None:
    """Raise ValueError for text that HDF5 would truncate or cannot encode."""
    for text in texts:
        if "\0" in text:
            raise ValueError(f"text with a NUL character cannot be stored: {text[:40]!r}")
        text.encode()


def check_name(name: str) -> None:
    """Raise ValueError for a name that some readers of the file would reject."""
    if not NAME.fullmatch(name):
        raise ValueError(f"{name!r} is not a valid name for a group or variable")


def plain(value: Any) -> Any:
    """Convert a value to JSON types.

    Raises ValueError for a non-finite number, TypeError for any other type.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"not a finite number: {value}")
        return float(value)
    if isinstance(value, str):
        check_text(value)
        return str(value)
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        check_text(*value)
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    raise TypeError(f"not a JSON value: {value!r}")


def remove_timings(summary: Mapping[str, Any], timed: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the summary without timings, at any depth."""

    def inner(value: Any) -> Any:
        if isinstance(value, Mapping):
            return remove_timings(value)
        return [inner(item) for item in value] if isinstance(value, list) else value

    return {key: inner(value) for key, value in summary.items() if not (key in timed or TIMING.fullmatch(key))}


def labelled(values: ArrayLike, label: Label, *dims: str, gaps: bool = False) -> Variable:
    """Build a variable from values whose dimensions are `dims`, then those of the label."""
    return Variable(np.asarray(values), (*dims, *label.dims), label.unit, label.text, label.timing, gaps)


def columns(rows: Sequence[Any], labels: Mapping[str, Label], dim: str) -> dict[str, Variable]:
    """Build one variable per label, from the attribute or key of that name in each row."""
    of: Any = getitem if rows and isinstance(rows[0], Mapping) else getattr
    return {label.name or name: column([of(row, name) for row in rows], label, dim) for name, label in labels.items()}


def values_by_column(row: Any, labels: Mapping[str, Label]) -> dict[str, Any]:
    """Return the labelled fields of one row, by column name."""
    return {label.name or name: getattr(row, name) for name, label in labels.items()}


def column(values: Sequence[Any], label: Label, dim: str) -> Variable:
    """Build a variable with one value per row. None becomes a missing value, or the `absent` value of the label."""
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


Array = NDArray[np.float64]

UNEVEN = "foothold_height_m"  # name of the variable with the foothold heights, stored only on uneven ground
FAR_EDGE_M = 1e6  # m; the first level begins this far behind the first foothold, beyond the edge of any drawing


def ground_levels(steps: Group) -> tuple[Array, Array] | None:
    """Return the positions (m) along the slope at which ground levels begin, midway between footholds, and their
    heights (m).

    steps  stored group of the walk's steps

    Returns None on even ground.
    """
    if UNEVEN not in steps.variables:
        return None
    along = np.append(0.0, steps["touch_along_m"])
    return np.append(-FAR_EDGE_M, 0.5 * (along[:-1] + along[1:])), np.append(0.0, steps[UNEVEN])
