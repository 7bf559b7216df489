"""Tests of the numerical error of a walk, found at tighter tolerances, and of the messages if it is unknown."""

import pytest
from annotated_types import Ge

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.schema import SolverSettings
from walkerlab.errors import NoAnswer
from walkerlab.physics.hybrid import recorded_walk
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import contact_sim, simulate
from walkerlab.pipeline.stages.walk import MIN_RTOL, change, tightened
from walkerlab.pipeline.store.content import Content

# fixed point of the paper's walker by the corrected equations at 0.0174 rad
STATE = [-0.2042, 0.1694, -0.605819, -0.861041]
GAIT = Content({}, {"state": STATE, "step_length_m": 0.3714})
MODULES = {"simulate": simulate, "contact-sim": contact_sim}
KEYS = {"step_period_s": "step_periods_s", "step_length_m": "step_lengths_m"}
OF_FEET = {"slip_m": "slips_m", "rolling_m": "rolling_m"}


def walk(stage, *sets, **options):
    config = load(None, sets).config
    return (
        MODULES[stage].run(restrict(config, PIPELINE[stage].takes), {"fixedpoint": GAIT}, Silent(), **options).summary
    )


@pytest.mark.parametrize(
    ("stage", "model", "keys"), [("simulate", "rigid", KEYS), ("contact-sim", "contact", KEYS | OF_FEET)]
)
def test_error_estimate_agrees_with_a_walk_at_much_tighter_tolerances(stage, model, keys):
    loose = walk(stage, f"solver.{model}.rtol=1e-4", f"solver.{model}.atol=1e-6", "outputs=[]", "strides=2")
    right = walk(stage, f"solver.{model}.rtol=1e-10", f"solver.{model}.atol=1e-12", "outputs=[]", "strides=2")
    error = loose["numerical_error"]
    assert list(error) == [*keys, "end_time_s", "of_steps"]
    assert list(error["of_steps"]) == list(keys)
    for key, of in keys.items():
        assert max(error["of_steps"][key]) == pytest.approx(error[key], rel=0.05)  # Two digits are stored.
        true = max(abs(a - b) for a, b in zip(loose[of], right[of], strict=True))
        # At an order of five or more, the error of the second walk is about 2 % of that of the first.
        assert error[key] == pytest.approx(true, rel=0.2)
        assert right["numerical_error"][key] < 1e-3 * true


def test_error_estimate_of_a_hip_torque_cost_agrees_with_far_tighter_tolerances():
    driven = ("walker.hip.torque_N_m=0.3", "outputs=[]", "strides=2")
    loose = walk("simulate", "solver.rigid.rtol=1e-4", "solver.rigid.atol=1e-6", *driven)
    right = walk("simulate", "solver.rigid.rtol=1e-10", "solver.rigid.atol=1e-12", *driven)
    true = abs(loose["cost_of_transport"] - right["cost_of_transport"])
    assert loose["numerical_error"]["cost_of_transport"] == pytest.approx(true, rel=0.2)
    assert right["numerical_error"]["cost_of_transport"] < 1e-3 * true
    assert "cost_of_transport" not in walk("simulate", "outputs=[]", "strides=2")["numerical_error"]


def test_second_walk_falls_back_to_a_smaller_factor_or_another_method():
    assert [bound.ge for bound in SolverSettings.model_fields["rtol"].metadata if isinstance(bound, Ge)] == [MIN_RTOL]
    usual, by = tightened(Tolerances("dop853", 1e-12, 1e-12, 1))
    assert (usual.rtol, usual.atol, by) == (pytest.approx(1e-14), 1e-14, "a hundred times tighter tolerances")
    some, by = tightened(Tolerances("dop853", 1e-13, 1e-12, 1))
    assert (some.rtol, some.atol, by) == (pytest.approx(1e-14), 1e-13, "ten times tighter tolerances")
    other, by = tightened(Tolerances("dop853", 2e-14, 1e-12, 1))
    assert (other.method, other.rtol, by) == ("radau5", 2e-14, "another method, radau5")
    assert tightened(Tolerances("radau5", MIN_RTOL, 1e-12, 1))[0].method == "dop853"


