"""`walkerlab sweep`: run a stage over many configs."""

import importlib
import os
import threading
from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from walkerlab.views.cli.request import OUTPUT_FIELDS, RUN_OPTIONS, Offer, Request, option, print_result, switch
from walkerlab.views.report.tables import paragraph

if TYPE_CHECKING:
    from walkerlab.pipeline.sweeps.sweep import Foreseen, Swept

SUMMARY_KEYS = ("of", "parameters", "points", "done", "failed", "outcomes", "endings", "numerical_error")
"""Keys of a sweep's summary that `--json` prints."""
MAX_LISTED_POINTS = 20
"""Maximum number of points that a dry run lists."""


@dataclass(frozen=True)
class SweepRequest(Request):
    """Options of a sweep."""

    over: list[str] | None = option(
        metavar="KEY=VALUES", help="A parameter: FROM:TO:N, FROM:TO:N:log or [a, b, ...]; may be repeated."
    )
    stage: str | None = option(metavar="NAME", help="The stage to run.")
    zipped: bool = switch(
        "--zip", help="Combine the n-th values into the n-th point, instead of forming the full grid."
    )
    sample: str | None = option(metavar="SAMPLER:N", help="Sample points instead: latin-hypercube:500, sobol:512.")
    seed: int | None = option(metavar="N", min=0, help="Seed of the sampled points; default: 1.")
    engine: str = option(default="local", metavar="NAME", help="Where to compute: local, dask[=ADDRESS] or slurm.")
    engine_option: list[str] | None = option(
        metavar="NAME=VALUE", help="For Slurm: slurm_partition, timeout_min, cluster, ..."
    )
    at_once: int = option(
        "--jobs", default=0, metavar="N", min=0, help="Chunks computed simultaneously; 0: one per core, or 16 on Slurm."
    )
    chunk_seconds: float | None = option(
        metavar="S", help="Target duration of a chunk; default: depends on the engine."
    )
    show: list[str] | None = option(metavar="NAME", help="Quantity to plot; may be repeated.")
    against: str | None = option(metavar="NAME", help="Quantity on the horizontal axis; default: the swept parameters.")
    as_csv: bool = switch(
        "--csv", help="Print the points with their headline values as CSV, and store that next to the result."
    )


OWN_FIELDS = [one.name for one in fields(SweepRequest) if one not in fields(Request)]
SHARED = (*OWN_FIELDS, *RUN_OPTIONS, "force", "dry_run", "no_wait", "every", *OUTPUT_FIELDS)


def sweep(request: SweepRequest) -> None:
    """Run a stage over a range of parameters, reusing results that exist."""
    from walkerlab.config.analyses import Sweep
    from walkerlab.pipeline.sweeps.engines import EngineOptions, parse_engine
    from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep, refuse_unrecorded
    from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork, modules_of

    options = dict(text.split("=", 1) for text in request.engine_option or () if "=" in text)
    if bad := [text for text in request.engine_option or () if "=" not in text]:
        raise typer.BadParameter(f"{bad[0]!r} is not NAME=VALUE", param_hint="--engine-option")
    chosen, address = parse_engine(request.engine)
    loaded = request.loaded
    over = request.over or ()
    block = loaded.config.sweep or Sweep()  # options that are not given take their values from it
    own = [(key, values, f"sweep.over.{key}") for key, values in block.over.items()]
    question = build_sweep(
        request.stage or block.stage,
        [axis_of_text(text) for text in over] or own,
        request.zipped or (block.zip and not over),
        request.sample if request.sample is not None else "" if over else block.sample,
        block.seed if request.seed is None else request.seed,
    )
    quantities = {f"--show {name}": name for name in request.show or ()}
    quantities |= {f"--against {request.against}": request.against} if request.against is not None else {}
    refuse_unrecorded(question, quantities)
    engine_options = EngineOptions(
        workers=request.at_once,
        address=address,
        modules=modules_of(question.stage, loaded.config, request.graph),
        folder=request.folder.path,
        options=options,
    )
    if request.dry_run:
        foreseen = SweepRun(question, loaded, request.folder, request.graph)
        show_plan(request, foreseen.foresee(request.at_once or os.cpu_count() or 1, MAX_LISTED_POINTS))
        return
    with chosen.start_early(engine_options) as engine:
        run = SweepRun(question, loaded, request.folder, request.graph)
        # Modules needed at the end are loaded while the workers compute.
        threading.Thread(target=importlib.import_module, args=("walkerlab.views.report.sweep_page",)).start()

        def check(available: Collection[str]) -> None:
            from walkerlab.views.report.sweep_page import check_options

            flags = {flag: name for flag, name in quantities.items() if name not in question.names}
            check_options(question.stage, flags, available)

        work = SweepWork(engine, engine_options, request.chunk_seconds, not request.no_wait, request.force, check)
        swept = run.run(work, request.console)
    show_result(request, swept)


