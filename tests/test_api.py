"""Tests of the Python interface."""

import ast
import copy
import doctest
import inspect
import itertools
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import walkerlab
from walkerlab import api
from walkerlab.code_digest import Sources
from walkerlab.config.contact import Contact
from walkerlab.config.loader import load
from walkerlab.config.walkers import CompassWalker, Kneed
from walkerlab.errors import ConfigError, NoAnswer, StaleError

OFFERED = {name: getattr(api, name) for name in api.__all__}
DESCRIBED = [name for name, offer in OFFERED.items() if offer.__module__.startswith("walkerlab.api")]


@pytest.mark.parametrize("module", ["memory", "models", "results", "runs"])
def test_docstring_examples_show_the_actual_output(module, tmp_path):
    names = {**OFFERED, "folder": tmp_path}
    found = doctest.testmod(sys.modules[f"walkerlab.api.{module}"], extraglobs=names)
    assert found.attempted > 5
    assert found.failed == 0


@pytest.mark.parametrize("name", DESCRIBED)
def test_public_names_describe_arguments_and_show_an_example(name):
    text = OFFERED[name].__doc__
    assert "\n    >>> " in text or "\n>>> " in inspect.cleandoc(text)
    if inspect.isfunction(OFFERED[name]):
        code = OFFERED[name].__code__
        arguments = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        assert [each for each in arguments if not re.search(rf"^ *{each}  +\S", text, re.MULTILINE)] == []
        assert {"Returns", "Raises"} <= {*text.split()}


def test_python_interface_does_not_use_the_type_any():
    texts = [path.read_text() for path in Path(api.__file__).parent.glob("*.py")]
    assert len(texts) > 3
    assert not any(re.search(r"\bAny\b", text) for text in texts)


def test_every_public_name_exists_and_has_a_docstring():
    for name in walkerlab.__all__:
        assert getattr(walkerlab, name).__doc__
    assert set(walkerlab.__all__) <= set(dir(walkerlab))
    with pytest.raises(AttributeError, match="no attribute 'sprint'"):
        _ = walkerlab.sprint


def test_type_stub_lists_the_same_names():
    stub = ast.parse((Path(walkerlab.__file__).parent / "__init__.pyi").read_text())
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    assert [(node.module, node.names[0].name) for node in imports] == [("walkerlab.api", "*")]
    assert walkerlab.__all__ == api.__all__


def test_importing_the_package_loads_no_third_party_package():
    command = "import sys; before = set(sys.modules); import walkerlab; print(*(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert loaded <= {"walkerlab"} | sys.stdlib_module_names


def test_stages_do_not_depend_on_the_python_interface():
    """If they did, editing a docstring of the interface would make every result out of date."""
    names = {module.name for module in Sources().closure("walkerlab.pipeline.stages.fixedpoint")}
    assert "walkerlab" in names
    assert "walkerlab.api" not in names


def test_python_rejects_a_case_name_that_the_catalogue_uses(tmp_path):
    case = {"name": "moon", "expected": ["walked"], "reason": "a name that is taken"}
    with pytest.raises(ConfigError, match="The catalogue already has cases named moon"):
        walkerlab.run("fixedpoint", set={"stability.cases": [case]}, runs=tmp_path)


IN_GRAMS = {"walker.leg_mass_kg": 5000}


@pytest.mark.parametrize(
    "ask",
    [
        lambda runs: walkerlab.run("fixedpoint", set=IN_GRAMS, runs=runs),
        lambda runs: walkerlab.sweep("fixedpoint", {"slope_deg": [1]}, set=IN_GRAMS, runs=runs, jobs=1),
        lambda _: walkerlab.find_gait(walkerlab.compass(leg_mass_kg=5000)),
    ],
    ids=["run", "sweep", "in memory"],
)
def test_warnings_of_the_command_line_are_python_warnings(ask, tmp_path):
    with pytest.warns(UserWarning, match="^[^:]*walker.leg_mass_kg.* masses are in kg, not in g$") as said:
        ask(tmp_path)
    assert {one.filename for one in said} == {__file__}


