"""Options that commands share, each declared once, and the run that they select."""

import glob
import inspect
import json
import os
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cached_property
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from walkerlab.extensions import check_names, foreign
from walkerlab.views.cli.console import Console
from walkerlab.views.cli.failures import exit_on_failure

# Imported for types only: help must load neither the config nor NumPy.
if TYPE_CHECKING:
    from walkerlab.config.loader import LoadedConfig
    from walkerlab.config.schema import Config
    from walkerlab.pipeline.plan.resolve import ResolvedRun
    from walkerlab.pipeline.plan.stage import Option
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
    """A setting KEY=VALUE made from a stage's own option; messages quote the option as the user typed it."""

    words: tuple[str, ...]  # the option as typed

    def __new__(cls, text: str, *words: str) -> "SetByOption":
        setting = super().__new__(cls, text)
        setting.words = words
        return setting

    @property
    def source(self) -> str:
        return " ".join(self.words)


def option(*flags: str, default: Any = None, **about: Any) -> Any:
    """Declare a field of a request that commands may offer as an option; `flags` and `about` are typer's arguments."""
    return field(default=default, metadata={"option": typer.Option(*flags, **about)})


def as_parameter(entry: Field[Any]) -> inspect.Parameter:
    """Convert a field declared by `option` to a parameter of the signature that typer reads."""
    kind, declared = inspect.Parameter.KEYWORD_ONLY, entry.metadata["option"]
    return inspect.Parameter(entry.name, kind, default=entry.default, annotation=Annotated[entry.type, declared])


def settings_from(options: Sequence["Option"], values: Mapping[str, Any]) -> tuple[SetByOption, ...]:
    """Convert a stage's own options to settings; `values`: value of each option by flag, None if the user gave none.

    Raises typer.BadParameter for malformed bounds, and for an option given without the options that it needs.
    """
    settings = []
    for option in options:
        value = values[option.flag]
        if option.runs or (not value and value != 0):
            continue
        if any(values[flag] is None for flag in option.needs):
            raise typer.BadParameter(f"requires {' and '.join(option.needs)}", param_hint=option.flag)
        typed = [word for item in (value if isinstance(value, list) else [value]) for word in (option.flag, str(item))]
        if ":" in option.metavar:
            text = bounds(option.flag, value, option.metavar)
        elif "=" in option.metavar:
            text = pairs(option.flag, value, option.type)
        elif option.metavar == "FILE" or option.type is list:
            text = json.dumps(value)
        else:
            text, typed = str(value), [option.flag, str(value).removesuffix(".0")]
        settings.append(SetByOption(f"{option.key}={text}", *(typed[:1] if option.type is bool else typed)))
    return tuple(settings)


def bounds(flag: str, values: Sequence[str], form: str) -> str:
    """Convert arguments NAME=A:B (or NAME for null, if `form` allows it) to a YAML block; else typer.BadParameter."""
    either = r"([^=]+)(?:=([^:]+):([^:]+))" + ("?" if "[" in form else "")
    parts = [re.fullmatch(either, value) for value in values]
    if None in parts:
        raise typer.BadParameter(f"give a name and two numbers, {form}", param_hint=flag)
    named = (f"{part[1]}: [{part[2]}, {part[3]}]" if part[2] else f"{part[1]}: null" for part in parts if part)
    return "{" + ", ".join(named) + "}"


def pairs(flag: str, values: Sequence[str], kind: type) -> str:
    """Convert NAME=VALUE,... arguments to YAML; with `--units`, a bare unit applies to all quantities of its kind."""
    # Imported here: few commands read files of other programs.
    from walkerlab.errors import ConfigError
    from walkerlab.exchange.columns import parse_pairs, parse_units

    try:
        named = parse_units(values) if flag == "--units" else parse_pairs(flag, values)
    except ConfigError as error:
        raise typer.BadParameter(f"{error.message} {error.advice}", param_hint=flag) from None
    return json.dumps(named) if kind is str else "{" + ", ".join(f"{k}: {value}" for k, value in named.items()) + "}"


