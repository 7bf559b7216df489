"""Interface of an engine's adapter: a module that builds a planar model in its engine and steps it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from walkerlab.exchange.engine_scene import EngineContact
from walkerlab.exchange.planar import PlanarModel
from walkerlab.physics.solvers.system import Floats

Forces = Callable[[float, Floats, Floats], Floats]
"""Function of time (s), coordinates and velocities. It returns generalised forces, which the next call overwrites."""


@dataclass(frozen=True)
class Integrator:
    """Properties of an engine's integrator."""

    order: int  # nominal order of convergence
    most_steps: int  # step budget of a run
    adapts: bool = False  # whether the step size follows a tolerance
    # whether to run it only with native contact, because without contact it equals another integrator
    for_contact_only: bool = False


@dataclass(frozen=True)
class OwnContact:
    """Contact model of an engine, with tuned settings."""

    model: str
    settings: Mapping[str, float]


OnStep = Callable[[float, Floats, Floats], bool]
"""Function called after every engine step with time (s), coordinates and velocities. It returns whether to continue."""


@dataclass(frozen=True)
class Stepping:
    """Integrator and step control of an engine's run."""

    integrator: str
    step_s: float  # step size, or the largest one if steps are adaptive
    tolerance: float | None = None  # None for fixed steps


class Simulation(ABC):
    """A model in an engine, which starts in a given state."""

    def __init__(
        self,
        model: PlanarModel,
        stepping: Stepping,
        q: Floats,
        v: Floats,
        forces: Forces | None = None,
        own: OwnContact | None = None,
    ) -> None:
        """Build the model in its start state.

        q, v    coordinates (m, rad) and velocities: first the degrees of freedom of the base, then the hinges
        forces  external forces on the walker, or None
        own     native ground contact of the engine, or None
        """
        self.stepping = stepping
        self.forces = forces
        self.own = own
        self.build(model, q, v)

    @abstractmethod
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        """Build the model in the engine, with `self.own` and `self.forces` unless they are None."""

    @abstractmethod
    def run(self, steps: int, until_s: float, on_step: OnStep) -> None:
        """Advance to `until_s` in at most `steps` steps, and stop early if `on_step` returns False."""

    @abstractmethod
    def carry(self, ball: int, has_ground: bool) -> None:
        """Enable or disable the ground under a foot. This has no effect without the engine's native contact."""


class Adapter(Protocol):
    """A module that drives one engine. It imports the engine only when a model is built."""

    INTEGRATORS: Mapping[str, Integrator]  # integrators by name
    CONTACTS: Mapping[str, str]  # name of the integrator for each contact model
    CANNOT_EXPRESS: tuple[str, ...]  # limitations, for the report

    def tune(self, model: str, target: EngineContact) -> OwnContact:
        """Return the settings with which a contact model comes closest to the target."""