def test_python_call_warns_of_a_moved_start():
    with pytest.warns(UserWarning, match="^start: theta_1 moved from -0.2 to "):
        walkerlab.simulate(slope_deg=1, start=[-0.2, 0.17, -0.6, -0.86], strides=1)


def test_python_and_command_line_share_runs(tmp_path):
    result = walkerlab.run("simulate", set={"slope_deg": 2}, runs=tmp_path, strides=1)
    assert result.artifact == tmp_path / "paper@slope_deg=2,strides=1" / "simulate.h5"
    assert result.summary["stage"] == "simulate"
    assert result.summary["steps"] == 2
    again = walkerlab.run("simulate", set={"slope_deg": 2}, runs=tmp_path, strides=1)
    assert again.summary["reused"]
    opened = walkerlab.open_run("paper@slope_deg=2,strides=1", tmp_path)
    assert opened.stages == ("fixedpoint", "simulate")
    assert opened.config.strides == 1
    assert opened.result("simulate").summary["steps"] == 2
    with pytest.raises(StaleError, match="tune"):
        opened.result("tune")


def test_result_in_memory_equals_the_stored_one_and_writes_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    walk = walkerlab.simulate(slope_deg=2, strides=1)
    assert not list(tmp_path.iterdir())
    stored = walkerlab.run("simulate", set={"slope_deg": 2}, strides=1)
    assert {key: stored.summary[key] for key in walk.summary if key != "left_out"} == {
        key: value for key, value in walk.summary.items() if key != "left_out"
    }
    assert walk.dataset("steps").equals(stored.dataset("steps"))


def test_missing_gait_is_returned_as_a_value():
    gait = walkerlab.find_gait(slope_deg=-1)
    assert "no gait at a slope" in gait.no_answer
    walk = walkerlab.simulate(slope_deg=-1)
    assert walk.no_answer.startswith("it needs fixedpoint: no gait")
    assert walk.summary == {}


def test_impossible_arguments_are_rejected():
    with pytest.raises(ConfigError, match=r"did you mean walker\.hip_mass_kg"):
        walkerlab.compass(hip_mas_kg=3)
    with pytest.raises(ConfigError, match="unknown stage"):
        walkerlab.run("walk")
    with pytest.raises(KeyError, match="its groups"):
        walkerlab.find_gait().dataset("gaits")
    with pytest.raises(ConfigError, match="there is no run"):
        walkerlab.open_run("nothing", Path("nowhere"))


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (lambda: walkerlab.find_gait(5), "walker: 5 is not a walker block"),
        (lambda: walkerlab.simulate(contact={"stiffness": 1e5}), "is not a contact block"),
        (lambda: walkerlab.basin(cells=50), r"basin\.cells: 50 is not a list"),
        (lambda: walkerlab.continue_gait(span=0.1), r"span: 0\.1 is not a pair of numbers"),
        (lambda: walkerlab.find_gait(slope_deg="steep"), "'steep' is not a number"),
        (lambda: walkerlab.find_gait(slope_deg=3, slope_rad=0.05), "slope already set by"),
    ],
)
def test_arguments_that_are_not_a_config_are_rejected(asked, message):
    with pytest.raises(ConfigError, match=message):
        asked()


