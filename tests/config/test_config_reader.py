"""Tests of reading YAML: YAML 1.2 scalars, positions in the text, and texts that are not a config."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walkerlab.config.reader import MAX_CHARACTERS, MAX_DEPTH, read, value_of
from walkerlab.config.tree import BlockNode, plain
from walkerlab.errors import ConfigError


def refusal(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        read(text, "f.yaml")
    return caught.value.message


def fate(text: str) -> str:
    try:
        read(text, "f.yaml")
    except ConfigError as error:
        return "refused with its place" if error.message.startswith("f.yaml:") else error.message
    return "read"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e7", 1e7),
        ("1E-3", 1e-3),
        ("1.", 1.0),
        (".5", 0.5),
        ("-1.5e+2", -150.0),
        ("+3", 3),
        ("007", 7),
        ("0x1F", 31),
        ("0o17", 15),
        ("no", "no"),
        ("yes", "yes"),
        ("off", "off"),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("2001-12-14", "2001-12-14"),
        ("-.inf", -math.inf),
        (".e3", ".e3"),
        ("9" * 5000, math.inf),
    ],
)
def test_plain_scalars_follow_yaml_1_2(text: str, value: Any) -> None:
    assert value_of(text) == value
    assert type(value_of(text)) is type(value)


@pytest.mark.parametrize("text", ["-0", "-0.0", "-0e5"])
def test_negative_zero_is_read_as_zero(text: str) -> None:
    assert str(value_of(text)) in ("0", "0.0")


def test_nan_is_read_as_a_number() -> None:
    value = value_of(".nan")
    assert isinstance(value, float)
    assert math.isnan(value)


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_survive_a_round_trip_through_repr(number: float) -> None:
    assert value_of(repr(number)) == number


def test_quoted_scalar_is_a_string() -> None:
    root = read("a: '1'\nb: \"no\"\nc: |\n  x\n", "f.yaml")
    assert root is not None
    assert plain(root) == {"a": "1", "b": "no", "c": "x\n"}


def test_every_key_and_value_has_its_line_and_column() -> None:
    root = read("# c\na:\n  b: [1, no]\n", "f.yaml")
    assert isinstance(root, BlockNode)
    inner = root.entries["a"]
    assert isinstance(inner, BlockNode)
    assert str(root.keys["a"]) == "f.yaml:2:1"
    assert str(inner.keys["b"]) == "f.yaml:3:3"
    assert str(inner.entries["b"].position) == "f.yaml:3:6"


def test_columns_of_an_embedded_text_are_counted_from_its_start() -> None:
    root = read("[1, x]", "--set start=[1, x]", column=7)
    assert root is not None
    assert root.position.column == 7


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", "---\n"])
def test_file_without_any_keys_is_read_as_empty(text: str) -> None:
    root = read(text, "f.yaml")
    assert root is None or plain(root) is None


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("a: 1\nb: 2\na: 3\n", "f.yaml:3:1", "a: duplicate key, first at f.yaml:1:1"),
        ("a: &x 1\n", "f.yaml:1:4", "anchor &x"),
        ("a: *x\n", "f.yaml:1:4", "alias *x"),
        ("a: !!python/object/apply:os.system [ls]\n", "f.yaml:1:4", "tag"),
        ("a: 1\n---\nb: 2\n", "f.yaml:2:1", "a second document"),
        ("%YAML 1.1\n---\na: no\n", "f.yaml:2:1", "YAML 1.2"),
        ("? [a, b]\n: 1\n", "f.yaml:1:3", "a key must be a word"),
        ("a:\n\t- 1\n", "f.yaml:2:1", "a tab"),
        ("a: {b: 1\n", "f.yaml:2:1", "not YAML"),
        ("a: 1\n  b: 2\n", "f.yaml:2:4", "not YAML"),
        ("a: 1\nb: \x00\n", "f.yaml:2:4", "\\x00 cannot be in a config"),
        ("a: \x1b[31m\n", "f.yaml:1:4", "\\x1b cannot be in a config"),
        ("a: \ud800\n", "f.yaml:1:4", "\\ud800 cannot be in a config"),
    ],
)
def test_unsupported_yaml_is_rejected_at_its_position(text: str, place: str, reason: str) -> None:
    message = refusal(text)
    assert message.startswith(f"{place}: ")
    assert reason in message


def test_every_duplicate_key_is_reported() -> None:
    assert refusal("a: 1\na: 2\nb: 1\nb: 2\n").count("duplicate key") == 2


def test_nested_aliases_are_rejected_before_expansion() -> None:
    bomb = "a: &a [1, 1]\n" + "".join(
        f"{new}: &{new} [*{old}, *{old}]\n" for old, new in zip("abcdefg", "bcdefgh", strict=True)
    )
    assert "anchor &a" in refusal(bomb)


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? "])
def test_deep_nesting_is_rejected_without_recursion(opening: str) -> None:
    message = refusal(opening * 5000)
    assert f"nested deeper than {MAX_DEPTH} levels" in message or "a key must be a word" in message


def test_oversized_text_is_rejected_before_it_is_parsed() -> None:
    assert "not a config" in refusal("a" * (MAX_CHARACTERS + 1))


@settings(deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_read_or_raises_config_error(text: str) -> None:
    assert fate(text) in ("read", "refused with its place")


@settings(deadline=None)
@given(st.text(alphabet="[]{}:,-?&*!|>'\"%@`# \n\t~ab1.", max_size=60))
def test_any_punctuation_is_read_or_raises_config_error(text: str) -> None:
    assert fate(text) in ("read", "refused with its place")


def test_tab_is_rejected_because_yaml_is_indented_by_spaces() -> None:
    with pytest.raises(ConfigError, match=r"^mine\.yaml:2:1: a tab: YAML is indented by spaces"):
        read("walker:\n\ttype: compass\n", "mine.yaml")
