"""Convert content to and from the bytes of HDF5 files that xarray can open."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from walkerlab.pipeline.store.content import Attribute, Group, Variable

# Text by which netCDF readers recognise a dimension without a coordinate. The dimension's length is appended to it.
BARE_DIMENSION = "This is a netCDF dimension but not a netCDF variable."
CONVENTIONS = "CF-1.11"
"""Metadata conventions of the files, for netCDF readers."""
ENCODING = "_Encoding"
"""Attribute by which xarray decodes text."""
MIN_TEXT_BYTES = 2
"""Minimum length of text in arrays. If it were one byte, netCDF readers would join the texts along the last
dimension."""
MAX_LEVELS = 16
STRINGS_AT_ONCE = 64
MIN_MEMBER_BYTES = 32
"""Minimum number of bytes that a member of a group takes in a file. The size of the file therefore limits the number of
members, even if links are circular.
"""


def image(content: Mapping[str, Group], root: Mapping[str, Attribute]) -> bytes:
    """Build an HDF5 file in memory. Thus only an ordinary write can fail on a full disk, not the HDF5 library."""
    # No file named "image" is created: the memory driver has no backing store.
    with h5py.File("image", "w", driver="core", backing_store=False, track_order=True) as file:
        write_attributes(file, root)
        for path, group in sorted(content.items()):
            target = file.create_group(path, track_order=True) if path else file
            if path:
                write_attributes(target, group.attrs)
            write_variables(target, sorted(group.variables.items(), key=lambda item: item[1].dims != (item[0],)))
        file.flush()
        return bytes(file.id.get_file_image())


def write_in_turn(
    path: Path, variables: Iterable[tuple[str, Variable]], root: Callable[[], Mapping[str, Attribute]]
) -> None:
    """Write the variables at a file's root one by one, coordinates first, and then the attributes of the root.

    Raises OSError if that fails.
    """
    with h5py.File(path, "w", track_order=True) as file:
        write_variables(file, variables)
        write_attributes(file, root())


class GroupOnDisk(Group):
    """Variables at the root of an intact file, each read on access."""

    def __init__(self, file: Path) -> None:
        # The checks of `Group` would read all variables.
        object.__setattr__(self, "variables", VariablesOnDisk(file))
        object.__setattr__(self, "attrs", {})


class VariablesOnDisk(Mapping[str, Variable]):
    """Variables at the root of a file, by name."""

    def __init__(self, file: Path) -> None:
        """Read the names and addresses of the datasets at the root."""
        self.file = file
        with h5py.File(file) as opened:
            members = {name: opened[name] for name in sorted(opened)}
            self._by_address = names_of(members)
            datasets = {name: member for name, member in members.items() if isinstance(member, h5py.Dataset)}
            self._names = [name for name, dataset in datasets.items() if not is_bare_dimension(dataset)]
        self._read = lru_cache(maxsize=8)(self._read_anew)

    def __getitem__(self, name: str) -> Variable:
        return self._read(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def _read_anew(self, name: str) -> Variable:
        with h5py.File(self.file) as opened:
            return read_variable(name, opened[name], self._by_address, Budget(self.file.stat().st_size))


def write_variables(target: Any, variables: Iterable[tuple[str, Variable]]) -> None:
    """Write variables one by one, coordinates first. A dimension without a coordinate is stored as a bare length."""
    for name, variable in variables:
        dataset = write_variable(target, name, variable)
        if variable.dims == (name,):
            dataset.make_scale(name)
            continue
        for axis, (dim, size) in enumerate(zip(variable.dims, variable.values.shape, strict=True)):
            if dim not in target:
                bare = target.create_dataset(dim, shape=(size,), dtype="i1", track_order=True)
                bare.make_scale(f"{BARE_DIMENSION}{size:10d}")
            dataset.dims[axis].attach_scale(target[dim])


def write_variable(target: Any, name: str, variable: Variable) -> Any:
    """Write one array with its labels."""
    kind = variable.values.dtype.kind
    values = encoded(variable.values) if kind == "O" else variable.values
    # Booleans are stored as bytes with the mark that xarray uses, because netCDF has no boolean type.
    dtype = {"O": values.dtype, "f": "<f8", "i": "<i8", "b": "i1"}[kind]
    dataset = target.create_dataset(name, data=values, dtype=dtype, track_order=True)
    marks = {mark: 1 for mark in ("timing", "missing") if getattr(variable, mark)}
    labels = {"units": variable.units, "long_name": variable.long_name}
    of_type = {"O": {ENCODING: "utf-8"}, "b": {"dtype": "bool"}}.get(kind, {})
    write_attributes(dataset, {**labels, **of_type, **marks})
    return dataset


def text_bytes(values: NDArray[Any]) -> int:
    """Return the length in bytes at which each string of an array is stored."""
    return max([MIN_TEXT_BYTES, *(len(text.encode()) for text in {"", *values.ravel().tolist()})])


def stored_bytes(values: NDArray[Any]) -> int:
    """Return the size of an array in a file."""
    return values.size * text_bytes(values) if values.dtype.kind == "O" else values.nbytes


def encoded(values: NDArray[Any]) -> NDArray[np.bytes_]:
    """Encode an array of strings as fixed-length UTF-8, padded with NUL."""
    # The type is not marked as UTF-8, because Octave stops at any text that is not marked as ASCII.
    texts = [text.encode() for text in values.ravel().tolist()]
    return np.array(texts, f"S{text_bytes(values)}").reshape(values.shape)


def write_attributes(holder: Any, attributes: Mapping[str, Attribute]) -> None:
    """Write attributes in order. Text is stored as UTF-8 of fixed length, like netCDF's ordinary text attributes."""
    for name, value in attributes.items():
        if isinstance(value, str):
            data = value.encode()
            holder.attrs.create(name, data, dtype=h5py.string_dtype("utf-8", max(len(data), 1)))
        else:
            holder.attrs[name] = value


