"""Tests of the adjustment, which is not needed on the paper's ground, is found if there is one, and otherwise reported
as missing.
"""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import NoAnswer
from walkerlab.evidence.paper import tune
from walkerlab.evidence.paper.tune import LimitFindings, causes
from walkerlab.physics.orbits.rigid_limit import ALL_SERIES, NORMAL_SERIES, ContactFactors, Distance, Extrapolation
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint
from walkerlab.views.report.blocks import Results, Statements
from walkerlab.views.report.sections import adjustment, verdict
from walkerlab.views.report.words import words


@functools.cache
def tuned(config, *sets):
    """Return the result of the stage, with a small map."""
    loaded = load(Path(config), sets).config
    gait = fixedpoint.run(restrict(loaded, PIPELINE["fixedpoint"].takes), {}, Silent())
    return tune.run(restrict(loaded, PIPELINE["tune"].takes), {"fixedpoint": gait}, Silent())


def small(config, *sets, cells=3):
    return tuned(config, f"tune.cells={cells}", "tune.rigid_limit=false", *sets)


def test_contact_walk_of_the_paper_needs_no_adjusted_start():
    found = small("paper").summary["adjustment"]
    assert not found["needed"]
    assert (found["scale_dtheta1"], found["scale_dtheta2"], found["walked_steps"]) == (1.0, 1.0, 10)
    margins = found["margins"]
    assert 0.95 < margins["dtheta_2 down"]["factor"] < 1.0 < margins["dtheta_2 up"]["factor"] < 1.2
    assert margins["dtheta_2 down"]["beyond"] == "off-pad"


def test_contact_walk_settles_on_the_contact_gait():
    summary = small("paper").summary
    gait, walk = summary["gait"], summary["procedure"]["adjusted"]
    assert gait["stable"]
    assert walk["step_periods_s"][-1] == pytest.approx(gait["period_s"], rel=1e-3)
    assert walk["step_lengths_m"][-1] == pytest.approx(gait["step_length_m"], rel=1e-3)
    assert sum(gait["lost_J"].values()) == pytest.approx(gait["height_lost_J"], rel=1e-7)


def test_work_per_step_equals_the_losses():
    gait = small("level", "strides=1", cells=2).summary["gait"]
    given = gait["work_per_step_J"]
    assert sum(gait["lost_J"].values()) == pytest.approx(sum(given.values()), rel=1e-7)
    assert given["push_off"] == pytest.approx(sum(given.values()), rel=1e-9)
    assert gait["cost_of_transport"] == pytest.approx(given["push_off"] / (20 * 9.81 * gait["step_length_m"]))
    assert abs(gait["balance_J"]) < 1e-7
    said = words("adjustment.explained", {"gait": gait}, False).replace("\xa0", " ")
    assert "Of the 1.694 J of work per step, 1.556 J go into damping at touch-down" in said
    told = words("adjustment.caused", {"total_s": 1e-3, "together_s": 1e-3}, True)
    assert "their interaction, including that with the push-off's duration" in told


def test_start_of_the_paper_does_not_lead_to_walking_and_the_reason_is_stated():
    start = small("paper").summary["paper_start"]
    assert start["outcome"] != "walked"
    assert start["energy_J"] == pytest.approx(221.5, abs=0.5)
    assert start["normal_force_N"] < 0.1 * start["weight_N"]
    assert "221.5 J" in start["reason"]


def test_reason_for_the_adams_start_describes_the_model_and_ground_of_each_outcome():
    start = small("paper").summary["paper_start"]
    rigid, contact = start["reason"].split("the contact model on ")
    assert "in the rigid model, whose stance foot is pinned to an even slope" in rigid
    assert "with the foot held down the walk ends (fell) at 0.347 s" in rigid
    assert contact.startswith("its checkerboard of pads, the ground, which cannot pull, carries no more than")
    assert f"and the walk ends at {start['end_time_s']:.3g} s" in contact
    assert "off-pad: a foot meets a pad from the side, where the rigid model has no pads" in contact
    # The pads end the walk. Without them the walker flies on.
    plane = small("paper", "contact.terrain=after-mid-swing", "strides=1", cells=2)
    assert plane.summary["paper_start"]["outcome"] != "off-pad"