def show_plan(request: Request, foreseen: "Foreseen") -> None:
    missing = foreseen.count - foreseen.there
    value = {
        **common(request, foreseen.path, 0.0),
        "dry_run": True,
        "points": foreseen.count,
        "reused": foreseen.there,
        "to_compute": missing,
        "estimate_s": foreseen.estimate_s,
        "first_points": list(foreseen.points),
    }
    more = foreseen.count - len(foreseen.points)
    lines = [f"  {point}" for point in foreseen.points] + ([f"  and {more} more"] if more else [])
    estimate = foreseen.estimate_s
    time = "no point of this kind has been timed yet" if estimate is None else f"about {format_duration(estimate)}"
    counts = f"{foreseen.count} points, {foreseen.there} already computed, {missing} to compute: {time}"
    print_result(request, value, [f"in {foreseen.path}:", *lines, counts])


def format_duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200.0 else f"{seconds / 3600:.1f} h"


def common(request: Request, path: Path, wall_s: float) -> dict[str, Any]:
    """Return the entries that both a planned and a finished sweep have in their JSON objects."""
    return {
        "stage": "sweep",
        "run_dir": str(request.folder.path),
        "artifact": str(path),
        "wall_s": wall_s,
        "left_out": [],
        "file": str(path),
    }


def show_result(request: SweepRequest, swept: "Swept") -> None:
    """Plot a sweep and print its result.

    Raises typer.Exit if points failed.
    """
    from walkerlab.pipeline.store.files import write_atomically
    from walkerlab.pipeline.sweeps.result import as_csv as table_of
    from walkerlab.views.report.sweep_page import draw

    page, figures = draw(swept, request.folder, tuple(request.show or ()), request.against or "")
    summary = swept.summary
    value = {
        **common(request, swept.path, swept.wall_s),
        "reused": swept.reused,
        **{name: summary[name] for name in SUMMARY_KEYS if name in summary},
        "figures": [str(path) for path in figures],
        "html": str(page),
    }
    lines = result_lines(swept, page)
    if request.as_csv:
        table = table_of(swept.content, swept.question, request.every)
        csv_path = swept.path.with_suffix(".csv")
        write_atomically(csv_path, table.encode())
        value["csv"], lines = str(csv_path), [table.removesuffix("\n")]
    print_result(request, value, lines, swept.error() if swept.failed else None)


def result_lines(swept: "Swept", page: Path) -> list[str]:
    from walkerlab.views.report.sweep_page import summary_lines

    summary = swept.summary
    outcomes = ", ".join(f"{count} {name}" for name, count in summary["outcomes"].items())
    over = ", ".join(f"{name} ({len(set(values))})" for name, values in summary["parameters"].items())
    return [
        f"sweep of {summary['of']} over {over}: {summary['points']} points, {outcomes}",
        *([f"  {swept.reused} of them were reused"] if swept.reused else []),
        *(line for text in summary_lines(summary) for line in paragraph(text)),
        f"  results  {swept.path}",
        f"  page     {page}",
    ]


COMMANDS = (Offer(sweep, SHARED, asks=SweepRequest),)
