"""Tests of the figures of robustness: sweeps over one parameter, and walks on rough ground."""

import numpy as np
import pytest
from synthetic_walks import rigid, stored

from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures import robustness
from walkerlab.views.figures.canvas import figure_style
from walkerlab.views.figures.families import MODEL_COLOURS

CUT_OFF = 40
STEPS = np.array([[[3.0, 7.0, 7.0, 20.0], [40.0, 12.0, 40.0, 40.0]]])


@pytest.fixture
def rough():
    walk = rigid()
    ground = np.array([1e-3, -2e-3] * 5)[: walk["steps"]["touch_along_m"].size]
    steps = Group({**walk["steps"].variables, "foothold_height_m": Variable(ground, ("step",), "m", "height")})
    walks = {
        "model": Variable(np.array(["rigid"]), ("model",), "", "model"),
        "roughness_m": Variable(np.array([2e-3, 1e-3]), ("roughness",), "m", "roughness"),
        "cut_off_at": Variable(np.array([CUT_OFF]), ("model",), "1", "last step"),
        "steps": Variable(STEPS, ("model", "roughness", "walk"), "1", "steps"),
    }
    groups = {"rough_walk/trajectory": walk["trajectory"], "rough_walk/steps": steps, "rough_steps": Group(walks)}
    return {"robustness": stored("robustness", groups, {})}


def test_fraction_still_walking_drops_at_failures_but_not_at_the_cut_off(rough):
    with figure_style():
        figure, _ = robustness.FIGURE_18.draw(rough)
    for walks, line in zip(STEPS[0], figure.axes[2].lines, strict=True):
        at, share = line.get_data()
        for count in (1, 3, 5, 7, 12, 39):
            told = share[np.flatnonzero(at <= count)[-1]]
            assert told == np.mean(walks > count), count
        assert at.max() == walks.max()


def test_foothold_heights_are_drawn_under_the_walker(rough):
    with figure_style():
        figure, _ = robustness.FIGURE_18.draw(rough)
    heights = rough["robustness"]["rough_walk/steps"]["foothold_height_m"]
    bars = [bar.get_height() for bar in figure.axes[1].patches]
    assert bars == pytest.approx([0.0, *(1e3 * heights)])
    assert "2 mm (s.d.) roughness" in robustness.FIGURE_18.render(rough).caption


def test_missing_rough_ground_walks_are_mentioned():
    why = robustness.FIGURE_18.why_left_out({"robustness": stored("robustness", {}, {})}, {})
    assert "rough ground" in why


def test_walk_that_falls_in_its_first_step_has_no_figure(rough):
    result = rough["robustness"]
    groups = {name: group for name, group in result.groups.items() if name != "rough_walk/steps"}
    why = robustness.FIGURE_18.why_left_out({"robustness": stored("robustness", groups, {})}, {})
    assert "no step" in why


def swept(count=5):
    x = np.linspace(1.0, 3.0, count)
    numbers = {"gaits.{}.gait_sensitivity_norm": 20.0 + (x - 2.0) ** 2, "gaits.{}.spectral_radius": 0.2 * x}
    numbers |= {"largest_step.{}.down_m": 0.01 * x, "largest_step.{}.up_m": 0.005 * x, "gaits.{}.speed_m_s": 0.3 * x}
    found = {"slope_deg": Variable(x, ("slope_deg",), "deg", "slope")}
    for k, model in enumerate(MODEL_COLOURS):
        found |= {name.format(k): Variable(y + k, ("slope_deg",), "1", name) for name, y in numbers.items()}
        for table in ("gaits", "largest_step"):
            found[f"{table}.{k}.model"] = Variable(np.array([model] * count), ("slope_deg",), "", "model")
    return Group(found)


def test_sweep_figure_shows_both_models_and_names_the_least_sensitive_gait():
    illustration = robustness.sweep_illustration(swept(), ("slope_deg",))
    assert illustration.heading == "Figure 17. Robustness over one parameter"
    assert illustration.say("seen").startswith("Four stacked plots")
    drawing = illustration.render({})
    assert "The rigid model's least sensitive gait is at 2 deg, with a norm of 20 s/m" in drawing.caption
    assert "The contact model's least sensitive gait is at 2 deg, with a norm of 21 s/m" in drawing.caption
    assert "speed (m/s)" in drawing.svg.decode()


def test_only_a_robustness_sweep_over_one_parameter_is_drawn():
    assert robustness.can_be_drawn(swept(), ("slope_deg",))
    assert not robustness.can_be_drawn(swept(), ("slope_deg", "walker.hip_mass_kg"))
    assert not robustness.can_be_drawn(Group({}), ("slope_deg",))


def driven(slope, impulse):
    values = {"slope_deg": slope, "impulse_N_s": impulse, "gaits.0.speed_m_s": [0.2, 0.4, 0.3, 0.6]}
    values |= {"gaits.0.cost_of_transport": [0.01, 0.02, 0.005, 0.01], "largest_step.0.down_m": [1e-3] * 4}
    values |= {"gaits.0.gait_sensitivity_norm": [30.0, 20.0, 50.0, 40.0], "outcome": [1.0] * 4}
    return Group({name: Variable(np.array(one), ("point",), "1", name) for name, one in values.items()})


def test_drives_are_distinguished_by_their_nonzero_parameter():
    names = ("slope_deg", "impulse_N_s")
    group = driven([1.0, 2.0, 0.0, 0.0], [0.0, 0.0, 2.0, 4.0])
    found = robustness.actuations(group, names)
    assert {name: points.tolist() for name, points in found.items()} == {
        "slope_deg": [True, True, False, False],
        "impulse_N_s": [False, False, True, True],
    }
    drawing = robustness.sweep_illustration(group, names).render({})
    assert "Driven by the slope, the least sensitive gait walks at 0.4 m/s, with a norm of 20 s/m" in drawing.caption
    assert "Driven by the push-off, the least sensitive gait walks at 0.6 m/s" in drawing.caption
    assert robustness.actuations(driven([1.0, 2.0, 1.0, 0.0], [0.0, 0.0, 2.0, 4.0]), names) is None
    assert robustness.actuations(group, ("slope_deg",)) is None
