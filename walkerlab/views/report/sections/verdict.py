"""The opening verdict: failed stages, how the walks ended, and which claims of the paper hold."""

import math
from collections import Counter
from collections.abc import Iterator

from walkerlab.config.drives import drives_of, springs_of
from walkerlab.views.report.blocks import Paragraph, Section, Statement, Statements
from walkerlab.views.report.outcomes import MODEL_NAMES, tone
from walkerlab.views.report.results import Results
from walkerlab.views.report.sections.models import departure
from walkerlab.views.report.tables import Tone
from walkerlab.views.report.words import words


def section(results: Results) -> Section | None:
    walks = {model.lower(): summary for stage, model in MODEL_NAMES.items() if (summary := results.summary(stage))}
    verdicts = Counter(row["verdict"] for row in results.claims)
    misprint = any(erratum["where"].startswith("A.5") for erratum in results.summary("compare").get("errata", ()))
    arguments = (results.summary("fixedpoint"), verdicts, misprint)
    config = results.config
    opening = ""
    if walks:
        opening = words("verdict.opening", walks, *arguments, drives_of(config), springs_of(config), config.ground.even)
    statements = sorted(outcome_statements(results), key=lambda statement: statement.tone != "bad")
    blocks = (
        *(Paragraph(failure, "bad") for failure in failures(results)),
        Paragraph(opening),
        Statements(tuple(statements), "cards") if statements else None,
        Paragraph(departure(results)),
    )
    return Section.of("verdict", "Verdict", blocks if any(blocks) else (Paragraph("There are no results to judge."),))


def failures(results: Results) -> list[str]:
    """List failed stages with the results that depend on them, then stored results that report a failure."""
    failed = [absent for absent in results.absent if absent.what in results.failed]
    dependent = [absent for absent in results.absent if absent.what not in results.failed]
    sentences = [
        words("verdict.failure", absent, [missing.what for missing in dependent if absent.why in missing.why])
        for absent in failed
    ]
    errors = {name: result.summary.get("no_answer") for name, result in results.stored.items()}
    return [*sentences, *(f"{name}: {why['message'].rstrip('.')}." for name, why in errors.items() if why is not None)]


def outcome_statements(results: Results) -> Iterator[Statement]:
    """Yield a statement for each walk (outcome, key numbers, advice), for the gait, and for a failed adjustment."""
    for stage, model in MODEL_NAMES.items():
        if summary := results.summary(stage):
            config = results.config
            outcome = summary["outcome"]
            tau = math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
            text = words("verdict.walk", summary, 2 * config.strides, tau, *walk_end(results, stage))
            yield Statement(model, text, outcome, tone(outcome))
    if gait := results.summary("fixedpoint"):
        badge: tuple[str, Tone] = ("stable", "good") if gait["stable"] else ("unstable", "fair")
        yield Statement("Periodic gait", words("verdict.gait", gait), *badge)
    change = results.summary("tune").get("adjustment")
    if change is not None and not change["found"]:
        text = f"{change['reason'].capitalize()}. {change['advice']}"
        yield Statement("Parameter adjustment", text, "no start helps", "bad")


def walk_end(results: Results, stage: str) -> tuple[float | None, float | None]:
    """Return a walk's end time (s) and the hip's height at that time (m), or None for values that are not stored."""
    summary = results.summary(stage)
    trajectory = results.group(stage, "trajectory")
    if trajectory is None or not trajectory["time"].size:
        return summary.get("end_time_s"), None
    height = float(trajectory["hip_height_m"][-1]) if "hip_height_m" in trajectory.variables else None
    return summary.get("end_time_s", float(trajectory["time"][-1])), height
