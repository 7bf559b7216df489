"""Tests of the stage `robustness`: its answers, its stored results, and the requests that it rejects."""

import json
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_measures import reactions
from walkerlab.physics.mechanics.impact import push_at_hip
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, robustness
from walkerlab.pipeline.store.content import rows_group
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene.rigid import rigid_walker
from walkerlab.views.report.answers import answer, further_tables
from walkerlab.views.report.sections import robustness as robustness_section
from walkerlab.views.report.sections.robustness import tables

# keys that programs may rely on
FIXED_KEYS = {
    "gait_sensitivity_norm": {"model", "disturbance", "indicator", "value", "direct", "unit", "scaled"},
    "sensitivity": {"model", "of", "to", "value", "unit"},
    "largest_step": {"model", "down_m", "up_m", "steps"},
    "largest_push": {"model", "forward_N_s", "backward_N_s", "steps"},
    "rough_ground": {"model", "roughness_m", "mean_steps", "standard_error", "walks", "capped"},
}
SCALED = "gait_sensitivity_norm_scaled"
FEW = ("robustness.walks=20", "robustness.roughness_m=[0.002]", "robustness.to=[slope_deg, walker.hip_mass_kg]")


def run(name, *changes, jobs=1, checkpoint=None):
    config = load(Path(name), changes).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())
    asked = restrict(config, PIPELINE["robustness"].takes)
    return robustness.run(
        asked, {"fixedpoint": gait}, Silent(), checkpoint=checkpoint or Checkpoint(None, ""), jobs=jobs
    )


@pytest.fixture(scope="module")
def rigid():
    return run("slope-3deg", "robustness.model=rigid", *FEW)


@pytest.fixture(scope="module")
def both():
    return run(
        "kneed",
        "robustness.steps=3",
        "robustness.walks=2",
        "robustness.max_steps=3",
        FEW[1],
        "robustness.to=[slope_deg]",
    )


def test_answer_has_the_expected_keys(rigid, both):
    for summary in (rigid.summary, both.summary):
        json.dumps(summary, allow_nan=False)
        for name, keys in FIXED_KEYS.items():
            assert summary[name], name
            for row in summary[name]:
                assert set(row) >= keys - {"standard_error"}, name
    assert [row["model"] for row in both.summary["largest_step"]] == ["rigid", "contact"]
    assert len(rigid.summary["gait_sensitivity_norm"]) == 6


def test_both_models_survive_similar_disturbances(both):
    rigid, contact = both.summary["largest_step"]
    first, second = (row["value"] for row in both.summary["gait_sensitivity_norm"][::6])
    assert contact["down_m"] == pytest.approx(rigid["down_m"], rel=0.2)
    assert second == pytest.approx(first, rel=0.1)
    pushes = both.summary["largest_push"]
    assert pushes[1]["forward_N_s"] == pytest.approx(pushes[0]["forward_N_s"], rel=0.2)


def test_sensitivity_to_slope_deg_is_per_degree(rigid):
    found = {(row["of"], row["to"]): row for row in rigid.summary["sensitivity"]}
    one = found["step_length_m", "slope_deg"]
    assert one["unit"] == "m per deg"
    # On gentle slopes, the step of a compass grows with about the cube root of the slope.
    assert 0.2 < one["relative"] < 0.5


def said_of(summary):
    return " ".join("\n".join(answer("robustness", summary)).replace("\N{NO-BREAK SPACE}", " ").split())


def test_robustness_answer_is_in_plain_words(rigid):
    said = said_of(rigid.summary)
    assert "still takes 50 steps after a step that goes down by 14.37 mm or up by 5.977 mm" in said
    assert "On ground with 2 mm (s.d.) roughness the rigid model takes" in said
    assert "Most effective change (rigid model): decrease walker.hip_mass_kg by 1 %" in said


def test_advice_names_a_walker_parameter_with_a_resolved_effect(rigid):
    """The advice names neither gravity nor a parameter without effect."""
    row = next(row for row in rigid.summary["sensitivity"] if row["of"] == "gait_sensitivity_norm_scaled")
    others = [row | {"to": "gravity_m_s2", "relative": -9.0}, row | {"to": "walker.x", "why": "lost in rounding"}]
    own = [row | {"to": "walker.hip_mass_kg", "relative": 0.25}]
    said = said_of({**rigid.summary, "sensitivity": [*others, *own]})
    assert "decrease walker.hip_mass_kg by 1 %; a floor drop then disturbs the step period 0.25 % less" in said
    assert "Most effective change" not in said_of({**rigid.summary, "sensitivity": others})


