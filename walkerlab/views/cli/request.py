"""Declare the options that commands share, print results and failures, and build typer's commands."""

import contextlib
import errno
import glob
import inspect
import json
import os
import re
import shlex
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cached_property, partial
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from walkerlab.errors import ConfigError, StoppedError, StorageError, WalkerlabError, add_run_options, escape_controls
from walkerlab.extensions import check_names, external_extensions
from walkerlab.pipeline.plan.graph import PIPELINE, Graph
from walkerlab.pipeline.plan.stage import Option
from walkerlab.pipeline.run.workers import raise_on
from walkerlab.views.cli.console import Console

# Imported only for types, because help must load neither the config nor NumPy.
if TYPE_CHECKING:
    from walkerlab.config.loader import LoadedConfig
    from walkerlab.config.schema import Config
    from walkerlab.pipeline.plan.resolve import ResolvedRun
    from walkerlab.pipeline.store.runs import RunFolder


RUNS = Path("runs")
BLOCK_KIND = re.compile(r"\([^)]*\)")
"""Pattern for the kind of a block in a key, as in `walker(kneed)`."""


def keys_to_set(incomplete: str) -> list[str]:
    """Return the config keys that complete a word, each with the `=` that `--set` needs."""
    # Imported here, because only shell completion needs the list.
    from walkerlab.config.reference import keys

    of_kinds = (BLOCK_KIND.sub("", row.key) for row in keys() if row.key != "extends")
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
    """Declare a field of a request that commands may offer as an option. `flags` and `about` are typer's arguments.

    Without flags, the option has the name of the field.
    """
    return field(default=default, metadata={"option": typer.Option(*flags, **about)})


switch = partial(option, default=False)
"""Declare a field that is an option without a value."""


@dataclass(frozen=True)
class Request:
    """Options shared by commands. Options that a command does not offer keep their defaults."""

    command: str  # name of the command as typed
    own: tuple[SetByOption, ...] = ()  # settings made from options that only this command has
    instead: str = ""  # stage to run instead of the command's own, if an option selects one; otherwise empty
    graph: Graph = PIPELINE  # the stages of the program
    full: bool = switch("--full", help="Also run the long campaign. An interrupted one resumes the next time.")
    config: str | None = option(
        "--config", "-c", metavar="FILE", autocompletion=configs_and_files,
        help="Config file, built-in config, or run by its name or folder; default: paper.",
    )  # fmt: skip
    sets: list[str] | None = option(
        "--set", metavar="KEY=VALUE", help="Change one key of the config; may be repeated.", autocompletion=keys_to_set
    )
    strides: int | None = option(metavar="N", help="Strides to walk; one stride is two steps.")
    name: str | None = option(
        metavar="NAME", help="Name of the run's folder; default: derived from the config and its changes."
    )
    runs: Path = option(default=RUNS, metavar="DIR", help="Folder of all runs.")
    jobs: int | None = option(
        metavar="N", min=1, help="Processes for independent stages and cells; default: all cores."
    )
    force: bool = switch("--force", help="Recompute the stage and all it needs, even if up to date.")
    dry_run: bool = switch("--dry-run", help="Show what would be done and why, but change nothing.")
    no_wait: bool = switch("--no-wait", help="Give up (exit 6) if another process works in the run folder.")
    open_page: bool = switch("--open", help="Show the page in the browser as soon as it exists.")
    every: bool = switch("--all", help="Show all values, not only the headline values.")
    as_json: bool = switch("--json", help="Print one JSON object on stdout.")
    quiet: bool = switch("--quiet", "-q", help="Show only warnings and errors.")
    verbose: bool = switch("--verbose", "-v", help="Show more messages.")

    @cached_property
    def console(self) -> Console:
        return Console(self.quiet, self.verbose, self.open_page)

    @property
    def settings(self) -> tuple[str, ...]:
        """All changes to the config, as KEY=VALUE."""
        return (*(self.sets or ()), *self.own)

    def typed_for(self, command: str) -> str:
        """Return the options with which `command` works on this run, each preceded by a space.

        If it is the command of this request, the options of its stage are repeated as typed. For other commands they
        become --set options, but a stage gets only those that it reads.
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
        # Not every command has --strides, but all that work on a run have --set.
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
        for warning in run.loaded.warnings:
            self.console.warn(warning)
        self.console.detail(f"config: {run.loaded.source}; run folder: {run.folder.path}")
        return run

    @property
    def loaded(self) -> "LoadedConfig":
        return self.resolved_run.loaded

    @property
    def resolved(self) -> "Config":
        return self.loaded.config

    @property
    def folder(self) -> "RunFolder":
        return self.resolved_run.folder


RUN_OPTIONS = ("config", "sets", "strides", "name", "runs")
"""Options that select the run."""
OUTPUT_FIELDS = ("as_json", "quiet", "verbose")
"""Options for the format and the amount of output."""


FULL_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


@contextlib.contextmanager
def exit_on_failure(request: Request) -> Iterator[None]:
    """Turn expected failures into a message on stderr and an exit code. With `--json`, also print a JSON object."""
    raise_on(signal.SIGTERM, KeyboardInterrupt)
    # A background job of a script ignores SIGINT, and must go on doing so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        raise_on(signal.SIGINT, KeyboardInterrupt)

    def fail(error: WalkerlabError) -> typer.Exit:
        """Print a failure and, with `--json`, an object that describes it.

        Returns the exception that ends the command with the failure's exit code.
        """
        if request.as_json:
            # If resolving the run is what failed, it has no folder.
            run_dir = str(request.folder.path) if "resolved_run" in vars(request) else None
            nothing: dict[str, Any] = {"artifact": None, "reused": False, "wall_s": 0.0, "left_out": []}
            print_json({"stage": request.command, "run_dir": run_dir, **nothing, "error": as_json(error, request)})
        print_error(error, request.typed_for)
        return typer.Exit(error.exit_code)

    try:
        yield
        # Without this line, an error in writing the output would appear only at exit, with a traceback.
        sys.stdout.flush()
    except WalkerlabError as error:
        raise fail(error) from None
    except KeyboardInterrupt:
        advice = "Finished results are kept; the same command computes the rest."
        raise fail(StoppedError("interrupted", advice)) from None
    except BrokenPipeError:
        discard_output()
        raise typer.Exit(0) from None
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            too_long = ConfigError(f"the name {error.filename[:60]!r}... is too long.", "Choose a shorter one.")
            raise fail(too_long) from None
        # An OSError without a file name comes from writing the output.
        if error.errno not in FULL_DISK_ERRORS or error.filename is not None:
            raise
        discard_output()
        lost = f"the output could not be written: {error.strerror}."
        print_error(StorageError(lost, "The results themselves are stored."))
        raise typer.Exit(StorageError.exit_code) from None


def discard_output() -> None:
    """Redirect stdout to the null device, so that flushing it at exit does not fail again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def print_result(
    request: Request, value: dict[str, Any], lines: Iterable[str], error: WalkerlabError | None = None
) -> None:
    """Print a result as text lines or, with `--json`, as the object `value`. Exit non-zero if there is an error."""
    if request.as_json:
        print_json(value if error is None else value | {"error": as_json(error, request)})
    else:
        sys.stdout.writelines(f"{escape_controls(line)}\n" for line in lines)
    if error is not None:
        print_error(error, request.typed_for)
        raise typer.Exit(error.exit_code)


