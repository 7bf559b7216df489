"""Commands that begin, show and repeat runs: init, open, rerun, export, animate."""

from pathlib import Path
from typing import Annotated

import typer

from walkerlab.cli.failures import exit_on_failure
from walkerlab.cli.options import RUNS, AsJson, Quiet, Runs, Verbose
from walkerlab.stages.graph import Graph

RunArgument = Annotated[
    str, typer.Argument(metavar="RUN", help="A run's folder, or its name in the folder of all runs.")
]
FIGURES = "figure-07 and so on, or its number; table-1 to table-3, table, trajectory"
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        help="Where to; its ending says the format, too. Default: named after the run.",
    ),
]
FIRST_WALK = "default: contact-sim, or simulate where that has not run"


def add_to(app: typer.Typer, graph: Graph) -> None:
    """Add the commands to a program for a pipeline."""

    @app.command("init")
    def init(
        file: Annotated[
            Path | None,
            typer.Argument(
                metavar="[FILE]", help="The config to be written; it must not exist. Default: my-TYPE.yaml."
            ),
        ] = None,
        walker: Annotated[
            str, typer.Option("--type", metavar="TYPE", help="Type of walker, or name of a built-in config.")
        ] = "compass",
        quiet: Quiet = False,
    ) -> None:
        """Write a commented config to begin with, and a schema by which editors check it."""
        with exit_on_failure("init", as_json=False):
            from walkerlab.cli.init import write_config

            said = write_config(file or Path(f"my-{walker}.yaml"), walker)
            if not quiet:
                print(said)

    @app.command("open")
    def open_run(run: RunArgument = "paper", runs: Runs = RUNS, quiet: Quiet = False, verbose: Verbose = False) -> None:
        """Show a run's page in the browser."""
        with exit_on_failure("open", as_json=False):
            from walkerlab.cli.browser import open_file
            from walkerlab.cli.console import Console
            from walkerlab.cli.resolve import page_of

            page = page_of(run, runs)
            open_file(page, Console(quiet, verbose))
            print(page)

    @app.command("rerun")
    def rerun(
        artifact: Annotated[Path, typer.Argument(metavar="ARTIFACT", help="A stage's result, such as simulate.h5.")],
        as_json: AsJson = False,
        quiet: Quiet = False,
        verbose: Verbose = False,
    ) -> None:
        """Compute a stored result again, from nothing, and say whether it comes out the same."""
        with exit_on_failure("rerun", as_json):
            from walkerlab.cli.console import Console
            from walkerlab.cli.rerun import rerun_artifact

            rerun_artifact(artifact, graph, Console(quiet, verbose), as_json)

    @app.command("export")
    def export(
        run: RunArgument,
        what: Annotated[str, typer.Argument(metavar="WHAT", help=FIGURES)],
        to: Annotated[str | None, typer.Option("--to", metavar="FORMAT", help="pdf, svg, png, csv, tex or nc.")] = None,
        output: Output = None,
        columns: Annotated[int, typer.Option(min=1, max=2, help="Columns of a journal that a figure fills.")] = 1,
        width: Annotated[
            float | None, typer.Option(min=72.0, metavar="PT", help="Width of a figure in points; a column has 252.")
        ] = None,
        model: Annotated[str | None, typer.Option(metavar="STAGE", help=f"Whose trajectory; {FIRST_WALK}.")] = None,
        runs: Runs = RUNS,
    ) -> None:
        """Write a figure, a table or a trajectory of a run for use elsewhere."""
        with exit_on_failure("export", as_json=False):
            from walkerlab.cli.console import Console
            from walkerlab.cli.exports import COLUMNS, Target, export_from
            from walkerlab.cli.resolve import walk_in
            from walkerlab.stages.runs import run_named

            folder, points = run_named(run, runs), width or COLUMNS[columns]
            print(export_from(folder, what, Target(to, output), points, walk_in(folder, model), Console()))

    @app.command("draw")
    def draw(
        file: Annotated[Path, typer.Argument(metavar="FILE", help="A config, or the name of a built-in one.")],
        to: Annotated[str | None, typer.Option("--to", metavar="FORMAT", help="svg, pdf or png.")] = None,
        output: Output = None,
    ) -> None:
        """Draw a config's walker to scale, with its measures named as the config names them."""
        with exit_on_failure("draw", as_json=False):
            from walkerlab.cli.console import Console
            from walkerlab.cli.exports import Target, draw_walker

            print(draw_walker(file, Target(to, output), Console()))

    @app.command("animate")
    def animate(
        run: RunArgument,
        to: Annotated[
            str | None,
            typer.Option("--to", metavar="FORMAT", help="gif, or mp4 where ffmpeg is found; a file goes too."),
        ] = None,
        output: Output = None,
        model: Annotated[str | None, typer.Option(metavar="STAGE", help=f"Whose walk; {FIRST_WALK}.")] = None,
        steps: Annotated[int, typer.Option(min=1, help="Steps that are shown.")] = 4,
        rate: Annotated[int, typer.Option(min=1, max=60, help="Pictures a second.")] = 25,
        slower: Annotated[float, typer.Option(min=0.01, help="So many times slower than life.")] = 1.0,
        runs: Runs = RUNS,
        quiet: Quiet = False,
    ) -> None:
        """Draw a run's walk as a moving picture."""
        with exit_on_failure("animate", as_json=False):
            from walkerlab.cli.console import Console
            from walkerlab.cli.exports import Target
            from walkerlab.cli.films import Film, write_film
            from walkerlab.cli.resolve import walk_in
            from walkerlab.stages.runs import run_named

            folder = run_named(run, runs)
            film = Film(walk_in(folder, model), steps, rate, slower)
            print(write_film(folder, Target(to, output), film, Console(quiet)))
