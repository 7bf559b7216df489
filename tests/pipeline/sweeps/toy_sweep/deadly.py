"""Some seeds end the process, one raises, one ends it the first time only; the others take a moment."""

import os
import signal
import time
from pathlib import Path

from walkerlab.pipeline.store.content import Content

ALWAYS, RAISES, ONCE = 13, 7, 21


def run(config, inputs, progress):
    if config.seed == RAISES:
        raise ZeroDivisionError("a bug")
    once = Path(os.environ.get("TOY_SWEEP_ONCE", "/nowhere"))
    if config.seed == ALWAYS or (config.seed == ONCE and once.parent.is_dir() and not once.exists()):
        if config.seed == ONCE:
            once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(float(os.environ.get("TOY_SWEEP_PAUSE", "0")))
    return Content({}, {"twice": 2 * config.seed})
