"""How a walk ended, in words with its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from walkerlab.config.reads import RigidConfig
from walkerlab.report.blocks import Statement
from walkerlab.report.numbers import count, length, number, quantity, span, whole
from walkerlab.report.results import Results
from walkerlab.report.tables import Tone

RIGID, CONTACT = "simulate", "contact-sim"
MODELS = {RIGID: "Rigid model", CONTACT: "Contact model"}
"""The stages that walk, and what they walk."""

WALKED = "walked"

ENDS = {
    "walked": "walks to the end",
    "fell": "falls",
    "off-pad": "trips on a pad",
    "lifted-off": "leaves the ground",
    "slid": "slides away",
    "no-heel-strike": "comes to no heel strike",
    "bent-knee": "comes down on a bent knee",
    "budget-exhausted": "runs out of right-hand sides",
    "solver-failed": "defeats the solver",
    "rejected": "is refused its start",
}
"""What a walker does in the end, by the outcome of its walk."""


def finding(results: Results, stage: str) -> Statement | None:
    """How the walk of a stage ended; None if there is none."""
    result = results.stored.get(stage)
    if result is None:
        return None
    summary = result.summary
    outcome = str(summary["outcome"])
    asked, taken = 2 * results.config.strides, int(summary["steps"])
    if outcome == WALKED:
        sentences = [f"It took all {asked} steps.", gait_sentence(summary)]
    else:
        took = f"It took {taken} of {count(asked, 'step')}."
        sentences = [took, gait_sentence(summary), *why(results, stage, outcome)]
    return Statement(MODELS[stage], " ".join(text for text in sentences if text), outcome, tone(outcome))


def ends(outcome: str) -> str:
    """What a walker does in the end; an outcome that this version does not know keeps its name."""
    return ENDS.get(outcome, f"ends as {outcome}")


def walks(steps: int, outcome: str) -> str:
    """How far a walker comes, as the rest of a sentence that it begins."""
    if outcome == WALKED:
        return f"walks all {count(steps, 'step')}"
    return f"walks {count(steps, 'step')} and then {ends(outcome)}" if steps else f"{ends(outcome)} in its first step"


def tone(outcome: str) -> Tone:
    """Whether a walk went as hoped."""
    return "good" if outcome == WALKED else "bad"


def gait_sentence(summary: Mapping[str, Any]) -> str:
    """Periods and lengths of the steps that were taken."""
    periods, lengths = summary["step_periods_s"], summary["step_lengths_m"]
    if not periods:
        return ""
    if len(periods) == 1:
        return f"Its one step took {quantity(periods[0], 's')} over {quantity(lengths[0], 'm')}."
    spoken = f"Steps last {span(periods, 's')} and are {span(lengths, 'm')} long"
    if " to " not in spoken:
        return f"{spoken}."
    return f"{spoken}; the last took {quantity(periods[-1], 's')} over {quantity(lengths[-1], 'm')}."


def why(results: Results, stage: str, outcome: str) -> list[str]:
    """What ended a walk that did not go as hoped: where and when, the numbers that judged it, and what to try."""
    summary = results.stored[stage].summary
    said = [end_sentence(results, stage), *EVIDENCE.get(outcome, no_evidence)(results.config, summary)]
    return [*said, str(summary.get("advice", ""))]


def end_sentence(results: Results, stage: str) -> str:
    """When it ended, and where the hip was then."""
    summary, trajectory = results.stored[stage].summary, results.group(stage, "trajectory")
    end = summary.get("end_time_s")
    height = None
    if trajectory is not None and trajectory["time"].size:
        end = float(trajectory["time"][-1]) if end is None else end
        if "hip_height_m" in trajectory.variables:
            height = float(trajectory["hip_height_m"][-1])
    if end is None:
        return ""
    where = "" if height is None else f"; the last sample has the hip {quantity(height, 'm', 3)} above the slope"
    return f"The walk ended at {quantity(end, 's', 4)}{where}."


def fall(_config: RigidConfig, summary: Mapping[str, Any]) -> list[str]:
    """Whether the ground threw it."""
    ratio = summary.get("damping_ratio")
    if ratio is None or ratio >= 1.0:
        return []
    return [f"The contact is under-damped, with a damping ratio of {number(ratio, 2)}: feet bounce on it."]


def lift(_config: RigidConfig, summary: Mapping[str, Any]) -> list[str]:
    """The force that the ground would have to pull with."""
    least = summary.get("min_normal_force_N")
    if least is None or least >= 0.0:
        return []
    return [f"The ground would have to pull with {quantity(-least, 'N', 3)}, which the rigid model assumes away."]


def slide(_config: RigidConfig, summary: Mapping[str, Any]) -> list[str]:
    """How far it slid, and how far it may."""
    pitch = summary.get("pitch_m")
    slips = summary.get("slips_m") or [summary.get("slip_per_step_m", 0.0)]
    worst = max(slips, key=abs)
    allowed = "" if pitch is None else f", the limit is a quarter of the pitch, {length(0.25 * pitch)}"
    return [f"The largest net slip of a completed step was {length(worst)}{allowed}."]


def trip(_config: RigidConfig, summary: Mapping[str, Any]) -> list[str]:
    """How steps and pads differ."""
    pitch, lengths = summary.get("pitch_m"), summary["step_lengths_m"]
    if pitch is None or not lengths:
        return []
    gap = sum(lengths) - pitch * len(lengths)
    way = "behind" if gap < 0 else "ahead of"
    return [f"Pads lie {length(pitch)} apart; by then its steps were {length(abs(gap))} {way} them."]


def wait(config: RigidConfig, _summary: Mapping[str, Any]) -> list[str]:
    """How long a step may take."""
    longest = 10.0 * math.sqrt(config.walker.leg_length_m / config.gravity_m_s2)
    return [f"A step that takes longer than {quantity(longest, 's', 3)} is none."]


def spent(_config: RigidConfig, summary: Mapping[str, Any]) -> list[str]:
    """What it had cost by then."""
    evaluations = summary.get("rhs_evaluations")
    return [] if evaluations is None else [f"By then it had cost {whole(evaluations)} right-hand sides."]


def no_evidence(_config: RigidConfig, _summary: Mapping[str, Any]) -> list[str]:
    """Nothing."""
    return []


EVIDENCE = {
    "fell": fall,
    "lifted-off": lift,
    "slid": slide,
    "off-pad": trip,
    "no-heel-strike": wait,
    "budget-exhausted": spent,
    "solver-failed": spent,
}
"""What judged a walk, by its outcome."""
