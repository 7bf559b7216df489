"""Check that outdated compiled code never runs after an edit, because compiled code is stored with a digest of its
sources.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from walkerlab.physics.kernel_cache import KEPT_GENERATIONS, build_target, cache_folder

PACKAGE = Path(__file__).parents[1] / "walkerlab"
CALL = """
from walkerlab.physics.kernel_cache import cache_folder
import walkerlab.physics.orbits.trial_of_code as trial
print(trial.twice(3.0), cache_folder().name)
"""
CALLER = '''"""A kernel that calls a function of another file."""

from walkerlab.physics.kernels import kernel
from walkerlab.physics.mechanics.trial_of_code import once


@kernel
def twice(x: float) -> float:
    """Twice that."""
    return 2.0 * once(x)
'''
CALLED = '''"""A function to be edited."""

from walkerlab.physics.kernels import kernel_part


@kernel_part
def once(x: float) -> float:
    """This."""
    return x + 1.0
'''


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory):
    """Return a copy of the package with the bytecode of the modules that kernels import."""
    folder = tmp_path_factory.mktemp("unchanged")
    shutil.copytree(PACKAGE, folder / "walkerlab", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    subprocess.run([sys.executable, "-c", "import walkerlab.physics.kernels"], cwd=folder, env=environment, check=True)
    return folder / "walkerlab"


@pytest.fixture
def copy(unchanged, tmp_path):
    """Return a copy of the package with two more files, and a way to run it in a fresh process."""
    package = tmp_path / "walkerlab"
    shutil.copytree(unchanged, package)
    (package / "physics" / "orbits" / "trial_of_code.py").write_text(CALLER)
    (package / "physics" / "mechanics" / "trial_of_code.py").write_text(CALLED)

    def run():
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache")}
        # -B is needed because Python's cache of bytecode goes by the time and size of a file.
        program = [sys.executable, "-B", "-c", CALL]
        done = subprocess.run(program, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        value, folder = done.stdout.split()
        return float(value), folder

    return package, run


def compiled(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.kernel")}


def test_editing_an_imported_function_recompiles_its_callers(copy):
    package, run = copy
    called = package / "physics" / "mechanics" / "trial_of_code.py"
    before = called.stat()
    assert run()[0] == 8.0
    called.write_text(CALLED.replace("x + 1.0", "x + 2.0"))
    # Not even the time of the file shows that it was edited.
    os.utime(called, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert run()[0] == 10.0


def test_reinstalled_or_moved_package_reuses_compiled_code(copy, tmp_path):
    package, run = copy
    _, folder = run()
    kept = compiled(tmp_path / "cache" / folder)
    assert run()[1] == folder
    assert compiled(tmp_path / "cache") == kept
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    # The copy has new times.
    shutil.copytree(package, moved / "walkerlab", ignore=shutil.ignore_patterns("__pycache__"))
    for path in (moved / "walkerlab").rglob("*.py"):
        path.touch()
    environment = {**os.environ, "PYTHONPATH": str(moved), "WALKERLAB_CACHE": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", CALL], cwd=moved, env=environment, check=True)
    assert kept
    assert compiled(tmp_path / "cache") == kept


@pytest.mark.parametrize("also", [False, True], ids=["chosen", "chosen and usual"])
def test_unwritable_cache_is_reported_once_and_workers_share_a_substitute(copy, tmp_path, also):
    (tmp_path / "file").write_text("")
    usual = str(tmp_path / ("file" if also else "usual"))
    given = {"WALKERLAB_CACHE": str(tmp_path / "file"), "XDG_CACHE_HOME": usual, "TMPDIR": str(tmp_path)}
    environment = {**os.environ, **given, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", IN_WORKERS], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    folders = set(done.stdout.split())
    assert len(folders) == 1
    assert done.stderr.count("is not writable") == 1
    assert folders.pop() in done.stderr
    assert ("later processes do not find" in done.stderr) == also


IN_WORKERS = """
from walkerlab.physics.kernel_cache import cache_root
from walkerlab.pipeline.run.workers import map_in_order
print(cache_root(), *map_in_order([cache_root] * 4, jobs=2))
"""
IMPORT_ALL = """
import walkerlab, walkerlab.physics.kernels, walkerlab.physics.orbits.trial_of_code
"""


def test_importing_kernels_writes_nothing(copy, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    given = {name: str(home / name) for name in ("WALKERLAB_CACHE", "XDG_CACHE_HOME", "HOME", "TMPDIR")}
    environment = {**os.environ, **given, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    before = sorted(tmp_path.rglob("*"))
    subprocess.run([sys.executable, "-c", IMPORT_ALL], cwd=tmp_path, env=environment, check=True)
    assert sorted(tmp_path.rglob("*")) == before


CHOSEN_LATE = """
import os, sys
from walkerlab.physics.orbits.trial_of_code import twice
os.environ["WALKERLAB_CACHE"] = sys.argv[1]
twice(3.0)
"""


def test_cache_folder_chosen_after_the_import_is_used(copy, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "at-first")}
    command = [sys.executable, "-c", CHOSEN_LATE, str(tmp_path / "later")]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    assert compiled(tmp_path / "later")
    assert not (tmp_path / "at-first").exists()


@pytest.fixture
def generations(copy, tmp_path):
    """Return a function that makes twelve older generations of compiled code, the newest last used `days` ago, and
    returns those that remain after a run.
    """
    _, run = copy
    host = cache_folder().name.split("-", 4)[4]  # kernels-DIGEST-pyVERSION-numbaVERSION-PROCESSOR

    def left_after_a_new_one(days):
        folders = [tmp_path / "cache" / f"kernels-{number:016x}-py311-numba0.62.0-{host}" for number in range(12)]
        for number, folder in enumerate(folders):
            folder.mkdir(parents=True)
            os.utime(folder, times=(time.time() - (days + number) * 86_400,) * 2)
        run()
        return [number for number, folder in enumerate(folders) if folder.exists()]

    return left_after_a_new_one


def test_recently_used_older_code_is_kept(generations):
    assert generations(days=1) == list(range(12))


def test_long_unused_compiled_code_is_deleted_except_the_latest(generations):
    assert generations(days=100) == list(range(KEPT_GENERATIONS - 1))


FOLDER_GONE = """
import shutil
from walkerlab.physics.kernel_cache import cache_folder
from walkerlab.physics.orbits.trial_of_code import twice
twice(3.0)
shutil.rmtree(cache_folder())
print(twice(3))
"""


def test_process_recompiles_if_its_compiled_code_is_removed(copy, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", FOLDER_GONE], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert float(done.stdout) == 8.0
    assert compiled(tmp_path / "cache")


DIGEST = "from walkerlab.physics.kernel_cache import sources_digest; print(sources_digest())"


@pytest.fixture(scope="module")
def digest_after_an_edit(unchanged, tmp_path_factory):
    """Return the digest of the kernels' sources before and after a comment is added to a file of a copy."""
    folder = tmp_path_factory.mktemp("edited")
    shutil.copytree(unchanged, folder / "walkerlab")
    command = [sys.executable, "-B", "-c", DIGEST]

    def digest():
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        return subprocess.check_output(command, cwd=folder, env=environment, text=True)

    before = digest()

    def digests(path):
        file = folder / "walkerlab" / path
        text = file.read_text()
        file.write_text(f"{text}\n# a remark\n")
        try:
            return before, digest()
        finally:
            file.write_text(text)

    return digests


