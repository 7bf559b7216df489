"""Tests of the extreme cases of a scene: which cases each walker has, and how cases of every walker are measured."""

from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import dotted_keys
from walkerlab.config.schema import Config
from walkerlab.evidence.verification.catalogue import PHYSICAL_ENDS, STOPPED_ENDS, scale_config, scene_cases, to_twin
from walkerlab.evidence.verification.judge import CaseCell
from walkerlab.evidence.verification.stability import resolve_scene
from walkerlab.evidence.verification.starts import RigidMasses, energy_gain, feet_off_the_slope
from walkerlab.physics.mechanics.impact import strike
from walkerlab.physics.mechanics.rigid_model import AT_STRIKE, STANCE, kinetic_energy
from walkerlab.physics.orbits.similarity import Units
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import Keys
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker

OTHERS = ("kneed", "kneed-round-feet", "round-feet", "torso")
GAIT = {"state": [-0.2889854602533978, 0.18818546025339777, -0.2889854602533978,
                  -0.05714810633751748, -1.1095873311765583, -0.05714810633751748],
        "step_length_m": 0.4726567858005637}  # fmt: skip
COMPLIANT = "walker.knee={lock: compliant, stop_stiffness: 1.0e+4}"


def config_of(name, *sets):
    return load(Path(name), sets).config


def cases_of(config, gait=GAIT):
    return {
        case.name: (case, own) for case, own in scene_cases(resolve_scene(config, {"fixedpoint": Content({}, gait)}))
    }


def start_of(config):
    """Return a start in motion, with both feet on the slope, straight knees and the torso on the bisector."""
    model = rigid_walker(config, "corrected")
    bodies = len(model.zero_state) // 2
    stance = 0.2
    swing = -2.0 * (config.slope_rad + config.walker.lean_rad) - stance
    more = 0.5 * (swing + stance) if config.walker.torso is not None else swing
    rates = (-0.4, -1.1, -0.75 if config.walker.torso is not None else -0.4)
    return model, np.array([*(swing, stance, more)[:bodies], *rates[:bodies]])


def test_kneed_scene_covers_every_family_of_cases():
    cases = cases_of(config_of("kneed"))
    assert {case.family for case, _ in cases.values()} == {"walkers", "ground", "knees", "slopes", "starts", "numerics"}
    assert 12 <= len(cases) <= 20
    assert all(set(case.expected) <= {*PHYSICAL_ENDS, "budget-exhausted"} for case, _ in cases.values())
    assert {name for name, (case, _) in cases.items() if case.twin} == {"scene-rigid", "scene-as-it-is"}


@pytest.mark.parametrize(
    ("name", "sets", "knees"),
    [
        ("kneed", (), {"scene-released-at-touch"}),
        ("kneed", (COMPLIANT,), {"scene-released-at-touch", "scene-stop-times-10", "scene-stop-over-10"}),
        ("round-feet", (), set()),
    ],
)
def test_knee_cases_exist_only_for_knees_and_stops(name, sets, knees):
    gait = GAIT if name == "kneed" else {"state": [-0.22, 0.2, -1.1, -1.4], "step_length_m": 0.2}
    cases = cases_of(config_of(name, *sets), gait)
    assert {name for name, (case, _) in cases.items() if case.family == "knees"} == knees


def test_every_case_has_a_different_config():
    cases = cases_of(config_of("kneed", COMPLIANT))
    for case, own in cases.values():
        assert Config.model_validate(own.model_dump()) == own, case.name
    assert len({own.model_dump_json() for case, own in cases.values() if case.model == "contact"}) >= len(cases) - 5


def test_scene_without_contact_is_tested_in_the_rigid_model_only():
    assert {case.model for case, _ in cases_of(config_of("kneed", "contact=null")).values()} == {"rigid"}


@pytest.mark.parametrize("slope", ["scene-level", "scene-twice-as-steep"])
def test_changed_slope_keeps_both_feet_on_the_ground(slope):
    _, own = cases_of(config_of("kneed"))[slope]
    masses = RigidMasses(assembly_of(own.walker, rigid=True), own.slope_rad)
    assert feet_off_the_slope(masses.poses(np.array([own.start]))) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("name", ["scene-friction-0", "scene-standing-still", "scene-rigid"])
def test_kneed_case_passes_every_check(name):
    case, own = cases_of(config_of("kneed"))[name]
    result, *ordinary = CaseCell(case, own).run()
    assert result.failures == ()
    assert ordinary == []
    if case.expected == STOPPED_ENDS:
        assert result.outcome != "walked"


@pytest.mark.parametrize("name", OTHERS)
def test_heel_strike_conserves_summed_momentum_of_any_walker(name):
    config = config_of(name)
    model, before = start_of(config)
    after = np.zeros(before.size)
    strike(model, model, AT_STRIKE, before, after)
    masses = RigidMasses(assembly_of(config.walker, rigid=True), config.slope_rad)
    poses = masses.poses(before[None]), masses.poses(after[None])
    assert feet_off_the_slope(poses[0]) < 1e-12
    assert masses.momentum_change(*poses) < 1e-12
    assert energy_gain(*poses) == 0.0
    wrong = after.copy()
    wrong[after.size // 2 + STANCE] *= 1.0 + 1e-6
    assert masses.momentum_change(poses[0], masses.poses(wrong[None])) > 1e-8


@pytest.mark.parametrize("name", OTHERS)
def test_summed_kinetic_energy_equals_that_of_the_equations(name):
    config = config_of(name)
    model, state = start_of(config)
    masses = RigidMasses(assembly_of(config.walker, rigid=True), config.slope_rad)
    assert masses.poses(state[None])[0].kinetic == pytest.approx(
        kinetic_energy(model, tuple(state.tolist())), rel=1e-12
    )


@pytest.mark.parametrize(("name", "sets"), [("kneed", (COMPLIANT,)), ("round-feet", ()), ("torso", ())])
def test_scaling_a_walker_up_and_down_again_restores_it(name, sets):
    config = config_of(name, *sets)
    by = to_twin(config)
    twin = scale_config(config, by)
    assert twin.walker.total_mass_kg == pytest.approx(by.mass * config.walker.total_mass_kg)
    again = scale_config(twin, Units(1.0 / by.length, 1.0 / by.mass, 1.0 / by.time))
    assert numbers_of(again.walker.model_dump()) == pytest.approx(numbers_of(config.walker.model_dump()))


def numbers_of(block):
    """Yield every number of a block and of the blocks in it."""
    inner = [numbers_of(value) if isinstance(value, dict) else value for value in block.values()]
    return [x for value in inner for x in (value if isinstance(value, list) else [value]) if isinstance(x, float)]


def test_every_scene_uses_the_same_problems_with_known_answers():
    stage = PIPELINE["known-problems"]
    slices = [Keys().identity(stage, config_of(name), {}).config_slice for name in ("kneed", "paper")]
    assert slices == [{}, {}]


def test_verification_ignores_the_scene_if_it_has_the_walker_of_the_paper():
    stage = PIPELINE["stability"]
    steep, paper = (Keys().identity(stage, config_of(name), {}).config_slice for name in ("slope-3deg", "paper"))
    assert steep == paper
    assert {"walker", "contact", "solver", "stability.cases"} <= set(dotted_keys(stage.takes_under(config_of("kneed"))))
    assert stage.inputs(config_of("slope-3deg")) == ("known-problems",)
    assert stage.inputs(config_of("kneed")) == ("known-problems", "fixedpoint")
