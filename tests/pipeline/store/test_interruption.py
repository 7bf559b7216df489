"""Check that interrupted writers leave the old file and nothing else."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import walkerlab
from walkerlab.errors import StorageError
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.content import Content
from walkerlab.pipeline.store.files import TEMPORARY, remove_leftovers, storage_errors, write_atomically

ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join(map(str, (Path(__file__).parent, Path(walkerlab.__file__).parent.parent))),
}

WRITE_FOR_EVER = """
import itertools, sys
from pathlib import Path
from conftest import full_content
from walkerlab.config.schema import Config
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.provenance import begin
origin = begin(Config(), {})
for number in itertools.count():
    artifact.write(Path(sys.argv[1]), full_content(number, 100_000), Identity("x", {"n": number}, {}, "code"), origin)
    print("written", flush=True)
"""

WRITE_WITH_LITTLE_ROOM = """
import resource, sys
from pathlib import Path
from conftest import full_content
from walkerlab.config.schema import Config
from walkerlab.errors import StorageError
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Identity
from walkerlab.pipeline.store.provenance import begin
resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))
try:
    artifact.write(Path(sys.argv[1]), full_content(), Identity("x", {}, {}, "code"), begin(Config(), {}))
except StorageError as error:
    print(error.exit_code, error.message, error.advice)
"""


def test_killed_writer_leaves_the_old_artifact(tmp_path):
    path = tmp_path / "a.h5"
    for delay in (0.0, 0.005, 0.02, 0.05, 0.08):
        with subprocess.Popen(
            [sys.executable, "-c", WRITE_FOR_EVER, path], env=ENVIRONMENT, stdout=subprocess.PIPE
        ) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == b"written\n"
            time.sleep(delay)
            os.kill(writer.pid, signal.SIGKILL)
        found = artifact.read(path)
        assert found["corrected/walk"]["state"].shape == (100_000, 2)
    remove_leftovers(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.h5"]


def test_full_disk_leaves_the_old_artifact(tmp_path, identity, origin):
    path = tmp_path / "a.h5"
    artifact.write(path, Content({}, {"x": 1}), identity, origin)
    before = path.read_bytes()
    command = [sys.executable, "-c", WRITE_WITH_LITTLE_ROOM, path]
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.stdout.startswith("4 "), done.stderr
    assert "could not be stored" in done.stdout
    assert done.stderr == ""
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.h5"]


def test_read_only_folder_leaves_the_old_artifact(tmp_path, content, identity, origin, unprivileged):
    path = tmp_path / "a.h5"
    artifact.write(path, Content({}, {"x": 1}), identity, origin)
    tmp_path.chmod(0o555)
    try:
        with unprivileged(), pytest.raises(StorageError, match="could not be stored") as caught:
            artifact.write(path, content, identity, origin)
    finally:
        tmp_path.chmod(0o755)
    assert "--runs" in caught.value.advice
    assert artifact.read(path).summary == {"x": 1}
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.h5"]


def test_missing_folder_is_reported(tmp_path):
    with pytest.raises(StorageError, match="there is no folder"):
        write_atomically(tmp_path / "gone" / "a", b"")


def test_storage_failures_are_distinguished_from_other_failures(tmp_path):
    with pytest.raises(StorageError, match="No space left"), storage_errors(tmp_path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(FileNotFoundError), storage_errors(tmp_path):
        (tmp_path / "template that was not shipped").read_text()


def test_only_temporary_files_count_as_leftovers(tmp_path):
    (tmp_path / "figures").mkdir()
    kept = [tmp_path / "a.h5", tmp_path / "notes.tmp", tmp_path / ".hidden", tmp_path / "figures" / "figure-02.svg"]
    left = [tmp_path / ".a.h5.12345678.tmp", tmp_path / "figures" / ".figure-02.svg.12345678.tmp"]
    for path in kept + left:
        path.touch()
    assert remove_leftovers(tmp_path) == sorted(left)
    assert all(path.exists() for path in kept)
    assert not list(tmp_path.rglob(TEMPORARY))
