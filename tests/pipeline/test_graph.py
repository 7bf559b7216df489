import importlib
import inspect
import pickle
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest

import walkerlab
from walkerlab.code_digest import Sources
from walkerlab.config import files
from walkerlab.config.fields import block_of
from walkerlab.config.files import BUILTIN_FOLDER, builtin_names
from walkerlab.config.loader import load
from walkerlab.config.reads import (
    CompassCasesConfig,
    ContactConfig,
    SceneCasesConfig,
    dotted_keys,
    keys_of,
    restrict,
    slice_of,
)
from walkerlab.config.schema import QUESTIONS, Config
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.results import Keys, added_code
from walkerlab.pipeline.plan.stage import Stage, results_of
from walkerlab.pipeline.store.artifact import differences

NAMES = [stage.name for stage in PIPELINE.stages]
EXPLICIT = "start=[-0.2, 0.17, -0.6, -0.86]"


def needed(target, *sets, config=None):
    return [stage.name for stage in PIPELINE.needed_for(target, load(config and Path(config), sets).config)]


@pytest.mark.parametrize("name", builtin_names())
def test_inputs_come_earlier_in_the_table(name):
    config = load(Path(name)).config
    inputs = {stage.name: {*stage.inputs(config), *stage.if_current} for stage in PIPELINE.stages}
    assert {stage: later for stage in NAMES if (later := inputs[stage] - set(NAMES[: NAMES.index(stage)]))} == {}


@pytest.mark.parametrize("name", builtin_names())
def test_keys_that_a_stage_reads_exist_in_the_config(name):
    config = load(Path(name)).config
    for stage in PIPELINE.stages:
        slice_of(config, stage.takes_under(config))


@pytest.mark.parametrize("stage", PIPELINE.stages, ids=NAMES)
def test_stage_table_and_signature_of_a_stage_name_the_same_config_types(stage):
    module = importlib.import_module(stage.module)
    named = {stage.takes_under(load(Path(name)).config) or Config for name in ("paper", "kneed")}
    first = next(iter(inspect.signature(module.run, eval_str=True).parameters.values())).annotation
    assert set(get_args(first) or (first,)) == named


@pytest.mark.parametrize("config", ["paper", "kneed"])
@pytest.mark.parametrize("stage", PIPELINE.stages, ids=NAMES)
def test_stage_receives_exactly_the_config_values_in_its_key(stage, config):
    loaded = load(Path(config)).config
    takes = stage.takes_under(loaded)
    assert shown(restrict(loaded, takes)) == (set(Config.model_fields) if takes is None else set(dotted_keys(takes)))


def shown(given):
    names = vars(given)
    parts = {name: shown(value) for name, value in names.items() if isinstance(value, SimpleNamespace)}
    return (names.keys() - parts.keys()) | {f"{name}.{key}" for name, keys in parts.items() for key in keys}


@pytest.mark.parametrize("stage", ["stability", "stability-maps"])
def test_changing_the_paper_config_changes_the_keys_of_its_cases(tmp_path, monkeypatch, stage):
    config = load(Path("rigid-only")).config
    before = Keys().identity(PIPELINE[stage], config, {}).config_slice
    text = (BUILTIN_FOLDER / "paper.yaml").read_text()
    (tmp_path / "paper.yaml").write_text(text.replace("hip_mass_kg: 10", "hip_mass_kg: 11"))
    monkeypatch.setattr(files, "BUILTIN_FOLDER", tmp_path)
    after = Keys().identity(PIPELINE[stage], config, {}).config_slice
    assert list(differences("", before, after)) == ["paper.walker.hip_mass_kg 10.0 -> 11.0"]


def test_cases_of_the_paper_apply_only_to_its_walker():
    stability = PIPELINE["stability"]
    takes = {name: stability.takes_under(load(Path(name)).config) for name in ("paper", "simplest", "torso", "kneed")}
    assert takes.pop("paper") is CompassCasesConfig
    assert set(takes.values()) == {SceneCasesConfig}
    assert stability.takes_under(load(sets=["slope_deg=3"]).config) is CompassCasesConfig
    assert stability.takes_under(load(sets=["walker.hip_mass_kg=9"]).config) is SceneCasesConfig


@pytest.mark.parametrize("stage", ["simulate", "fixedpoint"])
def test_walk_without_an_error_estimate_has_a_different_key(stage):
    config, keys = load().config, Keys()
    once, twice = (keys.identity(PIPELINE[stage], config, {}, again).key for again in (False, True))
    assert once != twice


def test_documented_stages_exist_in_order():
    fixed = ["fixedpoint", "simulate", "contact-sim", "compare", "plot", "report"]
    assert [name for name in NAMES if name in fixed] == fixed


