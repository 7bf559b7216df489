"""Options that commands share, each declared once, and the run that they select."""

import glob
import os
import re
import shlex
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.views.cli.console import Console

# Imported for types only: help must load neither the config nor NumPy.
if TYPE_CHECKING:
    from walkerlab.config.loader import LoadedConfig
    from walkerlab.config.schema import Config
    from walkerlab.pipeline.plan.resolve import ResolvedRun
    from walkerlab.pipeline.store.runfolder import RunFolder

RUNS = Path("runs")
OF_KIND = re.compile(r"\([^)]*\)")
"""Pattern for the kind of a block in a key, as in `walker(kneed)`."""


def keys_to_set(incomplete: str) -> list[str]:
    """Return the config keys that complete a word, each with the `=` that `--set` needs."""
    # Imported here and below: only shell completion needs the lists.
    from walkerlab.config.reference import keys

    of_kinds = (OF_KIND.sub("", row.key) for row in keys() if row.key != "extends")
    return [f"{key}=" for key in dict.fromkeys(of_kinds) if key.startswith(incomplete)]


def keys_to_vary(incomplete: str) -> list[str]:
    """Return the config keys that complete a word, without the `=`."""
    return [key.removesuffix("=") for key in keys_to_set(incomplete)]


def configs_and_files(incomplete: str) -> list[str]:
    """Return the built-in configs and the YAML files whose names complete a word."""
    from walkerlab.config.files import builtin_names

    folder, slash, stem = incomplete.rpartition("/")
    files = sorted(folder + slash + path.name for path in Path(folder + slash).glob(f"{glob.escape(stem)}*.yaml"))
    return [*(name for name in builtin_names() if name.startswith(incomplete)), *files]


class SetByOption(str):
    """A setting KEY=VALUE made from a stage's own option. Messages quote the option as the user typed it."""

    words: tuple[str, ...]  # the option as typed

    def __new__(cls, text: str, *words: str) -> "SetByOption":
        setting = super().__new__(cls, text)
        setting.words = words
        return setting

    @property
    def source(self) -> str:
        return " ".join(self.words)


def option(*flags: str, default: Any = None, **about: Any) -> Any:
    """Declare a field of a request that commands may offer as an option. `flags` and `about` are typer's arguments."""
    return field(default=default, metadata={"option": typer.Option(*flags, **about)})


@dataclass(frozen=True)
class Request:
    """Options shared by commands. Options that a command does not offer keep their defaults."""

    command: str  # name of the command as typed
    own: tuple[SetByOption, ...] = ()  # settings made from the command's own options
    instead: str = ""  # stage to run instead of the command's own, if an option selects one; otherwise empty
    graph: Graph = PIPELINE  # the stages of the program
    full: bool = option(
        "--full", default=False, help="Run the long campaign too; if interrupted, it resumes the next time."
    )
    config: str | None = option(
        "--config", "-c", metavar="FILE", autocompletion=configs_and_files,
        help="Config file, built-in config, or run by its name or folder; default: paper.",
    )  # fmt: skip
    sets: list[str] | None = option(
        "--set", metavar="KEY=VALUE", help="Change one key of the config; may be repeated.", autocompletion=keys_to_set
    )
    strides: int | None = option("--strides", metavar="N", help="Strides to walk; one stride is two steps.")
    name: str | None = option(
        "--name", metavar="NAME", help="Name of the run's folder; default: derived from the config and its changes."
    )
    runs: Path = option("--runs", default=RUNS, metavar="DIR", help="Folder of all runs.")
    jobs: int | None = option(
        "--jobs", metavar="N", min=1, help="Processes for independent stages and cells; default: all cores."
    )
    force: bool = option("--force", default=False, help="Recompute the stage and all it needs, even if up to date.")
    dry_run: bool = option("--dry-run", default=False, help="Show what would be done and why; change nothing.")
    no_wait: bool = option(
        "--no-wait", default=False, help="Give up (exit 6) if another process works in the run folder."
    )
    open_page: bool = option("--open", default=False, help="Show the page in the browser as soon as it exists.")
    every: bool = option("--all", default=False, help="Show all values, not only the headline values.")
    as_json: bool = option("--json", default=False, help="Print one JSON object on stdout.")
    quiet: bool = option("--quiet", "-q", default=False, help="Show only warnings and errors.")
    verbose: bool = option("--verbose", "-v", default=False, help="Show more messages.")

    @cached_property
    def console(self) -> Console:
        return Console(self.quiet, self.verbose, self.open_page)

    @property
    def settings(self) -> tuple[str, ...]:
        """All changes of the config, as KEY=VALUE."""
        return (*(self.sets or ()), *self.own)

    def typed_for(self, command: str) -> str:
        """Return the options, each preceded by a space, with which a command works on this run.

        This command repeats its own options; other stages get only those that they read, as settings, and all other
        commands get every one. Settings by --set go to every command.
        """
        from walkerlab.config.reads import keys_of

        stage = next((stage for stage in self.graph.stages if stage.name == command), None)
        words = [] if self.config is None else ["-c", self.config]
        for setting in self.sets or ():
            words += ["--set", setting]
        for own in self.own:
            block = own.partition("=")[0].partition(".")[0]
            if command == self.command:
                words += own.words
            elif stage is None or not isinstance(stage.takes, type) or block in keys_of(stage.takes):
                words += ["--set", own]
        words += [] if self.strides is None else ["--set", f"strides={self.strides}"]
        words += [] if self.name is None else ["--name", self.name]
        words += [] if self.runs == RUNS else ["--runs", str(self.runs)]
        return "".join(f" {shlex.quote(word)}" for word in words)

    @property
    def processes(self) -> int:
        """Number of processes that may run simultaneously."""
        if self.jobs is not None:
            return self.jobs
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

    @cached_property
    def resolved_run(self) -> "ResolvedRun":
        """Resolve the config and its run folder, and show the config's warnings.

        Raises ConfigError if it is invalid.
        """
        from walkerlab.pipeline.plan.resolve import resolve

        run = resolve(self.config, self.settings, self.strides, self.runs, self.name)
        loaded = run.loaded
        for warning in loaded.warnings:
            self.console.warn(warning)
        self.console.detail(f"config: {loaded.source}; run folder: {run.folder.path}")
        return run

    @property
    def run_dir(self) -> Path | None:
        """The run's folder, or None if the run has not been resolved."""
        return self.folder.path if "resolved_run" in vars(self) else None

    @property
    def loaded(self) -> "LoadedConfig":
        return self.resolved_run.loaded

    @property
    def resolved(self) -> "Config":
        return self.loaded.config

    @property
    def folder(self) -> "RunFolder":
        return self.resolved_run.folder


OF_A_RUN = ("config", "sets", "strides", "name", "runs")
"""Options that select the run."""
OUTPUT_FIELDS = ("as_json", "quiet", "verbose")
"""Options for the form and amount of output."""
