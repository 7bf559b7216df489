"""Engines with which our walks are compared. Their packages are imported only when they run."""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from walkerlab.evidence.benchmarks.engines.adapter import Adapter, Simulation

EXTRA = "pip install 'walkerlab[engines]'"


@dataclass(frozen=True)
class Engine:
    """A physics engine with which our walks are compared."""

    # name of the engine in the output; its adapter module and the distribution to install have the same name
    name: str
    module: str  # import name of its package
    core: str = ""  # distribution that contains the library itself, if it can be installed without `name`

    @property
    def is_installed(self) -> bool:
        """Whether the engine can be imported. This does not import it."""
        return importlib.util.find_spec(self.module) is not None

    @property
    def install_line(self) -> str:
        return f"pip install {self.name}"

    @property
    def version(self) -> str:
        """Version of the installed library, or "unknown" for a module without a distribution."""
        # The core comes first, because the distribution that contains it may be missing or have another version.
        for distribution in filter(None, (self.core, self.name)):
            with contextlib.suppress(importlib.metadata.PackageNotFoundError):
                return importlib.metadata.version(distribution)
        return "unknown"

    def adapter(self) -> Adapter:
        return cast("Adapter", importlib.import_module(f"walkerlab.evidence.benchmarks.engines.{self.name}"))

    @property
    def simulation(self) -> type[Simulation]:
        return cast("type[Simulation]", getattr(self.adapter(), f"{self.name.capitalize()}Run"))


PHYSICS_ENGINES = {
    engine.name: engine
    for engine in (Engine("mujoco", "mujoco", "mujoco-core"), Engine("drake", "pydrake"), Engine("exudyn", "exudyn"))
}


def installed() -> tuple[Engine, ...]:
    return tuple(engine for engine in PHYSICS_ENGINES.values() if engine.is_installed)


def installed_versions(_config: object = None) -> dict[str, str]:
    return {engine.name: engine.version for engine in installed()}
