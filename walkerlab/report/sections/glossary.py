"""The words of the report, those that its reader meets here and nowhere else."""

from __future__ import annotations

from walkerlab.report.blocks import Section, Terms
from walkerlab.report.results import Results

WORDS = (
    ("Step", "From one heel strike to the next; a stride is two of them, one with each leg."),
    ("Heel strike", "The instant in which the swing foot comes down ahead and the legs change roles."),
    ("Gait", "A walk in which every step is like the last: a fixed point of the step map."),
    ("Step map", "What takes the state just after one heel strike to the state just after the next."),
    (
        "Multiplier",
        "Eigenvalue of the step map’s derivative at a gait: the factor on a small disturbance in a step. "
        "A gait is stable if all are smaller than 1 in magnitude; the largest magnitude is the spectral radius.",
    ),
    ("Scuffing", "A straight swing leg passes below the ground near mid-swing. The rigid model ignores it."),
)
OF_CONTACT = (
    ("Rigid model", "A foot stands still on the ground until the other one comes down in a plastic impact."),
    ("Contact model", "Feet that sink into the ground and slip on it, by ADAMS’s laws of normal force and friction."),
    ("Penetration", "How deep a foot is in the ground; static, with the whole weight on one foot."),
    ("Slip", "How far a standing foot moves along the slope, rolling not counted."),
    ("Phase", "The part of a step that has gone by. At the same phase, a slower clock makes no difference."),
)


def section(results: Results) -> Section:
    """What the words mean."""
    words = WORDS if results.config.contact is None else (*WORDS, *OF_CONTACT)
    return Section("glossary", "Glossary", (Terms(words),), "The words of this report, in a line each.")
