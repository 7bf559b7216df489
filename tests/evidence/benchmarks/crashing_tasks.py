"""Tasks that crash, fail or never end, as engines may."""

import os
import signal
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Answers:
    number: int

    def run(self):
        print("engines talk")
        return self.number


@dataclass(frozen=True)
class Crashes:
    def run(self):
        os.kill(os.getpid(), signal.SIGSEGV)


@dataclass(frozen=True)
class Raises:
    def run(self):
        raise RuntimeError("bad model")


@dataclass(frozen=True)
class Sleeps:
    def run(self):
        time.sleep(60.0)
