"""Tests of precedence: a file overrides the config that it extends, and `--set` and `--strides` override both."""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import process_time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walkerlab.config.files import apply_settings, parse_setting
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.schema import Config, Contact
from walkerlab.config.tree import plain
from walkerlab.errors import ConfigError

Write = Callable[..., Path]
Loaded = Callable[..., LoadedConfig]
Refused = Callable[..., str]


def test_inherited_blocks_are_merged(write: Write) -> None:
    write("extends: paper\nname: base\nstrides: 7\nwalker: {hip_mass_kg: 3}\n", "base.yaml")
    config = load(write("extends: base.yaml\nwalker: {leg_mass_kg: 2}\ncontact: {damping: 50}\n")).config
    assert (config.walker.hip_mass_kg, config.walker.leg_mass_kg, config.strides) == (3, 2, 7)
    assert config.contact is not None
    assert (config.contact.damping, config.contact.stiffness) == (50, 1e5)


def test_name_is_not_inherited(loaded: Loaded) -> None:
    assert loaded("extends: paper\n").run_name == "mine"


@pytest.mark.parametrize("slope", ["slope_deg: 3", "slope_rad: 0.05235987755982989"])
def test_slope_in_either_unit_replaces_the_inherited_one(write: Write, slope: str) -> None:
    write("slope_deg: 1\n", "base.yaml")
    config = load(write(f"extends: base.yaml\n{slope}\n")).config
    assert config.slope_rad == pytest.approx(math.radians(3), rel=1e-15)


def test_null_removes_an_inherited_block(loaded: Loaded) -> None:
    assert loaded("extends: paper\ncontact: null\n").config.contact is None


def test_list_in_a_config_replaces_the_whole_inherited_list(loaded: Loaded) -> None:
    assert loaded("extends: paper\noutputs: [forces]\n").config.outputs == ("forces",)


def test_error_in_an_inherited_file_names_that_file(write: Write) -> None:
    write("strides: none\n", "base.yaml")
    with pytest.raises(ConfigError, match=r"base\.yaml:1:10: strides: 'none' is not an integer"):
        load(write("extends: base.yaml\n"))


def test_circular_inheritance_is_rejected(write: Write) -> None:
    write("extends: mine.yaml\n", "other.yaml")
    with pytest.raises(ConfigError, match=r"other\.yaml:1:10: extends: .*mine\.yaml extends itself"):
        load(write("extends: other.yaml\n"))


def test_missing_parent_is_reported_at_its_extends_key(refused: Refused) -> None:
    assert re.match(r"mine.yaml:2:10: there is no config .*nope\.yaml", refused("strides: 3\nextends: nope.yaml\n"))


@pytest.mark.parametrize("parent", ["[paper]", "3", "''", "{a: 1}"])
def test_parent_must_be_the_name_of_a_config(refused: Refused, parent: str) -> None:
    assert "extends: is not the name of a config" in refused(f"extends: {parent}\n")


def test_long_chain_of_parents_is_rejected(write: Write) -> None:
    for index in range(20):
        write(f"extends: c{index + 1}.yaml\n", f"c{index}.yaml")
    with pytest.raises(ConfigError, match="files deep"):
        load(write("extends: c0.yaml\n"))


def test_setting_is_parsed_as_yaml_and_typed_by_the_schema() -> None:
    config = load(
        None, ["contact.stiffness=1e6", "outputs=[forces]", "walker.hip_mass_kg=0", "equations=as-printed"]
    ).config
    assert config.contact is not None
    assert (config.contact.stiffness, config.outputs) == (1e6, ("forces",))
    assert (config.walker.hip_mass_kg, config.equations) == (0.0, "as-printed")


def test_later_setting_wins() -> None:
    assert load(None, ["strides=3", "strides=4"]).config.strides == 4
    assert load(None, ["slope_deg=3", "slope_deg=4"]).config.slope_rad == math.radians(4)


@pytest.mark.parametrize("settings", [["slope_rad=0.1", "slope_deg=3"], ["slope_deg=3", "slope_rad=0.1"]])
def test_slope_set_in_both_units_is_rejected(settings) -> None:
    with pytest.raises(ConfigError, match="slope"):
        load(None, settings)