def test_scaled_norm_does_not_favour_longer_legs():
    """Changing all lengths together only scales the walker, so the dimensionless norm stays the same."""
    found = run("slope-3deg", "robustness.model=rigid", "robustness.roughness_m=[]", "robustness.steps=1")
    shares = {row["to"]: row.get("relative") for row in found.summary["sensitivity"] if row["of"] == SCALED}
    lengths = [key for key in shares if key.endswith("_m")]
    assert {"walker.leg_length_m", "walker.foot_to_mass_m"} <= set(lengths)
    assert sum(shares[key] or 0.0 for key in lengths) == pytest.approx(0.0, abs=1e-6)
    assert abs(shares["gravity_m_s2"]) < 1e-6
    assert "slope_deg" in shares
    assert "slope_rad" not in shares
    shown = {
        one.caption: [row[1].text for rows in one.groups.values() for row in rows] for one in tables(found.summary)
    }
    assert all(key.startswith("walker.") for key in shown["Most effective changes"])
    assert set(shown["Gravity, slope and ground"]) == {"gravity_m_s2", "slope_deg"}
    assert "push_off.impulse_N_s" in shown["Parameters that are zero"]


def test_largest_push_reports_whether_the_ground_would_have_to_pull(rigid, both):
    """Compute the force of the ground from the weight and the acceleration of all masses during the walk after the
    push.
    """
    (push,) = rigid.summary["largest_push"]
    assert push["forward_normal_impulse_N_s"] > 0.0 > push["backward_normal_impulse_N_s"]
    said = said_of(rigid.summary)
    assert "After the largest push forward the ground still pushes, with at least" in said
    assert "During the largest push backward the ground would have to pull with" in said
    config = load(Path("slope-3deg")).config
    walker, gait = rigid_walker(config), fixedpoint.run(config, {}, Silent()).summary["state"]
    pushed = push_at_hip(walker, np.array(gait), -push["backward_N_s"])
    walk = take_walk(walker, EXACT_STEPS, tuple(pushed), 50, sampled=True)
    lowest = reactions(walker, walk.samples.state)[:, 1].min()
    assert push["backward_min_normal_force_N"] == pytest.approx(lowest, abs=0.05)
    assert {value for key, value in both.summary["largest_push"][1].items() if "normal" in key} == {None}


def test_parameters_are_ranked_over_both_models(both):
    lines = [line.split() for line in further_tables("robustness", both.summary) if " slope_" in line]
    shares = [abs(float(line[-1].replace("\N{MINUS SIGN}", "-"))) for line in lines]
    assert {line[0] for line in lines} == {"rigid", "contact"}
    assert len(shares) > 4
    assert shares == sorted(shares, reverse=True)


def test_large_means_are_rounded_to_significant_digits(rigid):
    one = rigid.summary["rough_ground"][0] | {"mean_steps": 492652.3, "standard_error": 348357.1, "method": "censored"}
    assert "takes 490,000 ± 350,000 steps on average before falling." in said_of(
        {**rigid.summary, "rough_ground": [one]}
    )


def test_robustness_walks_do_not_depend_on_processes_or_interruptions(rigid, tmp_path):
    assert run("slope-3deg", "robustness.model=rigid", *FEW, jobs=3).summary == rigid.summary
    kept = Checkpoint(tmp_path / "parts", "key")
    run("slope-3deg", "robustness.model=rigid", *FEW, checkpoint=kept)
    again = Checkpoint(tmp_path / "parts", "key")
    assert len(again.kept) == 5
    assert run("slope-3deg", "robustness.model=rigid", *FEW, checkpoint=again).summary == rigid.summary


def test_parameter_without_valid_neighbours_is_reported_with_the_reason():
    """For legs with almost no mass, the usual change of the torque is too large for a gait."""
    found = run("kuo", "robustness.to=[walker.hip.torque_N_m]", "robustness.roughness_m=[]", "robustness.steps=1")
    rows = found.summary["sensitivity"]
    assert {row["of"] for row in rows} >= {"period_s", "spectral_radius"}
    assert all(row["value"] is None and row["why"] == robustness.NO_NEIGHBOURS.why for row in rows)


def test_gradients_do_not_depend_on_the_number_of_processes(rigid):
    asked = restrict(load(Path("slope-3deg"), ("robustness.model=rigid",)).config, PIPELINE["robustness"].takes)
    gait = fixedpoint.run(asked, {}, Silent())
    subject, numbers = next(robustness.subjects(asked, {"fixedpoint": gait}, Silent())), rigid.summary["gaits"][0]
    keys = ("slope_deg", "walker.hip_mass_kg")
    assert robustness.sensitivities(subject, keys, numbers, Silent(), jobs=2) == rigid.summary["sensitivity"]


def test_unstable_gait_has_no_sensitivity_norm_but_all_other_results_are_given():
    with pytest.raises(NoAnswer, match="the gait of the rigid model is unstable") as raised:
        run("rigid-only", "slope_deg=4.6", *FEW)
    summary = raised.value.partial.summary
    assert summary["gaits"][0]["spectral_radius"] > 1.0
    assert not summary["gait_sensitivity_norm"]
    assert "Effect of the parameters on the gait" not in "".join(answer("robustness", {**summary, "sensitivity": []}))
    assert any("spectral_radius" in line for line in answer("robustness", summary))
    assert {row["of"] for row in summary["sensitivity"]} >= {"period_s", "spectral_radius"}


