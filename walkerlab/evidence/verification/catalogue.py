"""Catalogues of extreme cases: one for the paper's compass, and one of variations that apply to any scene.

The variations change the ground, the slope, the start, the knees or the settings of the solver. The twin of a walker
has another size, mass and gravity, but is dynamically similar, so it must walk in the same way.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, Final, TypeVar

from walkerlab.config.analyses import FATES, Case, Fate
from walkerlab.config.drives import HINGE_PARAMETERS
from walkerlab.config.fields import Block, annotation_of, replace_key
from walkerlab.config.loader import paper_config_with
from walkerlab.config.reader import read
from walkerlab.config.reads import RigidConfig
from walkerlab.config.schema import Config, replace_state, state_of
from walkerlab.config.tree import plain
from walkerlab.config.walkers import has_knees
from walkerlab.errors import ConfigError
from walkerlab.physics.orbits.similarity import Units
from walkerlab.scene.parts import hinge_law_of

CATALOGUE: Final = Path(__file__).parent / "catalogue.yaml"
UNIQUE_NAME_ADVICE: Final = "Give each case a unique name."
SCENE_CATALOGUE: Final = Path(__file__).with_name("scene_catalogue.yaml")
PHYSICAL_ENDS: tuple[Fate, ...] = tuple(
    fate for fate in FATES if fate not in ("budget-exhausted", "solver-failed", "rejected")
)
"""Physically possible outcomes. A case whose outcome we cannot know accepts them all, so only its measures can fail."""
STOPPED_ENDS: tuple[Fate, ...] = tuple(fate for fate in PHYSICAL_ENDS if fate != "walked")
SCENE_CHANGES: Final = ("start", "slope", "times", "over", "set")
CASE_DEFAULTS: Final = {"steps": 4, "budget": 1_000_000, "expected": PHYSICAL_ENDS}


@cache
def package_cases() -> tuple[Case, ...]:
    families = read_catalogue(CATALOGUE).items()
    cases = [Case.model_validate({"family": name, **entry}) for name, entries in families for entry in entries]
    return check_unique_names(cases)


def read_catalogue(path: Path) -> Any:
    """Read a catalogue file into plain values."""
    root = read(path.read_text(encoding="utf-8"), path.name)
    assert root is not None, "a catalogue is not empty"
    return plain(root)


def all_cases(user_cases: Sequence[Case], catalogue: Sequence[Case] | None = None) -> tuple[Case, ...]:
    """Return the cases of a catalogue (by default that of the package), then those of a config.

    Raises ConfigError if two cases share a name.
    """
    catalogue = package_cases() if catalogue is None else catalogue
    if shared := {case.name for case in catalogue} & {case.name for case in user_cases}:
        raise ConfigError(f"The catalogue already has cases named {', '.join(sorted(shared))}.", UNIQUE_NAME_ADVICE)
    return (*catalogue, *check_unique_names(user_cases))


def check_unique_names(cases: Sequence[Case]) -> tuple[Case, ...]:
    """Return the cases as a tuple.

    Raises ConfigError if two of them share a name.
    """
    names = [case.name for case in cases]
    if doubled := sorted({name for name in names if names.count(name) > 1}):
        raise ConfigError(
            f"Case names must differ, but these are used more than once: {', '.join(doubled)}.", UNIQUE_NAME_ADVICE
        )
    return tuple(cases)


def config_of(case: Case) -> Config:
    """Apply the changes of a case to the paper config.

    Raises ConfigError if the result is invalid.
    """
    return paper_config_with(case.config, f"case {case.name}")


def scene_cases(config: Config) -> list[tuple[Case, Config]]:
    """Return the cases of a scene with their configs, for both models or, without contact, only for the rigid one.

    config  the scene, with a numeric start and, on pads, a numeric pad pitch
    """
    present = features(config)
    cases = []
    for entry in read_catalogue(SCENE_CATALOGUE):
        needs = {entry.get("model", "contact"), *entry.pop("needs", ())}
        changes: dict[str, Any] = {name: entry.pop(name) for name in SCENE_CHANGES if name in entry}
        if entry.get("expected") == "stops":
            entry["expected"] = STOPPED_ENDS
        if needs <= present:
            case = Case.model_validate({**CASE_DEFAULTS, **entry, "name": f"scene-{entry['name']}"})
            cases.append((case, change_scene(config, changes)))
    return cases


def features(config: Config) -> set[str]:
    """Return the features of a scene that cases may require, such as friction or a compliant knee lock."""
    walker = config.walker
    present = {"rigid"}
    if config.contact is not None:
        present |= {"contact", "friction"} if config.contact.has_friction else {"contact"}
    if has_knees(walker):
        present |= {f"release at {walker.knee.release}", f"{walker.knee.lock} lock"}
    return present


def change_scene(config: Config, changes: Mapping[str, Any]) -> Config:
    """Apply the changes of a case to a scene. A new slope also turns the start, so that both feet stand on it."""
    start = changes.get("start", 1.0)
    slope = changes.get("slope", 1.0) * config.slope_rad
    values = dict(changes.get("set", {}))
    values |= {path: factor * attrgetter(path)(config) for path, factor in changes.get("times", {}).items()}
    values |= {path: attrgetter(path)(config) / factor for path, factor in changes.get("over", {}).items()}
    if "start" in changes or "slope" in changes:
        state = state_of(config.start)
        rotation = config.slope_rad - slope
        n = len(state) // 2
        turned = (*(x + rotation for x in state[:n]), *(start * x for x in state[n:]))
        values |= {"slope_rad": slope, "start": replace_state(config.start, turned)}
    for path, value in values.items():
        config = replace_key(config, path, value)
    return config


B = TypeVar("B", bound=Block)
# leg (m), mass (kg) and gravity (m/s^2) of the twin. The values are not round, so that rounding errors differ.
TWIN_LEG = 1.37
TWIN_MASS = 11.3
TWIN_GRAVITY = 7.43


def pendulum_time(config: RigidConfig) -> float:
    """Return the pendulum time sqrt(L/g) (s) of a config's walker."""
    return math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)