def test_report_is_the_last_stage():
    assert PIPELINE.stages[-1].name == "report"


def test_every_block_that_no_model_reads_belongs_to_a_stage():
    blocks = {name for name, field in Config.model_fields.items() if block_of(field) is not None}
    assert blocks - set(keys_of(ContactConfig)) - {"ground", "solver", "source"} == set(QUESTIONS)


def test_stage_needs_direct_and_indirect_inputs():
    assert needed("fixedpoint") == ["fixedpoint"]
    assert needed("simulate") == ["fixedpoint", "simulate"]
    assert needed("compare") == ["fixedpoint", "simulate", "contact-sim", "compare"]
    assert needed("report")[-1] == "report"


def test_given_start_needs_no_gait():
    assert needed("simulate", EXPLICIT) == ["simulate"]
    assert needed("contact-sim", EXPLICIT, "contact.pad_pitch=0.37") == ["contact-sim"]


def test_pads_at_the_rigid_step_length_always_need_the_gait():
    assert needed("contact-sim", EXPLICIT, "contact.pad_pitch=rigid") == ["fixedpoint", "contact-sim"]


@pytest.mark.parametrize("terrain", ["plane", "after-mid-swing"])
def test_given_start_needs_no_gait_on_ground_without_pads(terrain):
    assert needed("contact-sim", EXPLICIT, f"contact.terrain={terrain}") == ["contact-sim"]


def test_stages_of_equal_name_are_rejected():
    with pytest.raises(ValueError, match="the same name"):
        Graph(Stage("a", "m", "", object), Stage("a", "n", "", object))


def test_graph_without_an_import_path_cannot_be_pickled():
    with pytest.raises(TypeError, match="import path"):
        pickle.dumps(Graph(Stage("a", "m", "", object)))


def test_results_of_returns_the_same_inputs_for_every_config():
    assert results_of("a", "b")(load().config) == ("a", "b")


def test_importing_the_stage_table_loads_no_heavy_packages():
    heavy = "'numpy', 'h5py', 'scipy', 'numba', 'pydantic', 'ruamel'"
    code = f"import sys, walkerlab.pipeline.plan.graph; print([name for name in ({heavy}) if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


DRAW = {stage.name for stage in PIPELINE.stages if stage.draws}
EVIDENCE = ("compare", "tune", "accuracy", "engines", "known-problems", "stability", "stability-maps")


@pytest.fixture(scope="module")
def made_of():
    sources = Sources()
    return {stage.name: {module.name for module in sources.closure(stage.module)} for stage in PIPELINE.stages}


@pytest.mark.parametrize("stage", EVIDENCE)
def test_editing_an_evidence_stage_changes_only_its_key(made_of, stage):
    assert {name for name in set(made_of) - DRAW if PIPELINE[stage].module in made_of[name]} == {stage}


@pytest.mark.parametrize("stage", [stage.name for stage in PIPELINE.stages if not stage.draws])
def test_results_do_not_depend_on_the_registries(made_of, stage):
    registries = {
        "walkerlab.pipeline.plan.graph",
        "walkerlab.views.figures.stage",
        "walkerlab.views.report.registry",
    }
    registries |= {f"walkerlab{code.partition(':')[0]}" for code in walkerlab.EXTENSIONS.values()}
    assert not registries & made_of[stage]


LAW = "walkerlab.evidence.paper.law:as_printed"
COMPASS = ["equations=as-printed", "slope_deg=1"]


@pytest.mark.parametrize(
    ("stage", "config", "sets", "used"),
    [
        ("simulate", "paper", [], set()),
        ("simulate", "paper", COMPASS, {LAW}),
        ("simulate", "simplest", COMPASS, {LAW}),
        ("fixedpoint", "paper", [], {LAW}),  # The paper's walker has a gait for each set of equations.
        ("fixedpoint", "simplest", [], set()),
        ("fixedpoint", "kneed", [], set()),
        ("contact-sim", "paper", ["contact.terrain=plane"], set()),
    ],
)
def test_code_of_the_printed_equations_affects_only_stages_that_use_them(made_of, stage, config, sets, used):
    assert "walkerlab.evidence.paper.law" not in made_of[stage]
    loaded = load(Path(config), sets).config
    own = Keys().identity(PIPELINE[stage], loaded, {}).config_slice
    assert added_code(PIPELINE[stage], own) == used


def test_drawings_depend_on_the_figures_and_sections_of_extensions():
    modules = {code.partition(":")[0] for code in added_code(PIPELINE["plot"], {})}
    assert {"walkerlab.evidence.paper.figures", "walkerlab.evidence.verification.section"} <= modules
