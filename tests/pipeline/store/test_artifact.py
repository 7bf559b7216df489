import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from late_imports import import_late

import walkerlab
from walkerlab.config.schema import Config
from walkerlab.errors import StorageError
from walkerlab.pipeline.store import artifact, hdf5
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.hdf5 import GroupOnDisk
from walkerlab.pipeline.store.provenance import begin

xarray = import_late("xarray")

NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,8}", fullmatch=True)
TEXTS = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=8)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)
VALUES = st.one_of(
    st.lists(NUMBERS, max_size=5).map(lambda items: np.array(items, dtype=float)),
    st.lists(st.integers(-(2**63), 2**63 - 1), max_size=5).map(lambda items: np.array(items, dtype=np.int64)),
    st.lists(st.booleans(), max_size=5).map(lambda items: np.array(items, dtype=bool)),
    st.lists(TEXTS, max_size=5).map(lambda items: np.array(items, dtype=object)),
)


@st.composite
def contents(draw):
    groups = {}
    for path in draw(st.lists(st.lists(NAMES, min_size=1, max_size=3).map("/".join), max_size=3)):
        arrays = draw(st.dictionaries(NAMES, VALUES, max_size=3))
        variables = {
            name: Variable(values, (draw(st.sampled_from([name, f"{name}_dim"])),), draw(TEXTS) or "1", draw(TEXTS))
            for name, values in arrays.items()
            if values.dtype.kind != "O" or values.size
        }
        attrs = draw(st.dictionaries(NAMES, TEXTS | NUMBERS | st.booleans() | st.integers(-9, 9), max_size=2))
        groups[path] = variables, attrs
    try:
        built = {path: Group(variables, attrs) for path, (variables, attrs) in groups.items()}
        return Content(built, draw(st.dictionaries(TEXTS, JSON, max_size=3)))
    except ValueError:
        return Content()