def test_change_of_the_start_is_given_as_a_percentage_of_each_start():
    row = small("paper").summary["table2"]["dtheta_2"]
    assert row["paper_percent_of_matlab"] == pytest.approx(100 * (3.20 - 0.84) / 0.84)
    assert row["paper_percent_of_adams"] == pytest.approx(100 * (3.20 - 0.84) / 3.20)


def test_creeping_feet_need_an_adjustment_and_the_adjusted_start_walks():
    summary = small("sliding-feet", "tune.stance_factors=[1.0, 1.1]").summary
    found = summary["adjustment"]
    assert found["needed"]
    assert summary["procedure"]["released"]["outcome"] == "off-pad"
    assert summary["procedure"]["adjusted"]["outcome"] == "walked"
    assert 0.0 < summary["procedure"]["adjusted"]["numerical_error"]["step_period_s"] < 1e-5
    assert 0.0 < found["distance"] < 0.2


def test_adjustment_map_agrees_with_single_walks():
    content = small("paper")
    cells = content["map"]
    assert cells["outcome"].shape == (3, 3)
    walked = (cells["outcome"] == 0).sum()
    assert walked == content.summary["map"]["contact"].get("walked", 0)
    ended = {row["outcome"]: row["walks"] for row in content.summary["map"]["endings"]}
    assert ended == {name: many for name, many in content.summary["map"]["contact"].items() if name != "walked"}
    assert np.all(cells["steps"][cells["outcome"] == 0] == 10)


NO_FRICTION = ("contact.static_friction=0", "contact.dynamic_friction=0")


@pytest.mark.parametrize(
    "sets", [NO_FRICTION, ("contact.static_friction=0.05", "contact.dynamic_friction=0.04")], ids=["none", "little"]
)
def test_failure_to_find_a_start_that_walks_is_explained(sets):
    content = small("paper", *sets)
    gait, found = content.summary["gait"], content.summary["adjustment"]
    assert not gait["found"]
    assert len(gait["reason"]) > 20
    assert (found["needed"], found["found"], found["reason"]) == (True, False, "none of 9 starts walked 10 steps")
    assert len(found["advice"]) > 20
    assert "adjusted" not in content.groups
    assert "no_answer" not in content.summary


def test_page_says_that_no_start_leads_to_walking():
    results = Results(None, {"tune": small("paper", *NO_FRICTION)})
    (found,) = [block for block in verdict.section(results).blocks if isinstance(block, Statements)]
    (told,) = found.items
    assert (told.about, told.tone) == ("Parameter adjustment", "bad")
    assert "None of 9 starts walked" in told.text
    made = adjustment.section(results)
    assert made.finding == "No adjustment of the two initial velocities helps: none of 9 starts walked 10 steps."
    assert made.blocks[0].text.startswith("The contact model has no gait of its own")


def test_pads_spaced_by_the_contact_gait_give_no_answer_if_there_is_no_such_gait():
    with pytest.raises(NoAnswer, match="no contact gait to lay the pads for"):
        small("paper", *NO_FRICTION, "contact.pad_pitch=own")


def test_airborne_start_is_a_valid_answer():
    summary = small("paper", "start=[-0.2018, 0.167, -1.02, -3.2]").summary
    assert summary["adjustment"]["needed"]
    assert summary["procedure"]["released"]["outcome"] != "walked"


@functools.cache
def kneed():
    return small(
        "kneed", "strides=1", "solver.contact={rtol: 1.0e-5, atol: 1.0e-7}", "tune.stance_factors=[0.9, 1.1]", cells=2
    )


def test_kneed_walker_needs_no_adjustment_on_plain_ground():
    summary = kneed().summary
    found = summary["adjustment"]
    assert (found["needed"], found["found"], found["walked_steps"]) == (False, True, 2)
    down, up = (found["margins"][f"dtheta_2 {way}"] for way in ("down", "up"))
    assert 0.9 < down["factor"] < 1.0 < up["factor"]
    assert down["beyond"] is not None


