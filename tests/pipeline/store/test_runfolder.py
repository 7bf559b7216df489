import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import walkerlab
from walkerlab.errors import LockedError, StorageError
from walkerlab.pipeline.store.runs import RunFolder

HOLD = """
import sys, time
from pathlib import Path
from walkerlab.pipeline.store.runs import RunFolder
with RunFolder(Path(sys.argv[1]), "paper").locked():
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def folder(tmp_path):
    return RunFolder(tmp_path / "runs", "paper")


@pytest.fixture
def holder(folder):
    """Start another process that holds the lock of the folder."""
    environment = {**os.environ, "PYTHONPATH": str(Path(walkerlab.__file__).parent.parent)}
    command = [sys.executable, "-c", HOLD, folder.runs_dir]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_run_folder_has_the_documented_layout(folder):
    assert folder.path == folder.runs_dir / "paper"
    assert folder.artifact("contact-sim") == folder.path / "contact-sim.h5"
    assert not folder.path.exists()


def test_locked_folder_raises_an_error_at_once_if_waiting_is_off(folder, holder):
    with pytest.raises(LockedError) as caught, folder.locked(wait=False):
        pass
    assert caught.value.exit_code == 6


def test_lock_is_released_when_its_process_dies(folder, holder):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    with folder.locked(wait=False):
        pass


def test_waiting_for_the_lock_is_reported_and_succeeds(folder, holder):
    said = []

    def say(text):
        said.append(text)
        threading.Timer(0.1, holder.kill).start()

    with folder.locked(wait=True, say=say):
        assert holder.wait() == -signal.SIGKILL
    assert len(said) == 1
    assert "waiting" in said[0]


def test_folder_names_the_process_that_works_in_it(folder, holder):
    assert folder.worker().process == holder.pid
    (folder.path / ".worker.json").write_text("{}")
    assert folder.worker() is None
    with pytest.raises(LockedError, match="another walkerlab process is working"), folder.locked(wait=False):
        pass


def test_lock_is_released_after_a_failure(folder):
    with pytest.raises(KeyboardInterrupt), folder.locked():
        raise KeyboardInterrupt
    with folder.locked(wait=False):
        pass


def test_leftovers_of_killed_writers_are_deleted_under_the_lock(folder):
    folder.path.mkdir(parents=True)
    (folder.path / ".simulate.h5.12345678.tmp").touch()
    with folder.locked():
        assert sorted(entry.name for entry in folder.path.iterdir()) == [".lock", ".worker.json"]
    assert [entry.name for entry in folder.path.iterdir()] == [".lock"]


def test_folder_that_cannot_be_created_is_reported(tmp_path, unprivileged):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StorageError, match="could not be stored"), RunFolder(tmp_path / "file", "paper").locked():
        pass
    with pytest.raises(StorageError, match="could not be stored"), RunFolder(tmp_path, "file").locked():
        pass
    tmp_path.chmod(0o555)
    with unprivileged(), pytest.raises(StorageError), RunFolder(tmp_path, "paper").locked():
        pass
    tmp_path.chmod(0o755)
