"""Exported names of the package, for type checkers."""

from walkerlab.api import (
    Gait,
    Result,
    Run,
    basin,
    compass,
    contact,
    continue_gait,
    dataset,
    design,
    explore,
    export_model,
    find_gait,
    identify,
    kneed,
    mujoco_model,
    open_run,
    plan_measurements,
    read_walk,
    robustness,
    run,
    simulate,
    sweep,
    walker,
)
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError

__version__: str
EXTENSIONS: dict[str, str]

__all__ = [
    "Config",
    "ConfigError",
    "Gait",
    "Result",
    "Run",
    "basin",
    "compass",
    "contact",
    "continue_gait",
    "dataset",
    "design",
    "explore",
    "export_model",
    "find_gait",
    "identify",
    "kneed",
    "mujoco_model",
    "open_run",
    "plan_measurements",
    "read_walk",
    "robustness",
    "run",
    "simulate",
    "sweep",
    "walker",
]
