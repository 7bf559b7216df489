"""The benchmarks as an extension: accuracy of integration methods, and other engines with their adapters."""

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, Extension
from walkerlab.pipeline.plan.stage import DRAWINGS, Stage, dependency, gait_for_start_or_pads

STAGES = (
    Stage(
        "accuracy", "walkerlab.evidence.benchmarks.accuracy", "Measure error against run time, method by method.",
        reads.SceneConfig, gait_for_start_or_pads, work="times", needed_by=("report",), shown_by=("plot",),
    ),
    Stage(
        "engines", "walkerlab.evidence.benchmarks.engines.stage",
        "Simulate the walk in MuJoCo, Drake and Exudyn, first with our contact law, then with their native contact.",
        reads.SceneConfig, gait_for_start_or_pads, requires=("contact",), only_by="engines", shown_by=DRAWINGS,
        depends_on=dependency("programs", "walkerlab.evidence.benchmarks.engines.registry:installed_versions"),
    ),
)  # fmt: skip
EXTENSION = Extension(
    INTERFACE,
    STAGES,
    figures="walkerlab.evidence.benchmarks.figures:FIGURES",
    sections={"benchmarks": ("walkerlab.evidence.benchmarks.engines.section:section",)},
)
