"""Tests of the stage `continuation`: its results, their units, and the requests that it rejects."""

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.physics.orbits import family_search
from walkerlab.physics.orbits import two_parameters as plane_of_gaits
from walkerlab.physics.orbits.families import ValueSpan
from walkerlab.physics.orbits.family_search import THOROUGHNESS
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.step_map import gait_near
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.stages import continuation
from walkerlab.pipeline.stages.continuation import (
    FamilyQuestion,
    attractor_summary,
    ending_rows,
    first_doubling,
    sample_again,
)
from walkerlab.pipeline.stages.family_groups import birth_of
from walkerlab.scene.parameter import parameter_of
from walkerlab.scene.subject import rigid_map


def config(*sets):
    return load(sets=[f"continuation.{one}" if one.split("=")[0] in KEYS else one for one in sets]).config


KEYS = ("over", "from", "to", "model", "periods", "points", "second.over", "second.from", "second.to")


def follow(*sets):
    return continuation.run(restrict(config(*sets), PIPELINE["continuation"].takes), {}, Silent())


@pytest.fixture(scope="module")
def in_degrees():
    return follow("over=slope_deg", "from=4", "to=4.8", "periods=2")


def test_values_are_in_the_unit_of_the_requested_key(in_degrees):
    (in_radians,) = [
        one["value"]
        for one in follow(f"from={math.radians(4)}", f"to={math.radians(4.6)}", "periods=1").summary["bifurcations"]
        if one["kind"] == "flip"
    ]
    said = in_degrees.summary
    (first,) = [one["value"] for one in said["bifurcations"] if one["kind"] == "flip" and one["period"] == 1]
    assert (said["over"], said["unit"]) == ("slope_deg", "deg")
    assert first == pytest.approx(math.degrees(in_radians), abs=1e-9)


def test_gait_without_neighbours_is_reported_but_not_as_a_branch():
    sets = {"over": "walker.hip.spring_N_m_per_rad", "from": 0, "to": 40, "periods": 1}
    asked = load(Path("level"), [f"continuation.{key}={value}" for key, value in sets.items()]).config
    summary = continuation.run(restrict(asked, PIPELINE["continuation"].takes), {}, Silent(), again=False).summary
    assert len(summary["branches"]) == 2
    for branch in summary["branches"]:
        assert (branch["from"], branch["to"]) == (0.0, 40.0)
        assert [end["reason"] for end in branch["ends"]] == ["end of the span"] * 2
    (alone,) = [one for one in summary["left_out"] if "continues in neither direction" in one["why"]]
    assert alone["what"].startswith("a gait of the rigid model at 20 N m/rad")
    assert alone["why"].endswith("Newton's method finds no further gait")  # The reason is not that there is no walker.


def test_artifact_has_a_group_for_each_branch(in_degrees):
    said = in_degrees.summary
    assert set(said) >= {"branches", "bifurcations", "lyapunov", "over", "unit"}
    for number, branch in enumerate(said["branches"]):
        assert set(branch) >= {"model", "period", "from", "to", "points", "stable_range", "ends"}
        group = in_degrees[f"rigid/branch_{number}"]
        assert group["value"].size == branch["points"]
        assert group["step_period"].shape == (branch["points"], branch["period"])
    for one in said["bifurcations"]:
        assert set(one) >= {"kind", "period", "value", "multiplier", "model"}
        assert 4.0 <= one["value"] <= 4.8
    for one in said["lyapunov"]:
        assert set(one) >= {"value", "exponent", "uncertainty"}


def test_number_of_recomputed_gaits_is_reported(in_degrees):
    error = in_degrees.summary["numerical_error"]["rigid"]
    assert (error["walked_again"], error["ended_otherwise"]) == (16, 0)
    assert error["of"] == sum(branch["points"] for branch in in_degrees.summary["branches"])
    # Steps are integrated at 1e-13, and an unstable gait magnifies this error.
    assert 0.0 < error["step_period_s"] < 1e-11
    assert 0.0 < error["step_length_m"] < 1e-11
    assert error["by"] == "ten times tighter tolerances"