def as_json(error: WalkerlabError, request: Request) -> dict[str, Any]:
    return error.as_json() | {"advice": add_run_options(error.advice, request.typed_for)}


def print_error(error: WalkerlabError, options_of: Callable[[str], str] = lambda _: "") -> None:
    # A user who stops a command knows that nothing went wrong.
    lead = "" if isinstance(error, StoppedError) else "error: "
    print(f"{lead}{error.message}", file=sys.stderr)
    if error.advice:
        print(f"advice: {add_run_options(error.advice, options_of)}", file=sys.stderr)


def print_json(value: dict[str, Any]) -> None:
    print(json.dumps(value, indent=2, allow_nan=False))


def as_parameter(entry: Field[Any]) -> inspect.Parameter:
    """Convert a field declared by `option` to a parameter of the signature that typer reads."""
    kind = inspect.Parameter.KEYWORD_ONLY
    declared = entry.metadata["option"]
    return inspect.Parameter(entry.name, kind, default=entry.default, annotation=Annotated[entry.type, declared])


def settings_from(options: Sequence["Option"], values: Mapping[str, Any]) -> tuple[SetByOption, ...]:
    """Convert a stage's own options to settings. `values` has the value of each option by flag, None if not given.

    Raises typer.BadParameter for malformed bounds, and for an option given without the options that it needs.
    """
    settings = []
    for option in options:
        value = values[option.flag]
        # Unlike an empty list, 0 is a value.
        if option.runs or (not value and value != 0):
            continue
        if any(values[flag] is None for flag in option.needs):
            raise typer.BadParameter(f"requires {' and '.join(option.needs)}", param_hint=option.flag)
        typed = [word for item in (value if isinstance(value, list) else [value]) for word in (option.flag, str(item))]
        match option.kind:
            case "bounds" | "bounds-or-none":
                text = bounds(option, value)
            case "pairs" | "numbers" | "units":
                text = pairs(option, value)
            case "text" | "texts":
                text = json.dumps(value)
            case _:
                text = str(value)
                typed = [option.flag] if option.kind == "switch" else [option.flag, text.removesuffix(".0")]
        settings.append(SetByOption(f"{option.key}={text}", *typed))
    return tuple(settings)