def test_losses_of_the_kneed_gait_add_up_to_the_height_it_loses():
    gait = kneed().summary["gait"]
    assert sum(gait["lost_J"].values()) == pytest.approx(gait["height_lost_J"], rel=1e-7)
    assert gait["lost_J"]["knee_strikes"] > 0.0
    assert len(gait["multipliers"]) == len(gait["state"]) == len(gait["state_is"]) == 8
    assert "angular velocity of the swing shank (rad/s)" in gait["state_is"]
    step = kneed().summary["procedure"]["adjusted"]["step_periods_s"][-1]
    assert step == pytest.approx(gait["period_s"], rel=0.01)


def test_parts_about_the_paper_are_reported_as_omitted_for_other_walkers():
    content = kneed()
    assert set(content.summary["procedure"]) == {"released", "adjusted"}
    assert "paper_start" not in content.summary
    assert not {"hinged", "paper_start"} & set(content.groups)
    assert [entry["what"] for entry in content.summary["left_out"]] == [
        "the first step with a pinned stance foot",
        "the paper's start of its ADAMS model",
    ]
    assert set(content.summary["table2"]) == {f"{d}theta_{leg}" for d in ("", "d") for leg in ("1", "2", "1_shank")}
    assert content.summary["table2"]["dtheta_2"].keys() >= {"unit", "ours_rigid", "ours_adjusted"}
    assert small("paper").summary["left_out"] == []


def test_page_describes_the_kneed_adjustment():
    made = adjustment.section(Results(load(Path("kneed")).config, {"tune": kneed()}))
    assert "the stance leg starts" in made.finding
    assert "into the knee's strike" in made.blocks[0].text
    assert "link" not in made.finding


def tables_of(summary):
    made = adjustment.section(Results(load(Path("kneed")).config, {"tune": replace(kneed(), summary=summary)}))
    return {block.caption: block for block in made.blocks if hasattr(block, "caption")}


def test_unchanged_start_has_no_table_of_changes():
    assert not {"The start before and after the adjustment", "The procedure, walk by walk"} & set(
        tables_of(kneed().summary)
    )


def test_page_lists_torso_and_knees_only_if_the_walker_has_them():
    row = kneed().summary["table2"]["dtheta_2"]
    changed = kneed().summary | {
        "adjustment": kneed().summary["adjustment"] | {"needed": True},
        "table2": kneed().summary["table2"] | {"dtheta_torso": row},
    }
    tables = tables_of(changed)
    names = [row[0].text for row in next(iter(tables["The start before and after the adjustment"].groups.values()))]
    assert (names[2], names[-1]) == ("θ₁, shank (rad)", "θ̇, torso (rad/s)")
    walks = [row[0].text for row in next(iter(tables["The procedure, walk by walk"].groups.values()))]
    assert walks == ["from the rigid state", "from the adjusted start"]


def test_inseparable_causes_are_not_attributed_to_their_interaction():
    limit = LimitFindings((ALL_SERIES,), 0.7, 0.71, {ALL_SERIES: [], NORMAL_SERIES: [at_period(0.712)]}, None)
    told = causes(limit)
    assert "together_s" not in told
    assert told["rest_s"] == pytest.approx(0.012)
    said = words("adjustment.caused", told).replace("\u00a0", " ")
    assert said.startswith(
        "Its period differs from the rigid gait's by 10 ms. Switching off one cause at a time shows that −2 ms"
    )
    assert "12 ms (120 %) from creep in the friction law and the interaction, which could not" in said
    told = causes(replace(limit, without_creep=Extrapolation(0.701, 1e-6)))
    assert told["together_s"] == pytest.approx(0.003)


def at_period(period):
    return Distance(ContactFactors(NORMAL_SERIES, 1.0, 1.0, 1.0, 1.0), period, 0.37, 0.0, period - 0.7, 0.0, 0.0)


def test_report_of_another_compass_does_not_mention_the_paper():
    content = small("paper", "walker.hip_mass_kg=11", "strides=1", cells=2)
    assert "paper_start" not in content.summary
    assert "paper_start" not in content.groups
    assert not [key for row in content.summary["table2"].values() for key in row if key.startswith("paper")]
    assert [entry["what"] for entry in content.summary["left_out"]] == ["the paper's start of its ADAMS model"]
