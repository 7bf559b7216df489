"""Functions that workers call in tests."""

import atexit
import os
import signal
import sys
import time

from walkerlab.errors import NoAnswer
from walkerlab.pipeline.run.workers import map_in_order, tell


def square(number):
    return number * number


def own_id(_number=0):
    return os.getpid()


def sleep():
    time.sleep(600.0)


def begun_at():
    begun = time.monotonic()
    time.sleep(1.0)  # This is longer than the time between the starts of two workers.
    return begun


def kill_itself():
    os.kill(os.getpid(), signal.SIGKILL)


def be_told_to_end_twice():
    atexit.register(os.kill, os.getpid(), signal.SIGTERM)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(600.0)


def kill_itself_once(path):
    if not path.exists():
        path.touch()
        kill_itself()
    return numbers()


def numbers(number=0):
    return [float(number)]


def once_a_file_has(path, text, patience_s=60.0):
    """Return 1 as soon as a file contains a text, or 0 if it does not appear in time."""
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline:
        if path.exists() and text in path.read_bytes():
            return numbers(1)
        time.sleep(0.01)
    return numbers()


def leave_with_3():
    sys.exit(3)


def divide_by_zero():
    return 1 / 0


def no_answer():
    raise NoAnswer("nothing is there", "look elsewhere", {"partial": 1})


class NeedsTwoError(Exception):
    def __init__(self, one, two):
        super().__init__(f"{one} and {two}")


def raise_what_cannot_be_sent():
    raise NeedsTwoError(1, 2)


def return_what_cannot_be_sent():
    return lambda: None


def count_to(number):
    for value in range(number):
        tell(value)
    return "done"


def clean_up_at_the_end(path):
    try:
        path.with_suffix(".begun").touch()
        time.sleep(600.0)
    finally:
        path.touch()


def interrupt_handler():
    return signal.getsignal(signal.SIGINT)


def squares_of_workers_own(count):
    from functools import partial

    return list(map_in_order([partial(square, number) for number in range(count)], 2))
