"""Conditions under which benchmarks run: the machine, and the rule that no foot is pinned at the start."""

import os
import platform
from typing import Any

from walkerlab.config.reads import ContactConfig


def pinning_omissions(config: ContactConfig, measured: str) -> list[dict[str, str]]:
    """Return an omission if the config pins the first stance foot, because measured walks start with both feet free.

    measured  plural noun for what is measured, such as "engines"
    """
    if config.contact is None or config.contact.stance != "pinned":
        return []
    return [{"what": "pinned first step", "why": f"{measured} are measured on a walk whose first stance foot is free"}]


def environment() -> dict[str, Any]:
    return {"processor": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def plain_power(level: float) -> str:
    """Format a power of ten, such as 1e-3."""
    return f"{level:.0e}".replace("e-0", "e-")
