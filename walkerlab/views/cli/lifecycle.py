"""Commands that start, show and repeat runs: init, compile, open, rerun, export, draw, explore, animate."""

import signal
import time
from pathlib import Path
from typing import Annotated

import typer

from walkerlab.errors import StoppedError
from walkerlab.pipeline.run.workers import raise_on
from walkerlab.views.cli.request import OUTPUT_FIELDS, Offer, Request
from walkerlab.views.figures.style import EXPORT_DPI

RunArgument = Annotated[
    str, typer.Argument(metavar="RUN", help="A run's folder, or its name in the folder of all runs.")
]
ITEM_EXAMPLES = (
    "figure-07 or 7, steps, trajectory, model, or a table by its caption; any other word lists the run's items"
)
OUTPUT_HELP = "File to write; its ending gives the format. Default: named after the run or the config, in this folder."
Output = Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help=OUTPUT_HELP)]
FIRST_WALK = "default: contact-sim, or simulate if that has not run"


def init(
    request: Request,
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE]", help="The config to write, which must not exist yet. Default: my-TYPE.yaml."),
    ] = None,
    walker: Annotated[
        str, typer.Option("--type", metavar="TYPE", help="Type of walker, or name of a built-in config.")
    ] = "compass",
    checks: Annotated[bool, typer.Option("--check", help="Add a `check` block for a printed gait.")] = False,
) -> None:
    """Write a commented config to start from, and a schema with which editors can check it."""
    from walkerlab.views.cli.init import write_config

    message = write_config(file or Path(f"my-{walker}.yaml"), walker, checks)
    if not request.quiet:
        print(message)


def compile_kernels(request: Request) -> None:
    """Compile all code that a config's runs need, for example before many of them start on a cluster."""
    from walkerlab.pipeline.run.compile_ahead import compile_ahead

    began = time.monotonic()
    config = request.resolved_run.loaded.config
    kernels = compile_ahead([config], request.processes)
    if not request.quiet:
        print(f"{len(kernels)} kernels are ready for {config.name}, after {time.monotonic() - began:.0f} s.")


def open_run(request: Request, run: RunArgument = "paper") -> None:
    """Show a run's page in the browser."""
    from walkerlab.errors import StaleError
    from walkerlab.pipeline.store.runs import run_named

    folder = run_named(run, request.runs)
    page = (folder.path / "report.html").resolve()
    if not page.is_file():
        raise StaleError(f"{folder.path} has no page yet.", f"`walkerlab report -c {folder.quoted_path}` writes it.")
    request.console.show(page)
    print(page)


def rerun(
    request: Request,
    artifact: Annotated[Path, typer.Argument(metavar="ARTIFACT", help="A stage's result, such as simulate.h5.")],
) -> None:
    """Recompute a stored result from scratch and check that it is the same."""
    from walkerlab.views.cli.stored import rerun_artifact

    rerun_artifact(artifact, request)


def export(
    request: Request,
    run: RunArgument,
    what: Annotated[str, typer.Argument(metavar="WHAT", help=ITEM_EXAMPLES)],
    to: Annotated[
        str | None,
        typer.Option(metavar="FORMAT", help="pdf, svg, png, eps, tiff, csv, tex or nc; for a model adm, cmd or mjcf."),
    ] = None,
    output: Output = None,
    columns: Annotated[int, typer.Option(min=1, max=2, help="Journal columns that a figure or LaTeX table fills.")] = 1,
    width: Annotated[
        float | None,
        typer.Option(min=72.0, max=7200.0, metavar="PT", help="Width of a figure in points; a column is 252 wide."),
    ] = None,
    dpi: Annotated[int, typer.Option(min=30, max=2400, help="Pixels per inch of PNG and TIFF.")] = EXPORT_DPI,
    model: Annotated[str | None, typer.Option(metavar="STAGE", help=f"Model of the trajectory; {FIRST_WALK}.")] = None,
    law: Annotated[
        str | None,
        typer.Option(
            metavar="LAW", help="Contact law in ADAMS: contact (ADAMS's, the default) or functions (exactly ours)."
        ),
    ] = None,
    slope: Annotated[
        str | None,
        typer.Option(metavar="HOW", help="What MuJoCo tilts for a slope: gravity (default) or geometry (the ground)."),
    ] = None,
) -> None:
    """Write a figure, a table or a trajectory of a run, or its walker for ADAMS or MuJoCo."""
    from walkerlab.views.cli.exports import Target, export_from, run_to_export, walk_in, write_model

    if what == "model":
        for path in write_model(run, request, Target(to, output), law, slope or "gravity"):
            print(path)
        return
    if slope is not None:
        raise typer.BadParameter("changes only a model", param_hint="--slope")
    if request.sets:
        raise typer.BadParameter("changes only a model; give the run that has these settings", param_hint="--set")
    folder = run_to_export(run, request)
    target = Target(to, output, columns=columns, width=width, dpi=dpi)
    print(export_from(folder, what, target, walk_in(folder, model), request.console))


