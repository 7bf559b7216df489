"""Signals that end what runs: they raise an error in the main thread, and not where that would be dropped."""

import _thread
import os
import signal
import threading
import time
from types import FrameType

SOON_S = 0.02
CALLED_BACK = "_raw_object_cache"
"""How the functions begin that LLVM calls when it has compiled or loaded something; what they raise is lost."""

PATIENCE_S = 1.0
"""How long a command may take to keep what is finished, once the process that started it has ended."""


def raise_on(number: int, error: type[BaseException]) -> None:
    """Have a signal raise an error from now on; where LLVM has called back, as soon as it has gone on."""
    again: list[threading.Timer] = []

    def arrived(number: int, frame: FrameType | None) -> None:
        while again:
            again.pop().cancel()
        if not is_called_back(frame):
            raise error
        again.append(threading.Timer(SOON_S, _thread.interrupt_main, (number,)))
        again[0].start()

    signal.signal(number, arrived)


def is_called_back(frame: FrameType | None) -> bool:
    """Whether a frame, or one that called it, is of a function that LLVM has called."""
    while frame is not None:
        if frame.f_code.co_name.startswith(CALLED_BACK):
            return True
        frame = frame.f_back
    return False


def end_with_parent() -> None:
    """End this process, the leader of its session, and all it has started once its parent is gone, however that ended.

    The parent holds the other end of standard input and never writes to it.
    """

    def watch() -> None:
        os.read(0, 1)
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(PATIENCE_S)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
