"""Results that the stages store for a small run of the paper's walker. Other tests derive their results from them."""

import functools
from dataclasses import replace

import pytest

from walkerlab.config.loader import load
from walkerlab.physics.orbits import family_search, two_parameters
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.store.content import Group, Variable

SMALL = {
    "fixedpoint": (),
    "simulate": (),
    "contact-sim": (),
    "compare": (),
    "tune": ("tune.cells=3", "tune.rigid_limit=false"),
    "continuation": (
        "continuation.over=slope_deg", "continuation.from=4.3", "continuation.to=4.8", "continuation.periods=2",
        "continuation.points=10", "continuation.model=rigid",
        "continuation.second={over: walker.hip_mass_kg, from: 9.9, to: 10.1}",
    ),
}  # fmt: skip
MEMORY = MemoryResults()


@functools.cache
def real(stage):
    """Return the result of a stage on a walk of two strides, computed once per test run."""
    config = load(None, ["strides=2", *SMALL[stage]]).config
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(two_parameters, "PLANE_CELLS", (3, 2))
        patch.setattr(family_search, "OTHER_GAIT_VALUES", 2)
        patch.setattr(family_search, "SCATTERED", 4)
        few = replace(family_search.THOROUGHNESS["rigid"], values=24, transient=200, exponents=2, averaged=200)
        patch.setitem(family_search.THOROUGHNESS, "rigid", few)
        return answer_in_memory(config, stage, MEMORY)


def first_steps(stage, steps):
    """Return the trajectory of a walk up to the end of one of its steps."""
    result = real(stage)
    trajectory = result.groups["trajectory"]
    end = result.summary["touch_times_s"][min(max(steps, 1), result.summary["steps"]) - 1]
    keep = trajectory["time"] <= end
    cut = {
        name: Variable(one.values[keep], one.dims, one.units, one.long_name) if one.dims[0] == "time" else one
        for name, one in trajectory.variables.items()
    }
    return Group(cut, trajectory.attrs)
