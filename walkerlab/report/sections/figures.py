"""The figures, with their captions."""

from __future__ import annotations

from walkerlab.report.blocks import Section
from walkerlab.report.results import Results


def section(results: Results) -> Section | None:
    """All figures that were drawn."""
    if not results.pictures:
        return None
    return Section("figures", "Figures", results.pictures)
