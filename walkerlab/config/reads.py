"""What stages and their helpers take of a config: each type names the keys that may be read, and mypy holds them to it.

A config is of every type here. A stage is given an object that has the keys of its type and no others, and the key of
its result is made of them. What a key means, its unit and its bounds stand in config/schema.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol

# The command line's help is made from types of this module, and loads no schema and no pydantic.
if TYPE_CHECKING:
    from walkerlab.config import schema
    from walkerlab.config.basin import Basin
    from walkerlab.config.contact import Contact
    from walkerlab.config.continuation import Continuation
    from walkerlab.config.design import Design
    from walkerlab.config.drives import PushOff
    from walkerlab.config.ground import Footholds
    from walkerlab.config.robustness import Robustness
    from walkerlab.config.stability import Case
    from walkerlab.config.walkers import Walker


@cache
def keys_of(takes: type) -> dict[str, type | None]:
    """The keys that a type names, those of its bases first; for a block of which it takes a part, the type of that."""
    members = (item for base in reversed(takes.__mro__) for item in vars(base).items())
    return {name: _part(member) for name, member in members if isinstance(member, property)}


def _part(member: property) -> type | None:
    getter: Any = member.fget
    named = getter.__globals__.get(getter.__annotations__.get("return"))
    # a block of the config is taken whole, whether or not it is imported here
    return named if Protocol in getattr(named, "__mro__", ()) else None


def dotted_keys(takes: type) -> Iterator[str]:
    """The same keys, those of parts of blocks dotted: `solver.rigid`."""
    for name, part in keys_of(takes).items():
        yield from (name,) if part is None else (f"{name}.{key}" for key in dotted_keys(part))


def only(config: Any, takes: type | None) -> Any:
    """An object with the keys that a type names, and no others; the config itself for None."""
    if takes is None:
        return config
    return SimpleNamespace(**{name: only(getattr(config, name), part) for name, part in keys_of(takes).items()})


class PushOffAtOnce(Protocol):
    """A push-off that takes no time."""

    @property
    def impulse_N_s(self) -> float: ...


class RigidConfig(Protocol):
    """What the rigid model is made of."""

    @property
    def walker(self) -> Walker: ...
    @property
    def gravity_m_s2(self) -> float: ...
    @property
    def slope_rad(self) -> float: ...
    @property
    def push_off(self) -> PushOffAtOnce: ...
    @property
    def equations(self) -> schema.Equations: ...


class ContactConfig(RigidConfig, Protocol):
    """What both models are made of."""

    @property
    def push_off(self) -> PushOff: ...
    @property
    def contact(self) -> Contact | None: ...


class StartConfig(Protocol):
    """Where a walk starts."""

    @property
    def start(self) -> schema.Start: ...


class WalkConfig(StartConfig, Protocol):
    """Where a walk starts, how far it goes, and what is stored of it."""

    @property
    def strides(self) -> int: ...
    @property
    def ground(self) -> Footholds: ...
    @property
    def outputs(self) -> tuple[schema.Output, ...]: ...


class SceneConfig(StartConfig, ContactConfig, Protocol):
    """Both models and where they start."""


class WalksConfig(WalkConfig, SceneConfig, Protocol):
    """A scene and all that its walks in both models depend on."""

    @property
    def solver(self) -> schema.Solvers: ...
    @property
    def seed(self) -> int: ...


class RigidSolvers(Protocol):
    """How the rigid model is integrated."""

    @property
    def rigid(self) -> schema.RigidSolver: ...


class ContactSolvers(Protocol):
    """How the contact model is integrated."""

    @property
    def contact(self) -> schema.ContactSolver: ...


class GroundConfig(SceneConfig, Protocol):
    """A scene and how it is walked on its ground."""

    @property
    def solver(self) -> ContactSolvers: ...


class FixedPointConfig(RigidConfig, Protocol):
    """What `fixedpoint` takes."""

    @property
    def seed(self) -> int: ...


class SimulateConfig(WalkConfig, RigidConfig, Protocol):
    """What `simulate` takes."""

    @property
    def solver(self) -> RigidSolvers: ...


class ContactSimConfig(WalkConfig, GroundConfig, Protocol):
    """What `contact-sim` takes."""


class CompareConfig(ContactConfig, Protocol):
    """What `compare` takes."""

    @property
    def ground(self) -> Footholds: ...


class TuneConfig(GroundConfig, Protocol):
    """What `tune` takes."""

    @property
    def strides(self) -> int: ...
    @property
    def tune(self) -> schema.Tune: ...


class OwnCases(Protocol):
    """The config's own cases."""

    @property
    def cases(self) -> tuple[Case, ...]: ...


class CompassCasesConfig(Protocol):
    """What `stability` takes where the walker is the paper's compass: cases stand on the paper's config."""

    @property
    def walker(self) -> Walker: ...
    @property
    def push_off(self) -> PushOffAtOnce: ...
    @property
    def stability(self) -> OwnCases: ...


class SceneCasesConfig(WalksConfig, Protocol):
    """What `stability` takes where the walker is another one: cases stand on its own scene."""

    @property
    def stability(self) -> OwnCases: ...


class MapCells(Protocol):
    """How fine the maps of stability are."""

    @property
    def map_cells(self) -> int: ...


class MapsConfig(Protocol):
    """What `stability-maps` takes: the maps are of the paper's config."""

    @property
    def stability(self) -> MapCells: ...


class ContinuationConfig(FixedPointConfig, ContactConfig, Protocol):
    """What `continuation` takes."""

    @property
    def continuation(self) -> Continuation: ...


class BasinConfig(FixedPointConfig, GroundConfig, Protocol):
    """What `basin` takes."""

    @property
    def basin(self) -> Basin: ...


class RobustnessConfig(FixedPointConfig, ContactConfig, Protocol):
    """What `robustness` takes."""

    @property
    def robustness(self) -> Robustness: ...


class DesignConfig(FixedPointConfig, ContactConfig, Protocol):
    """What `design` takes."""

    @property
    def design(self) -> Design | None: ...


class NamedConfig(Protocol):
    """What `plot` takes."""

    @property
    def name(self) -> str: ...


if TYPE_CHECKING:
    OfEachType = tuple[
        SimulateConfig, ContactSimConfig, TuneConfig, CompassCasesConfig, SceneCasesConfig, MapsConfig,
        ContinuationConfig, BasinConfig, RobustnessConfig, DesignConfig, NamedConfig,
    ]  # fmt: skip

    def of_each_type(config: schema.Config) -> OfEachType:
        """Let mypy see that a config is."""
        return config, config, config, config, config, config, config, config, config, config, config
