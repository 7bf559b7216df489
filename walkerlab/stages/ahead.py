"""Kernels of a later stage compiled in a second process while an earlier stage compiles its own.

On a new machine both would else wait for the compiler, one after the other. What is compiled goes into the cache that
all processes share; if the second process fails, the stage compiles for itself.
"""

from __future__ import annotations

import contextlib
import importlib
import signal
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.process import BaseProcess

from walkerlab.config.schema import Config
from walkerlab.stages.graph import Stage


class Ahead:
    """The second process, if there is one."""

    def __init__(self) -> None:
        """Nothing is compiled ahead so far."""
        self._process: BaseProcess | None = None
        self.begun = False

    def begin(self, later: Sequence[Stage], config: Config) -> None:
        """Compile for the first of the later stages that takes long to compile."""
        self.begun = True
        slow = [stage for stage in later if stage.compiles_long]
        if slow:
            self._process = get_context("spawn").Process(target=compile_for, args=(slow[0].module, config), daemon=True)
            self._process.start()

    def wait_for(self, stage: Stage) -> None:
        """Let the second process end before the stage that it works for."""
        if self._process is not None and stage.compiles_long:
            self._process.join()
            self._process = None


def compile_for(module: str, config: Config) -> None:
    """What the second process does."""
    # an interrupt is the first process's to deal with
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(Exception):
        importlib.import_module(module).compile_kernels(config)
