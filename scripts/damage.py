"""Ways to damage a stored result, either by accident or deliberately, with a new valid seal."""

from __future__ import annotations

import hashlib
import io
import random
from collections.abc import Callable

import h5py
import numpy as np

from walkerlab.pipeline.store.artifact import SEAL_BYTES

Alteration = Callable[[random.Random, h5py.File], None]
HOSTILE = ("<script>alert(1)</script>", "../../x", "\x1b[2J", "9" * 10_000, "nan", "{}", "")


def cut(drawn: random.Random, data: bytes) -> bytes:
    """Cut the file short."""
    return data[: drawn.randrange(len(data))]


def flip(drawn: random.Random, data: bytes) -> bytes:
    """Flip a bit."""
    changed = bytearray(data)
    changed[drawn.randrange(len(data))] ^= 1 << drawn.randrange(8)
    return bytes(changed)


def overwrite(drawn: random.Random, data: bytes) -> bytes:
    """Overwrite a block with noise or zeros."""
    changed, at = bytearray(data), drawn.randrange(len(data))
    length = min(drawn.randrange(1, 4096), len(data) - at)
    changed[at : at + length] = drawn.randbytes(length) if drawn.random() < 0.5 else bytes(length)
    return bytes(changed)


def replace_all(drawn: random.Random, data: bytes) -> bytes:
    """Replace the whole file by something else."""
    return drawn.choice((b"", b"\x89HDF\r\n\x1a\n", b"text\n", drawn.randbytes(len(data))))


def forge(drawn: random.Random, data: bytes) -> bytes:
    """Alter the content with HDF5's own tools, and seal it again."""
    place = io.BytesIO(data[:-SEAL_BYTES])
    with h5py.File(place, "r+") as file:
        drawn.choice(ALTERATIONS)(drawn, file)
    image = place.getvalue()
    return image + f"\nwalkerlab sha256 {hashlib.sha256(image).hexdigest()}\n".encode()


def datasets(file: h5py.File) -> list[str]:
    """Return the paths of all arrays."""
    found: list[str] = []
    file.visititems(lambda name, node: found.append(name) if isinstance(node, h5py.Dataset) else None)
    return sorted(found)


def reshape(drawn: random.Random, file: h5py.File) -> None:
    """Give an array another shape."""
    name = drawn.choice(datasets(file))
    shape = tuple(size + drawn.randrange(1, 4) for size in file[name].shape) or (2,)
    del file[name]
    file.create_dataset(name, data=np.zeros(shape))


def change_number(drawn: random.Random, file: h5py.File) -> None:
    """Replace one number of an array, possibly by NaN."""
    name = drawn.choice([name for name in datasets(file) if file[name].dtype.kind == "f" and file[name].size])
    values = file[name][()]
    values.flat[drawn.randrange(values.size)] = drawn.choice((np.nan, np.inf, -1e308, drawn.random()))
    file[name][...] = values


def change_version(drawn: random.Random, file: h5py.File) -> None:
    """Change the version of the layout."""
    file.attrs["schema_version"] = drawn.choice((0, 1, -1, 10**6))


def hostile_attribute(drawn: random.Random, file: h5py.File) -> None:
    """Replace an attribute by a hostile value."""
    file.attrs[drawn.choice(sorted(file.attrs))] = drawn.choice(HOSTILE)


def declare_huge(drawn: random.Random, file: h5py.File) -> None:
    """Declare ten gigabytes in a file of a few kilobytes."""
    name = drawn.choice(datasets(file)) + "_more"
    chunks = (1 << 10,) if drawn.random() < 0.5 else None
    file.create_dataset(name, shape=(10 << 27,), dtype="f8", chunks=chunks)


def take_away(drawn: random.Random, file: h5py.File) -> None:
    """Remove an array or an attribute."""
    if drawn.random() < 0.5:
        del file[drawn.choice(datasets(file))]
    else:
        del file.attrs[drawn.choice(sorted(file.attrs))]


ALTERATIONS: tuple[Alteration, ...] = (
    reshape,
    change_number,
    change_version,
    hostile_attribute,
    declare_huge,
    take_away,
)
WAYS: tuple[Callable[[random.Random, bytes], bytes], ...] = (cut, flip, overwrite, replace_all, forge, forge)
