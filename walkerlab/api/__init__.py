"""Python interface: runs in folders, like those of the command line, or in memory."""

import warnings

from walkerlab.api import memory
from walkerlab.api.memory import *  # noqa: F403 (it lists its names)
from walkerlab.api.models import export_model, mujoco_model
from walkerlab.api.results import Gait, Result, dataset
from walkerlab.api.runs import Run, open_run, run, sweep
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.extensions import check_names

check_names(warnings.warn)

__all__ = [
    *memory.__all__, "Config", "ConfigError", "Gait", "Result", "Run", "dataset", "export_model", "mujoco_model",
    "open_run", "run", "sweep",
]  # fmt: skip
