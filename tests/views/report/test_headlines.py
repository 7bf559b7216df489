"""Tests of headline values, including those of a stage that the package does not know."""

import pytest

import walkerlab
from walkerlab.pipeline.headlines import HEADLINES, MAX_HEADLINES, QUANTITIES, has_quantity, headline_values, headlines
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.sweeps.chunk import flatten_summary


@pytest.mark.parametrize(
    ("stage", "answer", "lacking"),
    [
        ("fixedpoint", walkerlab.find_gait, {"knee_strike_s"}),
        ("simulate", lambda: walkerlab.simulate(strides=1), set()),
        ("contact-sim", lambda: walkerlab.simulate(strides=1, contact=walkerlab.contact()), set()),
    ],
)
def test_headlines_of_walkers_without_knees_omit_the_knee_strike(stage, answer, lacking):
    summary = answer().summary
    assert set(headline_values(stage, summary)) == set(HEADLINES[stage]) - lacking
    if stage != "fixedpoint":
        assert headline_values(stage, summary)["last_step_period_s"] == summary["step_periods_s"][-1]


LEVEL = {"slope_deg": 0, "push_off.impulse_N_s": 0.2, "walker.hip.torque_N_m": 0.15}


@pytest.mark.parametrize("stage", QUANTITIES)
def test_every_value_of_a_sweep_point_can_be_requested(stage, tmp_path):
    strides = None if stage == "fixedpoint" else 1
    path = walkerlab.run(stage, "kneed", LEVEL, tmp_path, strides=strides).artifact
    summary = artifact.read(path).summary
    numbers = {name for name, value in flatten_summary(summary).items() if isinstance(value, int | float)}
    assert [name for name in numbers if not has_quantity(stage, name)] == []
    assert {"speed_m_s", "froude", "cost_of_transport"} <= numbers
    assert summary["froude"] == pytest.approx(summary["speed_m_s"] / (9.81 * 1.0) ** 0.5, rel=1e-12)


def test_headline_values_are_few_and_belong_to_existing_stages():
    assert HEADLINES.keys() <= {stage.name for stage in PIPELINE.stages}
    assert max(map(len, HEADLINES.values())) <= MAX_HEADLINES
    assert all(has_quantity(stage, name) for stage in QUANTITIES for name in HEADLINES[stage])
    assert not has_quantity("fixedpoint", "froud")


def test_user_stage_uses_its_first_values_as_headlines():
    names = ["of.0", *(f"n{place}" for place in range(20))]
    assert headlines("mine", names) == names[1 : MAX_HEADLINES + 1]
    assert headlines("basin", ["outcomes.walked", "share_walking"]) == ["share_walking", "outcomes.walked"]
