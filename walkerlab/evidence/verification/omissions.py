"""Parts of the verification that a config leaves out, known before anything is loaded or run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkerlab.scene.omissions import Entry, omission
from walkerlab.scene.studies import is_studied

if TYPE_CHECKING:
    from walkerlab.config.reads import CompassCasesConfig, SceneCasesConfig


def verification_omissions(config: CompassCasesConfig | SceneCasesConfig) -> tuple[Entry, ...]:
    """List the omitted parts of the verification, or return () for the paper's compass."""
    if is_studied(config):
        return ()
    return (
        omission(
            "the named extreme cases",
            "they are cases of the paper's compass; this walker has cases of its own",
            "about a hundred cases",
        ),
        omission("ordinary methods on the extreme cases", "they are tested on the paper's compass", "8 runs per case"),
    )
