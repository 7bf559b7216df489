import math

import numpy as np
import pytest

from walkerlab.pipeline.store.content import Content, Group, Variable


def metres(values, **more):
    return Variable(np.asarray(values), ("x",), "m", "length", **more)


def one(variable, **more):
    return Content({"group": Group({"length": variable})}, **more)


def test_digest_does_not_depend_on_insertion_order():
    first = Group({"a": metres([1.0]), "b": metres([2.0])}, {"p": 1, "q": 2})
    second = Group({"b": metres([2.0]), "a": metres([1.0])}, {"q": 2, "p": 1})
    one_way = Content({"g": first, "h": first}, {"u": 1, "v": 2})
    other_way = Content({"h": second, "g": second}, {"v": 2, "u": 1})
    assert one_way.digest() == other_way.digest()


def test_digest_does_not_depend_on_memory_layout_or_width():
    table = np.arange(6.0).reshape(2, 3)
    as_stored = Variable(table, ("r", "c"), "m", "table").values
    from_fortran = Variable(np.asfortranarray(table), ("r", "c"), "m", "table")
    from_narrow = Variable(table.astype(np.float32), ("r", "c"), "m", "table")
    expected = one(Variable(as_stored, ("r", "c"), "m", "table")).digest()
    assert one(from_fortran).digest() == expected
    assert one(from_narrow).digest() == expected


@pytest.mark.parametrize(
    "changed",
    [
        one(metres([1.0, np.nextafter(2.0, 3.0)])),
        one(metres([1, 2])),
        one(metres([2.0, 1.0])),
        one(metres(["1.0", "2.0"])),
        one(metres([1.0, 2.0], missing=True)),
        one(Variable(np.array([1.0, 2.0]), ("y",), "m", "length")),
        one(Variable(np.array([1.0, 2.0]), ("x",), "mm", "length")),
        one(Variable(np.array([1.0, 2.0]), ("x",), "m", "width")),
        one(metres([1.0, 2.0]), summary={"steps": 1}),
        Content({"group": Group({"breadth": metres([1.0, 2.0])})}),
        Content({"other": Group({"length": metres([1.0, 2.0])})}),
        Content({"group": Group({"length": metres([1.0, 2.0])}, {"kind": "x"})}),
        Content({"group": Group({"length": metres([1.0, 2.0])}), "more": Group({})}),
    ],
)
def test_digest_changes_with_every_value_and_label(changed):
    assert changed.digest() != one(metres([1.0, 2.0])).digest()


def test_timings_do_not_affect_the_digest():
    def measured(seconds):
        walls = metres([seconds], timing=True)
        rows = [{"error": 1e-9, "wall_s": seconds, "compile_wall_s": seconds}]
        return one(walls, summary={"rows": rows, "wall_s": seconds, "best": str(seconds)}, timed=("best",))

    assert measured(1.0).digest() == measured(2.0).digest()


def test_nested_values_other_than_timings_affect_the_digest():
    assert Content({}, {"rows": [{"error": 1}]}).digest() != Content({}, {"rows": [{"error": 2}]}).digest()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_nonfinite_values_are_rejected(value):
    with pytest.raises(ValueError, match="finite"):
        metres([1.0, value])
    with pytest.raises(ValueError, match="finite"):
        Content({}, {"rows": [{"error": value}]})
    with pytest.raises(ValueError, match="finite"):
        Group({}, {"drift": value})


def test_declared_gaps_are_allowed():
    assert np.isnan(metres([math.nan], missing=True).values).all()


@pytest.mark.parametrize(
    "values", [np.array([1j]), np.array([object()]), np.array([2**63], dtype=np.uint64), np.array([b"bytes"])]
)
def test_unreadable_values_are_rejected(values):
    with pytest.raises(TypeError):
        metres(values)


@pytest.mark.parametrize("text", ["cut\0short", "\ud800"])
def test_unreadable_text_is_rejected(text):
    with pytest.raises(ValueError):
        metres(np.array([text], dtype=object))
    with pytest.raises(ValueError):
        Content({}, {"note": text})
    with pytest.raises(ValueError):
        Group({}, {"note": text})


def test_names_of_dimensions_must_match_the_shapes_of_the_values():
    with pytest.raises(ValueError, match="dimensions"):
        Variable(np.zeros((2, 2)), ("x",), "m", "length")
    with pytest.raises(ValueError, match="dimensions"):
        Variable(np.zeros((2, 2)), ("x", "x"), "m", "length")
    with pytest.raises(ValueError, match="other variables have"):
        Group({"a": metres([1.0]), "b": metres([1.0, 2.0])})
    with pytest.raises(ValueError, match="names both a dimension and a variable"):
        Group({"x": Variable(np.zeros((1, 2)), ("x", "y"), "m", "x"), "a": metres([1.0])})


@pytest.mark.parametrize("path", ["/absolute", "a//b", "a/../b", "a b", "é"])
def test_nonportable_paths_are_rejected(path):
    with pytest.raises(ValueError, match="name"):
        Content({path: Group({})})


def test_group_and_an_array_may_not_share_a_name():
    with pytest.raises(ValueError, match="group"):
        Content({"a": Group({"b": metres([1.0])}), "a/b": Group({})})


def test_stored_values_cannot_be_changed_from_outside():
    source = np.array([1.0])
    variable = metres(source)
    source[0] = 2.0
    assert variable.values[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        variable.values[0] = 3.0


def test_summary_is_plain_json():
    summary = Content({}, {"state": np.arange(2), "x": np.float64(0.5), "row": (1, None, {"a": True})}).summary
    assert summary == {"state": [0, 1], "x": 0.5, "row": [1, None, {"a": True}]}
    with pytest.raises(TypeError):
        Content({}, {"x": {1, 2}})


def test_parent_groups_are_created():
    assert sorted(Content({"a/b/c": Group({})}).groups) == ["a", "a/b", "a/b/c"]
    assert Content({"a/b": Group({})}).digest() == Content({"a/b": Group({}), "a": Group({})}).digest()


@pytest.mark.parametrize("values", [[1.0], [1], [True]])
def test_number_without_a_unit_is_rejected(values):
    with pytest.raises(ValueError, match="has no unit; use '1' for a dimensionless quantity"):
        Variable(np.array(values), ("x",), "", "how many")