def test_omitted_arguments_default_to_the_built_in_config(monkeypatch):
    asked = []
    monkeypatch.setattr("walkerlab.api.memory.run_in_memory", lambda stage, config: asked.append(config))
    walkerlab.find_gait()
    walkerlab.simulate()
    walkerlab.continue_gait()
    walkerlab.basin()
    wanted = load().config.model_copy(update={"name": "memory", "source": None, "contact": None})
    assert asked == [wanted] * 4
    walkerlab.find_gait(walkerlab.kneed(), slope_deg=np.int64(3), strides=7)
    assert asked[-1].walker == walkerlab.kneed()
    assert (asked[-1].slope_rad, asked[-1].strides) == (np.deg2rad(3.0), 7)
    walkerlab.basin(cells=np.array([5, 6]), seed=2)
    assert asked[-1].basin.cells == (5, 6)
    walkerlab.continue_gait(span=(0.01, 0.02))
    assert (asked[-1].continuation.over, asked[-1].continuation.least) == ("slope_rad", 0.01)
    walkerlab.basin(basin={"steps": 10})
    assert asked[-1].basin.steps == 10


UNGUARDED = """
import sys
import walkerlab
runs, engine, jobs = sys.argv[1:]
gaits = walkerlab.sweep("fixedpoint", {"slope_deg": [1, 3]}, runs=runs, engine=engine, jobs=int(jobs))
print([round(float(period), 4) for period in gaits.period_s])
"""


def run_unguarded(tmp_path, engine, jobs, from_standard_input):
    """Return the outcome of a script that sweeps without a main guard."""
    path = tmp_path / "unguarded.py"
    path.write_text(UNGUARDED)
    return subprocess.run(
        [sys.executable, "-" if from_standard_input else str(path), str(tmp_path / "runs"), engine, jobs],
        input=UNGUARDED if from_standard_input else "",
        capture_output=True,
        text=True,
        timeout=240,
    )


@pytest.mark.parametrize("from_standard_input", [False, True], ids=["script", "stdin"])
def test_script_without_a_guard_sweeps_once(tmp_path, from_standard_input):
    done = run_unguarded(tmp_path, "local", "2", from_standard_input)
    assert done.stdout == "[0.7036, 0.7343]\n", done.stderr
    assert done.returncode == 0


def test_unknown_keyword_of_a_sweep_is_rejected(tmp_path):
    with pytest.raises(TypeError, match="smaple"):
        walkerlab.sweep("fixedpoint", {"slope_deg": "1:3"}, runs=tmp_path, smaple="sobol:4")


@pytest.mark.parametrize("from_standard_input", [False, True], ids=["script", "stdin"])
def test_missing_main_guard_is_reported_at_once(tmp_path, from_standard_input):
    pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    done = run_unguarded(tmp_path, "dask", "1", from_standard_input)
    assert done.returncode == 1
    assert "ConfigError: --engine dask: its processes did not start" in done.stderr


def test_printed_results_and_runs_fit_on_a_screen(tmp_path):
    stored = walkerlab.run("simulate", runs=tmp_path, strides=1)
    run = walkerlab.open_run(stored.artifact.parent)
    for shown in (walkerlab.find_gait(), stored, run, run.result("fixedpoint"), run.config, walkerlab.contact()):
        assert len(repr(shown)) < 24 * 80
    assert "last_step_period_s" in repr(stored)
    assert repr(run).endswith(": fixedpoint, simulate")


def test_multipliers_are_complex_numbers():
    gait = walkerlab.find_gait()
    assert isinstance(gait, walkerlab.Gait)
    assert [[one.real, one.imag] for one in gait.multipliers] == gait.summary["multipliers"]
    assert walkerlab.find_gait(slope_deg=-1).multipliers == ()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: walkerlab.run("fixedpoint", runs=5), r"^runs: 5 is not a folder"),
        (lambda: walkerlab.open_run("paper", 5), r"^runs: 5 is not a folder"),
        (
            lambda: walkerlab.sweep("fixedpoint", {"slope_deg": "[10]"}),
            r"^over slope_deg: '\[10\]' is neither a list of values nor a range",
        ),
        (
            lambda: walkerlab.sweep("fixedpoint", {"slope_deg": 10}),
            r"^over slope_deg: 10 is neither a list of values nor a range",
        ),
        (lambda: walkerlab.compass(hip_mass=20), r"^walker\.hip_mass: unknown key \(20\)"),
        (
            lambda: walkerlab.find_gait(slope_deg=1, slope_rad=1),
            r"^slope_\w+: slope already set by slope_\w+;",
        ),
        (
            lambda: walkerlab.design(over={"slope_deg": 3}, minimise="period_s"),
            r"^design.over: 3 is not a list; allowed",
        ),
        (lambda: walkerlab.design(over=3, minimise="period_s"), r"^design.over: 3 is not a block of keys; allowed"),
        (lambda: walkerlab.design(over={"slope_deg": (1, 3)}, keep=[1]), r"^design.keep: \[1\] is not a block"),
        (lambda: walkerlab.robustness(to="slope_deg"), r"^robustness.to: 'slope_deg' is not a list"),
    ],
)
def test_error_in_an_argument_has_no_file_position(call, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=said):
        call()


