"""What the paper's adjustment does without under a config; known before anything is loaded or run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkerlab.config.walkers import is_passive_compass
from walkerlab.paper.law import is_own_walker
from walkerlab.scene.omissions import Entry, omission

if TYPE_CHECKING:
    from walkerlab.config.reads import RigidConfig

PAPERS = "it is the paper's procedure with its compass"


def of_adjustment(config: RigidConfig) -> tuple[Entry, ...]:
    """Return what the adjustment of another walker than the paper's compass does without."""
    entries = []
    if not is_passive_compass(config):
        entries.append(omission("the first step with a hinged stance foot", PAPERS, "two walks"))
    if not is_own_walker(config):
        entries.append(omission("the paper's start of its ADAMS model", "it is of the paper's own compass", "a walk"))
    return tuple(entries)