def test_missing_derivative_is_a_gap():
    """The spectral radius has no derivative at points where multipliers meet."""
    rows = [
        {"of": "period_s", "to": "slope_rad", "value": 0.1},
        {"of": "spectral_radius", "to": "slope_rad", "value": None},
    ]
    stored = rows_group(rows, robustness.LABELS["sensitivity"])["value"]
    np.testing.assert_array_equal(stored, [0.1, np.nan])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (("robustness.roughness_m=[0.7]",), "more than half the leg length"),
        (("robustness.to=[walker.thigh.mass_kg]",), "walker.thigh.mass_kg"),
        (("robustness.to=[strides]",), "affects no model"),
        (("robustness.to=[contact.stiffness]", "robustness.model=rigid"), "does not affect the rigid model"),
        (("robustness.to=[push_off.duration_s]",), "does not affect the rigid or the contact model"),
    ],
)
def test_invalid_questions_are_rejected(changes, said):
    with pytest.raises(ConfigError, match=said):
        run("slope-3deg", *changes)


def test_sensitivity_to_a_contact_parameter_is_computed_for_the_contact_model_only():
    found = run("slope-3deg", "robustness.roughness_m=[]", "robustness.steps=1", "robustness.to=[contact.stiffness]")
    assert {row["model"] for row in found.summary["sensitivity"]} == {"contact"}


def test_contact_model_is_skipped_without_its_block():
    with pytest.raises(ConfigError, match="contact"):
        run("rigid-only", "robustness.model=both")
    assert {row["model"] for row in run("rigid-only", "slope_deg=3", *FEW).summary["gaits"]} == {"rigid"}


def test_terminal_shows_two_tables_and_the_rest_on_request(both):
    shown, rest = answer("robustness", both.summary), further_tables("robustness", both.summary)
    heads = [line for line in shown if line.startswith("model ")]
    others = [line for line in rest if line.startswith("model ")]
    assert (len(heads), len(others)) == (2, len(robustness_section.filled_tables(both.summary)) - 2)
    assert others
    assert not {*heads} & {*others}
    assert shown[-1].startswith(f"The option -v shows {len(others)} more table")


def test_empty_list_of_parameters_omits_the_derivatives():
    asked = ("robustness.model=rigid", "robustness.to=[]", "robustness.roughness_m=[]", "robustness.steps=3")
    summary = run("slope-3deg", *asked).summary
    assert summary["sensitivity"] == []
    assert summary["gait_sensitivity_norm"]
    assert "Most effective change" not in " ".join(answer("robustness", summary))


@pytest.fixture(scope="module")
def limping():
    few = ("robustness.walks=2", "robustness.roughness_m=[0.001]", "robustness.steps=3", "robustness.max_steps=4")
    return run("paper", "walker.leg_2={leg_mass_kg: 5.3}", "robustness.to=[]", *few)


def test_both_models_report_similar_limits_for_each_leg(limping):
    summary = limping.summary
    json.dumps(summary, allow_nan=False)
    for name in ("largest_step", "largest_push"):
        assert [(row["model"], row["leg"]) for row in summary[name]] == [
            ("rigid", 1), ("rigid", 2), ("contact", 1), ("contact", 2),
        ]  # fmt: skip
        assert limping.groups[name]["leg"].tolist() == [1, 2, 1, 2]
    rigid, contact = summary["largest_push"][:2], summary["largest_push"][2:]
    for one, other in zip(rigid, contact, strict=True):
        assert other["forward_N_s"] == pytest.approx(one["forward_N_s"], rel=0.1)
    # In both models, leg 2 survives a larger forward push than leg 1, by more than the models differ.
    assert rigid[1]["forward_N_s"] > 1.2 * rigid[0]["forward_N_s"]
    norms = {(row["model"], row["leg"]): row["value"] for row in summary["gait_sensitivity_norm"][::6]}
    assert norms["contact", 1] / norms["contact", 2] == pytest.approx(norms["rigid", 1] / norms["rigid", 2], rel=0.05)


def test_report_says_which_leg_is_disturbed(limping, rigid):
    said = said_of(limping.summary)
    assert "after a step of leg 1 that goes down by" in said
    assert "as leg 2 begins to swing" in said
    assert "leg" not in said_of(rigid.summary).replace("leg_", "").replace("leg length", "")
    first, *_ = tables(limping.summary)
    assert [column.title for column in first.columns][:2] == ["model", "swing leg"]


def test_changing_one_of_two_equal_legs_has_half_the_effect():
    few = ("robustness.model=rigid", "robustness.roughness_m=[]", "robustness.steps=1")
    keys = "robustness.to=[walker.leg_mass_kg, walker.leg_2.leg_mass_kg]"
    content = run("slope-3deg", *few, keys)
    values = {(row["of"], row["to"]): row["value"] for row in content.summary["sensitivity"]}
    assert len(values) == 12
    for of in ("period_s", "step_length_m", "speed_m_s", "gait_sensitivity_norm"):
        both, one = (values[of, key] for key in ("walker.leg_mass_kg", "walker.leg_2.leg_mass_kg"))
        assert one == pytest.approx(0.5 * both, rel=1e-5), of
