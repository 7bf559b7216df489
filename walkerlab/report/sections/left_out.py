"""What is not in this report, and why."""

from __future__ import annotations

from walkerlab.report.blocks import Column, Paragraph, Section, table
from walkerlab.report.results import Absent, Results


def section(results: Results) -> Section:
    """Results that were not computed, and parts of results that were left out."""
    rows = [[absent.what, absent.why] for absent in everything_absent(results)]
    if not rows:
        said = Paragraph("Nothing: every result that the pipeline has is there.")
        return Section("left-out", "Left out", (said,))
    columns = [Column("what"), Column("why", wide=True)]
    missing = table("What was left out of this scene, and why", columns, rows, wordy=True)
    return Section("left-out", "Left out", (missing,))


def everything_absent(results: Results) -> list[Absent]:
    """What is missing as a whole, then what results say that they left out."""
    found = list(results.absent)
    for result in results.stored.values():
        found += [Absent(str(entry["what"]), str(entry["why"])) for entry in result.summary.get("left_out", [])]
    return list(dict.fromkeys(found))
