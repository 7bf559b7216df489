"""Tests of the stage `design`: optima compared with grids, bounds, rejected requests, and the config that it writes."""

import json
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.physics.orbits.design import DesignProblem, Point, count_optima, search_from_starts
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.gradients import gait_quantities
from walkerlab.physics.orbits.robustness import LARGEST, largest_disturbance
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import design, fixedpoint
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene.contact import contact_scene, gait_off_pads, start_state
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.subject import find_model_gait
from walkerlab.views.report.answers import answer

# keys that programs may rely on
FIXED_KEYS = {
    "best", "value", "start_value", "quantity", "constraints", "gradient_norm", "evaluations",
}  # fmt: skip


def run(name, *changes, checkpoint=None):
    config = load(Path(name), changes).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())
    return design.run(
        restrict(config, PIPELINE["design"].takes),
        {"fixedpoint": gait},
        Silent(),
        checkpoint=checkpoint or Checkpoint(None, ""),
    ).summary


def gait_at(name, *changes):
    config = load(Path(name), changes).config
    return find_gaits(rigid_walker(config, config.equations)).gait


def test_optimum_equals_that_of_a_grid_search():
    """Compare with the smallest spectral radius on a grid of 46 hip masses."""
    found = run(
        "slope-3deg", "design.minimise=spectral_radius", "design.over={walker.hip_mass_kg: [5, 50]}", "design.starts=3"
    )
    assert set(found) >= FIXED_KEYS
    json.dumps(found, allow_nan=False)
    masses = np.linspace(5.0, 50.0, 46)
    radii = [gait_at("slope-3deg", f"walker.hip_mass_kg={mass!r}").spectral_radius for mass in masses.tolist()]
    assert found["value"] <= min(radii) + 1e-9
    assert abs(found["best"]["walker.hip_mass_kg"] - masses[int(np.argmin(radii))]) <= 1.0
    assert found["value"] == pytest.approx(
        gait_at("slope-3deg", f"walker.hip_mass_kg={found['best']['walker.hip_mass_kg']!r}").spectral_radius, rel=1e-8
    )


def test_design_search_finds_the_gait_at_the_parameters_it_tries():
    """From the gait with a hip of 10 kg, Newton's method would find an unstable gait of the walker of 50 kg, with
    multiplier 4.55.
    """
    asked = ("design.minimise=spectral_radius", "design.over={walker.hip_mass_kg: [49.9, 50]}", "design.starts=1")
    found = run("slope-3deg", *asked)
    assert found["value"] == pytest.approx(gait_at("slope-3deg", "walker.hip_mass_kg=50").spectral_radius, rel=1e-3)


def test_interrupted_design_searches_resume(tmp_path):
    asked = ("design.minimise=spectral_radius", "design.over={walker.hip_mass_kg: [5, 50]}", "design.starts=2")
    whole = run("slope-3deg", *asked, checkpoint=Checkpoint(tmp_path / "parts", "key"))
    kept = Checkpoint(tmp_path / "parts", "key")
    assert list(kept.kept) == ["search 0", "search 1"]
    del kept.kept["search 1"]  # The search was interrupted before it had finished.
    again = run("slope-3deg", *asked, checkpoint=kept)
    for name in ("evaluations", "without_gait", "optima", "on_bound", "best"):
        assert again[name] == whole[name]
    assert again["best"] == {"walker.hip_mass_kg": 50.0}
    assert again["value"] == pytest.approx(whole["value"], rel=1e-9)


def test_constraints_are_kept_and_active_bounds_reported():
    found = run(
        "slope-3deg", "design.maximise=speed_m_s", "design.over={slope_deg: [1, 4]}",
        "design.keep={step_length_m: [0.3, 0.5]}", "design.starts=2",
    )  # fmt: skip
    assert found["numbers"]["step_length_m"] == pytest.approx(0.5, abs=1e-6)
    assert found["constraints"][0]["value"] <= 0.5 + 1e-6
    assert found["on_bound"] == []
    free = run("slope-3deg", "design.maximise=speed_m_s", "design.over={slope_deg: [1, 4]}", "design.starts=2")
    assert free["on_bound"] == ["slope_deg"]
    assert free["best"]["slope_deg"] == pytest.approx(4.0)
    assert free["value"] > free["start_value"]


def test_random_starts_agree_on_one_optimum():
    asked = ("design.minimise=gait_sensitivity_norm", "design.over={walker.foot_to_mass_m: [0.4, 0.6]}")
    found = run("slope-3deg", *asked, "design.starts=4", "seed=5")
    assert found["optima"] == 1
    assert found["value"] < found["start_value"]


