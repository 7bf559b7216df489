"""The engines there are: what they are called, what has to be installed for them, and which module drives them."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from walkerlab.benchmarks.engines.adapter import Adapter, Simulation

EXTRA = "pip install 'walkerlab[engines]'"


@dataclass(frozen=True)
class Engine:
    """One engine.

    name     on the command line's output and of its adapter's module
    module   that its package is imported as
    package  as it is installed
    """

    name: str
    module: str
    package: str

    @property
    def is_installed(self) -> bool:
        """Whether it can be imported; nothing of it is."""
        return importlib.util.find_spec(self.module) is not None

    @property
    def install_line(self) -> str:
        """What to type to have it."""
        return f"pip install {self.package}"

    @property
    def version(self) -> str:
        """Of the package that is installed; "unknown" of a module that came without one."""
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return "unknown"

    def adapter(self) -> Adapter:
        """The module that drives it."""
        return cast("Adapter", importlib.import_module(f"walkerlab.benchmarks.engines.{self.name}"))

    @property
    def simulation(self) -> type[Simulation]:
        """A model in it."""
        return cast("type[Simulation]", getattr(self.adapter(), f"{self.name.capitalize()}Run"))


ENGINES = {
    engine.name: engine
    for engine in (
        Engine("mujoco", "mujoco", "mujoco"),
        Engine("drake", "pydrake", "drake"),
        Engine("exudyn", "exudyn", "exudyn"),
    )
}


def installed() -> tuple[Engine, ...]:
    """Those that are there."""
    return tuple(engine for engine in ENGINES.values() if engine.is_installed)


def installed_versions() -> dict[str, str]:
    """Return the versions of the engines that are installed, by engine."""
    return {engine.name: engine.version for engine in installed()}
