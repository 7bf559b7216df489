"""What the verification does without under a config; known before anything is loaded or run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkerlab.scene.omissions import Entry, omission
from walkerlab.scene.studies import is_studied

if TYPE_CHECKING:
    from walkerlab.config.reads import CompassCasesConfig, SceneCasesConfig


def of_verification(config: CompassCasesConfig | SceneCasesConfig) -> tuple[Entry, ...]:
    """Return what the verification of another walker than the paper's compass does without."""
    if is_studied(config):
        return ()
    return (
        omission(
            "the named extreme cases",
            "they are the paper's compass's; this walker has its own",
            "about a hundred cases",
        ),
        omission("ordinary methods on the extreme cases", "they are shown on the paper's compass", "8 runs a case"),
    )