def test_omitting_the_error_estimate_changes_nothing_else_in_the_families():
    asked = config("over=slope_deg", "from=1", "to=1.5", "periods=1")
    memory = MemoryResults()
    looked_at, whole = (answer_in_memory(asked, "continuation", memory, again=again) for again in (False, True))
    assert whole.summary["numerical_error"].keys() == {"rigid"}
    assert looked_at.summary == {**whole.summary, "numerical_error": {}}


def test_newton_residual_is_part_of_the_numerical_error():
    """If the start of a gait is slightly off, its step has another period than the gait, however tight the tolerances
    are.
    """
    step_map = rigid_map(config(), parameter_of("slope_deg", config()), 1.0)
    gait = gait_near(step_map, np.array([0.22, -0.12, -0.35]), 3.0, Effort(1e-13))
    z = gait.z + np.array([1e-8, 0.0, 0.0])
    off = step_map.step(z, 3.0)
    lengths = np.array([off.length_m])
    point = SimpleNamespace(z=z, value=3.0, periods_s=np.array([off.period_s]), lengths_m=lengths)
    branch = SimpleNamespace(period=1, points=(point,))
    told = sample_again(SimpleNamespace(step_map=step_map, branches=(branch,)))
    assert told["step_period_s"] == pytest.approx(abs(off.period_s - gait.period_s), rel=1e-3)
    assert told["step_length_m"] == pytest.approx(abs(off.length_m - gait.steps[0].length_m), rel=1e-3)
    assert told["step_period_s"] > 1e-9


def test_branch_that_ends_because_the_foot_slides_says_what_to_change():
    end = SimpleNamespace(value=5.0, reason="slid: the stance foot slides away")
    branch = SimpleNamespace(period=1, ends=(SimpleNamespace(value=0.2, reason="end of the span"), end), crossings=())
    followed = SimpleNamespace(model="contact", branches=(branch,))
    (row,) = ending_rows(followed, SimpleNamespace(unit="deg"), config())
    assert (row["period"], row["value"], row["outcome"]) == (1, 5.0, "slid")
    assert row["said"].startswith(
        "At 5 deg the contact model's gait of 1 step ends (slid: the stance foot slides away)."
    )
    assert "contact.static_friction" in row["said"]


@pytest.mark.parametrize(("tripped", "side"), [((0.0, 1.0), "Above"), ((1.0, 0.0), "Below")])
def test_report_says_that_pads_end_the_walks_although_the_gait_continues(tripped, side):
    monitor = SimpleNamespace(name="tripped", limit=0.5)
    points = [SimpleNamespace(value=value, monitors=[one]) for value, one in zip((4.0, 4.2), tripped, strict=True)]
    crossing = SimpleNamespace(monitor=monitor, value=4.1)
    branch = SimpleNamespace(period=1, ends=(), crossings=(crossing,), points=points)
    step_map = SimpleNamespace(monitors=(monitor,))
    followed = SimpleNamespace(model="contact", branches=(branch,), step_map=step_map)
    (row,) = ending_rows(followed, SimpleNamespace(unit="deg"), config())
    assert row["said"].startswith(f"{side} about 4.1 deg the contact model's gait of 1 step trips over pads")
    assert "the pads end walks there, not the gait" in row["said"]


def test_summary_states_the_first_period_doubling(in_degrees):
    said = in_degrees.summary
    (walks,) = [branch for branch in said["branches"] if branch["period"] == 1 and branch["stable_range"]]
    assert said["first_doubling"] == {"rigid": walks["stable_range"][1]}


