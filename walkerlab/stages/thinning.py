"""What of a long walk's samples is stored: all of its beginning and end, and between them what shows each step."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from walkerlab.stages.progress import Progress

Samples = TypeVar("Samples")

FIRST_STEPS, LAST_STEPS = 200, 20
"""Steps of which every sample is stored."""
MOST_BETWEEN = 50_000
"""Samples of the steps between them, at most, beside both sides of every heel strike."""


def thinned(samples: Samples, time: NDArray[np.float64], ends: NDArray[np.float64], progress: Progress) -> Samples:
    """The samples that are stored; those of an ordinary walk themselves.

    samples  a dataclass of arrays whose first axis is time
    time     (samples,) s
    ends     (steps,) s, times at which steps ended
    """
    if ends.size <= FIRST_STEPS + LAST_STEPS:
        return samples
    kept = kept_of(time, ends)
    progress.note(
        f"{ends.size} steps: of {time.size} samples {kept.size} are stored, all of the first {FIRST_STEPS} and the "
        f"last {LAST_STEPS} steps, fewer of those between; both sides of every heel strike are among them"
    )
    arrays: Any = samples
    stored: Samples = replace(arrays, **{field.name: getattr(samples, field.name)[kept] for field in fields(arrays)})
    return stored


def kept_of(time: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.int64]:
    """Places of the samples that are stored."""
    step = np.searchsorted(ends, time, side="right")
    whole = (step < FIRST_STEPS) | (step >= ends.size - LAST_STEPS)
    changes = np.flatnonzero(np.diff(step))
    whole[changes] = whole[changes + 1] = True
    between = np.flatnonzero(~whole)
    whole[between[:: max(1, -(-between.size // MOST_BETWEEN))]] = True
    return np.flatnonzero(whole)
