"""Load a config: turn a file, `--set` and `--strides` into a typed config with warnings and a run name.

A config changed by `--set` runs in its own folder, named after the changed values. The name does not depend on how
they were typed, so equal experiments share a folder.
"""

import hashlib
import math
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from walkerlab.config import analyses, files, schema, walkers
from walkerlab.config.fields import block_of, short_number
from walkerlab.config.problems import Problem, problem_error
from walkerlab.config.reads import flatten
from walkerlab.config.tree import BlockNode, ListNode, Node, Position, Scalar
from walkerlab.config.validation import align_start, key_at, node_at, validate_tree
from walkerlab.errors import ConfigError

IMPLAUSIBLE_SLOPE_RAD: Final = 0.5
"""Steeper than any slope on which passive walkers are known to walk. A larger value was probably given in degrees."""
IMPLAUSIBLE_LENGTH_M: Final = 20.0
"""Longer than the legs of any real walker. A larger value was probably given in millimetres."""
IMPLAUSIBLE_GRAVITY_M_S2: Final = 30.0
"""Stronger than the gravity of any planet in the solar system. A larger value was probably given in cm/s^2."""
WATER_KG_M3: Final = 1000.0
"""Density of water. A mass above that of a cube of water with sides as long as the legs was probably given
in grams."""


@dataclass(frozen=True, slots=True)
class LoadedConfig:
    """A valid config with its origin."""

    config: schema.Config  # typed config, complete with defaults
    run_name: str  # name of the run's folder inside the runs folder
    # KEY=VALUE of each key that differs from the config's file; earlier changes of a stored run come first
    changes: tuple[str, ...]
    warnings: tuple[str, ...]  # about adjusted or suspicious values, one sentence each
    source: str  # name of the config's file in messages
    tree: BlockNode  # untyped tree of the config, with positions
    base_tree: BlockNode  # the same without settings

    @property
    def base(self) -> schema.Config:
        """The config without the changes by `--set` and `--strides`."""
        return align_start(validate_tree(self.base_tree), self.base_tree)[0]

    def add_position(self, error: ConfigError) -> ConfigError:
        """Put the position of the key at fault in front of an error's message, if the config's text has this key."""
        where = node_at(self.tree, error.key)[1] if error.key and self.tree.entries.get(str(error.key[0])) else None
        return ConfigError(f"{where}: {error.message}", error.advice) if where else error

    def variant(self, settings: Sequence[files.ConfigSetting]) -> schema.Config:
        """Return the config with some keys changed.

        Raises ConfigError with positions if it is invalid.
        """
        tree = files.apply_settings(self.tree, settings)
        return align_start(validate_tree(tree), tree)[0]


def load(
    path: Path | files.ConfigFile | None = None,
    sets: Sequence[str] = (),
    strides: int | None = None,
    name: str | None = None,
) -> LoadedConfig:
    """Load a config from a file, by the name of a built-in config, or from a stored run. The default is the paper's
    config.

    sets     `--set` options, KEY=VALUE, in order
    strides  `--strides`, which overrides everything else
    name     `--name`; None keeps the config's name

    Raises a ConfigError that lists every problem with file, line, column, value, allowed values and the nearest key.
    """
    file = path if isinstance(path, files.ConfigFile) else files.find_config(path)
    tree = files.merge_layers(files.read_layers(file))
    start = Position(file.label, 1, 1)
    if "name" not in tree.entries:
        safe = safe_name(file.path.stem)
        tree = tree.copy_without()
        tree.put("name", Scalar(start, safe, safe), start)
    settings = [files.parse_setting(text) for text in sets]
    options = {"strides": strides, "name": name}
    settings += [files.option_setting(key, value) for key, value in options.items() if value is not None]
    changed_tree = files.replace_cases_file(files.apply_settings(tree, settings), Path())
    changed = validate_tree(changed_tree)
    base = validate_tree(tree) if settings else changed
    check_cases(changed, changed_tree)
    config, adjustments = align_start(changed, changed_tree)
    slope = changed_tree.entries.get("slope_deg")
    degrees = float(slope.value) if isinstance(slope, Scalar) and isinstance(slope.value, int | float) else None
    new = changes_of(base, changed, degrees)
    keys = {key_of(change) for change in new}
    changes = (*(earlier for earlier in file.changes if key_of(earlier) not in keys), *new)
    if changed.name != base.name:
        folder = run_name(changed.name, new)
    elif file.text is not None and not new:  # an unchanged run keeps its folder, whatever its name
        folder = file.path.name
    else:
        folder = run_name(base.name if file.text is None else file.path.name.partition("@")[0], changes)
    named = tree.entries["name"]
    warnings = [*suspicious_values(config, changed_tree), *adjustments]
    if isinstance(named, Scalar) and named.position == start and named.value != file.path.stem:
        cannot = "since the file's name is not valid for a run folder"
        warnings.insert(0, f"{file.label}: the run is named {named.value}, {cannot}")
    return LoadedConfig(config, name or folder, changes, tuple(warnings), file.label, changed_tree, tree)


