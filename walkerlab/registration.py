"""Registration of code that nothing below may depend on: a registry names it in quotes and imports it when it is used.

The name is written in full, so that the code counts among what a result is made of (see sources.py).
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def registered(module: str, name: str) -> Any:
    """Return what a module registers under a name."""
    return getattr(import_module(module), name)


def later(module: str, name: str) -> Callable[..., Any]:
    """Return a function that is imported only when it is called."""
    return lambda *arguments: registered(module, name)(*arguments)