def bowls(x):
    """Return a function with two minima, the deeper one at 0.8, and no values between 0.4 and 0.6."""
    u = float(x[0])
    if 0.4 < u < 0.6:
        return None
    low, depth = (0.2, 1.0) if u <= 0.4 else (0.8, 0.5)
    return Point({"f": depth + (u - low) ** 2, "g": u}, {"f": np.array([2.0 * (u - low)]), "g": np.array([1.0])})


def test_searches_avoid_points_without_a_gait_and_count_optima():
    question = DesignProblem("f", 1.0, np.array([0.0]), np.array([1.0]), {}, bowls)
    found = search_from_starts(question, np.array([0.1]), 12, seed=1)
    assert found[0].x[0] == pytest.approx(0.8, abs=1e-6)
    assert count_optima(question, found) == 2
    within = DesignProblem("f", 1.0, np.array([0.0]), np.array([1.0]), {"g": (0.0, 0.3)}, bowls)
    assert search_from_starts(within, np.array([0.1]), 4, seed=1)[0].x[0] == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ((), "needs a quantity to optimise"),
        (("design.minimise=period_s",), "needs a quantity to optimise"),
        (("design.minimise=period_s", "design.over={walker.thigh.mass_kg: [1, 2]}"), "walker.thigh.mass_kg"),
        (("design.minimise=period_s", "design.over={slope_deg: [3, 1]}"), "the lower one first"),
        (("design.minimise=period_s", "design.maximise=speed_m_s"), "remove one of them"),
        (("design.minimise=period_s", "design.over={walker.hip_mass_kg: [-5, 3]}"), "hip_mass_kg cannot be -5 kg"),
        (("design.minimise=height",), "design.minimise"),
        (
            ("design.minimise=period_s", "design.over={slope_deg: [1, 3]}", "design.keep={w: [0, 1]}"),
            "is not a gait quantity",
        ),
    ],
)  # fmt: skip
def test_invalid_questions_are_rejected(changes, said):
    with pytest.raises(ConfigError, match=said):
        run("rigid-only", *changes)


def test_values_that_the_config_rejects_have_no_gait():
    """The mass of a leg cannot lie beyond the leg."""
    over = "design.over={walker.leg_length_m: [0.6, 1.1], walker.foot_to_mass_m: [0.3, 0.9]}"
    found = run("rigid-only", "design.minimise=period_s", over, "design.starts=2")
    assert 0 < found["without_gait"] < found["evaluations"]


@pytest.mark.parametrize("key", ["contact.damping", "push_off.duration_s"])
def test_parameter_that_the_model_does_not_use_is_rejected(key):
    """Every value would be as good as any other."""
    with pytest.raises(ConfigError, match=f"{key} does not affect the rigid model"):
        run("paper", "design.minimise=period_s", f"design.over={{{key}: [1, 2]}}")


def test_impossible_bounds_give_no_answer():
    with pytest.raises(NoAnswer, match="satisfies the constraints") as raised:
        run("slope-3deg", "design.minimise=period_s", "design.over={slope_deg: [2, 3]}",
            "design.keep={step_length_m: [2, 3]}", "design.starts=2")  # fmt: skip
    said = " ".join("\n".join(answer("design", raised.value.partial.summary)).split())
    assert said.startswith("No walker was found that satisfies all constraints.")
    assert "same point" not in said


def contact_gait(name):
    """Return the step of a contact gait, and the cost of transport that `design` computes for it."""
    config = load(Path(name), ["contact.terrain=after-mid-swing"]).config
    walker = rigid_walker(config, config.equations)
    gait = find_gaits(walker).gait
    told = {"state": gait.state, "step_length_m": gait.step_length}
    here = find_model_gait("contact", config, told, Silent().note).gait_on_map()
    found = gait_off_pads(config, gait.step_length, gait.state).gait
    return config, gait, found.step, gait_quantities(here, ["cost_of_transport"])["cost_of_transport"]


@pytest.mark.parametrize("name", ["slope-3deg", "level"])
def test_contact_cost_of_transport_is_ground_loss_per_weight_and_distance(name):
    _, _, step, cost = contact_gait(name)
    assert cost == pytest.approx(step.dissipated_J.sum() / (20.0 * 9.81 * step.length_m), rel=1e-7)


def test_settled_kneed_walk_has_the_cost_of_transport_of_its_gait():
    config, gait, _, cost = contact_gait("kneed-level")
    scene, costs, ways = contact_scene(config, gait.step_length), [], []
    for steps in (14, 15):
        walk = scene.walk(start_state(scene, gait.state), steps, Tolerances("radau5", 1e-9, 1e-11, 10**8))
        ways.append(walk.touch_along_m[-1])
        costs.append(walk.driven.cost_of_transport(1.0))
    assert np.subtract(*costs) / np.subtract(*ways) == pytest.approx(cost, rel=1e-5)