def draw(
    request: Request,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A config, or the name of a built-in one.")],
    to: Annotated[str | None, typer.Option(metavar="FORMAT", help="svg, pdf or png.")] = None,
    output: Output = None,
) -> None:
    """Draw a config's walker to scale, with dimensions labelled by their config keys."""
    from walkerlab.views.cli.exports import Target, draw_walker

    print(draw_walker(file, Target(to, output), request.console))


def explore(
    request: Request,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to serve on; 0: any free one.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser.")] = False,
) -> None:
    """Serve an interactive page with a slider for every parameter (Ctrl-C stops it)."""
    from walkerlab.views.explore.server import Server
    from walkerlab.views.explore.walks import ExploredConfig

    assert request.resolved
    if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:  # sent when the terminal closes
        raise_on(signal.SIGHUP, KeyboardInterrupt)
    try:
        server = Server(port, ExploredConfig(request.config, tuple(request.sets or ()), request.runs, {}))
    except OSError as error:
        raise typer.BadParameter(f"port {port} is not available: {error.strerror}", param_hint="--port") from None
    try:
        print(server.url, flush=True)
        if not no_browser:
            request.console.show(server.url)
        server.serve_forever()
    except KeyboardInterrupt:  # the intended way to stop
        raise typer.Exit(StoppedError.exit_code) from None
    finally:
        server.close()


def animate(
    request: Request,
    run: RunArgument,
    to: Annotated[str | None, typer.Option(metavar="FORMAT", help="gif, mp4 (needs ffmpeg), or a file name.")] = None,
    output: Output = None,
    model: Annotated[
        str | None,
        typer.Option(metavar="STAGE|both", help=f"Model of the walk, or `both` to draw both together; {FIRST_WALK}."),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Steps to show, from the first. Default: 4 or, for a fall, the last 4 and the fall."),
    ] = None,
    rate: Annotated[int, typer.Option(min=1, max=60, help="Frames per second.")] = 25,
    slower: Annotated[float, typer.Option(min=0.01, help="Slow motion: 2 is half speed.")] = 1.0,
) -> None:
    """Animate a run's walk, or the walks of both models in one picture."""
    from walkerlab.views.cli.exports import BOTH, Film, Target, run_to_export, walk_in, write_film

    folder = run_to_export(run, request)
    film = Film(BOTH if model == BOTH else walk_in(folder, model), steps, rate, slower)
    print(write_film(folder, Target(to, output), film, request.console))


COMMANDS = (
    Offer(init, ("quiet",)),
    Offer(compile_kernels, ("config", "sets", "runs", "jobs", "quiet", "verbose"), name="compile"),
    Offer(open_run, ("runs", "quiet", "verbose"), name="open"),
    Offer(rerun, (*OUTPUT_FIELDS,)),
    Offer(export, ("sets", "runs")),
    Offer(draw, ()),
    Offer(explore, ("config", "sets", "runs")),
    Offer(animate, ("runs", "quiet")),
)
