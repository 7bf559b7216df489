"""The verdict, first of all: what has no answer, how the walkers fared, and what of the paper stands."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from walkerlab.report.blocks import PageBlock, Paragraph, Section, Shares, Statement, Statements
from walkerlab.report.numbers import count
from walkerlab.report.outcomes import CONTACT, MODELS, WALKED, tone
from walkerlab.report.results import Results
from walkerlab.report.sections.models import departure
from walkerlab.report.sections.paper import TONES, errata, paper_numbers
from walkerlab.report.symbols import in_signs
from walkerlab.report.tables import Tone
from walkerlab.report.words import words

HEADLINES = {
    "A.5 row 2": "The equations of motion have a sign error",
    "eq. 11": "The paper’s gait is that of the misprinted equations",
    "Table 3, step periods": "The two steps of a cycle are equal",
    "Table 3, velocity": "The walker is much faster than printed",
    "Table 2, ADAMS start": "The raised velocities do not start a gait",
    "Fig. 8": "The models do not agree to 10⁻⁴",
    "section 4, Fig. 4b": "The contact’s numbers are meant in N, mm and s",
}
"""The errata that matter most, by how their place begins, and what they come to in a few words."""

Rows = Sequence[Mapping[str, Any]]


def section(results: Results) -> Section:
    """What a reader should know who reads no further."""
    blocks: list[PageBlock] = [Paragraph(failure, "bad") for failure in failures(results)]
    blocks += opening(results)
    told = (*(walk(results, stage) for stage in MODELS), gait(results), adjustment(results))
    fared = [found for found in told if found is not None]
    if fared:
        blocks.append(Statements(tuple(sorted(fared, key=lambda found: found.tone != "bad")), "cards"))
    departs = departure(results)
    if departs:
        blocks.append(Paragraph(departs))
    rows = paper_numbers(results)
    if rows and results.of_the_paper:
        blocks += of_the_paper(results, rows)
    elif not blocks:
        blocks.append(Paragraph("There are no results to judge."))
    return Section("verdict", "Verdict", tuple(blocks))


def opening(results: Results) -> list[PageBlock]:
    """What holds, what fails and what follows; nothing without a walk."""
    found = {model.lower(): results.summary(stage) for stage, model in MODELS.items()}
    walked = {model: summary for model, summary in found.items() if summary is not None}
    if not walked:
        return []
    verdicts = Counter(str(row["verdict"]) for row in paper_numbers(results)) if results.of_the_paper else Counter()
    misprint = any(erratum["where"].startswith("A.5") for erratum in errata(results))
    gait, contact = results.summary("fixedpoint"), results.summary(CONTACT)
    slower = None
    if gait and contact and contact["outcome"] == WALKED and gait.get("period_s"):
        slower = 100.0 * (contact["step_periods_s"][-1] / gait["period_s"] - 1.0)
    return [Paragraph(words("verdict.opening", walked, gait, verdicts, misprint, slower))]


def failures(results: Results) -> list[str]:
    """What has no answer, and what is missing for that reason; then results that are there and say that they fail."""
    failed = [absent for absent in results.absent if absent.what in results.failed]
    others = [absent for absent in results.absent if absent.what not in results.failed]
    told = [
        words("verdict.failure", absent, [other.what for other in others if absent.why in other.why])
        for absent in failed
    ]
    said = {name: result.summary.get("no_answer") for name, result in results.stored.items()}
    return [*told, *(f"{name}: {why['message'].rstrip('.')}." for name, why in said.items() if why is not None)]


def walk(results: Results, stage: str) -> Statement | None:
    """How the walk of a stage ended: where and when, the numbers that judged it, and what to try; None without it."""
    summary = results.summary(stage)
    if summary is None:
        return None
    outcome, config = str(summary["outcome"]), results.config
    tau = math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
    text = words("verdict.walk", summary, 2 * config.strides, tau, *end_of(results, stage))
    return Statement(MODELS[stage], text, outcome, tone(outcome))


def end_of(results: Results, stage: str) -> tuple[float | None, float | None]:
    """When a walk ended (s), and how high the hip was then over the slope (m); None where that was not stored."""
    summary, trajectory = results.stored[stage].summary, results.group(stage, "trajectory")
    if trajectory is None or not trajectory["time"].size:
        return summary.get("end_time_s"), None
    height = float(trajectory["hip_height_m"][-1]) if "hip_height_m" in trajectory.variables else None
    return summary.get("end_time_s", float(trajectory["time"][-1])), height


def gait(results: Results) -> Statement | None:
    """The periodic gait in a sentence; None if there is none."""
    summary = results.summary("fixedpoint")
    if summary is None:
        return None
    badge: tuple[str, Tone] = ("stable", "good") if summary["stable"] else ("unstable", "fair")
    return Statement("Periodic gait", words("verdict.gait", summary), *badge)


def adjustment(results: Results) -> Statement | None:
    """That no start walks in the contact model; None if one does, or none was sought."""
    found = (results.summary("tune") or {}).get("adjustment")
    if found is None or found["found"]:
        return None
    text = f"{found['reason'].capitalize()}. {found['advice']}"
    return Statement("Parameter adjustment", text, "no start helps", "bad")


def of_the_paper(results: Results, rows: Rows) -> list[PageBlock]:
    """How the paper's numbers fared, and its gravest errors."""
    blocks: list[PageBlock] = [shares(rows), Statements(by_verdict(rows), "lines")]
    gravest = headlines(results)
    return [*blocks, Paragraph(words("verdict.reasons")), Statements(gravest, "columns")] if gravest else blocks


def shares(rows: Rows) -> Shares:
    """How many numbers came out in which way."""
    verdicts = Counter(str(row["verdict"]) for row in rows)
    parts = [(name, verdicts[name], TONES.get(name, "plain")) for name in dict.fromkeys([*TONES, *verdicts])]
    title = f"Of {count(len(rows), 'number')} that the paper prints"
    return Shares(title, tuple(part for part in parts if part[1]))


def by_verdict(rows: Rows) -> tuple[Statement, ...]:
    """Which numbers fared how, by where they stand."""
    all_there = Counter(str(row["where"]) for row in rows)
    found = []
    for verdict, shade in TONES.items():
        here = Counter(str(row["where"]) for row in rows if row["verdict"] == verdict)
        if here:
            said = "; ".join(share(where, here[where], all_there[where]) for where in here)
            found.append(Statement(f"{verdict.capitalize()}:", f"{said}.", tone=shade))
    return tuple(found)


def share(where: str, some: int, every: int) -> str:
    """How many of the numbers of one place."""
    if some == every:
        return where if every == 1 else f"{where} (all {every})"
    return f"{where} ({some} of {every})"


def headlines(results: Results) -> tuple[Statement, ...]:
    """The gravest errata that were found, with what was measured for them."""
    found = errata(results)
    gravest = [(said, one) for start, said in HEADLINES.items() for one in found if one["where"].startswith(start)]
    return tuple(
        Statement(
            in_signs(f"{said} ({one['where']}):"), f"{in_signs(one['measured'].partition('; ')[0])}.", tone="fair"
        )
        for said, one in gravest
    )