def test_setting_a_block_replaces_the_whole_block() -> None:
    contact = load(None, ["contact.damping=50", "contact={stiffness: 2e5}"]).config.contact
    assert contact == Contact(stiffness=2e5)


def test_block_can_be_removed_and_added() -> None:
    assert load(None, ["contact=null"]).config.contact is None
    assert load(Path("rigid-only"), ["contact.damping=50"]).config.contact == Contact(damping=50)


def test_strides_option_overrides_everything() -> None:
    assert load(None, ["strides=3"], strides=2).config.strides == 2


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        (
            "contact.stifness=1e6",
            r"^--set contact\.stifness=1e6: contact\.stifness: unknown key .* did you mean contact\.stiffness\?",
        ),
        ("contact.damping=fast", r"^--set contact\.damping=fast: contact\.damping: 'fast' is not a number"),
        ("strides=", r"strides: nothing is not an integer"),
        ("name=../../x", r"is not valid"),
        ("extends=paper", r"extends: belongs in a file"),
        ("strides", r"is not of the form KEY=VALUE"),
        ("=3", r"is not of the form KEY=VALUE"),
        ("a..b=3", r"is not of the form KEY=VALUE"),
        ("contact.units.x=3", r"contact\.units is a value, not a block"),
        ("start=[1, 2", r"not YAML"),
        ("start=" + "[" * 5000, r"nested deeper"),
        (".".join("a" * 3000) + "=1", r"nested deeper"),
        ("walker=&a [*a]", r"anchor"),
        ("strides=\udcff", r"\\udcff cannot be in a config"),
        ("slope_deg=0,5", r"'0,5' is not a number; did you mean 0\.5\?"),
        ("contact.damping=1,5e2", r"'1,5e2' is not a number; did you mean 1\.5e2\?"),
        ("contact.damping=1.000,5", r"'1\.000,5' is not a number; allowed"),
        (r'recording.name="a\0b"', r"'a\\x00b' holds a character that no file can store"),
        (r'recording.file="\ud800.csv"', r"'\\ud800\.csv' holds a character that no file can store"),
        (r'recording.columns={"angle\0": x}', r"recording\.columns: .*holds a character that no file can store"),
        (r'recording.units={angle: "\udfff"}', r"recording\.units: .*holds a character that no file can store"),
        (r'identify={data: "\0"}', r"holds a character that no file can store"),
        (r'source={title: "\0"}', r"holds a character that no file can store"),
    ],
)
def test_bad_setting_is_rejected_with_its_position(refused: Refused, setting: str, expected: str) -> None:
    assert re.search(expected, refused("contact: {units: si}\n", sets=[setting]))


def test_settings_leave_the_original_config_unchanged() -> None:
    """This includes settings within a block that an earlier setting added."""
    tree = load(None).tree
    damping, stiffness = (parse_setting(f"contact.{text}") for text in ("damping=7", "stiffness=8"))
    block = parse_setting("contact={damping: 3, stiffness: 4}")
    both, alone = apply_settings(tree, [block, damping, stiffness]), apply_settings(tree, [block])
    assert plain(both)["contact"] == {"damping": 7, "stiffness": 8}
    assert plain(alone)["contact"] == {"damping": 3, "stiffness": 4}
    assert plain(tree) == plain(load(None).tree)


def test_time_to_apply_settings_is_linear_in_their_number() -> None:
    """Eight times as many settings take far less than 64 times as long."""
    took = []
    for count in (2_000, 16_000):
        settings = [replace(parse_setting("walker.x=1"), path=("walker", f"x{number}")) for number in range(count)]
        begin = process_time()
        apply_settings(load(None).tree, settings)
        took.append(process_time() - begin)
    assert took[1] < 24.0 * took[0]


def test_invalid_strides_are_rejected() -> None:
    with pytest.raises(ConfigError, match="--strides 0: strides: 0 is out of bounds"):
        load(strides=0)


@settings(deadline=None)
@given(st.text(max_size=40))
def test_any_setting_loads_or_raises_config_error(text: str) -> None:
    with suppress(ConfigError):
        assert isinstance(load(None, [text]).config, Config)