def test_flip_of_an_unstable_gait_is_not_the_first_doubling():
    walks = SimpleNamespace(period=1, stable_ranges=((1.0, 4.0),), bifurcations=(flip_at(4.0),))
    unstable = SimpleNamespace(period=1, stable_ranges=(), bifurcations=(flip_at(1.5),))
    doubled = SimpleNamespace(period=2, stable_ranges=((2.0, 3.0),), bifurcations=(flip_at(3.0),))
    assert first_doubling((unstable, doubled, walks)) == 4.0
    assert first_doubling((unstable, doubled)) is None


def flip_at(value):
    return SimpleNamespace(kind="flip", value=value)


def test_unsettled_walks_in_a_cascade_are_not_called_aperiodic():
    # These are flips of the contact model. Walks just beyond a flip take long to settle.
    flips, ranges = (4.097, 4.632, 4.734), ((0.2, 4.097), (4.097, 4.632), (4.632, 4.734))
    branches = [
        SimpleNamespace(period=2**k, stable_ranges=(ranges[k],), bifurcations=(flip_at(flips[k]),), ends=(born,))
        for k, born in enumerate(SimpleNamespace(value=value) for value in (0.2, *flips[:2]))
    ]
    seen = [SimpleNamespace(value=value, period=0) for value in (4.647, 4.74, 4.755, 4.76, 4.9)]
    attractors = SimpleNamespace(found=seen, lost_at=None, reason="")
    followed = SimpleNamespace(model="contact", branches=branches, attractors=attractors, exponents=())
    # The flips accumulate at 4.734 + 0.102 / (0.535 / 0.102 - 1) = 4.758.
    assert attractor_summary(followed)["aperiodic_from"] == 4.76


def test_stored_doubled_branch_begins_at_the_flip_of_its_parent(in_degrees):
    said = in_degrees.summary
    (number,) = [i for i, branch in enumerate(said["branches"]) if branch["period"] == 2]
    group = in_degrees[f"rigid/branch_{number}"]
    assert group["mark_after"][0] == -1
    assert group["mark_value"][0] == said["branches"][number]["from"]
    assert np.ptp(group["mark_step_period"][0]) == 0.0


def test_gait_at_a_flip_is_shown_from_the_first_step_of_the_doubled_branch():
    gait = SimpleNamespace(periods_s=np.array([0.5, 0.6, 0.7]), angles=np.array([0.1, 0.2, 0.3]))
    flip = SimpleNamespace(kind="flip", value=6.0, gait=gait)
    parent = SimpleNamespace(period=3, bifurcations=(flip,))
    first = SimpleNamespace(periods_s=np.array([0.61, 0.71, 0.51, 0.59, 0.69, 0.49]))
    doubled = SimpleNamespace(period=6, ends=(SimpleNamespace(value=6.0),), points=(first,), bifurcations=())
    (mark,) = birth_of(doubled, [parent, doubled])
    assert mark.periods.tolist() == [0.6, 0.7, 0.5, 0.6, 0.7, 0.5]
    assert mark.angles.tolist() == [0.2, 0.3, 0.1, 0.2, 0.3, 0.1]


def test_flip_curve_passes_through_the_flip_of_the_config(monkeypatch):
    # This test needs no map of the plane next to the curves.
    monkeypatch.setattr(plane_of_gaits, "PLANE_CELLS", (2, 2))
    found = follow(
        "over=slope_deg", "from=4", "to=4.8", "periods=1",
        "second.over=walker.hip_mass_kg", "second.from=9.5", "second.to=10.5",
    )  # fmt: skip
    curve = found["rigid/curve_0"]
    (flip,) = [one["value"] for one in found.summary["bifurcations"] if one["kind"] == "flip"]
    order = np.argsort(curve["second"])
    assert np.interp(10.0, curve["second"][order], curve["value"][order]) == pytest.approx(flip, abs=1e-9)


