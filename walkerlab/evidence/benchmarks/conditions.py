"""Conditions of benchmarks: machine, omission of a pinned first step; and formatting of error levels."""

import os
import platform
from typing import Any

from walkerlab.config.reads import ContactConfig


def hinge_left_out(config: ContactConfig, measured: str) -> list[dict[str, str]]:
    """Return an omission entry if the config hinges the first step, because measured walks have no hinge."""
    if config.contact is None or config.contact.stance != "pinned":
        return []
    return [{"what": "pinned first step", "why": f"{measured} are measured on a walk without a hinge"}]


def environment() -> dict[str, Any]:
    return {"processor": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def plain_power(level: float) -> str:
    """Format a power of ten, such as 1e-3."""
    return f"{level:.0e}".replace("e-0", "e-")
