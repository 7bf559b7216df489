"""Python interface: runs in folders, like those of the command line, or in memory."""

import warnings

from walkerlab.api.memory import (
    basin,
    check,
    compass,
    contact,
    continue_gait,
    design,
    explore,
    find_gait,
    identify,
    kneed,
    plan_measurements,
    read_walk,
    robustness,
    simulate,
    walker,
)
from walkerlab.api.models import export_model, mujoco_model
from walkerlab.api.results import Gait, Result, dataset
from walkerlab.api.runs import Run, open_run, run, sweep
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.extensions import check_names

check_names(warnings.warn)

__all__ = [
    "Config", "ConfigError", "Gait", "Result", "Run", "basin", "check", "compass", "contact", "continue_gait",
    "dataset", "design", "explore", "export_model", "find_gait", "identify", "kneed", "mujoco_model", "open_run",
    "plan_measurements", "read_walk", "robustness", "run", "simulate", "sweep", "walker",
]  # fmt: skip
