"""Tests of labelled arrays made of rows whose fields have units and meanings."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from walkerlab.labels import Label, labels_of
from walkerlab.pipeline.store.content import columns, real_and_imaginary, rows_group


@dataclass(frozen=True)
class Stone:
    """Record of a stone that was dropped."""

    kind: Annotated[str, Label("", "kind of stone")]
    depth_m: Annotated[float | None, Label("m", "how deep it fell")]
    bounces: Annotated[int | None, Label("1", "how often it bounced", absent=0)]
    places: Annotated[tuple[float, ...], Label("m", "where", ("bounce",), name="place_m")]
    wall_s: Annotated[float, Label("s", "run time", timing=True)]
    remark: str = ""

    @property
    def found(self) -> Annotated[bool, Label("1", "whether it was found")]:
        """Whether the stone reached the ground."""
        return self.depth_m is not None


STONES = [Stone("flint", 1.5, 2, (0.1, 0.2), 0.01), Stone("chalk", None, None, (0.3, 0.4), 0.02, "lost")]


def test_labelled_values_are_columns_with_unit_and_meaning():
    group = rows_group(STONES, labels_of(Stone), "stone", "number of the stone")
    said = {name: (one.dims, one.units, one.long_name) for name, one in group.variables.items()}
    assert said == {
        "stone": (("stone",), "1", "number of the stone"),
        "kind": (("stone",), "", "kind of stone"),
        "depth_m": (("stone",), "m", "how deep it fell"),
        "bounces": (("stone",), "1", "how often it bounced"),
        "place_m": (("stone", "bounce"), "m", "where"),
        "wall_s": (("stone",), "s", "run time"),
        "found": (("stone",), "1", "whether it was found"),
    }
    assert [name for name, one in group.variables.items() if one.timing] == ["wall_s"]
    assert group["kind"].tolist() == ["flint", "chalk"]
    assert group["found"].tolist() == [True, False]
    assert group["place_m"].tolist() == [[0.1, 0.2], [0.3, 0.4]]


def test_missing_value_becomes_a_gap_unless_its_label_defines_a_substitute():
    stored = columns(STONES, labels_of(Stone), "stone")
    np.testing.assert_array_equal(stored["depth_m"].values, [1.5, np.nan])
    assert stored["bounces"].values.tolist() == [2, 0]
    assert [name for name, one in stored.items() if one.missing] == ["depth_m"]


def test_printed_rows_are_stored_under_their_keys():
    printed = [{"from": 1.0, "said": "a"}, {"from": 2.0, "said": "b"}]
    stored = columns(printed, {"from": Label("deg", "where it begins")}, "branch")
    assert list(stored) == ["from"]
    assert (stored["from"].units, stored["from"].values.tolist()) == ("deg", [1.0, 2.0])


def test_complex_numbers_become_two_columns():
    stored = real_and_imaginary("multiplier", [(1 + 2j, 3.0), (0.0, -1j)], ("gait", "multiplier"), "multiplier")
    assert {name: one.values.tolist() for name, one in stored.items()} == {
        "multiplier_real": [[1.0, 3.0], [0.0, 0.0]],
        "multiplier_imag": [[2.0, 0.0], [0.0, -1.0]],
    }
    assert stored["multiplier_imag"].long_name == "multiplier, imaginary part"
