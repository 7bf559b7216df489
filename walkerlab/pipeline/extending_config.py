"""Write the config with the parameters that a stage found; it extends the config that the stage ran under."""

import os
from pathlib import Path
from typing import Any

from walkerlab.config.files import builtin_names
from walkerlab.config.layers import parse_setting
from walkerlab.config.loader import load
from walkerlab.config.writer import to_extending_yaml
from walkerlab.pipeline.graph import PIPELINE
from walkerlab.pipeline.progress import Reporter
from walkerlab.pipeline.resolve import ResolvedRun
from walkerlab.pipeline.runner import USUAL, Options, StageReport, execute
from walkerlab.pipeline.stage import Graph
from walkerlab.pipeline.store.files import write_numbered


def run_and_write(
    run: ResolvedRun, target: str, options: Options = USUAL, reporter: Reporter | None = None, graph: Graph = PIPELINE
) -> StageReport:
    """Execute a stage of a run; if it found parameters, write a config with them and add its file to the summary.

    Raises the errors of `execute`, and StorageError if the config cannot be written.
    """
    report = execute(run.loaded.config, target, run.folder, options, reporter, graph)
    name = graph[target].finds
    if name and report.summary and report.no_answer is None and not options.dry:
        report.summary["config"] = str(write_config(run, report, name))
    return report


def write_config(run: ResolvedRun, report: StageReport, name: str) -> Path:
    """Write the config of a stage's result; return its file."""
    settings = [parse_setting(f"{key}={value!r}") for key, value in values_of(report.summary).items()]
    typed = run.extends if run.extends in builtin_names() else os.path.relpath(run.extends, report.run_dir)
    base = load(Path(run.extends)).config
    changed = run.loaded.variant(settings).model_copy(update={report.stage: getattr(base, report.stage)})
    text = to_extending_yaml(typed, base, changed, f"{base.name}-{name}")
    return write_numbered(report.run_dir / f"{name}.yaml", text)


def values_of(summary: dict[str, Any]) -> dict[str, float]:
    if "best" in summary:
        return dict(summary["best"])
    return {estimate["key"]: estimate["value"] for estimate in summary["estimates"]}