@pytest.mark.parametrize(
    "path",
    [
        "__init__.py",
        "errors.py",
        "evidence/paper/rows.py",
        "physics/orbits/small_slope.py",
        "physics/mechanics/parts.py",
    ],
)
def test_editing_uncompiled_code_keeps_the_compiled_code(digest_after_an_edit, path):
    before, after = digest_after_an_edit(path)
    assert after == before


@pytest.mark.parametrize(
    "path",
    [
        "physics/solvers/dop853_tableau.py",
        "physics/solvers/stepping.py",
        "outcome.py",
        "physics/kernels.py",
        "physics/compiler.py",
    ],
)
def test_editing_kernel_sources_recompiles_them(digest_after_an_edit, path):
    before, after = digest_after_an_edit(path)
    assert after != before


def test_each_processor_type_has_separate_compiled_code(copy, monkeypatch):
    _, run = copy
    _, here = run()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "")
    _, elsewhere = run()
    assert "-generic-" in elsewhere
    assert here.partition("-py")[0] == elsewhere.partition("-py")[0]
    assert here != elsewhere


NOTEBOOK = """
import numba
import walkerlab.physics.kernels

@numba.njit(cache=True)
def own(x):
    return x + 1.0

print(own(1.0), own._cache.cache_path)
"""


@pytest.mark.usefixtures("copy")
def test_numba_cache_of_another_program_stays_in_its_folder(tmp_path):
    program = tmp_path / "elsewhere" / "program.py"
    program.parent.mkdir()
    program.write_text(NOTEBOOK)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True, check=True)
    value, folder = done.stdout.split()
    assert float(value) == 2.0
    assert Path(folder) == program.parent / "__pycache__"
    assert list(Path(folder).glob("*.nbc"))


FOREIGN = """
from typing import NamedTuple
from walkerlab.physics.mechanics.trial_of_system import value
from walkerlab.physics.orbits.trial_of_system import valued
class Foreign(NamedTuple):
    number: float
value.case(Foreign)(lambda system: 3.0)
result = valued(Foreign(1.0))
"""
OWN = """
from walkerlab.physics.mechanics.trial_of_system import Own
from walkerlab.physics.orbits.trial_of_system import valued
print(valued(Own(1.0)))
"""
SYSTEM = '''"""Systems of several types."""

from typing import Any, NamedTuple

from walkerlab.physics.kernels import dispatch_by_type


class Own(NamedTuple):
    """One of the package."""

    number: float


@dispatch_by_type
def value(system: Any) -> float:
    """A number."""


@value.case(Own)
def own_value(system: Own) -> float:
    """Its own."""
    return system.number
'''
VALUED = '''"""A kernel for systems of any type."""

from typing import Any

from walkerlab.physics.kernels import kernel
from walkerlab.physics.mechanics.trial_of_system import value


@kernel
def valued(system: Any) -> float:
    """Its value."""
    return value(system)
'''


