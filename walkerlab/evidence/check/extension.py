"""The check of printed gaits as an extension: its stage, command and section."""

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, Extension
from walkerlab.pipeline.plan.stage import Stage

STAGES = (
    Stage(
        "check", "walkerlab.evidence.check.stage",
        "Check a printed gait: is it right, and if not, why?", reads.CheckConfig, requires=("check",),
        needed_by=("report",), adds_command="walkerlab.evidence.check.command:OFFER",
    ),
)  # fmt: skip
EXTENSION = Extension(
    INTERFACE,
    STAGES,
    sections={"evidence": ("walkerlab.evidence.check.section:section",)},
    answers={"check": "walkerlab.evidence.check.section:answer"},
)
