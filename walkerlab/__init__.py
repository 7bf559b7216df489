"""Passive-dynamic walking as a reproducible experiment. See README.md, and docs/python.md for use from Python.

Names that `walkerlab.api` lists are imported on first access, so importing the package takes no time.
"""

from typing import Any

__version__ = "0.3.0.dev0"

EXTENSIONS = {
    "walks": ".pipeline.stages.table:WALKING",
    "study": ".evidence.paper.extension:EXTENSION",
    "benchmarks": ".evidence.benchmarks.extension:EXTENSION",
    "verification": ".evidence.verification.extension:EXTENSION",
    "check": ".evidence.check.extension:EXTENSION",
    "questions": ".pipeline.stages.table:ASKING",
    "drawings": ".views.report.extension:EXTENSION",
}
"""Built-in extensions (see extensions.py), in the order of their stages. Other packages register entry points."""


def __getattr__(name: str) -> Any:
    """Import an exported name on first access. `__all__` is the list of these names."""
    if name.startswith("_") and name != "__all__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # With an import statement, the code digest of every stage would contain the API, which no stage needs.
    from importlib import import_module

    api = import_module(".api", __name__)
    if name not in (*api.__all__, "__all__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(api, name)
    return value


def __dir__() -> list[str]:
    """Return all names of the package, including exports that are not loaded yet."""
    return sorted([*globals(), *__getattr__("__all__")])
