"""Tests of the stage `engines`: messages about runs, and about engines that are not installed."""

from dataclasses import dataclass, replace

import pytest
from synthetic_engines import ROWS, SWINGS, TUNING, content, row, truth

from walkerlab.config.loader import load
from walkerlab.errors import NoAnswer
from walkerlab.evidence.benchmarks.engines import registry
from walkerlab.evidence.benchmarks.engines import stage as engines
from walkerlab.evidence.benchmarks.engines.experiments import ADAPTIVE_TOLERANCES, EngineOnScene, TaskLost
from walkerlab.evidence.benchmarks.engines.registry import PHYSICS_ENGINES, Engine
from walkerlab.evidence.benchmarks.engines.stage import closest, ratios, supported_scene, three_digits
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.results import Keys
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.artifact import differences

ABSENT = Engine("absent", "no_such_engine_module")


def test_missing_engine_is_reported_with_its_install_command(monkeypatch):
    monkeypatch.setattr(engines, "PHYSICS_ENGINES", {"absent": ABSENT})
    assert engines.missing_engines() == [
        {"what": "engine absent", "why": "not installed: pip install absent"},
    ]


def test_without_engines_the_advice_is_to_install_the_extra(monkeypatch):
    monkeypatch.setattr(engines, "installed", lambda: ())
    with pytest.raises(NoAnswer) as caught:
        engines.run(load().config, {}, Silent())
    assert "walkerlab[engines]" in caught.value.advice


def test_engine_version_changes_the_result_key(monkeypatch):
    config = load().config
    monkeypatch.setattr(registry, "installed", lambda: (ABSENT,))
    monkeypatch.setattr(Engine, "version", "1.0")
    before = Keys().identity(PIPELINE["engines"], config, {}).config_slice
    monkeypatch.setattr(Engine, "version", "1.1")
    after = Keys().identity(PIPELINE["engines"], config, {}).config_slice
    assert list(differences("", before, after)) == ["programs.absent 1.0 -> 1.1"]


def install(folder, name, version):
    information = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")


