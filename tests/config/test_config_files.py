"""Check that any file is either read as a config or rejected with a message."""

import os
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from walkerlab.config.loader import load
from walkerlab.config.reader import MAX_CHARACTERS
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError

Write = Callable[..., Path]
BOMB = b"a: &a [x,x]\nb: &b [*a,*a]\nc: [*b,*b]\n"


def test_missing_file_is_reported_with_similar_names(write: Write, tmp_path: Path) -> None:
    write("name: mine\n", "experiment.yaml")
    with pytest.raises(ConfigError, match=r"there is no config .*experimnt\.yaml; did you mean .*experiment\.yaml\?"):
        load(tmp_path / "experimnt.yaml")


def test_folder_is_not_accepted_as_config(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is a folder"):
        load(tmp_path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs /dev/zero")
def test_endless_device_is_not_accepted_as_config() -> None:
    with pytest.raises(ConfigError, match="not a regular file"):
        load(Path("/dev/zero"))


def test_reading_a_pipe_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match="not a regular file"):
        load(tmp_path / "pipe.yaml")


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs a file that cannot be read even by root")
def test_unreadable_file_is_rejected() -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        load(Path("/proc/self/mem"))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_file_without_permission_is_rejected(write: Write) -> None:
    path = write("name: mine\n")
    path.chmod(0)
    with pytest.raises(ConfigError, match="permission denied"):
        load(path)


@pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "\udcff.yaml", "no/such/folder/x.yaml", ""])
def test_impossible_path_is_rejected(name: str) -> None:
    with pytest.raises(ConfigError):
        load(Path(name))


def test_link_to_itself_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load(tmp_path / "loop.yaml")


@pytest.mark.parametrize(
    "data",
    [
        b"\x89HDF\r\n\x1a\n\x00\x00",
        b"\xff\xfea\x00:\x00",
        b"\x7fELF\x02\x01",
        b"a: \xc3\x28\n",
        BOMB,
        b"\x00" * 100,
    ],
)
def test_junk_is_rejected_with_line_and_column(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "junk.yaml"
    path.write_bytes(data)
    with pytest.raises(ConfigError, match=r"junk\.yaml:\d+:\d+: "):
        load(path)


def test_position_of_an_invalid_utf8_byte_is_counted_in_characters(tmp_path: Path) -> None:
    path = tmp_path / "junk.yaml"
    path.write_bytes("a: 1\nä: ".encode() + b"\xff\n")
    with pytest.raises(ConfigError, match=r"junk\.yaml:2:4: byte 0xff is not UTF-8"):
        load(path)


def test_huge_file_is_rejected_without_reading_it(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    tracemalloc.start()
    with pytest.raises(ConfigError, match="not a config"):
        load(path)
    most_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most_bytes < 100 * MAX_CHARACTERS  # the file has 2^40 bytes


def test_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "marked.yaml"
    path.write_bytes(b"\xef\xbb\xbfslope_deg: 2\r\nstrides: 3\r\n")
    assert load(path).config.strides == 3


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=120))
def test_arbitrary_bytes_load_or_raise_config_error(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "any.yaml"
    path.write_bytes(data)
    with suppress(ConfigError):
        assert isinstance(load(path).config, Config)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.data())
def test_damaged_paper_config_loads_or_raises_config_error(tmp_path: Path, data: st.DataObject) -> None:
    text = (Path(__file__).parents[2] / "configs" / "paper.yaml").read_text(encoding="utf-8")
    at = data.draw(st.integers(0, len(text)))
    length = data.draw(st.integers(0, 40))
    junk = data.draw(st.text(alphabet=" \n\t[]{}:,#&*!|>'\"%@`-?0e.ax", max_size=12))
    path = tmp_path / "damaged.yaml"
    path.write_text(text[:at] + junk + text[at + length :], encoding="utf-8")
    with suppress(ConfigError):
        assert isinstance(load(path).config, Config)