@settings(max_examples=60, deadline=None)
@given(content=contents())
def test_artifact_survives_a_round_trip(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "x.h5"
    identity = Identity("x", {"a": 1}, {}, "code")
    origin = begin(Config(), {})
    written = artifact.write(path, content, identity, origin)
    read = artifact.read(path)
    assert read.digest() == content.digest()
    assert json.dumps(read.summary) == json.dumps(content.summary)
    assert sorted(read.groups) == sorted(content.groups)
    assert (read.identity, read.provenance, read.complete, read.seal) == (identity, origin, True, written.seal)


def test_every_part_of_an_artifacts_content_survives_a_round_trip(tmp_path, content, identity, origin):
    artifact.write(tmp_path / "a.h5", replace(content, complete=False), identity, origin)
    read = artifact.read(tmp_path / "a.h5")
    walk, original = read["corrected/walk"], content["corrected/walk"]
    assert read.digest() == content.digest()
    assert dict(walk.attrs) == dict(original.attrs)
    assert not read.complete
    assert read.timed == ("best",)
    for name, variable in original.variables.items():
        np.testing.assert_array_equal(walk[name], variable.values)
        assert walk[name].dtype == variable.values.dtype
        assert (walk.variables[name].dims, walk.variables[name].timing) == (variable.dims, variable.timing)


def test_xarray_opens_each_group(tmp_path, content, identity, origin):
    artifact.write(tmp_path / "a.h5", content, identity, origin)
    with xarray.open_dataset(tmp_path / "a.h5", group="corrected/walk", engine="h5netcdf") as walk:
        assert dict(walk.sizes) == {"time": 4, "component": 2, "event": 0}
        assert set(walk.coords) == {"time", "component", "event"}
        assert walk["state"].dims == ("time", "component")
        assert walk["state"].attrs == {"units": "rad", "long_name": "state"}
        assert walk["component"].values.tolist() == ["theta_1", "θ₂"]
        assert walk["loaded"].dtype == bool
        assert np.isnan(walk["force"].values).tolist() == [True, True, False, False]
        assert float(walk["state"].sel(time=1.0, component="θ₂")) == 2.0
        assert walk.attrs["outcome"] == "walked"
    with xarray.open_dataset(tmp_path / "a.h5", group="corrected", engine="h5netcdf") as empty:
        assert empty.attrs["note"].startswith("nothing")
    with xarray.open_dataset(tmp_path / "a.h5", engine="h5netcdf") as root:
        assert root.attrs["stage_key"] == identity.key


def test_root_arrays_open_as_one_dataset_and_keep_text_of_any_shape(tmp_path, identity, origin):
    words = np.array([["a", "b", "a"], ["c", "", "é"]], dtype=object)
    group = Group(
        {
            "slope": Variable(np.array([0.1, 0.2]), ("slope",), "rad", "slope"),
            "outcome": Variable(words, ("slope", "mass"), "", "outcome"),
        },
        {"coordinates": "slope"},
    )
    content = Content({"": group}, {"done": 6})
    artifact.write(tmp_path / "a.h5", content, identity, origin)
    assert artifact.read(tmp_path / "a.h5").digest() == content.digest()
    with xarray.open_dataset(tmp_path / "a.h5", engine="h5netcdf") as dataset:
        assert dataset.outcome.values.tolist() == words.tolist()
    with pytest.raises(ValueError, match="reserved names"):
        artifact.write(tmp_path / "a.h5", Content({"": Group({}, {"stage_key": "x"})}), identity, origin)


def test_every_array_has_a_unit_a_long_name_and_dimension_scales(tmp_path, content, identity, origin):
    artifact.write(tmp_path / "a.h5", content, identity, origin)
    with h5py.File(tmp_path / "a.h5") as file:
        for name, dataset in file["corrected/walk"].items():
            assert all(len(axis) == 1 for axis in dataset.dims) or dataset.is_scale, name
            assert {"units", "long_name"} <= set(dataset.attrs), name


def test_root_states_the_origin_of_the_result(tmp_path, content, identity, origin):
    artifact.write(tmp_path / "a.h5", content, identity, origin)
    with h5py.File(tmp_path / "a.h5") as file:
        root = {name: value.decode() if isinstance(value, bytes) else value for name, value in file.attrs.items()}
    assert root["stage_key"] == identity.key
    assert json.loads(root["input_keys"]) == {"fixedpoint": "a" * 64}
    assert root["config"].startswith("name: paper\n")
    assert json.loads(root["library_versions"])["numpy"] == np.__version__
    assert root["content_digest"] == content.digest()
    assert root["started_utc"].endswith("+00:00")
    assert json.loads(root["summary_json"]) == content.summary
    assert (root["title"], root["Conventions"]) == ("walkerlab simulate", "CF-1.11")
    expected = {"schema_version", "code_digest", "package_version", "platform", "seed", "ended_utc", "command_line"}
    assert expected <= set(root)


WRITE_ELSEWHERE = """
import sys
from conftest import full_content
print(full_content().digest())
"""


def in_turn(content, size):
    """Return a content that yields variables one by one: those of the first group with arrays, moved to the root."""
    group = content["corrected/walk"]
    coordinates = {name: one for name, one in group.variables.items() if one.dims == (name,)}
    summary = {key: value for key, value in content.summary.items() if key != "best"}
    return artifact.InTurn(summary, group.attrs, coordinates, sorted(group.variables.items()), size)


def test_writing_variables_one_by_one_gives_the_same_artifact(tmp_path, content, identity, origin):
    path, turn = tmp_path / "a.h5", in_turn(content, 10_000)
    artifact.write_in_turn(path, turn, identity, origin)
    whole = Content({"": content["corrected/walk"]}, turn.summary)
    found = artifact.read(path)
    assert found.digest() == whole.digest()
    assert found[""].attrs == whole[""].attrs
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert set(dataset.coords) == {"time", "component", "event"}
    on_disk = GroupOnDisk(path)
    assert sorted(on_disk.variables) == sorted(found[""].variables)
    for name, variable in on_disk.variables.items():
        assert variable.dims == found[""].variables[name].dims
        np.testing.assert_array_equal(variable.values, found[""][name])


def test_group_on_disk_is_scanned_once_for_many_variables(tmp_path, content, identity, origin, monkeypatch):
    path, looked = tmp_path / "a.h5", []
    artifact.write_in_turn(path, in_turn(content, 10_000), identity, origin)
    monkeypatch.setattr(hdf5, "names_of", lambda members, names_of=hdf5.names_of: looked.append(1) or names_of(members))
    on_disk = GroupOnDisk(path)
    assert len([on_disk[name] for name in on_disk.variables]) > 3
    assert len(looked) == 1


def test_failed_incremental_write_leaves_the_old_artifact(tmp_path, content, identity, origin):
    path = tmp_path / "a.h5"
    artifact.write(path, Content({}, {"x": 1}), identity, origin)
    before = path.read_bytes()
    with pytest.raises(StorageError, match="could not be stored"):
        artifact.write_in_turn(path, in_turn(content, 1 << 60), identity, origin)
    turn = in_turn(content, 10_000)
    broken = replace(turn, variables=iter([turn.variables[0], ("late", None)]))
    with pytest.raises(AttributeError):
        artifact.write_in_turn(path, broken, identity, origin)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_digest_is_the_same_in_another_process(content):
    folders = [Path(__file__).parent, Path(walkerlab.__file__).parent.parent]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders)), "PYTHONHASHSEED": "7"}
    done = subprocess.run([sys.executable, "-c", WRITE_ELSEWHERE], env=environment, capture_output=True, text=True)
    assert done.stdout.strip() == content.digest(), done.stderr


def test_check_accepts_only_the_right_key(tmp_path, content, identity, origin):
    path = tmp_path / "a.h5"
    assert artifact.check(path, identity.key).reason == "not there yet"
    artifact.write(path, content, identity, origin)
    accepted = artifact.check(path, identity.key)
    assert accepted.accepted
    assert accepted.artifact is not None
    other = artifact.check(path, "another")
    assert not other.accepted
    assert not other.damaged
    assert other.reason == "made for another key"


def test_second_write_replaces_the_file_and_leaves_no_other(tmp_path, identity, origin):
    path = tmp_path / "a.h5"
    artifact.write(path, Content({}, {"x": 1}), identity, origin)
    artifact.write(path, Content({}, {"x": 2}), identity, origin)
    assert artifact.read(path).summary == {"x": 2}
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.h5"]


def test_storage_error_has_a_message_and_advice(tmp_path, content, identity, origin):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StorageError) as caught:
        artifact.write(tmp_path / "file" / "a.h5", content, identity, origin)
    assert "could not be stored" in caught.value.message
    (tmp_path / "a.h5").mkdir()
    with pytest.raises(StorageError, match="could not be stored"):
        artifact.write(tmp_path / "a.h5", content, identity, origin)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.h5", "file"]
