"""Kernels compiled ahead in another process are those that the stage calls; a bug there is seen, and harms nothing."""

import subprocess
import sys
from dataclasses import replace

import pytest

from walkerlab.config.loader import load
from walkerlab.pipeline import executor
from walkerlab.pipeline.graph import PIPELINE, Graph
from walkerlab.pipeline.store.artifact import read
from walkerlab.pipeline.task import Precompiler
from walkerlab.pipeline.workers import WorkerPool

# in a process of its own: here other tests have compiled already
COMPILED_THEN_RUN = """
import os
from walkerlab.config.loader import load
from walkerlab.physics.hybrid import contact_result
from walkerlab.pipeline.stages import contact_sim
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.content import Content

def compiled():
    kernels = (vars(contact_result)[name] for name in sorted(vars(contact_result)))
    return [len(kernel.signatures) for kernel in kernels if hasattr(kernel, "signatures")]

def check(sets):
    config = load(None, ("strides=1", *sets)).config
    contact_sim.compile_kernels(config)
    ahead = compiled()
    gait = Content({}, {"state": [-0.204200, 0.169400, -0.605819, -0.861041], "step_length_m": 0.3714303})
    contact_sim.run(config, {"fixedpoint": gait}, Silent())
    assert any(ahead), (sets, ahead)
    assert compiled() == ahead, (sets, ahead, compiled())

for sets in [(), ("contact.stance=pinned",), ("outputs=[]",)]:
    if not (child := os.fork()):  # each begins without compiled kernels
        check(sets)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
"""


def test_what_is_compiled_ahead_is_all_that_the_stage_calls():
    process = subprocess.run([sys.executable, "-c", COMPILED_THEN_RUN], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


BROKEN = """

def compile_kernels(config):
    raise ZeroDivisionError("a kernel that does not compile")
"""
REFUSED = """

def compile_kernels(config):
    from walkerlab.errors import ConfigError
    raise ConfigError("which the stage itself will tell")
"""


@pytest.fixture
def compiling_bounce(toy, monkeypatch):
    """The toy pipeline as on a new machine, with other words to compile the kernels of its stage `bounce`."""

    def with_kernels(source):
        with (toy.source / "toy" / "bounce.py").open("a") as file:
            file.write(source)
        with (toy.source / "toy" / "__init__.py").open("a") as file:
            file.write("\nimport walkerlab.physics.kernels\n")
        monkeypatch.setenv("WALKERLAB_CACHE", str(toy.source / "nothing-compiled"))
        monkeypatch.setattr(executor, "nothing_compiled_yet", lambda: True)
        compiled = {"bounce": "compile_kernels"}
        toy.graph = Graph(*(replace(stage, precompile=compiled.get(stage.name, "")) for stage in toy.graph.stages))
        return toy

    return with_kernels


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_bug_in_kernels_compiled_ahead_is_raised_once_the_stages_have_run(compiling_bounce, jobs):
    toy = compiling_bounce(BROKEN)
    with pytest.raises(ZeroDivisionError, match="does not compile") as caught:
        toy.execute("page", jobs=jobs)
    assert "bounce.py" in caught.value.__notes__[0]
    assert read(toy.runs / "paper" / "bounce.h5").complete
    assert (toy.runs / "paper" / "report.html").exists()


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_user_can_act_on_is_left_to_the_stage_to_tell(compiling_bounce, jobs):
    report = compiling_bounce(REFUSED).execute("page", jobs=jobs)
    assert report.artifact is not None
    assert report.no_answer is None


def test_nothing_is_begun_for_stages_that_compile_fast():
    with WorkerPool(1) as pool:
        precompiler = Precompiler(pool, load(None, ()).config)
        for name in ("compare", "plot"):
            assert precompiler.begin(PIPELINE[name], only_first=False) is None