def own_parameter(name: str, option: "Option") -> inspect.Parameter:
    """Convert a stage's own option to a parameter of the signature that typer reads."""
    complete = keys_to_vary if option.metavar == "KEY" else None
    declared = typer.Option(option.flag, metavar=option.metavar, help=option.help, autocompletion=complete)
    kind: Any = list[str] if "=" in option.metavar or option.type is list else option.type
    if kind is bool:
        declared = typer.Option(option.flag, help=option.help)
    annotation = Annotated[kind | None, declared]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)


@dataclass(frozen=True)
class Request:
    """Options shared by commands; options that a command does not offer keep their defaults."""

    command: str  # name of the command as typed
    own: tuple[SetByOption, ...] = ()  # settings made from the command's own options
    instead: str = ""  # stage to run instead of the command's own, if an option selects one; otherwise empty
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
        from walkerlab.pipeline.plan.graph import PIPELINE

        stage = next((stage for stage in PIPELINE.stages if stage.name == command), None)
        words = [] if self.config is None else ["-c", self.config]
        for setting in self.sets or ():
            words += ["--set", setting]
        for own in self.own:
            block = own.partition("=")[0].partition(".")[0]
            if command == self.command:
                words += own.words
            elif stage is None or any(key.partition(".")[0] == block for key in stage.reads):
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
        """Resolve the config and its run folder, and show the config's warnings; ConfigError if it is invalid."""
        from walkerlab.pipeline.plan.graph import PIPELINE
        from walkerlab.pipeline.plan.resolve import resolve

        run = resolve(self.config, self.settings, self.strides, self.runs, self.name)
        loaded = run.loaded
        for stage in PIPELINE.stages:
            stage.checks(loaded.config)
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
OF_TALK = ("as_json", "quiet", "verbose")
"""Options for the form and amount of output."""


class KeysAreNoOptions(TyperCommand):
    """A command that suggests `--set KEY=VALUE` if a user types a config key as an option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the options; if an unknown option is a config key, the error message suggests `--set`."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:  # click's NoSuchOption; its module depends on typer's version
            typed = str(getattr(error, "option_name", ""))
            name = typed.lstrip("-").replace("-", "_")
            keys = keys_to_vary("") if name and any(option.name == "sets" for option in self.params) else []
            keys.sort(key=lambda key: not key.startswith(f"{self.name}."))  # prefer the command's own block
            key = next((key for key in keys if name in (key, key.rpartition(".")[2])), None)
            if key is not None:
                message = f"There is no option {typed}; set the config key with --set {key}=VALUE"
                error.message = message  # type: ignore[attr-defined]
            raise


def command(
    app: typer.Typer,
    *shared: str,
    name: str | None = None,
    purpose: str | None = None,
    asks: type[Request] = Request,
    sets: Sequence["Option"] = (),
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds a function of a request and further options to a program as a command.

    shared   fields of the request that the command offers as options
    name     name of the command; default: the function's
    purpose  help text; default: the function's docstring
    asks     type of the request; its additional fields come first in the help
    sets     options that set keys of the config; they come first in the help
    Errors of the function end the command as `exit_on_failure` describes.
    """

    def register(function: Callable[..., None]) -> Callable[..., None]:
        typed = name or function.__name__
        # Flags such as --from cannot be names of parameters.
        names = {f"set_{place}": option for place, option in enumerate(sets)}

        def run(**arguments: Any) -> None:
            values = {option.flag: arguments.pop(parameter) for parameter, option in names.items()}
            settings = settings_from(sets, values)
            instead = next((option.runs for option in sets if option.runs and values[option.flag]), "")
            request = asks(typed, settings, instead, **{field: arguments.pop(field) for field in shared})
            with exit_on_failure(request):
                if foreign() and typed != "extensions":
                    commands = [str(each.name) for each in app.registered_commands]
                    check_names(request.console.warn, (each for each in commands if commands.count(each) > 1))
                function(request, **arguments)

        _, *own = inspect.signature(function, eval_str=True).parameters.values()
        options = sorted(
            (parameter for parameter in fields(asks) if parameter.name in shared), key=fields(Request).__contains__
        )
        by_name = [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in (*own, *map(as_parameter, options))
        ]
        run.__signature__ = inspect.Signature([*starmap(own_parameter, names.items()), *by_name])  # type: ignore[attr-defined]
        app.command(typed, cls=KeysAreNoOptions, help=purpose or inspect.getdoc(function))(run)
        return function

    return register
