"""Families of gaits over a parameter: what was found, in a paragraph, and the bifurcations in a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from walkerlab.labels import with_unit
from walkerlab.report.blocks import Block, Column, Paragraph, Section, table
from walkerlab.report.gait_diagram import gait_diagram, parameter
from walkerlab.report.numbers import count, listed, number, quantity
from walkerlab.report.outcomes import ends
from walkerlab.report.results import Results

MODELS = ("rigid", "contact")


def section(results: Results) -> Section | None:
    """Branches, their bifurcations and the chaos beyond; None if none were followed."""
    summary = results.summary("continuation")
    if summary is None or not summary.get("branches"):
        return None
    first, *others = findings(summary) or [f"{count(len(summary['branches']), 'branch', 'branches')} followed."]
    blocks: list[Block] = [Paragraph(" ".join(others))] if others else []
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
            widest = max(ranges, key=lambda pair: pair[1] - pair[0])
            said.append(
                f"The {model} model's gait of one step is stable from {quantity(widest[0], unit, 4)} to "
                f"{quantity(widest[1], unit, 6)}."
            )
    doubling = summary["first_doubling"]
    if doubling.keys() >= set(MODELS):
        shift = doubling["contact"] - doubling["rigid"]
        said.append(f"Compliance and creep of the ground move its first flip by {quantity(shift, unit, 3)}.")
    said += [
        f"From the gait of {count(cascade['period'], 'step')} at {quantity(cascade['flips'][0], unit, 6)} on, the "
        f"{cascade['model']} model's period doubles {len(cascade['flips'])} times, the distances between doublings "
        f"shrinking by factors of {listed(number(ratio, 4) for ratio in cascade['ratios'])} (Feigenbaum: 4.669); "
        f"doublings accumulate at {quantity(cascade['accumulates_at'], unit, 6)}."
        for cascade in summary["cascades"]
        if "accumulates_at" in cascade
    ]
    for one in summary["attractors"]:
        if one["aperiodic_from"] is not None:
            said.append(f"Walks first settle on nothing periodic at {quantity(one['aperiodic_from'], unit, 4)}.")
        if one["lost_at"] is not None:
            said.append(
                f"At {quantity(one['lost_at'], unit, 4)} the {one['model']} model leaves its attractor and "
                f"{ends(one['ended'])}."
            )
    wild = max(summary["lyapunov"], key=lambda one: one["exponent"], default=None)
    if wild is not None and wild["exponent"] > 3.0 * wild["uncertainty"]:
        said.append(
            f"The largest Lyapunov exponent found is {number(wild['exponent'], 3)} a step "
            f"(standard error {number(wild['uncertainty'], 1)}), at {quantity(wild['value'], unit, 4)}."
        )
    return said


def bifurcations(summary: Mapping[str, Any]) -> Block:
    """Every bifurcation that was located."""
    rows = [
        [one["kind"], one["model"], str(one["period"]), number(one["value"], 9), number(one["multiplier"][0], 6)]
        for one in summary["bifurcations"]
    ]
    columns = [
        Column("kind"),
        Column("model"),
        Column("steps of the gait", numeric=True),
        Column(with_unit(parameter(summary), summary["unit"]), numeric=True),
        Column("critical multiplier", numeric=True),
    ]
    return table("Bifurcations, as zeros of their test functions", columns, rows)
