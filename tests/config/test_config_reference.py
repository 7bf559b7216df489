"""Check that the reference lists every key with all that a reader needs to set it."""

import json
import re
import runpy
from pathlib import Path

import pytest

from walkerlab.config.drives import Hip
from walkerlab.config.fields import leaves, leaves_of_other_kinds
from walkerlab.config.reference import as_json_schema, keys, select_keys
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError


def test_reference_lists_every_key() -> None:
    listed = [row.key for row in keys()]
    of_config = [path for path, _ in (*leaves(Config), *leaves_of_other_kinds(Config))]
    assert {".".join(path) for path in of_config} | {"extends", "slope_deg"} == set(listed)
    assert "walker(kneed).thigh.length_m" in listed
    assert len(listed) == len(set(listed))


def test_key_shared_by_all_walker_types_is_listed_once() -> None:
    assert [row.key.rpartition(".")[2] for row in select_keys("walker.hip")] == [*Hip.model_fields]
    assert [row.key for row in select_keys("walker.foot_centre_ahead_m")] == [
        "walker(straight-legs).foot_centre_ahead_m", "walker(kneed).foot_centre_ahead_m",
    ]  # fmt: skip
    assert [row.key for row in select_keys("walker(kneed).hip.torque_N_m")] == ["walker(kneed).hip.torque_N_m"]


def test_unknown_key_suggests_keys_that_contain_it() -> None:
    with pytest.raises(ConfigError) as error:
        select_keys("mass")
    suggested = re.findall(r"walker[.a-z_]+mass_kg", error.value.message)
    assert len(suggested) > 2
    assert {"walker.hip_mass_kg", "walker.leg_mass_kg"} <= set(suggested)
    for key in suggested:
        assert select_keys(key)


def test_each_row_has_type_bounds_default_meaning_and_source() -> None:
    for row in keys():
        assert all((row.type, row.bounds, row.default, row.meaning, row.source)), row


def test_config_reference_lists_bounds_and_units() -> None:
    rows = {row.key: row for row in keys()}
    length = rows["walker.leg_length_m"]
    assert (length.unit, length.bounds, length.default) == ("m", "from 0.001 to 1000", "1")
    assert rows["walker.foot_to_mass_m"].default == "leg_length_m / 2"
    assert rows["solver.contact.method"].default == "radau5"
    assert rows["solver.rigid.method"].bounds.startswith("dop853, radau5, or a method of SciPy or CVODE")


def test_table_lists_each_key_once() -> None:
    text = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "refresh_docs.py"))["config_keys"](None)
    table = [line for line in text.splitlines() if line.startswith("|")]
    assert {line.count("|") for line in table} == {table[0].count("|")}
    listed = [line.split(" | ")[0].removeprefix("| ") for line in table[2:]]
    assert len(set(listed)) == len(listed)
    # The keys of torso, hip and knee are the same for every type of walker, so they have one row.
    assert [row.key for row in keys() if not {row.key, "walker" + row.key.partition(")")[2]} & set(listed)] == []


def test_json_schema_describes_config_files() -> None:
    schema = json.loads(json.dumps(as_json_schema(), allow_nan=False))
    assert set(schema["properties"]) == {*Config.model_fields, "extends", "slope_deg"}
    assert schema["additionalProperties"] is False
    assert schema["not"] == {"required": ["slope_rad", "slope_deg"]}
    assert schema["properties"]["gravity_m_s2"]["unit"] == "m/s^2"
