"""Depending on the seed, end the process (always or only once), raise an error, need much memory, or take a moment."""

import os
import signal
import time
from pathlib import Path

from walkerlab.pipeline.store.content import Content

ALWAYS, RAISES, ONCE, GREEDY = 13, 7, 21, 29


def run(config, inputs, progress):
    if config.seed == RAISES:
        raise ZeroDivisionError("a bug")
    once = Path(os.environ.get("TOY_SWEEP_ONCE", "/nowhere"))
    if config.seed == ALWAYS or (config.seed == ONCE and once.parent.is_dir() and not once.exists()):
        if config.seed == ONCE:
            once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if config.seed == GREEDY and "TOY_SWEEP_GREED" in os.environ:
        kept = bytearray(int(os.environ["TOY_SWEEP_GREED"]))
        # Write into each page, so that the system really provides the memory.
        kept[:: 1 << 12] = b"x" * len(kept[:: 1 << 12])
        time.sleep(5.0)  # long enough for whoever watches the memory to notice
    time.sleep(float(os.environ.get("TOY_SWEEP_PAUSE", "0")))
    return Content({}, {"twice": 2 * config.seed})