def to_twin(config: RigidConfig) -> Units:
    """Return the scale factors that turn a config's walker into its twin."""
    length = TWIN_LEG / config.walker.leg_length_m
    mass = TWIN_MASS / config.walker.total_mass_kg
    return Units(length, mass, math.sqrt(length * config.gravity_m_s2 / TWIN_GRAVITY))


def scale_block(block: B, by: Units, special: Mapping[str, float]) -> B:
    """Return the block with each value scaled according to the unit of its key, or by its entry in `special`."""

    def value(quantity: Any, unit: float) -> Any:
        if isinstance(quantity, Block):
            return scale_block(quantity, by, special)
        if isinstance(quantity, tuple):
            return tuple(value(item, unit) for item in quantity)
        return quantity * unit if isinstance(quantity, float) and unit != 1.0 else quantity

    values: dict[str, Any] = {}
    for name, field in type(block).model_fields.items():
        unit = special.get(name) or by.natural_unit(annotation_of(field, "unit"))
        values[name] = value(getattr(block, name), unit)
    return block.model_copy(update=values)


def scale_config(config: Config, by: Units) -> Config:
    """Return the config of a similar walker: quantities with a unit are scaled, angles and pure numbers are not."""
    # A law of an extension may give its parameters other units. Hip and knees use the same names for them, so one
    # mapping serves both.
    law_units = hinge_law_of(config.walker).units(by.energy, by.time)
    changes: dict[str, object] = {
        "walker": scale_block(config.walker, by, dict(zip(HINGE_PARAMETERS, law_units, strict=True))),
        "gravity_m_s2": config.gravity_m_s2 * by.length / by.time**2,
        "push_off": scale_block(config.push_off, by, {}),
    }
    if not isinstance(config.start, str):
        state = state_of(config.start)
        n = len(config.start) // 2
        changes["start"] = replace_state(config.start, (*state[:n], *(rate / by.time for rate in state[n:])))
    if config.contact is not None:
        si = config.contact.to_si()
        pitch = config.contact.pad_pitch
        ground = {
            "units": "si",
            "stiffness": si.stiffness * by.force / by.length**si.exponent,
            "damping": si.damping * by.mass / by.time,
            "full_damping_penetration": si.full_damping_penetration * by.length,
            "stiction_velocity": si.stiction_velocity * by.length / by.time,
            "friction_velocity": si.friction_velocity * by.length / by.time,
            "pad_pitch": pitch if isinstance(pitch, str) else pitch * by.length,
        }
        changes["contact"] = config.contact.model_copy(update=ground)
    return config.model_copy(update=changes)