def safe_name(text: str) -> str:
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:64].rstrip(".") or "run"


def suspicious_values(config: schema.Config, tree: BlockNode) -> Iterator[str]:
    """Yield warnings about likely mistakes: wrong units, a pad pitch without pads, or a leg mass that was not moved
    when the leg length was changed."""
    walker = config.walker
    block = tree.entries.get("walker")
    places = block.keys if isinstance(block, BlockNode) else {}
    length = short_number(walker.leg_length_m)
    if isinstance(walker, walkers.CompassWalker) and {"leg_length_m", "foot_to_mass_m"} <= places.keys():
        leg = places["leg_length_m"]
        mass = places["foot_to_mass_m"].source
        stays = walker.foot_to_mass_m
        # In these cases the user changed the mass, not the leg.
        mass_was_changed = leg.source.startswith("built-in") or mass.startswith("--")
        if leg.source != mass and not mass_was_changed and stays != walker.leg_length_m / 2:
            yield (
                f"{leg}: walker.leg_length_m is {length} m, and walker.foot_to_mass_m is still {short_number(stays)} m "
                f"(from {mass}), so the mass is not in the middle of the leg"
            )
    slope = tree.keys.get("slope_rad")
    if slope is not None and abs(config.slope_rad) > IMPLAUSIBLE_SLOPE_RAD:
        degrees = short_number(round(math.degrees(config.slope_rad), 1))
        yield str(Problem(slope, f"slope_rad is in radians, so this is {degrees} degrees; slope_deg takes degrees"))
    gravity = tree.keys.get("gravity_m_s2")
    if gravity is not None and config.gravity_m_s2 > IMPLAUSIBLE_GRAVITY_M_S2:
        text = f"gravity_m_s2 is {short_number(config.gravity_m_s2)}; it is in m/s^2 (9.81 on earth), not in cm/s^2"
        yield str(Problem(gravity, text))
    contact = config.contact
    if contact is not None and contact.terrain != "checkerboard" and not isinstance(contact.pad_pitch, str):
        text = f"contact.pad_pitch has no effect on {contact.terrain}, which has no pads"
        yield str(Problem(key_at(tree, ("contact", "pad_pitch")), f"{text}; only checkerboard has pads"))
    entries = flatten(walker.model_dump(mode="json"), lists=True)
    for name, value in ((name, value) for name, value in entries if isinstance(value, int | float)):
        place = key_at(tree, ("walker", *(int(part) if part.isdigit() else part for part in name.split("."))))
        text = f"walker.{name} is {short_number(value)}"
        if name.endswith("length_m") and value > IMPLAUSIBLE_LENGTH_M:
            yield str(Problem(place, f"{text} m; lengths are in m, not in mm"))
        if name.endswith("mass_kg") and value > WATER_KG_M3 * walker.leg_length_m**3:
            yield str(Problem(place, f"{text} kg on legs of {length} m; masses are in kg, not in g"))


MAX_NAME: Final = 40
"""Maximum length of a run folder's name that spells out the changes."""
UNSAFE: Final = re.compile(r"[^A-Za-z0-9._,@=+-]")


def changes_of(base: schema.Config, changed: schema.Config, slope_deg: float | None = None) -> tuple[str, ...]:
    """List the keys in which `changed` differs from `base` as KEY=VALUE. If slope_deg is given, it stands for
    slope_rad."""
    before, after = base.model_dump(mode="json", exclude={"name"}), changed.model_dump(mode="json", exclude={"name"})
    added = []
    for name in before:
        block = block_of(schema.Config.model_fields[name])
        if block is not None and before[name] is None and after[name] is not None:
            before[name] = block().model_dump(mode="json")
            added.append(f"{name}=added")
    values_before = dict(flatten(before))
    differing = {key: value for key, value in flatten(after) if key not in values_before or values_before[key] != value}
    # A key that is null in a new block does not count as a change if the block was null before.
    absent = {f"{key}." for key, value in values_before.items() if value is None}
    differing = {key: value for key, value in differing.items() if value is not None or not key.startswith((*absent,))}
    if slope_deg is not None and "slope_rad" in differing:
        differing = {"slope_deg" if key == "slope_rad" else key: value for key, value in differing.items()}
        differing["slope_deg"] = slope_deg
    return (*added, *(f"{key}={_word(value)}" for key, value in differing.items()))


