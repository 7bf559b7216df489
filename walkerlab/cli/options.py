"""The options, each declared once, and how they are typed again."""

import glob
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

OF_KIND = re.compile(r"\([^)]*\)")
"""The kind of a block that has several: `walker(kneed)`."""


def keys_to_set(incomplete: str) -> list[str]:
    """The keys of a config that begin with what was typed, each with the `=` that `--set` wants."""
    # Imported here and below: only a shell that completes asks.
    from walkerlab.config.reference import keys

    of_kinds = (OF_KIND.sub("", row.key) for row in keys() if row.key != "extends")
    return [f"{key}=" for key in dict.fromkeys(of_kinds) if key.startswith(incomplete)]


def keys_to_vary(incomplete: str) -> list[str]:
    """The same without the `=`."""
    return [key.removesuffix("=") for key in keys_to_set(incomplete)]


def configs_and_files(incomplete: str) -> list[str]:
    """The built-in configs and the YAML files whose names begin with what was typed."""
    from walkerlab.config.files import builtin_names

    folder, slash, stem = incomplete.rpartition("/")
    files = sorted(folder + slash + path.name for path in Path(folder + slash).glob(f"{glob.escape(stem)}*.yaml"))
    return [*(name for name in builtin_names() if name.startswith(incomplete)), *files]


ConfigFile = Annotated[
    str | None,
    typer.Option(
        "--config",
        "-c",
        metavar="FILE",
        help="Config file, built-in config, or run by its name or folder; default: paper.",
        autocompletion=configs_and_files,
    ),
]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change one key of the config; may be repeated.",
        autocompletion=keys_to_set,
    ),
]
Runs = Annotated[Path, typer.Option("--runs", metavar="DIR", help="Folder of all runs.")]
Strides = Annotated[
    int | None, typer.Option("--strides", metavar="N", help="Strides to walk; one stride is two steps.")
]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", metavar="N", min=1, help="Processes for independent stages and cells; default: all cores."),
]
Open = Annotated[bool, typer.Option("--open", help="Show the page in the browser as soon as it is there.")]
Full = Annotated[bool, typer.Option("--full", help="Run the long campaign too; interrupted, it goes on the next time.")]
Force = Annotated[bool, typer.Option("--force", help="Run the stage and all it needs, up to date or not.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would happen and why; touch nothing.")]
NoWait = Annotated[bool, typer.Option("--no-wait", help="Give up (exit 6) if another process works in the run folder.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No messages but warnings and errors.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="More messages.")]
Over = Annotated[
    str | None,
    typer.Option(
        "--over", metavar="KEY", help="Key to follow gaits over, e.g. slope_deg.", autocompletion=keys_to_vary
    ),
]
From = Annotated[float | None, typer.Option("--from", metavar="A", help="Where the span begins, in the key's unit.")]
To = Annotated[float | None, typer.Option("--to", metavar="B", help="Where the span ends.")]
Model = Annotated[str | None, typer.Option("--model", metavar="rigid|contact|both", help="Whose gaits to follow.")]
Periods = Annotated[int | None, typer.Option("--periods", metavar="N", help="Steps of the longest gaits wanted.")]
Check = Annotated[bool, typer.Option("--check", help="Exit with 5 if a result is stale or missing.")]
AllRuns = Annotated[bool, typer.Option("--all", help="Every run in the folder of all runs.")]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")]

RUNS = Path("runs")


def typed_options(config: str | None, sets: Sequence[str] | None, strides: int | None, runs: Path) -> str:
    """The options that say which run is meant, each with a blank before it; none if it is that of the paper config."""
    words = [] if config is None else ["-c", config]
    for setting in sets or ():
        words += ["--set", setting]
    words += [] if strides is None else ["--set", f"strides={strides}"]
    words += [] if runs == Path("runs") else ["--runs", str(runs)]
    return "".join(f" {shlex.quote(word)}" for word in words)
