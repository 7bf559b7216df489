"""Types for the parts of a config that stages and their helpers may read. mypy checks that they read nothing else.

Each type lists its keys, and a config satisfies all types. A stage gets an object with only the keys of its type, and
their values, as canonical JSON, make up the key of its result. config/schema.py defines meaning, unit and bounds of the
keys.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol

# The help of the command line uses types of this module. Loading the schema and pydantic would slow it down.
if TYPE_CHECKING:
    from walkerlab.config import schema
    from walkerlab.config.analyses import Basin, Case, Continuation, Design, Plan, Robustness
    from walkerlab.config.check import Check
    from walkerlab.config.contact import Contact, Footholds
    from walkerlab.config.drives import PushOff
    from walkerlab.config.identify import Identify
    from walkerlab.config.recording import RecordedFile
    from walkerlab.config.second_leg import SecondPushOff
    from walkerlab.config.walkers import Walker


@cache
def keys_of(takes: type) -> dict[str, type | None]:
    """Map each key that a type reads (those of base classes first) to the type that lists what is read within it, or to
    None if the key is read completely."""
    members = (item for base in reversed(takes.__mro__) for item in vars(base).items())
    return {name: _part(member) for name, member in members if isinstance(member, property)}


def _part(member: property) -> type | None:
    getter: Any = member.fget
    annotation = getter.__annotations__.get("return")  # a name if the module postpones annotations
    result_type = getter.__globals__.get(annotation, annotation)
    # A type that is not a Protocol is a config block, which is read completely.
    return result_type if Protocol in getattr(result_type, "__mro__", ()) else None


def dotted_keys(takes: type) -> Iterator[str]:
    """Yield the keys of a type. Keys in a block that is read only in part are dotted, e.g. `solver.rigid`."""
    for name, part in keys_of(takes).items():
        yield from (name,) if part is None else (f"{name}.{key}" for key in dotted_keys(part))


def restrict(config: Any, takes: type | None) -> Any:
    """Return an object with only the keys of a type, or the config itself if the type is None."""
    if takes is None:
        return config
    return SimpleNamespace(**{name: restrict(getattr(config, name), part) for name, part in keys_of(takes).items()})


class PushOffAtOnce(Protocol):
    @property
    def impulse_N_s(self) -> float: ...
    @property
    def leg_2(self) -> SecondPushOff | None: ...


class RigidConfig(Protocol):
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
    """Keys that describe the scene, for both models."""

    @property
    def push_off(self) -> PushOff: ...
    @property
    def contact(self) -> Contact | None: ...


class StartConfig(Protocol):
    @property
    def start(self) -> schema.Start: ...


class WalkConfig(StartConfig, Protocol):
    """Start and length of a walk, its ground, and the arrays to store."""

    @property
    def strides(self) -> int: ...
    @property
    def ground(self) -> Footholds: ...
    @property
    def outputs(self) -> tuple[schema.Output, ...]: ...


class SceneConfig(StartConfig, ContactConfig, Protocol):
    """Keys that describe the scene, for both models, and the start of a walk."""


class WalksConfig(WalkConfig, SceneConfig, Protocol):
    """All keys on which walks of the two models depend."""

    @property
    def solver(self) -> schema.Solvers: ...
    @property
    def seed(self) -> int: ...


class RigidSolvers(Protocol):
    @property
    def rigid(self) -> schema.RigidSolver: ...


class ContactSolvers(Protocol):
    @property
    def contact(self) -> schema.ContactSolver: ...


class GroundConfig(SceneConfig, Protocol):
    """Keys that describe the scene, and solver settings of the contact model."""

    @property
    def solver(self) -> ContactSolvers: ...


class FixedPointConfig(RigidConfig, Protocol):
    @property
    def seed(self) -> int: ...


class SimulateConfig(WalkConfig, RigidConfig, Protocol):
    @property
    def solver(self) -> RigidSolvers: ...


class ContactSimConfig(WalkConfig, GroundConfig, Protocol):
    """Keys that `contact-sim` reads."""


class CompareConfig(ContactConfig, Protocol):
    @property
    def ground(self) -> Footholds: ...


class RecordedWalkConfig(RigidConfig, Protocol):
    @property
    def recording(self) -> RecordedFile | None: ...


class TuneConfig(GroundConfig, Protocol):
    @property
    def strides(self) -> int: ...
    @property
    def tune(self) -> schema.Tune: ...


class OwnCases(Protocol):
    @property
    def cases(self) -> tuple[Case, ...]: ...


class CompassCasesConfig(Protocol):
    """Keys that `stability` reads for the compass of the paper. The cases are variations of the paper's config."""

    @property
    def walker(self) -> Walker: ...
    @property
    def push_off(self) -> PushOffAtOnce: ...
    @property
    def stability(self) -> OwnCases: ...


