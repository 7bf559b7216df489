"""Stage `check`: compare a printed gait with the right one."""

from collections.abc import Mapping

from walkerlab.config.reads import CheckConfig
from walkerlab.evidence.check.answer import check_gait
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.store.content import Content


def run(config: CheckConfig, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Check the printed gait of a config, and search for an explanation of values that differ."""
    progress.start("check")
    return Content({}, check_gait(config))
