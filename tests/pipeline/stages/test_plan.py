"""Tests of the stage `plan`: its answer, its figure, and the requests that it rejects."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, plan
from walkerlab.views.cli.main import program
from walkerlab.views.figures.stage import FIGURES
from walkerlab.views.report.answers import answer
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections.identification import plan_section

FIT = "identify.fit={slope_deg: null, walker.leg_length_m: null}"
SHORT = ("plan.steps=6", "plan.max_steps=8")


def configured(*changes):
    return load(Path("paper"), changes).config


def taken(*changes):
    return restrict(configured(*changes), PIPELINE["plan"].takes)


@pytest.fixture(scope="module")
def content():
    config = configured()
    gait = {"fixedpoint": fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())}
    return plan.run(taken(FIT, *SHORT, "plan.errors={slope_deg: 0.02, walker.leg_length_m: 1e-9}"), gait, Silent())


def test_answer_names_the_simplest_measurement_and_the_steps_needed(content):
    text = " ".join(" ".join(str(line) for line in answer("plan", content.summary)).split())
    assert "The simplest measurement that determines every parameter in 6 steps: periods and lengths" in text
    assert "To determine the slope to ± 0.02 degrees, record " in text
    assert "record angles over time of " in text
    assert "To determine the leg length to ± 10⁻⁹ m, 8 steps do not suffice." in text
    assert "Assumed: periods measured to 0.002 s" in text


def test_summary_is_json_with_a_row_per_measurement(content):
    json.dumps(content.summary, allow_nan=False)
    rows = content.summary["measurements"]
    assert len({(row["measurement"], row["start"]) for row in rows}) == len(rows) == 8
    entry = rows[-1]["errors"][0]
    assert set(entry) == {"key", "standard_error", "unit", "wanted", "steps_needed"}


def test_figure_and_page_show_the_errors(content):
    figure = next(figure for figure in FIGURES if figure.stages == ("plan",))
    assert figure.why_left_out({"plan": content}, {}) is None
    assert figure.render({"plan": content}).png.startswith(b"\x89PNG")
    made = plan_section(Results(configured(), {"plan": content}))
    assert made is not None
    assert "Measurements to make" in made.title


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ((), "needs a parameter"),
        ((FIT, "identify.model=both"), "for one model"),
        ((FIT, "identify.model=contact", "contact=null"), "contact"),
        ((FIT, "plan.errors={walker.hip_mass_kg: 1}"), "is not estimated"),
        ((FIT, "plan.steps=40", "plan.max_steps=20"), "exceeds plan.max_steps"),
        (("identify.fit={walker.colour: null}",), "walker.colour"),
    ],
)
def test_invalid_plans_are_rejected(changes, message):
    with pytest.raises(ConfigError, match=message):
        plan.refuse(taken(*changes))


def test_nonpositive_error_is_rejected():
    with pytest.raises(ConfigError, match="not a number above 0"):
        configured("plan.errors={slope_deg: -1}")


def test_identify_with_the_option_plan_needs_no_data(tmp_path):
    options = ["--runs", str(tmp_path), "--fit", "slope_deg", "--set", "plan.steps=5", "--set", "plan.max_steps=5"]
    done = CliRunner().invoke(program(), ["identify", "--plan", *options, "--error", "slope_deg=0.05", "--json"])
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert summary["stage"] == "plan"
    assert summary["measurements"][0]["errors"][0]["wanted"] == 0.05
    assert CliRunner().invoke(program(), ["identify", *options, "--error", "slope_deg=0.05"]).exit_code == 2