def test_regions_of_the_plane_meet_at_the_flip_curve(monkeypatch):
    monkeypatch.setattr(plane_of_gaits, "PLANE_CELLS", (10, 3))
    found = follow(
        "over=slope_deg", "from=4", "to=4.8", "periods=1",
        "second.over=walker.hip_mass_kg", "second.from=8", "second.to=12",
    )  # fmt: skip
    plane, curve = found["rigid/regions"], found["rigid/curve_0"]
    order = np.argsort(curve["second"])
    flips = np.interp(plane["second"], curve["second"][order], curve["value"][order])
    assert plane["period"].tolist() == [[1 if value < flip else 2 for flip in flips] for value in plane["value"]]
    assert sum(one["share"] for one in found.summary["regions"]) == pytest.approx(1.0)


@pytest.mark.parametrize(("name", "unit"), [("paper", "mm/s"), ("contact-si", "m/s")])
def test_unit_of_a_contact_key_is_that_of_the_config(name, unit):
    config = load(Path(name)).config
    assert parameter_of("contact.stiction_velocity", config).unit == unit
    assert parameter_of("walker.hip_mass_kg", config).unit == "kg"


def test_values_derived_from_a_key_change_with_it():
    own = config("walker={leg_length_m: 1.0}")
    longer = parameter_of("walker.leg_length_m", own).config_at(own, 1.4)
    assert longer.walker.foot_to_mass_m == 0.7  # The default is half of the length.
    given = config("walker.foot_to_mass_m=0.5")
    assert parameter_of("walker.leg_length_m", given).config_at(given, 1.4).walker.foot_to_mass_m == 0.5
    assert parameter_of("walker.leg_length_m", given).config_at(given, -1.0) is None


@pytest.mark.parametrize(
    ("over", "models"),
    [
        ("slope_rad", {"rigid", "contact"}),
        ("contact.stiffness", {"contact"}),
        ("walker.hip_mass_kg", {"rigid", "contact"}),
    ],
)
def test_rigid_and_contact_models_are_each_affected_by_the_expected_keys(over, models):
    own = config()
    parameter = parameter_of(over, own)
    span = ValueSpan(*(factor * parameter.value_in(own) for factor in (1.0, 1.1)))
    asked = FamilyQuestion(own, parameter, span)
    assert {model for model in ("rigid", "contact") if asked.touches(model)} == models


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        (["over=walker.type"], "not a number"),
        (["over=walker"], "is a block of keys"),
        (["over=strides"], "affects no model"),
        (["over=slope_dge"], "did you mean slope_deg?"),
        (["over=contact.stiffness", "from=1e5", "to=2e5"], "does not affect the rigid model"),
        (
            ["over=push_off.duration_s", "from=0.001", "to=0.01", "model=contact", "walker.hip.torque_N_m=1"],
            "does not affect the contact model",
        ),
        (["over=walker.hip_mass_kg", "from=-1", "to=2"], "cannot be -1 kg"),
        (["contact=null", "model=contact"], "needs a contact block"),
        (["contact=null", "over=contact.stiffness"], "the config has no block contact"),
        (["second.over=walker.hip_mass_kg", "second.from=1", "second.to=2"], "outside 1 to 2"),
        (["second.over=walker.hip_mass_kg", "second.from=-1", "second.to=20"], "second.from: walker.hip_mass_kg can"),
        (["second.over=slope_deg", "second.from=0.1", "second.to=5"], "is already the parameter that"),
        (["second.over=contact.stiffness", "second.from=1", "second.to=1e6"], "does not affect the rigid model"),
    ],
)  # fmt: skip
def test_invalid_questions_are_rejected(sets, said):
    with pytest.raises(ConfigError, match=re.escape(said)) as refused:
        follow(*sets)
    assert refused.value.advice