def largest_at(slope_deg):
    config = load(Path("slope-3deg"), [f"slope_deg={slope_deg!r}"]).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent()).summary
    subject = find_model_gait("rigid", config, gait, lambda _: None)
    return {name: largest_disturbance(*subject.quick_by_leg(), *LARGEST[name], 50) for name in LARGEST}


def test_largest_step_up_is_maximised_and_compared_with_the_start():
    found = run(
        "slope-3deg", "design.maximise=largest_step_up_m", "design.over={slope_deg: [3, 3.8]}", "design.starts=1"
    )
    grid = [largest_at(slope)["largest_step_up_m"] for slope in np.linspace(3.4, 3.7, 3).tolist()]
    assert found["value"] >= max(grid) - 1e-5
    best = largest_at(found["best"]["slope_deg"])
    rows = {row["quantity"]: row for row in found["robustness"]}
    assert list(rows) == ["gait_sensitivity_norm", *LARGEST]
    assert found["value"] == pytest.approx(best["largest_step_up_m"], rel=1e-3)
    for name, of_start in largest_at(3).items():
        assert rows[name]["start"] == pytest.approx(of_start, rel=1e-3)
        assert rows[name]["best"] == pytest.approx(best[name], rel=1e-3)


def test_bounds_on_the_largest_push_are_kept():
    asked = ("design.minimise=speed_m_s", "design.over={slope_deg: [1, 2.5]}", "design.starts=1")
    found = run("slope-3deg", *asked, "design.keep={largest_push_backward_N_s: [0.75, 9]}")
    assert found["best"]["slope_deg"] == pytest.approx(1.52, abs=0.03)
    assert largest_at(found["best"]["slope_deg"])["largest_push_backward_N_s"] == pytest.approx(0.75, abs=1e-4)


def test_loss_of_robustness_at_the_optimum_is_reported():
    rows = [
        {"quantity": "gait_sensitivity_norm", "start": 16.3, "best": 7.2},
        {"quantity": "largest_step_down_m", "start": 0.0129, "best": 0.0226},
        {"quantity": "largest_step_up_m", "start": 0.0114, "best": 0.0073},
        {"quantity": "largest_push_forward_N_s", "start": 0.567, "best": 0.181},
        {"quantity": "largest_push_backward_N_s"},
    ]
    found = {
        "quantity": "gait_sensitivity_norm", "sense": "least", "model": "rigid", "value": 7.2, "start_value": 16.3,
        "best": {"slope_deg": 2.0}, "constraints": [], "on_bound": [], "multipliers_meet": False,
        "without_gait": 0, "evaluations": 9, "optima": 1, "starts": 1, "robustness": rows,
    }  # fmt: skip
    said = " ".join(" ".join(answer("design", found)).split())
    assert "less robust than the start: largest_step_up_m and largest_push_forward_N_s are worse" in said
    assert "largest_step_up_m 0.0114 0.0073" in said


def test_design_of_the_mass_of_one_leg_can_start_from_equal_legs():
    """Compare with the longest mean step on a grid of 17 walkers. The legs of the middle one are equal."""
    key = "walker.leg_2.leg_mass_kg"
    found = run("slope-3deg", "design.maximise=period_s", f"design.over={{{key}: [4.8, 5.2]}}", "design.starts=1")
    masses = np.linspace(4.8, 5.2, 17)
    periods = [gait_at("slope-3deg", f"{key}={mass!r}").period for mass in masses.tolist()]
    best = found["best"][key]
    assert found["start_value"] == pytest.approx(gait_at("slope-3deg").period, rel=1e-9)
    assert found["value"] >= max(periods) - 1e-9
    assert abs(best - masses[int(np.argmax(periods))]) <= 0.025
    assert found["value"] == pytest.approx(gait_at("slope-3deg", f"{key}={best!r}").period, rel=1e-8)


def test_largest_step_down_that_a_limping_walker_survives_is_that_of_its_weaker_leg():
    over = "design.over={walker.leg_2.leg_mass_kg: [4.95, 5.05]}"
    found = run("prosthesis", "design.maximise=largest_step_down_m", over, "robustness.steps=3", "design.starts=1")
    best = f"walker.leg_2.leg_mass_kg={found['best']['walker.leg_2.leg_mass_kg']!r}"
    config = load(Path("prosthesis"), (best,)).config
    gait = fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent()).summary
    legs = find_model_gait("rigid", config, gait, print).quick_by_leg()
    assert len(legs) == 2
    sizes = [largest_disturbance(leg, *LARGEST["largest_step_down_m"], 3) for leg in legs]
    assert found["value"] == pytest.approx(min(sizes), rel=1e-3)
    assert max(sizes) > 1.1 * min(sizes)
