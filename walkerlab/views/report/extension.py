"""The extension with the stages that draw the figures and the page, after all other stages."""

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, Extension
from walkerlab.pipeline.plan.stage import STRIDES, WALKED, Stage, walks_and

STAGES = (
    Stage(
        "plot", "walkerlab.views.figures.stage", "Draw the figures from the stored results.", reads.NamedConfig,
        walks_and(), work="draws", early_with=(*WALKED, "compare"), needed_by=("report",),
    ),
    Stage(
        "report", "walkerlab.views.report.stage", "Write the report, one HTML file.", None, walks_and(),
        options=(STRIDES,), work="draws", early_with=WALKED,
    ),
)  # fmt: skip
EXTENSION = Extension(INTERFACE, STAGES)
