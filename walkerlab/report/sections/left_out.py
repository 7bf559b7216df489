"""What is not in this report, and why."""

from __future__ import annotations

from collections.abc import Sequence

from walkerlab.report.blocks import Paragraph, Section
from walkerlab.report.numbers import count, listed
from walkerlab.report.results import Results
from walkerlab.report.tables import Column, table
from walkerlab.scene.left_out import LeftOut


def section(results: Results) -> Section:
    """Results that were not computed, and parts of results that were left out."""
    rows = rows_of(everything_absent(results))
    if not rows:
        said = Paragraph("Nothing: every result that the pipeline has is there.")
        return Section("left-out", "Left out", (said,), "Nothing.")
    columns = [Column("what"), Column("why", wide=True), Column("saves", wide=True)]
    missing = table("What was left out of this scene, why, and what that saves", columns, rows, wordy=True)
    return Section("left-out", "Left out", (missing,), f"{count(len(rows), 'thing')}, each with its reason.")


def rows_of(missing: Sequence[LeftOut]) -> list[list[str]]:
    """What is missing for one reason in a row, and in a row below it what is missing for want of that."""
    causes = dict.fromkeys(cause(absent.why, missing) for absent in missing)
    rows = []
    for why in causes:
        first = listed(absent.what for absent in missing if absent.why == why)
        saves = "; ".join(dict.fromkeys(absent.saves for absent in missing if absent.why == why and absent.saves))
        further = listed(absent.what for absent in missing if absent.why != why and cause(absent.why, missing) == why)
        rows += [[first, why, saves], *([[further, f"for want of {first}", ""]] if further else [])]
    return rows


def cause(why: str, missing: Sequence[LeftOut]) -> str:
    """The reason at the bottom of a reason, such as 'it needs simulate: it needs fixedpoint: no gait'."""
    return min((absent.why for absent in missing if why.endswith(absent.why)), key=len)


def everything_absent(results: Results) -> list[LeftOut]:
    """What is missing as a whole, then what results say that they left out."""
    found = list(results.absent)
    for result in results.stored.values():
        found += [LeftOut(**one) for one in result.summary.get("left_out", [])]
    return list(dict.fromkeys(found))
