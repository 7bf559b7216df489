"""Exported names of the package, for type checkers."""

from walkerlab.api import *  # noqa: F403 (the API lists its names once)

__version__: str
EXTENSIONS: dict[str, str]
