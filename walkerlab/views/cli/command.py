"""Turn functions of a request into commands of the program, with their options and the handling of failures."""

import inspect
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, fields
from itertools import starmap
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from walkerlab.extensions import check_names, foreign
from walkerlab.pipeline.plan.graph import Graph
from walkerlab.views.cli.failures import exit_on_failure
from walkerlab.views.cli.request import Request, SetByOption, keys_to_vary

# Imported for types only: help must load neither the config nor NumPy.
if TYPE_CHECKING:
    from walkerlab.pipeline.plan.stage import Option


def as_parameter(entry: Field[Any]) -> inspect.Parameter:
    """Convert a field declared by `option` to a parameter of the signature that typer reads."""
    kind = inspect.Parameter.KEYWORD_ONLY
    declared = entry.metadata["option"]
    return inspect.Parameter(entry.name, kind, default=entry.default, annotation=Annotated[entry.type, declared])


def settings_from(options: Sequence["Option"], values: Mapping[str, Any]) -> tuple[SetByOption, ...]:
    """Convert a stage's own options to settings. `values` holds the value of each option by flag, or None if the user
    gave none.

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
    """Convert NAME=VALUE,... arguments to YAML. A bare unit applies to all quantities of its kind."""
    # Imported here: few commands read files of other programs.
    from walkerlab.errors import ConfigError
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


class KeysAreNoOptions(TyperCommand):
    """A command that suggests `--set KEY=VALUE` if a user types a config key as an option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the options. If an unknown option is a config key, the error message suggests `--set`."""
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


class Offer(NamedTuple):
    """A function of a request, and of further options, that the program offers as a command."""

    function: Callable[..., None]
    shared: Sequence[str] = ()  # fields of the request that the command offers as options
    name: str | None = None  # name of the command; default: the function's
    asks: type[Request] = Request  # type of the request; its additional fields come first in the help
    purpose: str | None = None  # help text; default: the function's docstring
    sets: Sequence["Option"] = ()  # options that set keys of the config; they come first in the help


def add_command(app: typer.Typer, graph: Graph, offer: Offer) -> None:
    """Add a command to the program of a graph. Errors of its function end it as `exit_on_failure` describes."""
    function, shared, name, asks, purpose, sets = offer
    typed = name or function.__name__
    # Flags such as --from cannot be names of parameters.
    names = {f"set_{place}": option for place, option in enumerate(sets)}

    def run(**arguments: Any) -> None:
        values = {option.flag: arguments.pop(parameter) for parameter, option in names.items()}
        settings = settings_from(sets, values)
        instead = next((option.runs for option in sets if option.runs and values[option.flag]), "")
        request = asks(typed, settings, instead, graph, **{field: arguments.pop(field) for field in shared})
        with exit_on_failure(request):
            if foreign() and typed != "extensions":
                commands = [str(each.name) for each in app.registered_commands]
                check_names(request.console.warn, (each for each in commands if commands.count(each) > 1))
            function(request, **arguments)

    _, *own = inspect.signature(function, eval_str=True).parameters.values()
    options = sorted((entry for entry in fields(asks) if entry.name in shared), key=fields(Request).__contains__)
    by_name = [entry.replace(kind=inspect.Parameter.KEYWORD_ONLY) for entry in (*own, *map(as_parameter, options))]
    run.__signature__ = inspect.Signature([*starmap(own_parameter, names.items()), *by_name])  # type: ignore[attr-defined]
    app.command(typed, cls=KeysAreNoOptions, help=purpose or inspect.getdoc(function))(run)