def run_name(name: str, changes: Sequence[str]) -> str:
    """Name a run folder `name@key=value,...` if that is short, otherwise `name@label-` and 8 hex digits."""
    # The label is the first changed block that configures a stage, otherwise the first changed key.
    change = ",".join(changes)
    full_name = f"{name}@{change}" if change else name
    if not change or (len(full_name) <= MAX_NAME and not UNSAFE.search(change)):
        return full_name
    keys = [key_of(change_text) for change_text in changes]
    label = next((key.partition(".")[0] for key in keys if key.partition(".")[0] in schema.QUESTIONS), keys[0])
    return f"{name}@{UNSAFE.sub('-', label)}-{hashlib.sha256(change.encode()).hexdigest()[:8]}"


def key_of(change: str) -> str:
    return change.partition("=")[0]


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "_".join(_word(item) for item in value) or "none"
    if isinstance(value, int | float):
        return short_number(value)
    return "none" if value is None else str(value)


def paper_config_with(lines: Mapping[str, Any], source: str = "the paper's") -> schema.Config:
    """Build the paper config with changes. `lines` has nested keys with values, and `source` is how messages name them.

    Values of a start that follow from others are computed without a warning. Raises ConfigError if the result is
    invalid.
    """
    return paper_config_with_tree(tree_of(lines, Position(source, 1, 1)))


def paper_config_with_tree(upper: BlockNode) -> schema.Config:
    """Build the paper config with the keys of a block changed.

    Raises ConfigError with positions if the result is invalid.
    """
    # With SI units, keys missing from the contact block take the paper's physical values, not its numbers.
    layers = files.read_layers(files.builtin_config(files.DEFAULT))
    contact = upper.entries.get("contact")
    units = contact.entries.get("units") if isinstance(contact, BlockNode) else None
    if isinstance(units, Scalar) and units.value == "si":
        layers = [layer.copy_without("contact") for layer in layers]
    tree = files.merge_layers([*layers, upper])
    tree.put("name", Scalar(upper.position, files.DEFAULT, files.DEFAULT), upper.position)
    return align_start(validate_tree(tree), tree)[0]


def check_cases(config: schema.Config, tree: BlockNode) -> None:
    """Raise ConfigError with positions if a config's stability cases are invalid or share a name."""
    if not config.stability.cases:
        return
    block = tree.entries["stability"]
    listed = block.entries["cases"] if isinstance(block, BlockNode) else block
    assert isinstance(listed, ListNode), "validated cases are a list"
    places: dict[str, Position] = {}
    for case, node in zip(config.stability.cases, listed.items, strict=True):
        assert isinstance(node, BlockNode), "a validated case is a block"
        if case.name in places:
            raise problem_error(node.keys["name"], f"name: {case.name} is already used at {places[case.name]}")
        places[case.name] = node.keys["name"]
        lines = node.entries.get("config", BlockNode(node.position))
        assert isinstance(lines, BlockNode), "a validated config is a block"
        over = paper_config_with_tree(lines)
        if case.model == "contact":
            check_ground(case, over, lines)


def check_ground(case: analyses.Case, config: schema.Config, lines: BlockNode) -> None:
    if config.contact is None:
        where = lines.keys.get("contact", lines.position)
        raise problem_error(where, f"contact: case {case.name} needs a contact block but has none", "model: rigid")
    if not isinstance(config.start, tuple):
        return
    # Walks are judged relative to the step length of the start, even on ground without pads, so it must not be 0.
    by_start = config.contact.pad_pitch == "rigid" or config.contact.terrain == "after-mid-swing"
    if by_start and config.start[0] == config.start[1]:
        where = lines.keys.get("start", lines.position)
        text = f"start: case {case.name} starts with its feet together, but its ground needs a step length above 0"
        raise problem_error(where, text, "legs apart, or on a checkerboard contact.pad_pitch: a number")


def tree_of(block: Mapping[str, Any], position: Position) -> BlockNode:
    """Convert plain (or NumPy) values by key to a tree whose nodes all have the same position."""

    def node(value: Any) -> Node:
        if isinstance(value, Mapping):
            return tree_of(value, position)
        if isinstance(value, list | tuple):
            return ListNode(position, [node(item) for item in value])
        # NumPy's arrays and numbers have `tolist`.
        return node(value.tolist()) if hasattr(value, "tolist") else Scalar(position, value, str(value))

    tree = BlockNode(position)
    for name, value in block.items():
        tree.put(str(name), node(value), position)
    return tree
