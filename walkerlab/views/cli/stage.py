"""The command of a stage: run the stage and print the result, or show what would be computed."""

import shlex

from walkerlab.config.walkers import why_rigid_alone
from walkerlab.errors import ConfigError
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.run.executor import short_reason
from walkerlab.pipeline.run.runner import Options, StageReport, run_and_write
from walkerlab.views.cli.request import Request, print_result
from walkerlab.views.report.answers import answer, further_tables, verdict
from walkerlab.views.report.tables import aligned

DRAWN_AT_ONCE = {stage.name for stage in PIPELINE.stages if stage.on_demand}


def run_stage(request: Request, stage: Stage) -> None:
    """Run a stage and print its result.

    Raises typer.Exit(4) if there is no answer, and the errors of `run_and_write`.
    """
    try:
        report_on(request, stage)
    except ConfigError as error:
        raise request.loaded.add_position(error) from None


def report_on(request: Request, stage: Stage) -> None:
    """Run a stage as requested and print its result. A ConfigError that it raises lacks the position in the config
    file."""
    options = Options(request.force, not request.no_wait, request.processes, request.full, request.dry_run)
    reporter = None if options.dry else request.console
    report = run_and_write(request.resolved_run, stage.name, options, reporter, request.graph)
    value = report.as_json()
    error = report.no_answer
    if options.dry:
        value = value | {"dry_run": True}
        error = None
        rows = [[done.stage.name, done.action, done.reason] for done in report.steps]
        lines = [f"in {report.run_dir}:", *aligned(rows), *describe_omissions(report)]
    else:
        lines = report_lines(request, report)
        if request.open_page and "html" in report.summary and not request.console.shown:
            request.console.show(report.run_dir / str(report.summary["html"]))
    print_result(request, value, lines, error)


def report_lines(request: Request, report: StageReport) -> list[str]:
    """Describe the result: what was computed, where it is stored, and what to do next."""
    if report.artifact is None:
        return [f"{report.stage}: no result", *omission_lines(request, report)]
    # Without an answer, the reason and the advice are printed only once, as the error.
    separate = ("no_answer",) if report.no_answer is None else ("no_answer", "advice", "reason")
    own = {key: value for key, value in report.summary.items() if key not in separate}
    if "html" in own:
        shows = f"`walkerlab open {shlex.quote(str(report.run_dir))}` shows it"
        details = f"`walkerlab show STAGE{request.typed_for('show')}` lists every value"
        where = ["", f"page: {(report.run_dir / str(own['html'])).resolve()}", f"next: {shows}; {details}."]
        rigid_alone = ["", why_rigid_alone(request.resolved.walker)] if request.resolved.contact is None else []
        lines = [*verdict(report.results), *answer(report.stage, own), *rigid_alone, *where]
    else:
        drawn = [{**figure, "svg": str(report.run_dir / figure["svg"])} for figure in own.get("figures", ())]
        answers = answer(report.stage, own | ({"figures": drawn} if drawn else {}))
        if request.verbose:
            answers += further_tables(report.stage, own)
        # An artifact is also stored if there is no answer, but then its path would not help the user.
        lines = [*answers, *([""] if answers else []), *([f"stored in {report.artifact}"] if own else [])]
    if report.stage in DRAWN_AT_ONCE and report.content is not None:
        # Imported here, because most stages draw nothing.
        from walkerlab.views.figures.stage import draw_at_once

        figures = draw_at_once(report.stage, report.content, report.run_dir, anew=not report.reused)
        lines += [f"figure: {path}" for path in figures]
    return [*lines, *omission_lines(request, report)]


def omission_lines(request: Request, report: StageReport) -> list[str]:
    return describe_omissions(report) if request.verbose or report.artifact is None else []


def describe_omissions(report: StageReport) -> list[str]:
    """Describe what was left out, why, and what that saves."""
    return [
        f"left out: {entry.what} ({short_reason(entry.why)})" + (f"; saves {entry.saves}" if entry.saves else "")
        for entry in report.left_out
    ]
