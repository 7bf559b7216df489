"""The opening verdict: failed stages, how the walks ended, and which claims of the paper hold."""

import math
from collections import Counter
from collections.abc import Iterator

from walkerlab.config.drives import drives_of, springs_of
from walkerlab.views.report.blocks import Paragraph, Section, Statement, Statements
from walkerlab.views.report.outcomes import MODELS, tone
from walkerlab.views.report.results import Results
from walkerlab.views.report.sections.models import departure
from walkerlab.views.report.tables import Tone
from walkerlab.views.report.words import words


def section(results: Results) -> Section | None:
    walked = {model.lower(): summary for stage, model in MODELS.items() if (summary := results.summary(stage))}
    verdicts = Counter(row["verdict"] for row in results.claims)
    misprint = any(erratum["where"].startswith("A.5") for erratum in results.summary("compare").get("errata", ()))
    # what holds, what fails and what follows
    found, config = (results.summary("fixedpoint"), verdicts, misprint), results.config
    said = ""
    if walked:
        said = words("verdict.opening", walked, *found, drives_of(config), springs_of(config), config.ground.even)
    fared = sorted(how_all_fared(results), key=lambda one: one.tone != "bad")
    blocks = (
        *(Paragraph(failure, "bad") for failure in failures(results)),
        Paragraph(said),
        Statements(tuple(fared), "cards") if fared else None,
        Paragraph(departure(results)),
    )
    return Section.of("verdict", "Verdict", blocks if any(blocks) else (Paragraph("There are no results to judge."),))


def failures(results: Results) -> list[str]:
    """List failed stages with what depends on them, then stored results that report a failure."""
    failed = [absent for absent in results.absent if absent.what in results.failed]
    others = [absent for absent in results.absent if absent.what not in results.failed]
    told = [
        words("verdict.failure", absent, [other.what for other in others if absent.why in other.why])
        for absent in failed
    ]
    said = {name: result.summary.get("no_answer") for name, result in results.stored.items()}
    return [*told, *(f"{name}: {why['message'].rstrip('.')}." for name, why in said.items() if why is not None)]


def how_all_fared(results: Results) -> Iterator[Statement]:
    """Yield a statement for each walk (outcome, key numbers, advice), for the gait, and for a failed adjustment."""
    for stage, model in MODELS.items():
        if summary := results.summary(stage):
            config, outcome = results.config, summary["outcome"]
            tau = math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
            text = words("verdict.walk", summary, 2 * config.strides, tau, *end_of(results, stage))
            yield Statement(model, text, outcome, tone(outcome))
    if gait := results.summary("fixedpoint"):
        badge: tuple[str, Tone] = ("stable", "good") if gait["stable"] else ("unstable", "fair")
        yield Statement("Periodic gait", words("verdict.gait", gait), *badge)
    change = results.summary("tune").get("adjustment")
    if change is not None and not change["found"]:
        text = f"{change['reason'].capitalize()}. {change['advice']}"
        yield Statement("Parameter adjustment", text, "no start helps", "bad")


def end_of(results: Results, stage: str) -> tuple[float | None, float | None]:
    """Return when a walk ended (s) and the hip's height then (m); None where not stored."""
    summary, trajectory = results.summary(stage), results.group(stage, "trajectory")
    if trajectory is None or not trajectory["time"].size:
        return summary.get("end_time_s"), None
    height = float(trajectory["hip_height_m"][-1]) if "hip_height_m" in trajectory.variables else None
    return summary.get("end_time_s", float(trajectory["time"][-1])), height
