"""Interface of an engine's adapter: a module that builds a planar model in its engine and steps it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from walkerlab.exchange.engine_scene import EngineContact
from walkerlab.exchange.planar import PlanarModel
from walkerlab.physics.solvers.system import Floats

Forces = Callable[[float, Floats, Floats], Floats]
"""Generalised forces from time, coordinates and velocities; the result is overwritten by the next call."""


@dataclass(frozen=True)
class Integrator:
    """An engine's integrator."""

    order: int  # nominal
    most_steps: int  # budget of a run
    adapts: bool = False  # whether steps follow a tolerance
    for_contact_only: bool = False  # whether it equals another integrator in the absence of contact


@dataclass(frozen=True)
class OwnContact:
    """Contact model of an engine, with tuned settings."""

    model: str
    settings: Mapping[str, float]


OnStep = Callable[[float, Floats, Floats], bool]
"""Told time (s), coordinates and velocities at the end of every step of an engine; whether to go on."""


@dataclass(frozen=True)
class Stepping:
    """Integrator and step control of an engine's run."""

    integrator: str
    step_s: float  # step size, or the largest one where steps are adaptive
    tolerance: float | None = None  # None for fixed steps


class Simulation(ABC):
    """Model in an engine, in its start state."""

    def __init__(
        self,
        model: PlanarModel,
        stepping: Stepping,
        q: Floats,
        v: Floats,
        forces: Forces | None = None,
        own: OwnContact | None = None,
    ) -> None:
        """Build the model at coordinates q (root freedoms, then hinges; m, rad) and velocities v.

        forces  external forces on the walker
        own     the engine's own ground contact
        """
        self.stepping, self.forces, self.own = stepping, forces, own
        self.build(model, q, v)

    @abstractmethod
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        """Build the model in the engine, with `self.own` and `self.forces` where they are not None."""

    @abstractmethod
    def run(self, steps: int, until_s: float, on_step: OnStep) -> None:
        """Advance until a time, for at most `steps` steps, or until `on_step` returns False."""

    @abstractmethod
    def carry(self, ball: int, has_ground: bool) -> None:
        """Enable or disable a foot's ground; has no effect without the engine's own contact."""


class Adapter(Protocol):
    """A module that drives one engine, and imports it only when a model is built."""

    INTEGRATORS: Mapping[str, Integrator]  # by name
    CONTACTS: Mapping[str, str]  # integrator of each contact model
    CANNOT_EXPRESS: tuple[str, ...]  # limitations, for the report

    def tuned(self, model: str, target: EngineContact) -> OwnContact:
        """Settings with which a contact model comes closest to the target."""