def test_numerical_error_says_if_the_tolerances_were_tightened_less_than_usual():
    error = walk("simulate", "solver.rigid.rtol=1e-13", "solver.rigid.atol=1e-15", "outputs=[]")["numerical_error"]
    assert error["by"] == "ten times tighter tolerances"
    assert error["step_period_s"] < 1e-12


WALKED = {
    "outcome": "walked",
    "steps": 2,
    "step_periods_s": [0.7, 0.7],
    "step_lengths_m": [0.3, 0.3],
    "end_time_s": 1.4,
}


def test_second_walk_with_another_outcome_gives_a_reason_instead_of_an_error():
    fell = WALKED | {"outcome": "fell", "steps": 1}
    assert change(WALKED, fell) == {
        "reason": "with a hundred times tighter tolerances the walk ends differently: fell after 1 step"
    }
    assert list(change(WALKED, WALKED | {"steps": 1}, by="another method, radau5")) == ["reason"]


def test_numerical_error_is_the_largest_change_over_all_steps():
    again = WALKED | {"step_periods_s": [0.7, 0.75], "step_lengths_m": [0.2, 0.3], "end_time_s": 1.45}
    expected = {"step_period_s": 0.05, "step_length_m": 0.1, "end_time_s": 0.05}
    found = change(WALKED, again)
    assert found.pop("of_steps") == {"step_period_s": [0.0, 0.05], "step_length_m": [0.1, 0.1]}
    assert found == pytest.approx(expected)
    knees = {"knee_strike_times_s": [0.4, None, 1.2]}
    later = change(WALKED | knees, again | {"knee_strike_times_s": [0.4, None, 1.5]})
    assert later.pop("of_steps")["knee_strike_time_s"] == [0.0, None, 0.3]
    assert later == pytest.approx(expected | {"knee_strike_time_s": 0.3})


def test_steps_of_a_cycle_are_matched_before_comparison():
    cycle, periods = [0.5, 0.9, 0.6, 0.8], {}
    for name, first in (("one", 0), ("other", 3)):
        periods[name] = [0.7, 0.7, *(cycle[(first + step) % 4] for step in range(16))]
    walks = [WALKED | {"steps": 18, "step_periods_s": each, "step_lengths_m": [0.3] * 18} for each in periods.values()]
    settled = [walk | {"repeats_after": 4} for walk in walks]
    assert change(*settled)["of_steps"]["step_period_s"][2:] == [0.0] * 16
    # Walks that do not repeat are compared step by step. Each step has the largest change so far.
    assert change(*walks)["of_steps"]["step_period_s"][1:5] == [0.0, 0.3, 0.4, 0.4]


@pytest.mark.parametrize("stage", MODULES)
def test_walk_without_a_step_has_a_numerical_error_only_for_its_end_time(stage):
    fallen = walk(stage, "start=[-0.1674, 0.1674, -0.4, -0.5]", "slope_rad=0", "contact.pad_pitch=0.3", "outputs=[]")
    assert fallen["outcome"] in ("fell", "off-pad")
    assert fallen["steps"] == 0
    assert list(fallen["numerical_error"]) == ["end_time_s"]
    assert 0.0 < fallen["end_time_s"] < 10.0
    assert fallen["numerical_error"]["end_time_s"] < 1e-6


def test_complete_walk_ends_at_its_last_touch():
    found = walk("simulate", "outputs=[]")
    assert found["end_time_s"] == found["touch_times_s"][-1]


@pytest.mark.parametrize("stage", MODULES)
def test_second_walk_can_be_disabled(stage):
    assert "numerical_error" not in walk(stage, "outputs=[]", "strides=1", again=False)


def test_walk_without_an_answer_is_not_repeated(monkeypatch):
    monkeypatch.setattr(recorded_walk, "BUDGET_OF_A_STEP", 100)
    with pytest.raises(NoAnswer) as caught:
        walk("simulate")
    assert "numerical_error" not in caught.value.partial.summary
