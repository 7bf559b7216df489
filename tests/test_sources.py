import itertools
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import walkerlab
from walkerlab.code_digest import Sources
from walkerlab.extensions import extensions
from walkerlab.pipeline.plan.graph import PIPELINE

NUMBER = itertools.count()
NO_CACHES = shutil.ignore_patterns("__pycache__")


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Give each test a new package: its name, and a function that writes its files."""
    name = f"package_{next(NUMBER)}"
    monkeypatch.syspath_prepend(tmp_path)

    def write(**sources):
        for path, text in {"__init__": "", **sources}.items():
            file = tmp_path / name / (path.replace("__SLASH__", "/") + ("" if "." in path else ".py"))
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(textwrap.dedent(text))
        return name

    return write


IMPORTS = [
    "from {package} import law",
    "from {package}.law import force",
    "from {package}.law import (\n    force,  # a comment (with a bracket)\n    other,\n)",
    "from {package} import other, law as renamed",
    "from {package} import (other,\n    law)",
    "from {package} import other, \\\n    law",
    "import {package}.law",
    "import json, {package}.law as renamed",
    "from . import law",
    "from .law import force",
    "import json; from .law import force",
    "def late():\n    from {package}.law import force",
    "if True: from .law import force",
    "try:\n    import {package}.law\nexcept ImportError:\n    pass",
]


@pytest.mark.parametrize("statement", IMPORTS)
def test_code_digest_follows_every_form_of_import(package, statement):
    name = package(other="", law="FORCE = 1\n")
    package(start=statement.format(package=name) + "\n")
    before = Sources().code_digest(f"{name}.start")
    package(law="FORCE = 2\n")
    assert Sources().code_digest(f"{name}.start") != before


def test_digest_follows_indirect_imports_and_parent_packages(package):
    sources = {
        "__init__": "",
        "start": "from .a import x",
        "a": "from .deep import b",
        "deep__SLASH____init__": "",
        "deep__SLASH__b": "from .. import nothing",
    }
    name = package(**sources)
    before = Sources().code_digest(f"{name}.start")
    for changed, text in sources.items():
        package(**{**sources, changed: f"{text}\nCHANGED = True\n"})
        assert Sources().code_digest(f"{name}.start") != before, changed
    package(**sources)
    assert Sources().code_digest(f"{name}.start") == before


def test_digest_ignores_modules_that_are_not_imported(package):
    name = package(start="from .law import force  # not: from .other import x", law="force = 1", other="x = 1")
    before = Sources().code_digest(f"{name}.start")
    package(other="x = 2", new="y = 3")
    assert Sources().code_digest(f"{name}.start") == before


def test_digest_covers_data_files_next_to_the_code(package):
    name = package(start="", page__SLASH____init__="", page__SLASH__draw="")
    package(**{"page__SLASH__parts__SLASH__page.html": "<html>"})
    drawing, other = Sources().code_digest(f"{name}.page.draw"), Sources().code_digest(f"{name}.start")
    package(**{"page__SLASH__parts__SLASH__page.html": "<html lang='en'>"})
    assert Sources().code_digest(f"{name}.page.draw") != drawing
    assert Sources().code_digest(f"{name}.start") == other


def test_code_digest_of_an_external_stage_includes_this_package(package):
    name = package(start="from walkerlab.errors import NoAnswer")
    assert "walkerlab.errors" in {module.name for module in Sources().closure(f"{name}.start")}


def test_circular_imports_are_handled(package):
    name = package(a="from . import b", b="from . import a")
    assert [module.name for module in Sources().closure(f"{name}.a")] == [name, f"{name}.a", f"{name}.b"]


def test_missing_module_is_an_error(package):
    with pytest.raises(ModuleNotFoundError):
        Sources().code_digest(package() + ".nowhere")


ROOT = Path(walkerlab.__file__).parent.parent
WRITTEN = [
    stage.module for stage in PIPELINE.stages if (ROOT / stage.module.replace(".", "/")).with_suffix(".py").exists()
]
DRAWINGS = [stage.module for stage in PIPELINE.stages if stage.draws]
STARTS = ["walkerlab.pipeline.run.runner", "walkerlab.views.cli.stored", "walkerlab.physics.kernels", *WRITTEN]
LIBRARIES = [
    "h5py", "jinja2", "matplotlib.figure", "multiprocessing.connection", "numba.extending", "numba.typed", "PIL.Image",
    "pydantic.main", "pydantic.functional_validators", "ruamel.yaml", "scipy.integrate", "scipy.optimize", "typer",
    "xml.etree.ElementTree",
]  # fmt: skip
IMPORTED = """
import gc, importlib, os, sys
gc.disable()
libraries, starts = (line.split() for line in sys.stdin)
for name in libraries:
    importlib.import_module(name)
for name in starts:
    if not os.fork():
        importlib.import_module(name)
        print(*(name for name in sys.modules if name.partition('.')[0] == 'walkerlab'), flush=True)
        os._exit(0)
    os.wait()
"""


@pytest.fixture(scope="module")
def imported():
    """Return the modules that importing each start loads, in a process that has only third-party libraries."""
    asked = f"{' '.join(LIBRARIES)}\n{' '.join(STARTS)}\n"
    # Threads of libraries would not exist in the fork.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED], cwd=ROOT, env=environment, input=asked, capture_output=True, text=True
    )
    found = [set(line.split()) for line in done.stdout.splitlines()]
    assert len(found) == len(STARTS), done.stderr
    return dict(zip(STARTS, found, strict=True))


@pytest.mark.parametrize("name", STARTS)
def test_code_digest_covers_every_module_that_python_imports(name, imported):
    """The scanner finds imports in the text. The interpreter checks it independently."""
    assert name in imported[name]
    drawn = {code for extension in extensions().values() for code in extension.drawing_code()}
    added = {code.partition(":")[0] for code in drawn} if name in DRAWINGS else set()
    declared = {f"walkerlab{code.partition(':')[0]}" for code in walkerlab.EXTENSIONS.values()}
    assert imported[name] <= {module.name for module in Sources().closure(name, *added, *declared)}


def test_new_version_number_changes_no_stage_key(tmp_path):
    def digest(version):
        shutil.copytree(Path(walkerlab.__file__).parent, tmp_path / version / "walkerlab", ignore=NO_CACHES)
        init = tmp_path / version / "walkerlab" / "__init__.py"
        init.write_text(init.read_text().replace(walkerlab.__version__, version))
        stage = "walkerlab.evidence.benchmarks.engines.stage"
        code = f"from walkerlab.code_digest import Sources; print(Sources().code_digest({stage!r}))"
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path / version, env={}, capture_output=True, text=True
        )
        assert not done.stderr
        return done.stdout

    assert digest("7.0.0") == digest("8.0.0.dev0")
