"""Check the architecture: imports go down through the layers, kernels import only kernels, configs have one source."""

import ast
import functools
import re
import subprocess
import sys
from pathlib import Path

import walkerlab
from walkerlab.physics.kernel_cache import KERNEL_HOMES
from walkerlab.pipeline.plan.graph import PIPELINE

PACKAGE = Path(walkerlab.__file__).parent
# Each layer imports only layers further down in this list.
LAYERS = (
    "api",
    "evidence.verification",
    "evidence.benchmarks",
    "evidence.paper",
    "evidence.check",
    "views.cli",
    "views.explore",
    "views.report",
    "views.figures",
    "views.prose",
    "pipeline.sweeps",
    "pipeline.stages",
    "pipeline.run",
    "pipeline.plan",
    "pipeline",
    "pipeline.store",
    "exchange",
    "scene",
    "physics.estimation",
    "physics.orbits",
    "physics.hybrid",
    "physics.ground",
    "physics.mechanics",
    "physics.solvers",
    "physics.kernels",
    "physics.compiler",
    "physics.kernel_cache",
    "physics.energy_channels",
    "config",
    "extensions",
    "code_digest",
    "labels",
    "outcome",
    "private_files",
    "errors",
)
WINGS = ("evidence", "views", "pipeline", "exchange", "scene", "physics", "config")
SOURCES = sorted(PACKAGE.rglob("*.py"))
DOORS = {"__init__.py", "__main__.py", *(f"{wing}/__init__.py" for wing in WINGS)}
KERNEL_LAYERS = {f"physics.{home}" for home in KERNEL_HOMES}
COMPILER = {"physics.kernels", "physics.compiler", "physics.kernel_cache"}
COMPILING = {"kernel", "kernel_part", "forced_inline", "dispatch_by_type", "dispatch_by_type_or_default"}


def layer_of_module(name):
    """Return the layer of a module: the longest one with which its name begins, or an empty string if there is none."""
    layers = [layer for layer in LAYERS if f"{name}.".startswith(f"walkerlab.{layer}.")]
    return max(layers, key=len, default="")


def layer_of(path):
    return layer_of_module(".".join(("walkerlab", *path.relative_to(PACKAGE).with_suffix("").parts)))


def named(path):
    return str(path.relative_to(PACKAGE))


IN_LAYERS = [path for path in SOURCES if named(path) not in DOORS]


@functools.cache
def imported_modules(path):
    return tuple(modules_in(path))


