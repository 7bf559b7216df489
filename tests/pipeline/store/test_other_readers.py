"""Read artifacts with Octave, NCO, xarray and h5py, and older artifacts with this version."""

import hashlib
import json
import shutil
import subprocess
from dataclasses import replace

import h5py
import numpy as np
import pytest
from late_imports import import_late

from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import Content, Group, Variable
from walkerlab.pipeline.store.hdf5 import GroupOnDisk

xarray = import_late("xarray")

TEXTS = {"mixed": ["", "walked", "θ₂ é"], "empty": ["", "", ""], "short": ["a", "b", "c"]}


@pytest.fixture
def texts():
    """Return a content with text of all kinds, at the root and in a group. By name, the texts lie between numbers."""
    step = {"step": Variable(np.arange(3), ("step",), "1", "step")}
    columns = {name: Variable(np.array(values, object), ("step",), "", name) for name, values in TEXTS.items()}
    more = {
        "alone": Variable(np.array("é", object), (), "", "one text"),
        "none": Variable(np.array([], str), ("nothing",), "", "no text"),
        "a.before": Variable(np.arange(3.0), ("step",), "m", "number"),
        "z_after": Variable(np.arange(6.0).reshape(3, 2), ("step", "side"), "m", "numbers"),
    }
    group = Group({**step, **columns, **more}, {"name": "Hüfte", "nothing": "", "count": 3, "exact": True})
    summary = {"long": "θ" * 40_000}
    return Content({"": group, "walk": group}, summary)


@pytest.fixture
def stored(tmp_path, texts, identity, origin):
    artifact.write(tmp_path / "a.h5", texts, identity, origin)
    return tmp_path / "a.h5"


def test_text_is_stored_with_a_fixed_length_and_long_attributes_are_readable(stored, texts):
    with h5py.File(stored) as file:
        for holder in (file, file["walk"], *file["walk"].values()):
            for name in holder.attrs:
                kind = h5py.check_string_dtype(holder.attrs.get_id(name).dtype)
                assert kind is None or kind.length is not None, name
        for name in TEXTS:
            assert h5py.check_string_dtype(file[name].dtype).length is not None
            assert [text.decode() for text in file[name][()]] == TEXTS[name]
        assert file["alone"][()].decode() == "é"
        assert file["none"].shape == (0,)
        assert file.attrs["nothing"] == b""
        assert file.attrs["name"].decode() == "Hüfte"
        assert json.loads(file.attrs["summary_json"]) == texts.summary  # The attribute has 80,000 bytes.
    assert artifact.read(stored).digest() == texts.digest()


def test_xarray_reads_text_as_text(stored):
    for group in (None, "walk"):
        with xarray.open_dataset(stored, group=group, engine="h5netcdf") as dataset:
            assert {name: dataset[name].values.tolist() for name in TEXTS} == TEXTS
            assert dataset["alone"].item() == "é"
            assert dataset["none"].size == 0
            assert dataset.attrs["name"] == "Hüfte"
            assert dataset.attrs["nothing"] == ""


def test_variables_on_disk_are_read_as_they_were_written(stored, texts):
    group = GroupOnDisk(stored)
    assert list(group.variables) == sorted(texts[""].variables)
    for name, variable in texts[""].variables.items():
        assert group[name].tolist() == variable.values.tolist()


def test_creation_order_of_members_and_attributes_is_tracked(stored):
    tracked = h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED
    with h5py.File(stored) as file:
        for group in (file["/"], file["walk"]):
            assert group.id.get_create_plist().get_link_creation_order() == tracked
        for member in (file["/"], file["walk"], *file["walk"].values()):
            assert member.id.get_create_plist().get_attr_creation_order() == tracked


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="Octave is not installed (apt-get install octave)")
def test_octave_loads_all_variables(stored, texts):
    program = f"""
    data = load("{stored}");
    for group = {{data, data.walk}}
      g = group{{1}};
      names = setdiff(fieldnames(g), {{"walk"}});
      printf("%s,", names{{:}}), printf("\\n");
      printf("%s|", cellstr(g.mixed){{:}}, cellstr(g.short){{:}}, g.alone), printf("\\n");
      printf("%g,", g.a_before, g.z_after), printf("\\n");
    end
    """
    done = subprocess.run(["octave-cli", "--quiet", "--eval", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    names = sorted(name.replace(".", "_") for name in [*texts[""].variables, "nothing", "side"])
    expected = [",".join(names) + ",", "|walked|θ₂ é|a|b|c|é|", "0,1,2,0,1,2,3,4,5,"]
    assert done.stdout.splitlines() == expected * 2
    assert "load" not in done.stderr


@pytest.mark.skipif(not shutil.which("ncatted"), reason="NCO is not installed (apt-get install nco)")
def test_nco_can_modify_a_copy(stored, tmp_path):
    copy = tmp_path / "copy.h5"
    shutil.copy(stored, copy)
    subprocess.run(["ncatted", "-O", "-h", "-a", "note,global,c,c,hello", copy], check=True, capture_output=True)
    with xarray.open_dataset(copy, engine="h5netcdf") as dataset:
        assert dataset.attrs["note"] == "hello"
        assert dataset["mixed"].values.tolist() == TEXTS["mixed"]


def in_layout_2(path):
    """Turn a file into one of layout 2, which has text of variable length instead of fixed length."""
    text = h5py.string_dtype()

    def replace_attributes(node):
        for name in list(node.attrs):
            kind = h5py.check_string_dtype(node.attrs.get_id(name).dtype)
            if kind is not None and kind.length is not None and name not in ("CLASS", "NAME"):
                node.attrs.create(name, node.attrs[name].decode(), dtype=text)

    def replace_dataset(group, name):
        old = group[name]
        values = np.array([item.decode() for item in old[()].ravel()], object).reshape(old.shape)
        scales, labels = [axis[0] for axis in old.dims], {key: old.attrs[key] for key in ("units", "long_name")}
        del group[name]
        new = group.create_dataset(name, data=values, dtype=text)
        new.attrs.update(labels)
        for axis, scale in enumerate(scales):
            new.dims[axis].attach_scale(scale)

    with h5py.File(path, "r+") as file:
        for group in (file, file["walk"]):
            replace_attributes(group)
            for name, member in list(group.items()):
                if isinstance(member, h5py.Dataset):
                    replace_attributes(member)
                    if h5py.check_string_dtype(member.dtype) is not None:
                        replace_dataset(group, name)
        file.attrs["schema_version"] = 2
    image = path.read_bytes()
    end = artifact.SEAL.search(image)
    image = image[: end.start()] if end else image
    path.write_bytes(image + f"\nwalkerlab sha256 {hashlib.sha256(image).hexdigest()}\n".encode())


def test_artifact_of_the_previous_layout_is_readable_but_outdated(tmp_path, texts, identity, origin):
    older = replace(identity, schema_version=2)
    path = tmp_path / "a.h5"
    artifact.write(path, texts, older, origin)
    in_layout_2(path)
    with h5py.File(path) as file:
        for name in (*TEXTS, "alone", "none"):
            assert h5py.check_string_dtype(file[name].dtype).length is None
    read = artifact.read(path)
    assert read.digest() == texts.digest()
    assert (read.identity, read.summary) == (older, texts.summary)
    assert artifact.check(path, older.key).accepted
    assert artifact.check(path, identity.key).reason == "made for another key"