def test_robustness_and_design_run_in_memory():
    asked = {"model": "rigid", "steps": 5, "roughness_m": [0.002], "max_steps": 50}
    found = walkerlab.robustness(walkerlab.compass(), 3, to=["slope_deg"], walks=4, **asked)
    assert [(row["model"], row["steps"]) for row in found.summary["largest_step"]] == [("rigid", 5)]
    assert found.summary["rough_ground"][0]["cut_off_at"] == 50
    walker = walkerlab.design(
        walkerlab.compass(), over={"slope_deg": np.array([2, 3])}, maximise="speed_m_s", slope_deg=2.5, starts=1
    )
    assert walker.summary["best"] == {"slope_deg": 3.0}


def test_sweep_without_xarray_computes_nothing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ConfigError, match="a Dataset needs xarray"):
        walkerlab.sweep("fixedpoint", {"slope_deg": [1, 2]}, runs=tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_infinite_list_is_rejected(tmp_path):
    with pytest.raises(ConfigError, match="10000001 points"):
        walkerlab.sweep("fixedpoint", {"seed": itertools.count()}, runs=tmp_path / "runs")


def test_exported_model_starts_on_its_gait(tmp_path):
    walker = walkerlab.compass(foot_radius_m=0.1)
    written = walkerlab.export_model(tmp_path / "round.adm", walker, slope_deg=0.9, strides=2, law="functions")
    assert [path.name for path in written] == ["round.adm", "round.acf"]
    assert "walked, 4 steps" in written[0].read_text()
    with pytest.raises(ConfigError, match=r"round\.pdf: not a model\."):
        walkerlab.export_model(tmp_path / "round.pdf")


def test_identify_runs_in_memory():
    walk = walkerlab.simulate(slope_deg=3, strides=5, start=[-2.0 * np.radians(3.0) - 0.2253, 0.2253, -0.37, -1.1])
    summary = walk.summary
    columns = {"period_s": summary["step_periods_s"], "length_m": summary["step_lengths_m"]}
    answer = walkerlab.identify(columns, "slope-3deg", ["slope_deg"], level="steps")
    (slope,) = answer.summary["estimates"]
    assert slope["key"] == "slope_deg"
    assert slope["value"] == pytest.approx(3.0, abs=0.01)


def test_measurement_plan_runs_in_memory():
    plan = walkerlab.plan_measurements("slope-3deg", ["slope_deg"], steps=4, max_steps=6, errors={"slope_deg": 0.02})
    angles = plan.summary["measurements"][3]
    assert angles["measurement"] == "angles over time"
    assert 2 <= angles["errors"][0]["steps_needed"] <= 6


@pytest.mark.parametrize(
    ("maker", "block"),
    [(walkerlab.compass, CompassWalker), (walkerlab.kneed, Kneed), (walkerlab.contact, Contact)],
)
def test_walker_and_ground_signatures_list_every_key(maker, block):
    signature = inspect.signature(maker)
    assert set(signature.parameters) == {*block.model_fields} - {"type"}
    assert signature.return_annotation is block
    assert isinstance(maker(), block)


def test_omitted_keys_keep_their_defaults():
    walker = walkerlab.compass(leg_length_m=0.8, hip={"spring_N_m_per_rad": 1.0})
    assert (walker.leg_length_m, walker.foot_to_mass_m, walker.hip.spring_N_m_per_rad) == (0.8, 0.4, 1.0)
    assert walkerlab.kneed(thigh={"length_m": 0.4}).thigh.length_m == 0.4
    assert walkerlab.contact(friction="none", pad_pitch=0.2).pad_pitch == 0.2


def test_result_values_can_be_read_as_attributes_and_items():
    walk = walkerlab.simulate(strides=1)
    assert walk.outcome == walk["outcome"] == walk.summary["outcome"]
    assert walk.last_step_period_s == walk["last_step_period_s"] == walk.summary["step_periods_s"][-1]
    assert {"outcome", "step_periods_s", "last_step_period_s", "plot"} <= set(dir(walk))
    assert pickle.loads(pickle.dumps(walk)).outcome == copy.deepcopy(walk).outcome == "walked"


def test_missing_result_value_gives_a_hint():
    walk = walkerlab.simulate(strides=1)
    with pytest.raises(AttributeError, match=r"has no value 'outcom'\. Did you mean outcome\?"):
        _ = walk.outcom
    with pytest.raises(KeyError, match=r"has no value 'zzz'\. It has .*last_step_period_s.* and more in `summary`"):
        _ = walk["zzz"]
    with pytest.raises(AttributeError, match=r"an array: dataset\('trajectory'\).angle"):
        _ = walk.angle
    with pytest.raises(AttributeError, match="'period_s': no gait at a slope"):
        _ = walkerlab.find_gait(slope_deg=-1).period_s


def test_notebooks_show_a_result_as_tables(tmp_path):
    html = walkerlab.find_gait()._repr_html_()
    assert "there is a stable gait" in html
    assert "<td" in html
    assert "0.703597" in html
    assert walkerlab.find_gait(slope_deg=-1)._repr_html_().startswith("<p>No answer: no gait at a slope")
    hostile = api.Result("known-problems", {"name": "<script>"}, walkerlab.find_gait().content)
    assert "<script>" not in hostile._repr_html_()


@pytest.mark.parametrize(
    ("ask", "names"),
    [
        (lambda: walkerlab.simulate(strides=2), {"figure-02", "figure-07", "figure-10"}),
        (lambda: walkerlab.simulate(contact=walkerlab.contact(), strides=2), {"figure-06", "ground-forces"}),
        (lambda: walkerlab.basin(cells=(4, 4)), {"figure-15"}),
    ],
    ids=["rigid", "contact", "basin"],
)
def test_result_in_memory_can_be_plotted(ask, names):
    result = ask()
    assert names <= set(result.figures)
    for name in ("", *result.figures):
        assert result.plot(name).axes
    assert result.plot()._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ConfigError, match="has no figure circle"):
        result.plot("circle")


