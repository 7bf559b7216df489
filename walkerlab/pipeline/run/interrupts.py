"""Signals that stop a command: they raise an error in the main thread, but not inside LLVM callbacks, which lose it."""

import _thread
import os
import signal
import threading
import time
from types import FrameType

SOON_S = 0.02
CALLED_BACK = "_raw_object_cache"
"""Prefix of the names of functions that LLVM calls after compiling or loading; errors raised in them are lost."""

STORING_PATIENCE_S = 1.0
"""Time that a command has to store finished results after its parent has ended."""


def raise_on(number: int, error: type[BaseException]) -> None:
    """Make a signal raise an error. Inside an LLVM callback, send the signal again shortly afterwards."""
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
    """Whether a frame or one of its callers is an LLVM callback."""
    while frame is not None:
        if frame.f_code.co_name.startswith(CALLED_BACK):
            return True
        frame = frame.f_back
    return False


def end_with_parent() -> None:
    """End this process and everything it has started as soon as its parent is gone.

    This process must lead its session; the parent must hold the other end of standard input and never write to it.
    """

    def watch() -> None:
        os.read(0, 1)
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(STORING_PATIENCE_S)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
