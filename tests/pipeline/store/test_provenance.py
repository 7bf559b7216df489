import importlib
import subprocess
from pathlib import Path

import pytest

import walkerlab
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.pipeline.store import provenance
from walkerlab.pipeline.store.commit import FILE, IN_METADATA, commit_of_source


def test_versions_are_those_of_the_imported_libraries():
    versions = provenance.library_versions()
    for name in ("numpy", "scipy", "h5py", "pydantic"):
        assert versions[name] == importlib.import_module(name).__version__


@pytest.mark.parametrize("name", ["paper", "rigid-only", "slope-3deg"])
def test_stored_config_loads_unchanged(name, tmp_path):
    original = load(Path(name)).config
    (tmp_path / "stored.yaml").write_text(provenance.begin(original, {}).config)
    assert load(tmp_path / "stored.yaml").config == original


def test_result_records_seed_inputs_and_times():
    origin = provenance.begin(Config(seed=7), {"fixedpoint": "abc"}).finish()
    assert origin.seed == 7
    assert origin.input_digests == {"fixedpoint": "abc"}
    assert origin.started_utc <= origin.ended_utc
    assert origin.package_version == walkerlab.__version__


def test_recorded_commit_is_that_of_the_package_and_marks_uncommitted_changes(tmp_path, monkeypatch):
    def git(*arguments):
        identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
        done = subprocess.run(["git", *identity, *arguments], cwd=tmp_path, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    source = tmp_path / "walkerlab" / "__init__.py"
    source.parent.mkdir()
    source.touch()
    monkeypatch.setattr(walkerlab, "__file__", str(source))
    assert provenance.git_commit() is None
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "first")
    assert provenance.git_commit() == git("rev-parse", "HEAD")
    (tmp_path / "notes.txt").touch()
    assert provenance.git_commit() == git("rev-parse", "HEAD")
    for changed in (source, tmp_path / "configs" / "paper.yaml"):
        changed.parent.mkdir(exist_ok=True)
        changed.write_text("changed = True\n")
        assert provenance.git_commit() == git("rev-parse", "HEAD") + "-dirty"
        git("add", ".")
        git("commit", "--quiet", "--message", "changed")


def test_installed_package_inside_another_repository_has_no_commit(tmp_path, monkeypatch):
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    installed = tmp_path / "site-packages" / "walkerlab" / "__init__.py"
    monkeypatch.setattr(walkerlab, "__file__", str(installed))
    assert provenance.git_commit() is None


def test_installed_package_records_its_commit(tmp_path, monkeypatch):
    package = tmp_path / "walkerlab"
    metadata = tmp_path / "walkerlab-0.1.0.dist-info"
    (metadata / IN_METADATA).parent.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: walkerlab\nVersion: 0.1.0\n")
    (metadata / IN_METADATA).write_text("abc123\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(walkerlab, "__file__", str(package / "__init__.py"))
    assert provenance.git_commit() == "abc123"
    monkeypatch.setattr(walkerlab, "__file__", str(tmp_path / "elsewhere" / "walkerlab" / "__init__.py"))
    assert provenance.git_commit() is None


def test_source_distribution_passes_its_commit_to_the_build(tmp_path):
    assert commit_of_source(tmp_path) is None
    (tmp_path / FILE).write_text("abc123\n")
    assert commit_of_source(tmp_path) == "abc123"