class SceneCasesConfig(WalksConfig, Protocol):
    """Keys that `stability` reads for a walker other than the paper's. The extreme cases vary its scene."""

    @property
    def stability(self) -> OwnCases: ...


class MapCells(Protocol):
    @property
    def map_cells(self) -> int: ...


class MapsConfig(Protocol):
    """Keys that `stability-maps` reads. The maps are computed for the paper's config."""

    @property
    def stability(self) -> MapCells: ...


class ContinuationConfig(FixedPointConfig, ContactConfig, Protocol):
    @property
    def continuation(self) -> Continuation: ...


class BasinConfig(FixedPointConfig, GroundConfig, Protocol):
    @property
    def basin(self) -> Basin: ...


class RobustnessConfig(FixedPointConfig, ContactConfig, Protocol):
    @property
    def robustness(self) -> Robustness: ...


class StepsToTake(Protocol):
    @property
    def steps(self) -> int: ...


class DesignConfig(FixedPointConfig, ContactConfig, Protocol):
    @property
    def design(self) -> Design | None: ...
    @property
    def robustness(self) -> StepsToTake: ...


class IdentifyConfig(FixedPointConfig, ContactConfig, Protocol):
    @property
    def identify(self) -> Identify | None: ...


class CheckConfig(FixedPointConfig, Protocol):
    """Keys that `check` reads."""

    @property
    def check(self) -> Check | None: ...


class PlanConfig(IdentifyConfig, Protocol):
    """Keys that `plan` reads."""

    @property
    def plan(self) -> Plan | None: ...


class NamedConfig(Protocol):
    """Keys that `plot` reads."""

    @property
    def name(self) -> str: ...


if TYPE_CHECKING:
    OfEachType = tuple[
        SimulateConfig, ContactSimConfig, TuneConfig, CompassCasesConfig, SceneCasesConfig, MapsConfig,
        ContinuationConfig, BasinConfig, RobustnessConfig, DesignConfig, IdentifyConfig, PlanConfig, CheckConfig,
        NamedConfig,
    ]  # fmt: skip

    def check_every_type(config: schema.Config) -> OfEachType:
        """Let mypy check that a config satisfies every type."""
        return (config,) * 14


def slice_of(config: schema.Config, takes: type | None) -> dict[str, Any]:
    """Return the keys of a config that a type of `config.reads` lists, as nested JSON data. None returns all keys.

    Raises KeyError if a key is not in the schema.
    """

    def part(data: Any, takes: type | None) -> Any:
        return data if takes is None else {name: part(data[name], inner) for name, inner in keys_of(takes).items()}

    return dict(part(config.model_dump(mode="json"), takes))


def flatten(block: Mapping[str, Any], lists: bool = False, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted names and values of nested objects. If `lists` is true, split lists, too, into items named by their
    index."""
    for name, value in block.items():
        inner = {str(index): item for index, item in enumerate(value)} if lists and isinstance(value, list) else value
        if isinstance(inner, Mapping):
            yield from flatten(inner, lists, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def canonical_json(data: Any) -> str:
    """Return JSON that is the same for equal content: sorted keys, no blanks, ASCII, shortest floats.

    Raises ValueError if a number is not finite.
    """
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