@pytest.mark.parametrize("installed", [{"robot-core": "4.1"}, {"robot-core": "4.1", "robot": "4.0"}, {"robot": "4.1"}])
def test_engine_version_is_that_of_its_library(installed, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    for name, version in installed.items():
        install(tmp_path, name, version)
    assert Engine("robot", "robot", "robot-core").version == "4.1"


def test_mujoco_core_package_is_sufficient(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    install(tmp_path, "mujoco-core", "4.0.1")
    assert PHYSICS_ENGINES["mujoco"].version == "4.0.1"


@dataclass
class LosesEverything:
    lost: TaskLost
    asked: int = 0

    def do(self, _task, _timeout_s):
        self.asked += 1
        return self.lost


@pytest.mark.parametrize(
    ("lost", "outcome", "rungs"),
    [
        (TaskLost("the engine's process ended with code -11"), "solver-failed", 8),
        (TaskLost("", True), "budget-exhausted", 1),
    ],
    ids=["crash", "time-out"],
)
def test_failed_run_is_a_row_and_a_timed_out_run_is_not_refined(lost, outcome, rungs):
    scene = supported_scene(load().config, 0.37, (-0.2042, 0.1694, -0.6058, -0.861))
    engine = replace(ABSENT, name="exudyn")
    runs = EngineOnScene(engine, scene, truth(), LosesEverything(lost)).same_law()
    rows = [one for one in runs if one.integrator == "DOPRI5 adaptive"]
    assert len(rows) == min(rungs, len(ADAPTIVE_TOLERANCES))
    assert {(one.outcome, one.why, one.error) for one in rows} == {(outcome, lost.reason, None)}


def test_every_engine_adapter_uses_known_integrators_and_states_what_it_cannot_express():
    for engine in PHYSICS_ENGINES.values():
        adapter = engine.adapter()
        assert set(adapter.CONTACTS.values()) <= set(adapter.INTEGRATORS)
        assert adapter.CANNOT_EXPRESS


def test_speed_ratios_use_the_fastest_sufficiently_accurate_runs():
    found = ratios(ROWS)
    # Ours takes 5 ms at 1e-3. MuJoCo takes 0.4 s, because its run of 0.1 s is not accurate enough.
    assert found["1e-3"]["mujoco"] == pytest.approx(0.4 / 0.005)
    assert "mujoco" not in found["1e-5"]
    assert found["1e-5"]["drake"] == pytest.approx(2.0 / 0.006)


def test_closest_contact_is_chosen_by_the_error_at_the_smallest_step_size():
    best = closest(ROWS)
    assert (best["engine"], best["contact"]) == ("drake", "lagged")
    assert best["period_error_s"] == pytest.approx(6e-4)


def test_contact_whose_walk_is_unfinished_is_not_chosen_as_closest_to_the_force_law():
    fallen = [replace(one, error=None, outcome="fell") if one.engine == "drake" else one for one in ROWS]
    assert closest(fallen)["engine"] == "mujoco"


def test_step_size_suffices_only_if_it_and_all_smaller_ones_give_three_digits():
    steps = three_digits(ROWS, truth())
    assert steps["same-law"] == {"mujoco RK4": 1e-4, "drake runge_kutta3": 2e-4}
    # The period with MuJoCo's own contact is 0.7125 and 0.7126 at the two smallest steps, and 0.675 at the largest.
    assert steps["own-law"]["mujoco soft"] == pytest.approx(2.5e-4)


def test_conclusion_names_the_closest_contact_with_cost_and_step_size():
    text = content().summary["conclusions"]["compass"]["own-law"]
    assert text.startswith("The contact closest to ADAMS's law is 'lagged' of drake")
    assert "differs by 0.6 ms from" in text
    assert "fell after 3 steps" in text


def test_converged_and_changing_periods_are_distinguished():
    rows = [replace(one, period_s=0.71251) if one.period_s == 0.7125 else one for one in ROWS]
    rows = [replace(one, period_s=0.71252) if one.period_s == 0.7126 else one for one in rows]
    text = content(rows).summary["conclusions"]["compass"]["own-law"]
    assert "their difference is due to the model: mujoco soft by 0.01 ms." in text
    # The periods are off by 4.9 and 0.6 ms.
    assert "still changes these periods: drake lagged by 4.3 ms." in text


def test_ratio_of_errors_over_the_last_halving_of_the_step_is_reported():
    found = content().summary["convergence"]["compass"]["same-law"]
    assert found["mujoco RK4"] == pytest.approx(4e-3 / 6e-4)
    assert "divides the error by mujoco RK4 6.7" in content().summary["conclusions"]["compass"]["same-law"]


def test_stored_result_does_not_depend_on_run_times():
    slower = [replace(one, wall_s=3.0 * one.wall_s) for one in ROWS]
    assert content(slower).digest() == content().digest()
    other = [replace(one, period_s=one.period_s and one.period_s + 1e-9) for one in ROWS]
    assert content(other).digest() != content().digest()


def test_rows_have_the_documented_keys():
    keys = {"engine", "version", "experiment", "step_s", "error", "wall_s", "period_s", "step_length_m", "outcome"}
    assert all(keys <= set(one) for one in content().summary["rows"])


def test_complete_tables_are_stored():
    stored = content()
    assert stored["rows"].variables["engine"].values.size == len(ROWS)
    assert stored["swings"].variables["order"].values.size == len(SWINGS)
    assert stored["tuning"].variables["target"].values.size == len(TUNING)


def test_start_with_scaled_velocities_has_the_same_angles():
    scene = supported_scene(load().config, 0.37, (-0.2042, 0.1694, -0.6058, -0.861))
    slower = scene.scale_start(0.95)
    assert slower.start[:4] == scene.start[:4]
    assert slower.start[4:] == pytest.approx([0.95 * x for x in scene.start[4:]])


def test_rows_of_scaled_starts_do_not_count_for_the_closest_contact():
    other = row("drake", "lagged", "own-law", 2.5e-4, 1e-9, 1.0, 0.711, start=0.95)
    assert closest([*ROWS, other])["period_error_s"] == pytest.approx(6e-4)