def bounds(option: "Option", values: Sequence[str]) -> str:
    """Convert arguments NAME=A:B (or NAME for null, if allowed) to a YAML block.

    Raises typer.BadParameter for arguments of another form.
    """
    either = r"([^=]+)(?:=([^:]+):([^:]+))" + ("?" if option.kind == "bounds-or-none" else "")
    parts = [re.fullmatch(either, value) for value in values]
    if None in parts:
        raise typer.BadParameter(f"give a name and two numbers, {option.metavar}", param_hint=option.flag)
    named = (f"{part[1]}: [{part[2]}, {part[3]}]" if part[2] else f"{part[1]}: null" for part in parts if part)
    return "{" + ", ".join(named) + "}"


def pairs(option: "Option", values: Sequence[str]) -> str:
    """Convert NAME=VALUE,... arguments to YAML. A unit without NAME applies to all quantities of its kind."""
    # Imported here, because few commands read files of other programs.
    from walkerlab.exchange.columns import parse_pairs, parse_units

    try:
        named = parse_units(values) if option.kind == "units" else parse_pairs(option.flag, values)
    except ConfigError as error:
        raise typer.BadParameter(f"{error.message} {error.advice}", param_hint=option.flag) from None
    if option.kind != "numbers":
        return json.dumps(named)
    return "{" + ", ".join(f"{key}: {value}" for key, value in named.items()) + "}"


def own_parameter(name: str, option: "Option") -> inspect.Parameter:
    """Convert a stage's own option to a parameter of the signature that typer reads."""
    complete = keys_to_vary if option.kind == "key" else None
    declared = typer.Option(option.flag, metavar=option.metavar or None, help=option.help, autocompletion=complete)
    types = {"int": int, "float": float, "switch": bool, "word": str, "text": str, "key": str}
    value: Any = types.get(option.kind, list[str])
    annotation = Annotated[value | None, declared]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)


class SuggestingCommand(TyperCommand):
    """A command that suggests `--set KEY=VALUE` if a user types a config key as an option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the options. If an unknown option is a config key, the error message suggests `--set`."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:  # NoSuchOption of click, whose module depends on the version of typer
            typed = str(getattr(error, "option_name", ""))
            name = typed.lstrip("-").replace("-", "_")
            keys = keys_to_vary("") if name and any(option.name == "sets" for option in self.params) else []
            keys.sort(key=lambda key: not key.startswith(f"{self.name}."))  # prefer the command's own block
            key = next((key for key in keys if name in (key, key.rpartition(".")[2])), None)
            if key is not None:
                message = f"There is no option {typed}; set the config key with --set {key}=VALUE"
                error.message = message  # type: ignore[attr-defined]
            raise


class Offer(NamedTuple):
    """A function that the program offers as a command. Its arguments are a request and further options."""

    function: Callable[..., None]
    shared: Sequence[str] = ()  # fields of the request that are options of the command
    name: str | None = None  # name of the command; default: the function's
    asks: type[Request] = Request  # type of the request; its additional fields come first in the help
    purpose: str | None = None  # help text; default: the function's docstring
    sets: Sequence["Option"] = ()  # options that set keys of the config; they come first in the help


def add_command(app: typer.Typer, graph: Graph, offer: Offer) -> None:
    """Add a command to the program of a graph.

    If the command's function raises an error, the command ends as `exit_on_failure` describes.
    """
    function, shared, name, asks, purpose, sets = offer
    typed = name or function.__name__
    # A flag such as --from cannot be the name of a parameter.
    names = {f"set_{index}": option for index, option in enumerate(sets)}

    def run(**arguments: Any) -> None:
        values = {option.flag: arguments.pop(parameter) for parameter, option in names.items()}
        settings = settings_from(sets, values)
        instead = next((option.runs for option in sets if option.runs and values[option.flag]), "")
        request = asks(typed, settings, instead, graph, **{field: arguments.pop(field) for field in shared})
        with exit_on_failure(request):
            if external_extensions() and typed != "extensions":
                commands = [str(each.name) for each in app.registered_commands]
                check_names(request.console.warn, (each for each in commands if commands.count(each) > 1))
            function(request, **arguments)

    _, *own = inspect.signature(function, eval_str=True).parameters.values()
    options = sorted((entry for entry in fields(asks) if entry.name in shared), key=fields(Request).__contains__)
    by_name = [entry.replace(kind=inspect.Parameter.KEYWORD_ONLY) for entry in (*own, *map(as_parameter, options))]
    run.__signature__ = inspect.Signature([*starmap(own_parameter, names.items()), *by_name])  # type: ignore[attr-defined]
    app.command(typed, cls=SuggestingCommand, help=purpose or inspect.getdoc(function))(run)