def follow_coarsely(*sets):
    """Follow the attractor at fewer values than usual, and only gaits of 1, 2 and 4 steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(THOROUGHNESS, "rigid", replace(THOROUGHNESS["rigid"], values=36, exponents=12, averaged=400))
        patch.setattr(family_search, "OTHER_PERIODS", ())
        patch.setattr(family_search, "SCATTERED", 0)
        return follow(*sets, "periods=4").summary


@pytest.fixture(scope="module")
def beyond_the_first_flip():
    return follow_coarsely("over=slope_deg", "from=4.9", "to=5.25")


def test_span_starting_beyond_the_first_flip_finds_the_same_flips(beyond_the_first_flip):
    wider = follow_coarsely("over=slope_deg", "from=4.2", "to=5.25")
    for steps in (2, 4):
        (flip,), (wanted,) = (flips_of(said, steps) for said in (beyond_the_first_flip, wider))
        assert flip == pytest.approx(wanted, abs=1e-9)
    (doubled,) = [one for one in beyond_the_first_flip["branches"] if one["period"] == 2]
    assert (doubled["from"], doubled["to"]) == pytest.approx((4.9, 5.25))


def test_span_starting_beyond_the_first_flip_finds_chaos(beyond_the_first_flip):
    (attractor,) = beyond_the_first_flip["attractors"]
    # The flips of the cascade accumulate at 5.03922 deg, and walks are simulated every 0.01 deg.
    assert 5.0392 < attractor["aperiodic_from"] < 5.06
    assert attractor["from"] == 4.9
    steepest = max(beyond_the_first_flip["lyapunov"], key=lambda one: one["value"])
    assert steepest["value"] > 5.15
    assert steepest["exponent"] > 5.0 * steepest["uncertainty"]


@pytest.mark.parametrize(("least", "settled"), [(4.95, 4), (5.1, 0)])
def test_gaits_with_fewer_steps_than_the_attractor_are_found(least, settled):
    said = follow_coarsely("over=slope_deg", f"from={least}", "to=5.15")
    assert {one["period"] for one in said["branches"] if one["from"] == least} >= {1, 2, 4}
    assert settled in said["attractors"][0]["periods"]


def test_attractor_at_the_end_of_a_span_is_followed_downwards():
    # On this slope, lighter legs are further along the cascade, until walks fall.
    said = follow_coarsely("over=walker.leg_mass_kg", "slope_deg=5.1", "from=3.8", "to=7")
    assert {one["period"] for one in said["branches"]} >= {1, 2}
    (attractor,) = said["attractors"]
    assert attractor["to"] == 7.0
    assert 3.8 < attractor["lost_at"] < attractor["from"]
    assert attractor["ended"] == "fell"


def flips_of(said, steps):
    return [one["value"] for one in said["bifurcations"] if (one["kind"], one["period"]) == ("flip", steps)]


def test_span_without_a_gait_has_no_answer():
    with pytest.raises(NoAnswer, match="no gait was found with slope_deg from -3 to -1 deg"):
        follow("over=slope_deg", "from=-3", "to=-1")


def test_span_must_run_upward():
    with pytest.raises(ConfigError, match="must be above `from`"):
        config("from=0.2", "to=0.1")


def test_stored_motion_of_rigid_gaits_is_periodic(in_degrees):
    moving = {path: group for path, group in in_degrees.groups.items() if "/motion_" in path}
    assert {int(group.attrs["steps"]) for group in moving.values()} == {1, 2}
    for path, group in moving.items():
        branch, place = in_degrees[path.rpartition("/")[0]], int(path.rpartition("_")[2])
        assert group.attrs["value"] == branch["value"][place]
        # The motion is two steps: a one-step gait twice, or a two-step gait once. Unstable gaits drift slightly.
        assert group["angle"][-1] == pytest.approx(group["angle"][0], abs=1e-5)
        way = 2 / branch["step_length"].shape[1] * branch["step_length"][place].sum()
        ends = group["foot_along_m"][[0, -1]]
        assert ends[1] - ends[0] == pytest.approx([way, way], abs=1e-5)
