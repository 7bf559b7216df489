"""Fixtures: a content that uses all features of the format, and the attributes of its file."""

import contextlib
import os

import numpy as np
import pytest

from walkerlab.config.schema import Config
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.provenance import begin


def full_content(scale: float = 1.0, samples: int = 4) -> Content:
    time = np.linspace(0.0, 1.0, samples)
    walk = Group(
        {
            "time": Variable(time, ("time",), "s", "time since the start"),
            "state": Variable(scale * np.outer(time, [1.0, 2.0]), ("time", "component"), "rad", "state"),
            "component": Variable(np.array(["theta_1", "θ₂"]), ("component",), "", "component of the state"),
            "foot": Variable(np.arange(samples) % 2, ("time",), "1", "stance foot"),
            "loaded": Variable(time > 0.5, ("time",), "1", "whether it carries weight"),
            "force": Variable(np.where(time > 0.5, time, np.nan), ("time",), "N", "normal force", missing=True),
            "wall": Variable(time, ("time",), "s", "run time", timing=True),
            "mean": Variable(np.array(0.5), (), "rad", "mean"),
            "event": Variable(np.array([], dtype=str), ("event",), "", "no event"),
        },
        {"outcome": "walked", "steps": 10, "drift_J": 1e-12, "stable": True},
    )
    empty = Group({}, {"note": "nothing here, and that is said"})
    summary = {"state": [-0.2, 0.17], "outcome": "walked", "rows": [{"error": 1e-9, "wall_s": 0.1}], "best": "dop853"}
    return Content({"corrected/walk": walk, "corrected": empty}, summary, timed=("best",))


@pytest.fixture
def content():
    return full_content()


@pytest.fixture
def identity():
    return Identity("simulate", {"slope_rad": 0.0174, "walker": {"leg_mass_kg": 5.0}}, {"fixedpoint": "a" * 64}, "c0de")


@pytest.fixture
def origin():
    return begin(Config(), {"fixedpoint": "b" * 64})


@contextlib.contextmanager
def without_privileges():
    """Make file permissions count for whoever runs the tests, including root."""
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(user)


@pytest.fixture
def unprivileged():
    return without_privileges
