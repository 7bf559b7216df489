"""Late imports for registries: code is named by a quoted string and imported on first use.

Module names are written in full, so that code digests include the modules (see code_digest.py).
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def registered(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


def later(module: str, name: str) -> Callable[..., Any]:
    """Return a stand-in that imports the function when it is called."""
    return lambda *arguments: registered(module, name)(*arguments)
