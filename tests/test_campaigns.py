"""Run short versions of the campaigns in scripts/: kills, parallel runs, fuzzed configs, damage, random
walkers, speed.
"""

import importlib.util
import sys
from pathlib import Path

import pytest

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.evidence.verification.section import section
from walkerlab.evidence.verification.stability import summarise
from walkerlab.evidence.verification.verdict import CaseResult
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.page import Page, render

SCRIPTS = Path(__file__).parent.parent / "scripts"
MARKUP = "<script>alert(1)</script>"


def script(name):
    sys.path.insert(0, str(SCRIPTS))  # Python does the same for a script that is run.
    spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def fuzz():
    return script("fuzz_campaign")


@pytest.fixture(scope="module")
def kill():
    return script("kill_campaign")


def test_fuzzed_configs_are_simulated_or_raise_config_error(fuzz):
    fates, wrong = fuzz.fuzz_configs(150, seed=1)
    assert wrong == []
    assert fates["refused with its position"] > 20
    assert sum(fates.values()) == 150


def test_damaged_results_are_rejected(fuzz):
    fates, wrong = fuzz.damage_results(40, seed=1)
    assert wrong == []
    assert fates["not accepted"] > 20


def test_killed_runs_lose_nothing(kill):
    moments, lost = kill.campaign("simulate", "rigid-only", kills=3, seed=1)
    assert lost == []
    assert sum(moments.values()) == 3


def test_runs_killed_during_any_stage_lose_nothing(kill):
    moments, lost = kill.spread("simulate", "rigid-only", kills=2, seed=1)
    assert lost == []
    assert sum(moments.values()) == 2


def test_two_runs_at_once_do_not_disturb_each_other(kill):
    assert kill.together("simulate", "rigid-only", [2]) == []


def test_both_gaits_of_random_walkers_with_light_hips_are_found():
    assert script("walker_campaign").tally("light-hips", 12, seed=1).wrong == []


def test_short_landings_on_rough_ground_agree_with_an_independent_integrator():
    """The random walks include landings just ahead of the other foot, which must not count as steps."""
    found = script("walker_campaign").tally("straight-legs", 8, seed=1)
    assert found.wrong == []
    assert found.short_landings > 0


@pytest.mark.parametrize("name", ["straight-legs", "parts", "torso", "kneed-torso", "kneed-torque"])
def test_disturbances_of_random_gaits_decay_at_the_rate_of_their_multipliers(name):
    found = script("walker_campaign").tally(name, 6, seed=2)
    assert found.wrong == []
    assert found.steps_seen > 0
    assert sum(found.ends.values()) == 6


def test_benchmark_compares_methods_of_sufficient_accuracy(monkeypatch):
    benchmark = script("benchmark")
    monkeypatch.setattr(benchmark, "LADDER", (1e-10, 1e-11, 1e-12))
    against_numpy, against_ours, smallest = benchmark.rigid_lines(benchmark.Stopwatch(1, 0.0))
    assert " x: dop853 " in against_numpy.measured
    assert " x: dop853 " in against_ours.measured
    # This row is about an error and not about a time, so it must not be missed on any machine.
    assert smallest.verdict != benchmark.MISSED


@pytest.mark.parametrize("name", ["../../x", "a/b", "..", "-x", MARKUP, "x\n", ""])
def test_run_name_cannot_escape_the_runs_folder(name):
    with pytest.raises(ConfigError):
        load(sets=[f"name={name!r}"])


def test_case_texts_are_escaped_in_the_page():
    case = CaseResult("x", "own", "contact", MARKUP, ("walked",), "fell", 0, 0.0, 1, 0.1, (), (MARKUP,))
    summary = summarise([case], [], [])
    stability = type("Stored", (), {"summary": summary, "groups": {}})()
    page = render(Page("title", (section(Results(None, {"stability": stability})),)))
    assert MARKUP not in page
    assert "&lt;script&gt;" in page


def test_trailing_foot_keeps_slipping_on_stiffer_ground_unlike_in_the_rigid_impact():
    script("flip_shift")
    trailing = script("trailing_foot")
    losses, shares = [], []
    for ground in trailing.GROUNDS[:2]:
        walker, y = trailing.at_touch(ground, "paper", 4.2)
        free = trailing.freed(walker, y)
        found = trailing.strike(walker, y)
        losses.append(free.slip - found.slips)
        shares.append(found.share)
        assert found.rises > free.vertical_velocity
    assert all(0.005 < loss < 0.02 for loss in losses)
    assert losses[1] > losses[0]
    assert all(0.0005 < share < 0.002 for share in shares)