def test_code_compiled_for_types_of_another_program_is_ignored(copy, tmp_path):
    package, _ = copy
    (package / "physics" / "mechanics" / "trial_of_system.py").write_text(SYSTEM)
    (package / "physics" / "orbits" / "trial_of_system.py").write_text(VALUED)
    (tmp_path / "foreign.py").write_text(FOREIGN)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache")}

    def run(source):
        return subprocess.run(
            [sys.executable, "-c", source], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        ).stdout

    run("import foreign")
    (tmp_path / "foreign.py").unlink()
    assert run(OWN) == "1.0\n"


BUILD = """
import os, sys
from pathlib import Path
from walkerlab.physics import kernel_cache
os.environ["NUMBA_CPU_NAME"], os.environ["NUMBA_CPU_FEATURES"] = kernel_cache.build_target()[0], ""
import walkerlab.physics.orbits.trial_of_code as trial
trial.twice(3.0)
from walkerlab.physics.compiler import files_in_use
from walkerlab.pipeline.run.compile_ahead import write_machine_code
write_machine_code(kernel_cache.BUILT, files_in_use)
"""
USE = """
import sys
from walkerlab.physics import kernel_cache
names = []
kernel_cache.watchers.append(names.append)
import walkerlab.physics.orbits.trial_of_code as trial
print(trial.twice(3.0), *names, kernel_cache.why_not_built(), sep="|")
"""


@pytest.fixture
def built(copy, tmp_path):
    """Return a copy of the package with the machine code of its trial kernel, and a way to run it with an empty
    cache.
    """
    if build_target() is None:
        pytest.skip("no kernels are built for this platform")
    package, _ = copy

    def run(source, **changes):
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache"), **changes}
        program = [sys.executable, "-B", "-c", source]
        done = subprocess.run(program, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip().split("|")

    run(BUILD)
    shutil.rmtree(tmp_path / "cache")
    return package, run


def test_packaged_kernels_are_used_without_compiling_or_writing(built, tmp_path):
    _, run = built
    assert run(USE) == ["8.0", ""]
    assert not (tmp_path / "cache").exists()


def test_processor_without_required_features_compiles_its_own_kernels(built):
    _, run = built
    value, name, why = run(USE, NUMBA_CPU_FEATURES="")
    assert (value, name) == ("8.0", "twice")
    assert why.startswith("this processor lacks ")


@pytest.mark.parametrize("name", ["Python", "numba", "llvmlite", "platform"])
def test_kernels_built_elsewhere_are_not_used(built, name):
    package, run = built
    about = package / "physics" / "machine_code" / "about.json"
    entries = json.loads(about.read_text())
    about.write_text(json.dumps({**entries, name: "another"}))
    value, compiled_name, why = run(USE)
    assert (value, compiled_name) == ("8.0", "twice")
    assert why.startswith(f"{name} differs: another when the package was built, {entries[name]} here.")


def test_kernels_built_from_other_sources_are_not_used(built):
    package, run = built
    (package / "physics" / "mechanics" / "trial_of_code.py").write_text(CALLED.replace("x + 1.0", "x + 2.0"))
    value, name, why = run(USE)
    assert (value, name) == ("10.0", "twice")
    assert why.startswith("sources differs: ")


def test_damaged_packaged_kernel_is_recompiled_only_once(built):
    package, run = built
    (file,) = (package / "physics" / "machine_code").glob("*.kernel")
    file.write_bytes(file.read_bytes()[:-1])
    assert run(USE) == ["8.0", "twice", ""]
    assert run(USE) == ["8.0", ""]


OWN_LAW = """
from typing import NamedTuple
from walkerlab.physics.mechanics.trial_of_system import value
class Law(NamedTuple):
    number: float
@value.case(Law)
def value_of_law(law):
    return 2.0 * law.number
"""
USE_OF_LAW = """
from own_law import Law
from walkerlab.physics import kernel_cache
from walkerlab.physics.orbits.trial_of_system import valued
names = []
kernel_cache.watchers.append(names.append)
print(valued(Law(1.0)), *names, sep="|")
"""


def test_editing_a_user_law_recompiles_it(copy, tmp_path):
    package, _ = copy
    (package / "physics" / "mechanics" / "trial_of_system.py").write_text(SYSTEM)
    (package / "physics" / "orbits" / "trial_of_system.py").write_text(VALUED)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "WALKERLAB_CACHE": str(tmp_path / "cache")}

    def run(law):
        (tmp_path / "own_law.py").write_text(law)
        program = [sys.executable, "-B", "-c", USE_OF_LAW]
        return subprocess.check_output(program, cwd=tmp_path, env=environment, text=True).strip().split("|")

    assert run(OWN_LAW) == ["2.0", "valued"]
    assert run(OWN_LAW) == ["2.0"]
    assert run(OWN_LAW.replace("2.0 *", "3.0 *")) == ["3.0", "valued"]