def test_plot_of_a_gait_shows_its_multipliers():
    gait = walkerlab.find_gait()
    (axes,) = gait.plot().axes
    points = [complex(*line.get_xydata()[0]) for line in axes.lines if line.get_marker() == "o"]
    assert points == list(gait.multipliers)
    with pytest.raises(NoAnswer, match="no gait at a slope"):
        walkerlab.find_gait(slope_deg=-1).plot()


def test_group_of_arrays_becomes_a_table_with_units():
    pytest.importorskip("pandas")
    walk = walkerlab.simulate(strides=1)
    steps = walk.to_dataframe()
    assert steps.period_s.tolist() == walk.summary["step_periods_s"]
    assert steps.index.tolist() == [0, 1]
    assert steps.attrs["units"]["length_m"] == "m"
    trajectory, data = walk.to_dataframe("trajectory"), walk.dataset("trajectory")
    assert trajectory["angle.2"].tolist() == data.angle.sel(leg=2).values.tolist()
    assert trajectory.index.tolist() == data.time.values.tolist()
    grid = walkerlab.basin(cells=(3, 4)).to_dataframe()
    assert grid.index.nlevels == 2
    assert len(grid) == 12
    with pytest.raises(KeyError, match="has no group 'walks'; its groups: steps, trajectory"):
        walk.to_dataframe("walks")


