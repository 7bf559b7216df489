"""Headline numbers: that a stage has them, and which those of an unknown stage are."""

import pytest

import walkerlab
from walkerlab.pipeline.graph import STAGES
from walkerlab.pipeline.runs import headline_values
from walkerlab.report.headlines import HEADLINES, MOST, headlines


@pytest.mark.parametrize(
    ("stage", "answer", "lacking"),
    [
        ("fixedpoint", walkerlab.find_gait, {"knee_strike_s"}),
        ("simulate", lambda: walkerlab.simulate(strides=1), set()),
        ("contact-sim", lambda: walkerlab.simulate(strides=1, contact=walkerlab.contact()), set()),
    ],
)
def test_a_stage_has_its_headline_numbers_but_those_of_knees(stage, answer, lacking):
    summary = answer().summary
    assert set(headline_values(stage, summary)) == set(HEADLINES[stage]) - lacking
    if stage != "fixedpoint":
        assert headline_values(stage, summary)["last_step_period_s"] == summary["step_periods_s"][-1]


def test_headlines_are_of_stages_that_there_are_and_few():
    assert HEADLINES.keys() <= {stage.name for stage in STAGES}
    assert max(map(len, HEADLINES.values())) <= MOST


def test_a_stage_of_ones_own_has_its_first_numbers_for_headlines():
    names = ["of.0", *(f"n{place}" for place in range(20))]
    assert headlines("mine", names) == names[1 : MOST + 1]
    assert headlines("basin", ["outcomes.walked", "share_walking"]) == ["share_walking", "outcomes.walked"]