def parse(data: bytes) -> tuple[dict[str, Group], dict[str, Attribute]]:
    """Parse the groups, by path, and the root attributes of an untrusted HDF5 file.

    Data that declare more than the file can hold are not read. Raises ValueError for them and for content that `image`
    cannot write. Errors of the HDF5 library are passed on.
    """
    with h5py.File(h5py.h5f.open_file_image(data)) as file:
        return dict(walk_groups(file, "", Budget(len(data)))), read_attributes(file)


class Budget:
    """Number of bytes that the unread datasets may still declare. A file cannot hold more bytes than its own size."""

    def __init__(self, size: int) -> None:
        """Set the budget to the size of the file, in bytes."""
        self.left = size

    def spend(self, size: int) -> None:
        """Subtract bytes that the contents declare from the budget.

        Raises ValueError if they declare more than the file holds.
        """
        self.left -= size
        if self.left < 0:
            raise ValueError("it declares more data than the file holds")


def walk_groups(parent: Any, path: str, budget: Budget) -> Iterator[tuple[str, Group]]:
    """Yield all groups below a group with their paths, children first."""
    if path.count("/") >= MAX_LEVELS:
        raise ValueError("its groups are nested too deeply")
    variables: dict[str, Variable] = {}
    members: dict[str, Any] = {}
    for name in sorted(parent):
        budget.spend(MIN_MEMBER_BYTES)
        if not isinstance(parent.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"it holds a link, {name!r}")
        members[name] = parent[name]
    names = names_of(members)
    for name, member in members.items():
        if isinstance(member, h5py.Group):
            yield from walk_groups(member, f"{path}/{name}" if path else name, budget)
        elif not is_bare_dimension(member):
            variables[name] = read_variable(name, member, names, budget)
    if path or variables:
        yield path, Group(variables, read_attributes(parent) if path else {})


def is_bare_dimension(dataset: Any) -> bool:
    return "NAME" in dataset.attrs and read_text(dataset, "NAME").startswith(BARE_DIMENSION)


def names_of(members: Mapping[str, Any]) -> dict[int, str]:
    """Map the address of each of a group's members to its name. HDF5 would search the whole file to find the name for
    an address."""
    return {h5py.h5o.get_info(member.id).addr: name for name, member in members.items()}


