"""What an adapter is: a module that builds a planar model in its engine and steps it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from walkerlab.benchmarks.engines.planar import PlanarModel
from walkerlab.solvers.system import Floats

Forces = Callable[[float, Floats, Floats], Floats]
"""Generalised forces from time, coordinates and velocities; the result is overwritten by the next call."""


@dataclass(frozen=True)
class EngineContact:
    """What an engine's own contact is to be tuned to, by closed forms, SI.

    mass             that stands on one foot (kg)
    gravity          towards the ground (m/s^2)
    penetration      under that weight at rest (m)
    exponent         of the penetration that the force grows with
    damping_ratio    c / (2 sqrt(k m)) there
    friction         tangential over normal force of a foot that slides
    creep_load       tangential over normal force of a foot that stands
    creep_velocity   at which it creeps under that load (m/s)
    """

    mass: float
    gravity: float
    penetration: float
    exponent: float
    damping_ratio: float
    friction: float
    creep_load: float
    creep_velocity: float


@dataclass(frozen=True)
class Integrator:
    """One of an engine's integrators.

    order       that it promises
    most_steps  of a run: what takes longer is not run
    adapts      its steps to a tolerance
    for_contact_only  without contact it is one of the others
    """

    order: int
    most_steps: int
    adapts: bool = False
    for_contact_only: bool = False


@dataclass(frozen=True)
class OwnContact:
    """An engine's own contact with the settings that it was tuned to."""

    model: str
    settings: Mapping[str, float]


OnStep = Callable[[float, Floats, Floats], bool]
"""Told time (s), coordinates and velocities at the end of every step of an engine; whether to go on."""


@dataclass(frozen=True)
class Stepping:
    """How an engine is to step.

    integrator  one of its own
    step_s      size of its steps; where they are adapted, the largest
    tolerance   where they are adapted, else None
    """

    integrator: str
    step_s: float
    tolerance: float | None = None


class Simulation(ABC):
    """A model in its start state."""

    def __init__(
        self,
        model: PlanarModel,
        stepping: Stepping,
        q: Floats,
        v: Floats,
        forces: Forces | None = None,
        own: OwnContact | None = None,
    ) -> None:
        """The model at coordinates q (of the root's freedoms, then of the hinges; m, rad) with velocities v.

        forces  on the walker from outside the engine
        own     the engine's own contact with the ground
        """
        self.stepping, self.forces, self.own = stepping, forces, own
        self.build(model, q, v)

    @abstractmethod
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        """Build the model in the engine, with its own contact if it has one, under the forces if there are any."""

    @abstractmethod
    def run(self, steps: int, until_s: float, on_step: OnStep) -> None:
        """Step until a time, or for a number of steps, or until it is told to stop."""

    @abstractmethod
    def carry(self, ball: int, has_ground: bool) -> None:
        """Put ground under a foot or take it away; means nothing without the engine's own contact."""


class Adapter(Protocol):
    """A module of this package that drives one engine; it imports the engine when it is first asked for something.

    INTEGRATORS     by name
    CONTACTS        its contact models, each with the integrator that it runs with
    CANNOT_EXPRESS  what it cannot, in words
    """

    INTEGRATORS: Mapping[str, Integrator]
    CONTACTS: Mapping[str, str]
    CANNOT_EXPRESS: tuple[str, ...]

    def tuned(self, model: str, target: EngineContact) -> OwnContact:
        """The settings by which a contact model does what the target says, as far as it can."""