def test_table_without_pandas_raises_an_error_with_advice(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ConfigError, match="a DataFrame needs pandas") as caught:
        walkerlab.find_gait().to_dataframe()
    assert caught.value.advice == "pip install pandas"


@pytest.fixture
def mujoco():
    module = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'walkerlab[engines]'")
    yield module
    module.set_mjcb_control(None)


def test_mujoco_model_is_built_from_a_run_a_config_or_a_name(mujoco, tmp_path):
    walkerlab.run("fixedpoint", "kneed", runs=tmp_path)
    run = walkerlab.open_run("kneed", tmp_path)
    for config in (run, run.config, "kneed"):
        model, data = walkerlab.mujoco_model(config)
        assert data.qpos == pytest.approx(model.key("gait").qpos, abs=0.0)
        mujoco.mj_step(model, data, 36_000)
        # By then the swing knee has locked, at 0.3486 s.
        assert data.eq_active.all()


def test_mujoco_model_of_a_gait_starts_on_that_gait(mujoco, tmp_path):
    stored = walkerlab.run("fixedpoint", "kneed", runs=tmp_path)
    heavy = walkerlab.find_gait(walkerlab.compass(hip_mass_kg=12), slope_deg=2)
    for gait in (stored, heavy):
        model, data = walkerlab.mujoco_model(gait)
        slope = np.arctan2(model.opt.gravity[0], -model.opt.gravity[2])
        # The base body is the first stance leg.
        assert data.qpos[2] - slope == pytest.approx(gait.state[1], abs=1e-12)
        last = model.numeric("steps_in_walkerlab").data.reshape(2, -1)[:, -1]
        assert last == pytest.approx([gait.period_s, gait.step_length_m], rel=0.05)
    assert mujoco.mj_getTotalmass(model) == pytest.approx(22.0, rel=1e-12)


def test_mujoco_model_with_changed_keys_starts_in_the_new_gait(mujoco):
    gait = walkerlab.find_gait(slope_deg=2)
    _, data = walkerlab.mujoco_model(gait, slope_deg=3)
    steeper = walkerlab.find_gait(slope_deg=3)
    assert data.qpos[2] - np.deg2rad(3) == pytest.approx(steeper.state[1], abs=1e-12)


def test_mujoco_model_without_a_gait_raises_no_answer_error(mujoco):
    with pytest.raises(NoAnswer, match="no gait"):
        walkerlab.mujoco_model(walkerlab.find_gait(slope_deg=-1))


def test_mujoco_model_accepts_config_blocks_and_a_slope_option(mujoco):
    heavy = walkerlab.compass(hip_mass_kg=20)
    model, _ = walkerlab.mujoco_model("paper", slope="geometry", walker=heavy)
    assert model.body_subtreemass[model.joint("height").bodyid[0]] == pytest.approx(30.0)
    assert model.opt.gravity == pytest.approx([0.0, 0.0, -9.81])
    with pytest.raises(ConfigError, match="unknown way to express a slope"):
        walkerlab.mujoco_model("paper", slope="steep")


def test_columns_of_unequal_length_are_rejected():
    with pytest.raises(ConfigError, match="period_s 2, length_m 1"):
        walkerlab.identify({"period_s": [0.7, 0.71], "length_m": [0.4]}, fit=["slope_deg"])


def test_check_without_printed_values_asks_for_the_check_block():
    with pytest.raises(ConfigError, match="check needs a printed gait"):
        walkerlab.check("paper")
