"""Kernels compiled in a second process are those that the stage calls; a second process that fails harms nothing."""

import subprocess
import sys

import pytest

from walkerlab.config.loader import load
from walkerlab.stages.ahead import Ahead
from walkerlab.stages.graph import PIPELINE, Stage

# in a process of its own: here other tests have compiled already
COMPILED_THEN_RUN = """
import sys
from walkerlab.config.loader import load
from walkerlab.hybrid import contact_run
from walkerlab.stages import contact_sim
from walkerlab.stages.progress import Silent
from walkerlab.store.content import Content

def compiled():
    kernels = (vars(contact_run)[name] for name in sorted(vars(contact_run)))
    return [len(kernel.signatures) for kernel in kernels if hasattr(kernel, "signatures")]

config = load(None, ("strides=1", *sys.argv[1:])).config
contact_sim.compile_kernels(config)
ahead = compiled()
gait = Content({}, {"state": [-0.204200, 0.169400, -0.605819, -0.861041], "step_length_m": 0.3714303})
contact_sim.run(config, {"fixedpoint": gait}, Silent())
assert any(ahead), ahead
assert compiled() == ahead, (ahead, compiled())
"""


@pytest.mark.parametrize("sets", [(), ("contact.stance=pinned",), ("outputs=[]",)])
def test_what_is_compiled_ahead_is_all_that_the_stage_calls(sets):
    process = subprocess.run([sys.executable, "-c", COMPILED_THEN_RUN, *sets], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


def test_a_second_process_that_fails_is_waited_for_and_forgotten():
    stage = Stage("broken", "walkerlab.no_such_module", "Fails.", takes=object, compiles_long=True)
    ahead = Ahead()
    ahead.begin((stage,), load(None, ()).config)
    ahead.wait_for(stage)
    assert ahead._process is None


def test_nothing_is_begun_for_stages_that_compile_fast():
    ahead = Ahead()
    ahead.begin((PIPELINE["compare"], PIPELINE["plot"]), load(None, ()).config)
    assert ahead._process is None
