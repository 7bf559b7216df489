"""The figures, with their captions."""

from __future__ import annotations

from walkerlab.report.blocks import MAIN, Gallery, PageBlock, Paragraph, Section
from walkerlab.report.results import Results


def section(results: Results) -> Section | None:
    """The figures of the walks and gaits."""
    shown = tuple(picture for picture in results.pictures if picture.page == MAIN)
    if not shown:
        return None
    blocks: list[PageBlock] = [Gallery(shown)]
    if results.of_the_paper:
        blocks.insert(0, Paragraph("Figures have the numbers that they have in the paper. A click enlarges one."))
    return Section("figures", "Figures", tuple(blocks))
