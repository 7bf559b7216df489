"""The reproduced study as an extension: its stages, figures, sections, tables and equations."""

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, Extension, Study, lazy_function
from walkerlab.pipeline.plan.stage import DRAWINGS, Option, Stage, recording_options, results_of, walks_and

WITH = ("--with",)
STAGES = (
    Stage(
        "compare", "walkerlab.evidence.paper.compare",
        "Compare both models with each other and with every value of the paper.", reads.CompareConfig,
        walks_and(), requires=("contact",), needed_by=DRAWINGS,
        options=(
            Option("--with", "recording.file", "FILE", "Also compare a walk from a file, such as CSV.", "text"),
            *recording_options("recording", *WITH),
        ),
    ),
    Stage(
        "tune", "walkerlab.evidence.paper.tune",
        "Adjust the initial velocities until the contact model walks, and report how much was needed and why.",
        reads.TuneConfig, results_of("fixedpoint"), requires=("contact",), needed_by=("report",), shown_by=("plot",),
        needs_equal_legs=True,
        does_without=lazy_function("walkerlab.evidence.paper.omissions:adjustment_omissions"),
    ),
)  # fmt: skip
EXTENSION = Extension(
    INTERFACE,
    STAGES,
    figures="walkerlab.evidence.paper.figures:FIGURES",
    sections={
        "task": ("walkerlab.evidence.paper.sections:paper_section",),
        "walks": ("walkerlab.evidence.paper.sections:recorded",),
        "evidence": (
            "walkerlab.evidence.paper.sections:numbers",
            "walkerlab.evidence.paper.sections:tables",
            "walkerlab.evidence.paper.sections:errors",
        ),
    },
    answers={"compare": "walkerlab.evidence.paper.sections:answer"},
    tables={"compare": "walkerlab.evidence.paper.sections:table_of"},
    studies=(
        Study("walkerlab.evidence.paper.law:is_own_walker", {"as-printed": "walkerlab.evidence.paper.law:as_printed"}),
    ),
)
