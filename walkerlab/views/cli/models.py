"""`walkerlab export RUN model`: write a run's walker, at the start of its gait, as a model for ADAMS or MuJoCo."""

from dataclasses import replace
from pathlib import Path

from walkerlab.errors import ConfigError
from walkerlab.exchange.export import ENDINGS, export_model, parse_law, parse_slope
from walkerlab.exchange.exported import GaitStart
from walkerlab.pipeline.plan.resolve import resolve, warn_of_edits
from walkerlab.pipeline.run.runner import Options, execute
from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
from walkerlab.pipeline.store.provenance import git_commit
from walkerlab.views.cli.exports import Target, write_file
from walkerlab.views.cli.request import Request


def write_model(
    run: str, request: Request, target: Target, law: str | None = None, slope: str = "gravity"
) -> list[Path]:
    """Write a model of the walker of a run or config, and return the files written. A missing gait is computed first.

    run    run or config
    law    contact law in a model for ADAMS; None for its default
    slope  what is tilted in a model for MuJoCo: gravity, or the geometry

    Raises ConfigError for an unknown run or format, or if a format cannot express the walker, and NoAnswer if the
    walker has no gait.
    """
    resolved = resolve(run, request.settings, runs=request.runs)
    console = request.console
    config = resolved.loaded.config
    folder = resolved.folder
    for warning in resolved.loaded.warnings:
        console.warn(warning)
    warn_of_edits(config, folder, console.warn)
    # MuJoCo's viewer opens only files that end in .xml.
    named_mjcf = target.output is not None and target.output.suffix == ".mjcf"
    to = "xml" if target.to == "mjcf" and not named_mjcf else target.to
    path, ending = replace(target, to=to).choose_file("a model", folder.name, list(ENDINGS))
    kind = ENDINGS[ending]
    adams_law = parse_law(law or "contact")
    if law is not None and kind == "mjcf":
        raise ConfigError("--law chooses between contact laws of ADAMS.", "Leave it out for MuJoCo.")
    inputs = {}
    if config.start == "fixed-point":
        report = execute(config, "fixedpoint", folder, Options(), console)
        if report.no_answer is not None:
            raise report.no_answer
        assert report.content is not None, "a stage with an answer stores it"
        inputs["fixedpoint"] = report.content
    start = GaitStart(*rigid_start(config, inputs), step_asymmetry(config, inputs))
    exported = export_model(config, start, kind, adams_law, git_commit(), path.stem, parse_slope(slope))
    for omission in exported.left_out:
        console.note(f"left out: {omission}")
    paths = [path, *(path.with_name(name) for name in list(exported.files)[1:])]
    for extra in paths[1:]:
        target.refuse(extra, extra.suffix.removeprefix("."))
    return [write_file(file, text.encode(), console) for file, text in zip(paths, exported.files.values(), strict=True)]
