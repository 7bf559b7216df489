"""The options, each declared once."""

from pathlib import Path
from typing import Annotated

import typer

ConfigFile = Annotated[
    Path | None,
    typer.Option("--config", "-c", metavar="FILE", help="Config file, or name of a built-in config; default: paper."),
]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key of the config; may be repeated."),
]
Runs = Annotated[Path, typer.Option("--runs", metavar="DIR", help="Folder of all runs.")]
Strides = Annotated[
    int | None, typer.Option("--strides", metavar="N", help="Strides to walk; one stride is two steps.")
]
Jobs = Annotated[int, typer.Option("--jobs", metavar="N", min=1, help="Processes for independent cells.")]
Full = Annotated[bool, typer.Option("--full", help="Run the long campaign too; interrupted, it goes on the next time.")]
Force = Annotated[bool, typer.Option("--force", help="Run the stage and all it needs, up to date or not.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would happen and why; touch nothing.")]
NoWait = Annotated[bool, typer.Option("--no-wait", help="Give up (exit 6) if another process works in the run folder.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No messages but warnings and errors.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="More messages.")]
Over = Annotated[str | None, typer.Option("--over", metavar="KEY", help="Key to follow gaits over, e.g. slope_deg.")]
From = Annotated[float | None, typer.Option("--from", metavar="A", help="Where the span begins, in the key's unit.")]
To = Annotated[float | None, typer.Option("--to", metavar="B", help="Where the span ends.")]
Model = Annotated[str | None, typer.Option("--model", metavar="rigid|contact|both", help="Whose gaits to follow.")]
Periods = Annotated[int | None, typer.Option("--periods", metavar="N", help="Steps of the longest gaits wanted.")]
Check = Annotated[bool, typer.Option("--check", help="Exit with 5 if a result is stale or missing.")]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")]

RUNS = Path("runs")
