"""Check that the unit suffix of a name agrees with the unit in its label."""

import pytest

import walkerlab
from walkerlab.evidence.benchmarks import accuracy
from walkerlab.evidence.benchmarks.engines import rows as engines
from walkerlab.evidence.paper import tune
from walkerlab.evidence.verification.known_problems import Known
from walkerlab.evidence.verification.verdict import CaseResult
from walkerlab.labels import axis_label, labels_of, unit_by_name
from walkerlab.pipeline.stages import fixedpoint, walk

CLASSES = (engines.EngineRow, engines.SwingRow, engines.TuningRow, accuracy.MethodRow, CaseResult, Known)
LABELS = {
    **{kind.__qualname__ + kind.__module__: labels_of(kind) for kind in CLASSES},
    "gait": fixedpoint.NUMBERS | fixedpoint.KNEE_LABELS,
    "walk": walk.TIME_LABELS | walk.STEP_LABELS,
    "limit": tune.FACTOR_LABELS | tune.DISTANCE_LABELS,
}


@pytest.mark.parametrize("labels", LABELS.values(), ids=LABELS)
def test_unit_suffix_of_a_name_agrees_with_its_unit(labels):
    assert labels
    for field, label in labels.items():
        assert unit_by_name(label.name or field) in ("1", label.unit)
        assert label.text


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("period_s", "s"), ("velocity_m_s", "m/s"), ("max_friction_ratio", "1"), ("slope_deg", "deg"), ("s", "1"),
        ("dissipated_J.friction", "J"), ("gaits.0.period_s", "s"), ("bodies_kg.height_m", "m"),
    ],
)  # fmt: skip
def test_unit_is_read_from_the_longest_matching_suffix(name, unit):
    assert unit_by_name(name) == unit


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("walker.thigh.mass_kg", "thigh mass"), ("work_per_step_J.hip_torque", "work per step hip torque"), ("s", "s"),
        ("walker.leg_2.leg_mass_kg", "mass of leg 2"), ("walker.leg_2.thigh.length_m", "thigh length of leg 2"),
    ],
)  # fmt: skip
def test_axis_labels_contain_no_unit(name, label):
    assert axis_label(name) == label


@pytest.mark.parametrize(
    ("stage", "name", "parts"), [("fixedpoint", "work_per_step_J", 5), ("contact-sim", "dissipated_J", 3)]
)
def test_parts_of_an_energy_in_a_sweep_are_in_joules(stage, name, parts, tmp_path):
    swept = walkerlab.sweep(stage, {"slope_deg": [1.0]}, set={"strides": 1}, runs=tmp_path, jobs=1)
    units = [swept[key].attrs["units"] for key in swept if key.startswith(f"{name}.")]
    assert units == ["J"] * parts
