"""Late imports for registries: code is named by a quoted string and imported when it is used.

Names are written in full, so that digests of code include them (see code_digest.py).
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def registered(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


def later(module: str, name: str) -> Callable[..., Any]:
    """Return a stand-in for a function that is imported when first called."""
    return lambda *arguments: registered(module, name)(*arguments)
