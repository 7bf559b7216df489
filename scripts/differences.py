"""Decide what counts as a difference between two answers: texts, JSON, and stored results."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np


class Near(NamedTuple):
    """Rule for ordinary numbers: they agree within a fraction of the largest of them, or within an absolute difference
    in SI units.
    """

    relative: float
    absolute: float


class AsLarge(NamedTuple):
    """Rule for rounding and error estimates: numbers need only have the same order of magnitude, or lie below the
    floor.
    """

    factor: float
    floor: float


# Rules by a pattern for the path of a quantity or for the last part of its path. The first match counts, and None means
# that the quantity is not compared. Each rule allows about five times the effect that a change of the equations by one
# rounding has in compare_versions.py.
RULES: tuple[tuple[str, Near | AsLarge | None], ...] = (
    # Times, durations and sources are no part of an answer.
    (r".*wall.*|.*cpu.*|.*(_per_s|seconds)|(started|ended)_utc|.*_(digests?|keys?)|(package|library)_versions?", None),
    (r"command_line|platform|git_commit|summary_json|DIMENSION_LIST|REFERENCE_LIST", None),
    # What other solvers give in extreme cases depends on rounding, and so does the used fraction of a budget.
    (r".*/(ordinary\[\d+\]|measures\[\d+\]/(value|limit)).*", None),
    # Rounding changes counts of work if a solver step is only just accepted.
    (r"rejected.*", Near(0.1, 20.0)),
    (r".*(evaluations|accepted|jacobians|newton|solves|iterations).*|steps_tried|work", Near(0.04, 10.0)),
    (r".*residual.*|.*drift.*|.*rounding.*|.*(step_)?error|.*numerical.*|.*agreement.*", AsLarge(30.0, 1e-8)),
    (r".*lyapunov.*|exponent|.*uncertainty.*|.*attractor.*|.*chaotic.*", Near(0.2, 0.05)),
    # The ratio is to a force that goes through zero in a fall.
    (r"max_friction_ratio", Near(0.02, 1e-6)),
    # These come from the derivative of a step, or from a search that ends when it is near enough.
    (r".*multiplier.*|.*radius.*|.*derivative.*|.*/orders/.*|.*factor.*|.*margin.*|.*distance.*", Near(1e-5, 1e-6)),
    # Contact is stiff, so forces and velocities amplify small differences in penetration.
    (r".*_N|.*penetration.*", Near(3e-5, 1e-5)),
    (r".*velocity.*|.*rate.*|.*slip.*|.*dissipat.*|.*_J", Near(1e-6, 1e-7)),
    (r".*", Near(1e-7, 1e-8)),
)  # fmt: skip
NUMBER = re.compile(r"[-\u2212]?\d[\d,]*(?:\.\d+)?(?:[eE][-+]?\d+)?")
SUPERSCRIPT = "\u207b\u2070\u00b9\u00b2\u00b3\u2074-\u2079"
POWER_OF_TEN = re.compile(rf"(?:[-\u2212]?\d+(?:\.\d+)? \u00d7 )?10[{SUPERSCRIPT}]+")
GONE, NEW = "is gone", "is new"
HEX = re.compile(r"\b[0-9a-f]{8,}\b")


@dataclass(frozen=True)
class Difference:
    """Two values that differ, and their difference as a multiple of the allowed one."""

    name: str
    share: float  # fraction of the allowed difference; inf for NaN
    words: str


def rule_for(name: str) -> Near | AsLarge | None:
    """Return the rule for a quantity, which its path names."""
    last = re.sub(r"(\[\d+\])+$", "", re.split("[/:@]", name)[-1])
    return next(rule for pattern, rule in RULES if re.fullmatch(pattern, name if "/" in pattern else last))


def of_values(old: Any, new: Any, name: str, looser: float = 1.0) -> Iterator[Difference]:
    """Yield differences between two JSON values. `looser` multiplies every tolerance."""
    if rule_for(name) is None or (old is None and new is None):
        return
    if isinstance(old, dict) and isinstance(new, dict):
        yield from of_names(old, new, name)
        for key in old.keys() & new.keys():
            yield from of_values(old[key], new[key], f"{name}/{key}", looser)
    elif isinstance(old, str) and isinstance(new, str):
        yield from of_texts(old, new, name)
    elif is_numeric(old) and is_numeric(new):
        yield from of_numbers(np.asarray(old, float), np.asarray(new, float), name, looser)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from of_values(one, other, f"{name}[{i}]", looser)
    elif old != new:
        yield Difference(name, math.inf, f"{shortened(old)} and {shortened(new)}")


def of_names(old: Any, new: Any, name: str) -> Iterator[Difference]:
    """Yield a difference for each name that only one side has."""
    for key in sorted(set(old) ^ set(new)):
        if rule_for(key) is not None:
            yield Difference(f"{name}/{key}", math.inf, GONE if key in old else NEW)


def of_texts(old: str, new: str, name: str) -> Iterator[Difference]:
    """Yield differences between two texts.

    Words must be equal except for white space, and numbers up to the last printed digit. Errors and powers of ten may
    differ.
    """
    texts = [" ".join(HEX.sub("#", POWER_OF_TEN.sub("#", text)).split()) for text in (old, new)]
    words = [NUMBER.sub("#", text) for text in texts]
    if words[0] != words[1]:
        at = next((i for i, (a, b) in enumerate(zip(*words, strict=False)) if a != b), min(map(len, words)))
        shown = [text[max(0, at - 30) : at + 60] for text in words]
        yield Difference(name, math.inf, f"...{shown[0]}... and ...{shown[1]}...")
        return
    for one, other in zip(*(NUMBER.findall(text) for text in texts), strict=True):
        apart = abs(spoken(one) - spoken(other))
        if apart > 1.01 * max(last_digit(one), last_digit(other)):
            yield Difference(name, math.inf, f"{one} and {other} in '{texts[1][:60]}'")


def spoken(number: str) -> float:
    """Return the value of a printed number."""
    return float(number.replace(",", "").replace("\u2212", "-"))


def last_digit(number: str) -> float:
    """Return what one unit in the last digit of a printed number is worth. For whole numbers, and for numbers with more
    digits than can be meant, return 0.
    """
    mantissa, _, exponent = number.lower().partition("e")
    decimals = mantissa.partition(".")[2]
    if len(decimals) > 9:
        return 1e-8 * max(1.0, abs(spoken(number)))
    return float(f"1e{int(exponent or 0) - len(decimals)}") if decimals else 0.0


def of_numbers(old: Any, new: Any, name: str, looser: float) -> Iterator[Difference]:
    """Yield differences between two arrays."""
    if old.shape != new.shape:
        yield Difference(name, math.inf, f"shapes {old.shape} and {new.shape}")
        return
    absent = np.isnan(old)
    if np.any(absent != np.isnan(new)):
        yield Difference(name, math.inf, "other values are missing")
        return
    old, new = old[~absent], new[~absent]
    off = float(np.max(np.where(old == new, 0.0, np.abs(old - new)), initial=0.0))
    if off == 0.0:
        return
    rule, scale = rule_for(name), float(np.max(np.abs(old)))
    if isinstance(rule, AsLarge):
        sizes = [max(rule.floor, float(np.max(np.abs(values)))) for values in (old, new)]
        share = math.log(max(sizes) / min(sizes)) / math.log(rule.factor * max(1.0, looser))
        yield Difference(name, share, f"{np.max(np.abs(old)):.2g} and {np.max(np.abs(new)):.2g} at most")
    elif rule is not None:
        share = off / ((rule.absolute + rule.relative * scale) * looser)
        yield Difference(name, share, f"{off:.2e} apart, of at most {scale:.6g}")


def of_artifacts(old: Path, new: Path, name: str, looser: float = 1.0) -> Iterator[Difference]:
    """Yield differences between two HDF5 files: names, shapes, types, attributes (units, long names) and values."""
    with h5py.File(old) as one, h5py.File(new) as other:
        items = [dict(everything_in(file)) for file in (one, other)]
        yield from of_names(*items, name)
        for path in items[0].keys() & items[1].keys():
            pair = [found[path] for found in items]
            attributes = [{key: plain(item.attrs[key]) for key in item.attrs if rule_for(key)} for item in pair]
            yield from of_values(*attributes, f"{name}:{path}@", looser)
            if not all(isinstance(item, h5py.Dataset) for item in pair):
                continue
            if pair[0].dtype.kind != pair[1].dtype.kind:
                yield Difference(f"{name}:{path}", math.inf, f"types {pair[0].dtype} and {pair[1].dtype}")
            elif "timing" not in pair[0].attrs:
                yield from of_values(*(plain(item[()]) for item in pair), f"{name}:{path}", looser)


def everything_in(file: Any) -> Iterator[tuple[str, Any]]:
    """Return every group and dataset of a file by path, including the root."""
    found = [("", file)]
    file.visititems(lambda path, item: found.append((path, item)))
    yield from found


def plain(value: Any) -> Any:
    """Convert a stored value to JSON types. Text that is JSON is parsed."""
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray) and value.dtype.kind in "OS":
        return [plain(each) for each in value.ravel()]
    return value.item() if isinstance(value, np.generic) else value


def is_numeric(values: Any) -> bool:
    """Whether a value is a number, or nested lists of numbers in rows of equal length."""
    try:
        return not isinstance(values, str | dict | None) and np.asarray(values).dtype.kind in "fiub"
    except ValueError:
        return False


def shortened(value: Any) -> str:
    """Format a value in at most sixty characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
