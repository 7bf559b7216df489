"""Walls between the parts of the package: imports run downward, kernels stay at home, configs have one source."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import walkerlab
from walkerlab.kernel_cache import KERNEL_HOMES
from walkerlab.pipeline.graph import PIPELINE

PACKAGE = Path(walkerlab.__file__).parent
# each imports only those after it
LAYERS = (
    "cli",
    "api",
    "explorer",
    "sweeps",
    "verification",
    "benchmarks",
    "paper",
    "report",
    "figures",
    "stages",
    "pipeline",
    "store",
    "scene",
    "orbits",
    "hybrid",
    "ground",
    "mechanics",
    "solvers",
    "workers",
    "config",
    "kernels",
    "compiler",
    "kernel_cache",
    "sources",
    "labels",
    "prose",
    "registration",
    "stopping",
    "outcome",
    "account",
    "errors",
)
SOURCES = sorted(PACKAGE.rglob("*.py"))
IN_LAYERS = [path for path in SOURCES if path.parent != PACKAGE or path.stem in LAYERS]
COMPILING = {"kernel", "callable_kernel", "kernel_part", "forced_inline", "by_type", "by_type_or_default"}


def layer_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def named(path):
    return str(path.relative_to(PACKAGE))


def imported_modules(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute, so that they can be read"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def imported_layers(path):
    modules = (name.split(".") for name in imported_modules(path))
    return {parts[1] for parts in modules if parts[0] == "walkerlab" and len(parts) > 1 and parts[1] in LAYERS}


def test_every_part_of_the_package_has_its_layer():
    parts = {path.name.removesuffix(".py") for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert parts - {"__init__", "__main__", "__pycache__"} <= set(LAYERS)


def test_the_docs_tell_of_the_same_layers():
    text = (Path(__file__).parent.parent / "docs" / "architecture.md").read_text()
    told = text.partition("## Layers")[2].partition("Each imports")[0]
    assert tuple(told.replace(">", " ").split()) == LAYERS


@pytest.mark.parametrize("path", IN_LAYERS, ids=named)
def test_imports_run_downward(path):
    own = LAYERS.index(layer_of(path))
    assert {name for name in imported_layers(path) if LAYERS.index(name) < own} == set()


@pytest.mark.parametrize("path", IN_LAYERS, ids=named)
def test_compiled_functions_stand_where_the_cache_key_looks(path):
    if layer_of(path) in (*KERNEL_HOMES, "kernels", "compiler", "kernel_cache"):
        return
    names = set(imported_modules(path))
    assert not {name.split(".")[0] for name in names} & {"numba", "llvmlite"}
    assert not names & {f"walkerlab.kernels.{name}" for name in COMPILING}


@pytest.mark.parametrize("path", [path for path in IN_LAYERS if layer_of(path) in KERNEL_HOMES], ids=named)
def test_compiled_functions_are_made_only_of_what_the_cache_key_covers(path):
    """A constant from elsewhere would be frozen into machine code that its change does not renew."""
    assert imported_layers(path) <= {*KERNEL_HOMES, "kernels", "outcome", "account", "errors"}


def test_no_two_modules_of_tests_have_one_name():
    names = [path.name for path in Path(__file__).parent.rglob("*.py")]
    assert {name for name in names if names.count(name) > 1} <= {"conftest.py", "__init__.py"}


RUN = """
import sys
from walkerlab.cli.main import main
sys.argv = ["walkerlab", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*sorted(sys.modules))
"""


def test_a_walk_of_the_rigid_model_never_loads_contact_code(tmp_path):
    config = tmp_path / "rigid.yaml"
    config.write_text("extends: rigid-only\nstrides: 1\n")
    command = [sys.executable, "-c", RUN, "simulate", "--config", str(config), "--runs", str(tmp_path), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.splitlines()[-1].split()
    assert "walkerlab.hybrid.rigid_walk" in loaded
    physical = (
        "walkerlab.ground",
        "walkerlab.orbits.contact_gait",
        "walkerlab.hybrid.contact",
        "walkerlab.scene.contact",
    )
    assert [name for name in loaded if name.startswith(physical)] == []


def test_a_walk_from_a_given_start_loads_nothing_that_draws_or_seeks_gaits(tmp_path):
    config = tmp_path / "given.yaml"
    config.write_text("extends: rigid-only\nstrides: 1\nstart: [-0.2042, 0.1694, -0.6, -0.86]\n")
    command = [sys.executable, "-c", RUN, "simulate", "--config", str(config), "--runs", str(tmp_path), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.splitlines()[-1].split()
    assert "numba" in loaded
    assert {"matplotlib", "scipy.optimize", "walkerlab.orbits.fixed_point", "jinja2"} & set(loaded) == set()


def test_a_gait_is_found_and_told_without_the_page_or_scipy_linalg(tmp_path):
    command = [sys.executable, "-c", RUN, "fixedpoint", "--runs", str(tmp_path), "--force"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "there is a stable gait" in done.stdout
    loaded = done.stdout.splitlines()[-1].split()
    assert [name for name in loaded if name.startswith(("scipy.linalg", "walkerlab.report.sections", "jinja2"))] == []


EVIDENCE = ("verification", "benchmarks", "paper")
REGISTRIES = {"scene/studies.py", "pipeline/graph.py", "figures/registry.py", "report/registry.py", "report/answers.py"}
QUOTED_EVIDENCE = re.compile(rf"[\"']walkerlab\.(?:{'|'.join(EVIDENCE)})\.")


def test_evidence_is_named_by_registries_alone():
    """What stands below the study, the verification and the benchmarks names them only where they register."""
    below = LAYERS.index(EVIDENCE[-1])
    core = [path for path in IN_LAYERS if LAYERS.index(layer_of(path)) > below]
    assert {named(path) for path in core if QUOTED_EVIDENCE.search(path.read_text())} == REGISTRIES


STAGE_MODULES = {stage.module for stage in PIPELINE.stages}


@pytest.mark.parametrize("module", sorted(STAGE_MODULES))
def test_stages_import_no_other_stage(module):
    path = PACKAGE.parent / Path(*module.split(".")).with_suffix(".py")
    assert STAGE_MODULES & set(imported_modules(path)) == set()
