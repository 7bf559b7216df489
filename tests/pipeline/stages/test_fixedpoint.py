"""Tests of the stage `fixedpoint`: its results and messages on slopes with and without a gait."""

import json
import math
import re

import numpy as np
import pytest

from walkerlab.config.reads import restrict
from walkerlab.config.schema import Config
from walkerlab.errors import NoAnswer
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint

# keys that programs may rely on
FIXED_KEYS = {
    "state",
    "period_s",
    "step_length_m",
    "multipliers",
    "spectral_radius",
    "stable",
    "residual",
    "energy_J",
    "equations",
    "slope_rad",
    "work_per_step_J",
    "cost_of_transport",
}


def run(again=True, **changes):
    config = Config.model_validate(changes)
    return fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent(), again)


@pytest.fixture(scope="module")
def paper():
    return run()


def test_summary_has_the_expected_keys_and_both_sets_of_equations(paper):
    assert set(paper.summary) >= FIXED_KEYS
    assert set(paper.summary["equation_sets"]) == {"corrected", "as-printed"}
    for name, one in paper.summary["equation_sets"].items():
        assert set(one) >= FIXED_KEYS
        assert one["equations"] == name
    json.dumps(paper.summary, allow_nan=False)


def test_main_equations_are_those_of_the_config(paper):
    assert paper.summary["equations"] == "corrected"
    printed = run(equations="as-printed").summary
    assert printed["state"] == paper.summary["equation_sets"]["as-printed"]["state"]
    assert [round(value, 4) for value in printed["state"][:2]] == [-0.2022, 0.1674]


def test_summary_has_a_small_residual_and_arrays_of_the_right_shape(paper):
    summary = paper.summary
    assert summary["residual"] <= 1e-11
    assert len(summary["state"]) == 4
    assert np.shape(summary["multipliers"]) == (3, 2)
    assert summary["spectral_radius"] == pytest.approx(np.hypot(*summary["multipliers"][0]))
    assert summary["stable"] is True


@pytest.mark.parametrize("equations", ["corrected", "as-printed"])
def test_all_gaits_are_stored_with_the_chosen_one_marked(paper, equations):
    group, summary = paper[f"{equations}/gaits"], paper.summary["equation_sets"][equations]
    assert group.sizes == {"gait": summary["gaits_found"], "coordinate": 4, "multiplier": 3}
    chosen = group.attrs["chosen"]
    assert group["state"][chosen].tolist() == summary["state"]
    assert group["period_s"][chosen] == summary["period_s"]
    assert group["stable"][chosen]
    assert (np.diff(group["period_s"]) > 0.0).all()
    assert (group["residual"] <= 1e-11).all()


def test_result_is_reproducible(paper):
    assert run().digest() == paper.digest()


def test_another_seed_finds_the_same_gait(paper):
    other = run(seed=7)
    assert other.summary["state"] == pytest.approx(paper.summary["state"], abs=1e-12)
    assert other.summary["random_hits"] != paper.summary["random_hits"]


@pytest.mark.parametrize(
    ("slope", "begins", "said", "advised"),
    [
        (0.0, "no gait at", "standing still is no gait", "slope_deg above 0"),
        (-0.05, "no gait at", "does not descend", "slope_deg above 0"),
        (0.5, "no gait at", "the ground would have to pull", "walkerlab continuation"),
        (1.5, "no gait was found at", "none of 1100 random starting values", "walkerlab continuation"),
        (1.5, "no gait was found at", "long-period seed is lost at a slope of", "walkerlab continuation"),
    ],
)
def test_slope_without_a_gait_is_explained(slope, begins, said, advised):
    with pytest.raises(NoAnswer, match=f"{begins} a slope of") as caught:
        run(slope_rad=slope)
    assert said in caught.value.message
    assert advised in caught.value.advice
    assert caught.value.partial.summary["equation_sets"]["corrected"]["reason"] in caught.value.message


def test_failure_advises_a_slope_with_a_gait():
    with pytest.raises(NoAnswer) as caught:
        run(slope_rad=0.7)
    command = re.search("`walkerlab fixedpoint --set slope_deg=([0-9.]+)`", caught.value.advice)
    assert run(slope_rad=math.radians(float(command[1]))).summary["stable"]
    with pytest.raises(NoAnswer) as quick:
        run(slope_rad=0.7, again=False)
    assert caught.value.advice.endswith(quick.value.advice)
    assert "slope_deg=" not in quick.value.advice


def test_advice_blames_the_drive_if_a_driven_walker_has_no_gait():
    driven = Config.model_validate({"slope_rad": 0.0, "push_off": {"impulse_N_s": 60.0}})
    assert "too strong or too weak on this slope: try another push_off.impulse_N_s" in fixedpoint.advice(driven)
    sprung = Config.model_validate({"slope_rad": 0.0, "walker": {"hip": {"spring_N_m_per_rad": 5.0}}})
    assert "or drive the walker (push_off.impulse_N_s" in fixedpoint.advice(sprung)


def test_impossible_walker_is_explained():
    with pytest.raises(NoAnswer, match="random starting values"):
        run(walker={"leg_inertia_kg_m2": 1e9})
