"""Check that compiled code and pickles, which run when loaded, are loaded only if no other user can write them."""

import contextlib
import os
import pickle
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from walkerlab.private_files import make_private, make_private_folder, may_be_foreign

NOBODY = 65_534
KERNEL = """
from walkerlab.physics.kernels import kernel


@kernel
def tripled(x):
    return 3.0 * x
"""
CALL = """
import sys
sys.path.insert(0, sys.argv[1])
from walkerlab.physics.kernel_cache import cache_folder
from three_times import tripled
print(tripled(2.0), cache_folder())
"""
need_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files of two users")


class Planted:
    """Object that writes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def as_user(user):
    """Return arguments that start a process as another user. For this user there are none."""
    return {} if user == os.geteuid() else {"user": user, "group": user, "extra_groups": []}


@pytest.fixture(scope="module")
def ordinary():
    """Return an ordinary user: this process's or, for root, nobody if that user can read this Python."""
    if os.geteuid() == 0:
        program = [sys.executable, "-B", "-c", "import numba, walkerlab.physics.kernels"]
        with contextlib.suppress(OSError):
            done = subprocess.run(program, cwd="/", capture_output=True, **as_user(NOBODY))
            return NOBODY if done.returncode == 0 else 0
    return os.geteuid()


@pytest.fixture
def home(ordinary):
    """Return a folder that belongs to an ordinary user."""
    folder = Path(tempfile.mkdtemp(prefix="walkerlab-test-"))
    (folder / "three_times.py").write_text(KERNEL)
    os.chown(folder, ordinary, -1)
    yield folder
    shutil.rmtree(folder)


def call(home, cache, user, umask=0o022, **more):
    """Call the kernel in a process whose cache is `cache`. Return the folder of compiled code, and stderr."""
    variables = {"WALKERLAB_CACHE": str(cache), "HOME": str(home), "XDG_CACHE_HOME": str(home / "usual"), **more}
    done = subprocess.run(
        [sys.executable, "-B", "-c", CALL, str(home)],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        umask=umask,
        cwd=home,
        **as_user(user),
    )
    assert done.returncode == 0, done.stderr
    value, folder = done.stdout.split()
    assert value == "6.0"
    return Path(folder), done.stderr


def permissions(folder):
    return {stat.S_IMODE(path.lstat().st_mode) for path in [folder, *folder.rglob("*")] if path.is_dir()}, {
        stat.S_IMODE(path.lstat().st_mode) for path in folder.rglob("*") if path.is_file()
    }


def compiled(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.kernel")}


@pytest.mark.parametrize("umask", [0o002, 0o000, 0o077])
def test_compiled_code_is_private_for_any_umask(home, ordinary, umask):
    cache = home / "deep" / "cache"
    folder, said = call(home, cache, ordinary, umask)
    assert said == ""
    assert folder.parent == cache
    assert permissions(home / "deep") == ({0o700}, {0o600})
    first = compiled(folder)
    assert first
    call(home, cache, ordinary, umask)
    assert compiled(folder) == first


def test_older_group_writable_cache_is_made_private_and_used(home, ordinary):
    cache = home / "cache"
    folder, _ = call(home, cache, ordinary)
    first = compiled(folder)
    for path in [cache, *cache.rglob("*")]:
        path.chmod(0o775 if path.is_dir() else 0o664)
    used, said = call(home, cache, ordinary, 0o002)
    assert (used, said) == (folder, "")
    assert compiled(folder) == first
    assert permissions(cache) == ({0o700}, {0o600})


def test_world_writable_code_is_recompiled(home, ordinary):
    cache = home / "cache"
    folder, _ = call(home, cache, ordinary)
    witness = home / "witness"
    for path in folder.rglob("*.kernel"):
        path.write_bytes(pickle.dumps(Planted(witness)))
        path.chmod(0o666)
    used, said = call(home, cache, ordinary)
    assert used == folder
    assert not witness.exists()
    assert said.count("other users may have written this code") == 1
    assert permissions(cache) == ({0o700}, {0o600})


def test_world_writable_code_folder_is_refilled(home, ordinary):
    cache = home / "cache"
    folder, _ = call(home, cache, ordinary)
    folder.chmod(0o777)
    used, said = call(home, cache, ordinary)
    assert used == folder
    assert "other users may have written this code" in said
    assert permissions(cache) == ({0o700}, {0o600})


@pytest.mark.parametrize("kind", ["file", "generation"])
def test_links_into_the_cache_are_not_followed(home, ordinary, kind):
    cache = home / "cache"
    folder, _ = call(home, cache, ordinary)
    chosen = next(folder.rglob("*.kernel"))
    chosen = {"file": chosen, "generation": folder}[kind]
    elsewhere = home / "elsewhere"
    chosen.rename(elsewhere)
    chosen.symlink_to(elsewhere)
    _, said = call(home, cache, ordinary)
    assert "other users may have written" in said
    assert elsewhere.exists()
    assert not chosen.is_symlink()


def test_cache_that_is_a_link_is_used(home, ordinary):
    (home / "scratch").mkdir(0o700)
    os.chown(home / "scratch", ordinary, -1)
    (home / "cache").symlink_to(home / "scratch")
    folder, said = call(home, home / "cache", ordinary)
    assert said == ""
    assert folder.resolve().parent == home / "scratch"


@need_root
@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o755])
def test_cache_with_code_of_another_user_is_rejected(home, mode):
    cache = home / "cache"
    folder, _ = call(home, cache, 0)
    witness = home / "witness"
    for path in folder.rglob("*.kernel"):
        path.write_bytes(pickle.dumps(Planted(witness)))
    for path in [folder, *folder.rglob("*")]:
        os.chown(path, NOBODY, NOBODY)
    cache.chmod(mode)
    used, said = call(home, cache, 0)
    assert used.parent == home / "usual" / "walkerlab"
    assert not witness.exists()
    assert said.count("holds compiled code of other users: compiled code is kept in") == 1


@need_root
def test_cache_folder_of_another_user_is_rejected(home):
    cache = home / "cache"
    cache.mkdir()
    os.chown(cache, NOBODY, NOBODY)
    used, said = call(home, cache, 0)
    assert used.parent == home / "usual" / "walkerlab"
    assert said.count("belongs to another user") == 1


def test_cache_shared_by_all_users_is_rejected_and_left_untouched(home, ordinary):
    shared = home / "shared"
    shared.mkdir()
    (shared / "file of others").touch()
    shared.chmod(0o1777)
    used, said = call(home, shared, ordinary)
    assert used.parent == home / "usual" / "walkerlab"
    assert said.count("is open to other users") == 1
    assert stat.S_IMODE(shared.stat().st_mode) == 0o1777


@need_root
def test_foreign_files_in_the_cache_are_deleted(home):
    folder = home / "folder"
    make_private_folder(folder / "inner")
    (folder / "inner" / "ours").touch(0o644)
    (folder / "theirs").touch()
    os.chown(folder / "theirs", NOBODY, NOBODY)
    (folder / "all of theirs" / "deep").mkdir(parents=True)
    os.chown(folder / "all of theirs", NOBODY, NOBODY)
    assert may_be_foreign(folder / "theirs")
    assert sorted(make_private(folder)) == [folder / "all of theirs", folder / "theirs"]
    assert [path.name for path in folder.rglob("*")] == ["inner", "ours"]
    assert permissions(folder) == ({0o700}, {0o600})
