"""Check that all kernels of a config's stages are compiled ahead, and that the same walks run without a compiler."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# It needs a fresh process, because this one has loaded kernels for other tests.
AHEAD_THEN_RUN = """
import sys
from pathlib import Path
from walkerlab.config.loader import load
from walkerlab.physics.compiler import files_in_use
from walkerlab.pipeline.run.compile_ahead import PARTS
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.plan.results import MemoryResults

name, *sets = sys.argv[1:]
config = load(Path(name), ("strides=1", *sets)).config
for part in PARTS:
    part(config)
ahead = sorted(files_in_use)
assert len(ahead) >= 7, ahead
memory = MemoryResults()
for stage in ("fixedpoint", "simulate", "contact-sim"):
    if stage != "contact-sim" or config.contact is not None:
        answer_in_memory(config, stage, memory)
assert sorted(files_in_use) == ahead, files_in_use.difference(ahead)
"""


@pytest.mark.parametrize(
    "arguments",
    [["paper"], ["paper", "contact.stance=pinned"], ["kneed"], ["torso"], ["simplest"], ["kuo", "outputs=[]"]],
    ids=" ".join,
)
def test_precompilation_covers_every_kernel_of_the_walks(arguments):
    process = subprocess.run([sys.executable, "-c", AHEAD_THEN_RUN, *arguments], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


INTERPRETED = """
import numba
from walkerlab.config.loader import load
from walkerlab.physics.hybrid.rigid_walk import walk
from walkerlab.physics.orbits.fixed_point import SearchSettings, find_gaits
from walkerlab.scene.rigid import rigid_walker
assert not hasattr(walk, "py_func") or not numba.config.DISABLE_JIT
gaits = find_gaits(rigid_walker(load(None, ()).config), settings=SearchSettings(random_starts=2)).gaits
print(len(gaits), *(f"{gait.period:.10f}" for gait in gaits))
"""


def test_same_gaits_are_found_without_a_compiler():
    def gaits(**changes):
        command = [sys.executable, "-c", INTERPRETED]
        return subprocess.check_output(command, env={**os.environ, **changes}, text=True)

    assert gaits(NUMBA_DISABLE_JIT="1") == gaits()


def test_wheels_have_platform_tags_that_indexes_accept():
    pytest.importorskip("hatchling")
    tags = pytest.importorskip("packaging.tags")
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "scripts" / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    tag = module.wheel_tag()
    assert tag in {str(each) for each in tags.sys_tags()}
    assert re.fullmatch(r"cp3\d+-none-(manylinux_2_17|macosx_11_0|win)_\w+", tag)
