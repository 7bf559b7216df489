"""Families of gaits over a parameter: what was found, in a paragraph, and the bifurcations in a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.labels import with_unit
from walkerlab.report.blocks import PageBlock, Paragraph, Section
from walkerlab.report.gait_diagram import gait_diagram, parameter
from walkerlab.report.numbers import count, number
from walkerlab.report.results import Results
from walkerlab.report.sections.gaits import complex_number
from walkerlab.report.tables import Column, Table, table
from walkerlab.report.words import words

MODELS = ("rigid", "contact")


def section(results: Results) -> Section | None:
    """Branches, their bifurcations and the chaos beyond; None if none were followed."""
    summary = results.summary("continuation")
    if summary is None or not summary.get("branches"):
        return None
    first, *others = findings(summary) or [f"{count(len(summary['branches']), 'branch', 'branches')} followed."]
    blocks: list[PageBlock] = [Paragraph(" ".join(others))] if others else []
    diagram = gait_diagram(results)
    if diagram is not None:
        blocks.append(diagram)
    if summary["bifurcations"]:
        blocks.append(bifurcations(summary))
    return Section("families", f"Families of gaits over {parameter(summary)}", tuple(blocks), first)


def findings(summary: Mapping[str, Any]) -> list[str]:
    """What there is to say, sentence by sentence."""
    unit = str(summary["unit"])
    said = []
    for model in MODELS:
        stable = [one for one in summary["branches"] if one["model"] == model and one["period"] == 1]
        ranges = [pair for one in stable for pair in one["stable_ranges"]]
        if ranges:
            said.append(words("families.stable", model, *max(ranges, key=lambda pair: pair[1] - pair[0]), unit))
    doubling = summary["first_doubling"]
    if doubling.keys() >= set(MODELS):
        said.append(words("families.shift", doubling["contact"] - doubling["rigid"], unit))
    cascades = [one for one in summary["cascades"] if "accumulates_at" in one]
    said += [words("families.cascade", one, len(one["flips"]), unit) for one in cascades]
    for one in summary["attractors"]:
        if one["aperiodic_from"] is not None:
            said.append(words("families.aperiodic", one["aperiodic_from"], unit))
        if one["lost_at"] is not None:
            said.append(words("families.lost", one, unit))
    wild = max(summary["lyapunov"], key=lambda one: one["exponent"], default=None)
    if wild is not None and wild["exponent"] > 3.0 * wild["uncertainty"]:
        said.append(words("families.chaos", wild, unit))
    return said


def bifurcations(summary: Mapping[str, Any]) -> Table:
    """Every bifurcation that was located."""
    columns = (
        Column("kind", "kind"),
        Column("model", "model"),
        Column("steps of the gait", "period", numeric=True),
        Column(with_unit(parameter(summary), summary["unit"]), "value", lambda value: number(value, 9), numeric=True),
        Column("critical multiplier", "multiplier", lambda parts: complex_number(*parts), numeric=True),
    )
    return table("Bifurcations, as zeros of their test functions", columns, summary["bifurcations"])
