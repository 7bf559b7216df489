import pytest

from walkerlab.pipeline.store.artifact import Identity, changed_parts, differences

SLICE = {"slope_rad": 0.0174, "contact": None, "walker": {"leg_mass_kg": 5.0, "hip_mass_kg": 10.0}}
INPUTS = {"fixedpoint": "a", "simulate": "b"}
OLD = Identity("compare", SLICE, INPUTS, "code", 1)


def test_key_does_not_depend_on_the_order_of_entries():
    backwards = {
        "walker": {"hip_mass_kg": 10.0, "leg_mass_kg": 5.0},
        "contact": None,
        "slope_rad": 0.0174,
    }
    assert Identity("compare", backwards, {"simulate": "b", "fixedpoint": "a"}, "code", 1).key == OLD.key


@pytest.mark.parametrize(
    ("new", "change"),
    [
        (Identity("compare", {**SLICE, "slope_rad": 0.05}, INPUTS, "code", 1), "slope_rad 0.0174 -> 0.05"),
        (
            Identity("compare", {**SLICE, "walker": {"leg_mass_kg": 6.0, "hip_mass_kg": 10.0}}, INPUTS, "code", 1),
            "walker.leg_mass_kg 5.0 -> 6.0",
        ),
        (Identity("compare", {**SLICE, "contact": {"damping": 90}}, INPUTS, "code", 1), "contact none -> {...}"),
        (Identity("compare", SLICE, {**INPUTS, "simulate": "c"}, "code", 1), "input simulate changed"),
        (Identity("compare", SLICE, {"fixedpoint": "a"}, "code", 1), "input simulate left out"),
        (Identity("compare", SLICE, {**INPUTS, "tune": "c"}, "code", 1), "input tune added"),
        (Identity("compare", SLICE, INPUTS, "other", 1), "code changed"),
        (Identity("compare", SLICE, INPUTS, "code", 2), "layout of artifacts 1 -> 2"),
    ],
)
def test_changed_part_of_an_identity_changes_its_key_and_is_named(new, change):
    assert new.key != OLD.key
    assert changed_parts(OLD, new) == [change]


def test_equal_identities_have_no_changes():
    assert changed_parts(OLD, OLD) == []


def test_name_is_not_part_of_the_key():
    assert Identity("simulate", SLICE, INPUTS, "code", 1).key == OLD.key
    assert len(OLD.key) == 64


def test_digests_of_files_are_shortened():
    old, new = ({"files": {"recording.file": letter * 64}} for letter in "ab")
    assert list(differences("", old, new)) == ["files.recording.file aaaaaaaa... -> bbbbbbbb..."]