def read_variable(name: str, dataset: Any, names: Mapping[int, str], budget: Budget) -> Variable:
    """Read one array with its labels. `names` maps the addresses of the group's members to their names."""
    values = read_values(name, dataset, budget)
    if "dtype" in dataset.attrs and read_text(dataset, "dtype") == "bool":
        values = values.astype(np.bool_)
    scales = [] if dataset.is_scale else [h5py.h5o.get_info(axis[0].id).addr for axis in dataset.dims]
    if not all(scale in names for scale in scales):
        raise ValueError(f"a dimension of {name!r} is not in its group")
    return Variable(
        values,
        dims=(name,) if dataset.is_scale else tuple(names[scale] for scale in scales),
        units=read_text(dataset, "units"),
        long_name=read_text(dataset, "long_name"),
        timing="timing" in dataset.attrs,
        missing="missing" in dataset.attrs,
    )


def read_values(name: str, dataset: Any, budget: Budget) -> NDArray[Any]:
    """Read the values of a dataset after checking its declared size."""
    layout = dataset.id.get_create_plist()
    if layout.get_layout() not in (h5py.h5d.CONTIGUOUS, h5py.h5d.COMPACT) or layout.get_external_count():
        raise ValueError(f"{name!r} has a layout that walkerlab does not write")
    if dataset.shape is None:
        raise ValueError(f"{name!r} has no shape")
    dtype = dataset.dtype
    budget.spend(int(dataset.size) * int(dtype.itemsize))
    if is_text(dtype):
        return read_strings(dataset, budget)
    if dtype not in (np.dtype("<f8"), np.dtype("<i8"), np.dtype("i1")):
        raise ValueError(f"{name!r} has type {dtype}, which walkerlab does not write")
    return np.asarray(dataset[()])


def read_strings(dataset: Any, budget: Budget) -> NDArray[Any]:
    """Read the strings of a dataset. In files of layout 2, they have variable lengths."""
    if h5py.check_string_dtype(dataset.dtype).length is None:
        return read_variable_strings(dataset, budget)
    texts = np.asarray(dataset[()])
    # Equal strings share one object, because a short string takes far more memory here than in the file.
    decoded = {text: text.decode() for text in set(texts.ravel().tolist())}
    return np.array([decoded[text] for text in texts.ravel().tolist()], object).reshape(texts.shape)


def read_variable_strings(dataset: Any, budget: Budget) -> NDArray[Any]:
    """Read strings of variable length a few at a time, so that the budget also catches many references to one long
    string."""
    if dataset.ndim == 0:
        return np.array(dataset[()].decode(), dtype=object)
    values = np.empty(dataset.shape, dtype=object)
    # Strings are read in slices of the last dimension, which holds all points of a sweep over one parameter.
    for row in np.ndindex(dataset.shape[:-1]):
        for start in range(0, dataset.shape[-1], STRINGS_AT_ONCE):
            part = (*row, slice(start, start + STRINGS_AT_ONCE))
            texts = dataset[part]
            budget.spend(sum(len(text) for text in texts))
            values[part] = [text.decode() for text in texts]
    return values


def read_attributes(holder: Any) -> dict[str, Attribute]:
    """Read the attributes of a group as Python types.

    Raises ValueError for other types.
    """
    attributes: dict[str, Attribute] = {}
    for name in holder.attrs:
        declared = holder.attrs.get_id(name)
        is_known = declared.dtype in (np.dtype("<f8"), np.dtype("<i8"), np.dtype("?")) or is_text(declared.dtype)
        if declared.shape != () or not is_known:
            raise ValueError(f"its attribute {name!r} has a type that walkerlab does not write")
        attributes[name] = read_text(holder, name) if is_text(declared.dtype) else holder.attrs[name].item()
    return attributes


def read_text(holder: Any, name: str) -> str:
    """Read a text attribute."""
    value = holder.attrs[name]
    if isinstance(value, bytes):
        return value.decode()
    if not isinstance(value, str):
        raise ValueError(f"its attribute {name!r} is not text")
    return value


def is_text(dtype: Any) -> bool:
    return h5py.check_string_dtype(dtype) is not None
