"""Tests of checkpoints: complete entries survive, but incomplete ones and those of another result do not."""

import math

import pytest

from walkerlab.errors import StorageError
from walkerlab.pipeline.store.files import Checkpoint, line

NUMBERS = [0.1, math.pi, 1e-300, -0.0, 5e-324, 1.7976931348623157e308, 3.0]


@pytest.fixture
def path(tmp_path):
    checkpoint = Checkpoint(tmp_path / "x.parts", "key")
    checkpoint.keep("one", NUMBERS)
    checkpoint.keep("two", [2.0])
    return checkpoint.path


def test_checkpointed_values_are_restored_bit_for_bit(path):
    kept = Checkpoint(path, "key").kept
    assert [number.hex() for number in kept["one"]] == [number.hex() for number in NUMBERS]
    assert list(kept) == ["one", "two"]


@pytest.mark.parametrize("cut", range(1, 21))
def test_truncated_last_line_of_a_checkpoint_is_dropped_and_rewritten(path, cut):
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    checkpoint = Checkpoint(path, "key")
    assert list(checkpoint.kept) == ["one"]
    checkpoint.keep("two", [2.0])
    assert path.read_bytes() == whole


def test_checkpoint_lines_after_a_damaged_one_are_dropped(path):
    path.write_bytes(path.read_bytes().replace(b"0.1", b"0.2"))
    assert Checkpoint(path, "key").kept == {}


@pytest.mark.parametrize("forged", [b"\n", b"x\n", line(3), line(["a"]), line(["a", ["b"]]), line({"a": 1, "b": 2})])
def test_malformed_checkpoint_line_is_dropped(path, forged):
    with path.open("ab") as file:
        file.write(forged)
    assert list(Checkpoint(path, "key").kept) == ["one", "two"]


def test_checkpoint_of_another_key_stays_until_the_first_new_part_is_stored(path):
    before = path.read_bytes()
    checkpoint = Checkpoint(path, "other")
    assert checkpoint.kept == {}
    assert path.read_bytes() == before
    checkpoint.keep("three", [3.0])
    assert Checkpoint(path, "other").kept == {"three": [3.0]}
    assert Checkpoint(path, "key").kept == {}


def test_forgetting_a_checkpoint_deletes_its_file_but_new_parts_can_still_be_kept(path):
    checkpoint = Checkpoint(path, "key")
    checkpoint.forget()
    assert not path.exists()
    checkpoint.keep("one", [1.0])
    assert Checkpoint(path, "key").kept == {"one": [1.0]}


def test_missing_folder_is_reported(tmp_path):
    with pytest.raises(StorageError):
        Checkpoint(tmp_path / "nowhere" / "x.parts", "key").keep("one", [1.0])
