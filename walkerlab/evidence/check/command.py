"""`walkerlab check`: check printed gaits of configs, or a state typed on the command line."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from walkerlab.errors import ConfigError, escape_controls
from walkerlab.views.cli.request import Offer, Request, print_error, print_json

if TYPE_CHECKING:
    from walkerlab.config.loader import LoadedConfig

SEPARATORS = re.compile(r"[\s,;\[\]()]+")


def check(
    request: Request,
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE...", help="Configs with a block `check`, or folders of such configs."),
    ] = None,
    state: Annotated[
        str | None, typer.Option(metavar="NUMBERS", help="Printed state, in quotes, of the walker in --config.")
    ] = None,
) -> None:
    """Check a printed gait: is it right, and if not, why?"""
    if state is not None and files:
        raise typer.BadParameter("takes the walker in --config, so give no FILE", param_hint="--state")
    paths = [*(files or ()), *([Path(request.config)] if request.config else [])]
    if not paths:
        raise typer.BadParameter("name a config with a block `check`; `walkerlab init FILE --check` writes one")
    settings = request.settings
    if state is not None:
        numbers = ", ".join(f"'{number}'" for number in SEPARATORS.split(state) if number)
        settings = (*settings, f"check.printed.state=[{numbers}]")
    answers: list[dict[str, Any]] = []
    for path in configs_in(paths):
        try:
            answers.append(answer_to(path, settings, request))
        except ConfigError as error:
            answers.append({"file": str(path), "error": error.as_json()})
            print_error(error)
            continue
        if not request.as_json:
            print_answer(answers[-1], first=len(answers) == 1)
    if request.as_json:
        single = len(paths) == 1 and bool(paths[0].suffix or request.config)
        print_json(answers[0] if single else {"checks": answers})
    if any("error" in answer for answer in answers):
        raise typer.Exit(ConfigError.exit_code)


OFFER = Offer(check, ("config", "sets", "as_json", "quiet", "verbose"))


def configs_in(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield each path that is a config, and the configs in each path that is a folder.

    Raises ConfigError for a folder without configs.
    """
    # Imported here and below, because the help would otherwise have to load the config and NumPy.
    from walkerlab.config.files import BUILTIN_FOLDER, PUBLISHED, SUFFIXES

    for typed in paths:
        path = BUILTIN_FOLDER / typed if typed == PUBLISHED and not typed.exists() else typed
        if not path.is_dir():
            yield path
            continue
        inside = sorted(file for file in path.iterdir() if file.suffix in SUFFIXES and not file.name.startswith("."))
        if not inside:
            raise ConfigError(f"the folder {path} has no configs.", f"Their names end in {' or '.join(SUFFIXES)}.")
        yield from inside


def answer_to(path: Path, settings: Sequence[str], request: Request) -> dict[str, Any]:
    """Check one config.

    Raises ConfigError, with the position of the fault, if it is invalid.
    """
    from walkerlab.config.loader import load
    from walkerlab.evidence.check.answer import check_gait

    loaded: LoadedConfig = load(path, settings)
    for warning in loaded.warnings:
        request.console.warn(warning)
    try:
        return {"file": str(path), "name": loaded.config.name, **check_gait(loaded.config)}
    except ConfigError as error:
        raise loaded.add_position(error) from None


def print_answer(answer: dict[str, Any], first: bool) -> None:
    from walkerlab.evidence.check.section import answer as in_blocks
    from walkerlab.views.report.tables import lay_out

    lines = [*([] if first else [""]), f"{answer['name']} ({answer['file']})", *lay_out(in_blocks(answer))]
    print("\n".join(map(escape_controls, lines)))
