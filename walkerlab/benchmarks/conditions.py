"""What measurements have in common: the machine, the walk they are made on, and how levels of error are written."""

import os
import platform
from typing import Any

from walkerlab.config.reads import ContactConfig


def hinge_left_out(config: ContactConfig, measured: str) -> list[dict[str, str]]:
    """Return, if the config has a hinged first step, that the walk measured on has none."""
    if config.contact is None or config.contact.stance != "pinned":
        return []
    return [{"what": "hinged first step", "why": f"{measured} are measured on a walk that is free from its start"}]


def environment() -> dict[str, Any]:
    """Return what run times depend on."""
    return {"processor": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def plain_power(level: float) -> str:
    """Return a power of ten as text, such as 1e-3."""
    return f"{level:.0e}".replace("e-0", "e-")
