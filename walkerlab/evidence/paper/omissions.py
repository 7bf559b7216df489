"""Parts of the paper's adjustment that do not apply to a config. They are known before anything is loaded or run."""

from walkerlab.config.reads import RigidConfig
from walkerlab.config.walkers import is_passive_compass
from walkerlab.evidence.paper.law import is_own_walker
from walkerlab.scene.omissions import Entry, omission

COMPASS_ONLY = "the paper uses it for its compass only"


def adjustment_omissions(config: RigidConfig) -> tuple[Entry, ...]:
    """Return the omissions for a walker other than the paper's compass."""
    entries = []
    if not is_passive_compass(config):
        entries.append(omission("the first step with a pinned stance foot", COMPASS_ONLY, "two walks"))
    if not is_own_walker(config):
        entries.append(omission("the paper's start of its ADAMS model", "only that compass has it", "a walk"))
    return tuple(entries)
