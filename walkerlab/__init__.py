"""Passive-dynamic walking as a reproducible experiment; see README.md, and docs/python.md for use from Python.

Names in `__all__` are imported on first access, so importing the package takes no time. `__init__.pyi` lists the same
names for type checkers.
"""

from typing import Any

__version__ = "0.3.0.dev0"

EXTENSIONS = {
    "walks": ".pipeline.stages.table:WALKING",
    "study": ".evidence.paper.extension:EXTENSION",
    "benchmarks": ".evidence.benchmarks.extension:EXTENSION",
    "verification": ".evidence.verification.extension:EXTENSION",
    "questions": ".pipeline.stages.table:ASKING",
    "drawings": ".views.report.extension:EXTENSION",
}
"""The package's own extensions (see extensions.py), in the order of their stages. Other packages announce theirs."""

__all__ = [
    "Config",
    "ConfigError",
    "Gait",
    "Result",
    "Run",
    "basin",
    "compass",
    "contact",
    "continue_gait",
    "dataset",
    "design",
    "explore",
    "export_model",
    "find_gait",
    "identify",
    "kneed",
    "mujoco_model",
    "open_run",
    "plan_measurements",
    "read_walk",
    "robustness",
    "run",
    "simulate",
    "sweep",
    "walker",
]


def __getattr__(name: str) -> Any:
    """Load an exported name on first access."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # An import statement would put the API, which no stage needs, into the code digest of every stage.
    from importlib import import_module

    value = getattr(import_module(".api", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return all names of the package, including exports that are not loaded yet."""
    return sorted([*globals(), *__all__])