def modules_in(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute, so that they can be read"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def imported_layers(path):
    return set(map(layer_of_module, imported_modules(path))) - {""}


def test_every_module_has_its_layer():
    assert [named(path) for path in IN_LAYERS if not layer_of(path)] == []


def test_docs_list_the_same_layers():
    text = (Path(__file__).parent.parent / "docs" / "architecture.md").read_text()
    listed = text.partition("## Layers")[2].partition("```text")[2].partition("```")[0]
    assert tuple(listed.replace(">", " ").split()) == LAYERS


def exceptions(found, paths=IN_LAYERS):
    """Return what the function `found` finds in each file. Files in which it finds nothing are skipped."""
    return {named(path): names for path in paths if (names := found(path))}


def test_modules_import_only_from_lower_layers():
    assert exceptions(lambda path: imported_layers(path) & {*LAYERS[: LAYERS.index(layer_of(path))]}) == {}


PHYSICS = sorted((PACKAGE / "physics").rglob("*.py"))


def test_physics_imports_no_config_file_or_study_code():
    known = {"physics", "outcome", "errors", "code_digest", "private_files"}
    assert len(PHYSICS) > 50
    assert exceptions(lambda path: {layer.partition(".")[0] for layer in imported_layers(path)} - known, PHYSICS) == {}
    foreign = {"h5py", "ruamel", "pydantic", "typer", "matplotlib"}
    assert exceptions(lambda path: {name.partition(".")[0] for name in imported_modules(path)} & foreign, PHYSICS) == {}


def test_compiled_functions_are_in_layers_covered_by_the_cache_key():
    elsewhere = [path for path in IN_LAYERS if layer_of(path) not in KERNEL_LAYERS | COMPILER]
    compilers = {"numba", "llvmlite"}
    assert exceptions(lambda path: {name.split(".")[0] for name in imported_modules(path)} & compilers, elsewhere) == {}
    compiling = {f"walkerlab.physics.kernels.{name}" for name in COMPILING}
    assert exceptions(lambda path: compiling.intersection(imported_modules(path)), elsewhere) == {}


def test_compiled_functions_import_only_code_covered_by_the_cache_key():
    """Otherwise a constant from elsewhere would be compiled into machine code, which would not be renewed when the
    constant changes.
    """
    covered = {*KERNEL_LAYERS, "physics.kernels", "physics.energy_channels", "outcome", "errors"}
    compiled = [path for path in IN_LAYERS if layer_of(path) in KERNEL_LAYERS]
    assert compiled
    assert exceptions(lambda path: imported_layers(path) - covered, compiled) == {}


def test_test_modules_have_unique_names():
    names = [path.name for path in Path(__file__).parent.rglob("*.py")]
    assert {name for name in names if names.count(name) > 1} <= {"conftest.py", "__init__.py"}


RUN = """
import sys
from walkerlab.views.cli.main import main
sys.argv = ["walkerlab", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*sorted(sys.modules))
"""


def test_rigid_walk_does_not_import_contact_code(tmp_path):
    config = tmp_path / "rigid.yaml"
    config.write_text("extends: rigid-only\nstrides: 1\n")
    command = [sys.executable, "-c", RUN, "simulate", "--config", str(config), "--runs", str(tmp_path), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.splitlines()[-1].split()
    assert "walkerlab.physics.hybrid.rigid_walk" in loaded
    physical = (
        "walkerlab.physics.ground",
        "walkerlab.physics.orbits.contact_gait",
        "walkerlab.physics.hybrid.contact",
        "walkerlab.scene.contact",
    )
    assert [name for name in loaded if name.startswith(physical)] == []


def test_walk_from_a_given_start_imports_no_drawing_or_gait_search(tmp_path):
    config = tmp_path / "given.yaml"
    config.write_text("extends: rigid-only\nstrides: 1\nstart: [-0.2042, 0.1694, -0.6, -0.86]\n")
    command = [sys.executable, "-c", RUN, "simulate", "--config", str(config), "--runs", str(tmp_path), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.splitlines()[-1].split()
    assert "numba" in loaded
    assert {"matplotlib", "scipy.optimize", "walkerlab.physics.orbits.fixed_point", "jinja2"} & set(loaded) == set()


def test_finding_a_gait_imports_neither_report_nor_scipy_linalg(tmp_path):
    command = [sys.executable, "-c", RUN, "fixedpoint", "--runs", str(tmp_path), "--force"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "there is a stable gait" in done.stdout
    loaded = done.stdout.splitlines()[-1].split()
    assert [
        name for name in loaded if name.startswith(("scipy.linalg", "walkerlab.views.report.sections", "jinja2"))
    ] == []


QUOTED_MODULE = re.compile(r"walkerlab(?:\.\w+)+(?=:\w+$|$)")


def rank(layer):
    return LAYERS.index(layer)


def quoted_modules(path):
    texts = (node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant))
    return {match[0] for text in texts if isinstance(text, str) and (match := QUOTED_MODULE.match(text))}


def test_no_string_in_a_module_refers_to_a_module_of_a_higher_layer():
    quoted = [(path, name, layer_of_module(name)) for path in IN_LAYERS for name in quoted_modules(path)]
    upward = [(named(path), name) for path, name, layer in quoted if layer and rank(layer) < rank(layer_of(path))]
    assert upward == []


def test_built_in_extensions_are_listed_once():
    table = PACKAGE / "pipeline" / "stages" / "table.py"
    assert "walkerlab.pipeline.stages.simulate" in quoted_modules(table)
    listed = {code.partition(":")[0].removeprefix(".") for code in walkerlab.EXTENSIONS.values()}
    declaring = {path for path in IN_LAYERS if "walkerlab.extensions.Extension" in imported_modules(path)}
    assert listed == {".".join(path.relative_to(PACKAGE).with_suffix("").parts) for path in declaring}


STAGE_MODULES = {stage.module for stage in PIPELINE.stages}


def test_stages_import_no_other_stage():
    paths = [PACKAGE.parent / Path(*module.split(".")).with_suffix(".py") for module in sorted(STAGE_MODULES)]
    assert exceptions(lambda path: STAGE_MODULES.intersection(imported_modules(path)), paths) == {}
