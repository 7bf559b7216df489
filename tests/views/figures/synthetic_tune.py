"""Results of `tune` set by hand, with the parts that figures need: walks, map of starts, and rigid limit."""

import numpy as np
from synthetic_walks import motion, stored

from walkerlab.evidence.paper.figures import ERROR_LOOKS, LIMITS, RUN_TIME
from walkerlab.outcome import Outcome
from walkerlab.pipeline.stages.walk import variables_over_time
from walkerlab.pipeline.store.content import Group, Variable

STEPS = 10
FACTORS = np.linspace(0.0, 2.0, 6)


def walk(period):
    time, _, angle, velocity = motion(STEPS, period, jumps=True)
    touches = {"touch_time_s": Variable(period * np.arange(1, STEPS + 1), ("step",), "s", "touch")}
    return Group(variables_over_time(time=time, angle=angle, velocity=velocity) | touches)


def starts():
    """Return a map with every possible outcome."""
    both = ("stance", "swing")
    outcome = np.resize([int(one) for one in Outcome], (FACTORS.size, FACTORS.size))
    cells = {"outcome": outcome, "steps": np.where(outcome == Outcome.WALKED, STEPS, 1)}
    dims = tuple(f"{name}_factor" for name in both)
    axes = {name: Variable(FACTORS, (name,), "1", name) for name in dims}
    cells |= {f"rigid_{name}": values for name, values in cells.items()}
    maps = {name: Variable(values, dims, "1", name) for name, values in cells.items()}
    marks = {f"{name}_{one}_factor": 1.1 for name in ("adjusted", "gait") for one in both}
    return Group(axes | maps, {**marks, "steps_wanted": STEPS})


def limit(run_times):
    columns = {name: Variable(0.1 * 10.0 ** -np.arange(4.0), ("setting",), "1", name) for name in ERROR_LOOKS}
    return Group(columns | {RUN_TIME: Variable(np.array(run_times), ("setting",), "s", "run time")})


def tuned(run_times=(0.021, 0.024, 0.03, 0.067)):
    """Return the result of `tune` for a walker other than the paper's."""
    groups = {"rigid_start": walk(0.7), "adjusted": walk(0.71), "map": starts()}
    groups |= {name: limit(run_times) for name, _ in LIMITS}
    adjustment = {"needed": True, "scale_dtheta1": 1.2, "scale_dtheta2": 0.9, "walked_steps": STEPS}
    shares = {"cells": 36, "walks_share": 0.1, "rigid": {"walked": 4}}
    summary = {"procedure": {"adjusted": {"outcome": "walked"}}, "adjustment": adjustment, "map": shares}
    return {"tune": stored("tune", groups, summary)}
