"""Failures at the edge: one message, one advice, one exit code; a bug keeps its traceback."""

import contextlib
import json
import sys
from collections.abc import Iterator
from typing import Any

import typer

from walkerlab.errors import StoppedError, WalkerlabError


@contextlib.contextmanager
def exit_on_failure(command: str, as_json: bool) -> Iterator[None]:
    """Turn what a user can act on into words on stderr and an exit code, and with `--json` into an object too."""
    try:
        yield
    except WalkerlabError as error:
        if as_json:
            print_json(failed(command, error))
        say(error)
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        stopped = StoppedError("interrupted", "Stages that were finished are kept; the same command does the rest.")
        if as_json:
            print_json(failed(command, stopped))
        print(f"{stopped.message}\nadvice: {stopped.advice}", file=sys.stderr)
        raise typer.Exit(stopped.exit_code) from None


def say(error: WalkerlabError) -> None:
    """Print a failure and what to do about it on stderr."""
    print(f"error: {error.message}", file=sys.stderr)
    if error.advice:
        print(f"advice: {error.advice}", file=sys.stderr)


def failed(command: str, error: WalkerlabError) -> dict[str, Any]:
    """The JSON object of a command that came to nothing: the keys there always are, and the error."""
    return {
        "stage": command,
        "run_dir": None,
        "artifact": None,
        "reused": False,
        "wall_s": 0.0,
        "left_out": [],
        "error": described(error),
    }


def described(error: WalkerlabError) -> dict[str, Any]:
    """A failure as JSON."""
    return {"message": error.message, "advice": error.advice, "exit_code": error.exit_code}


def print_json(value: dict[str, Any]) -> None:
    """Print one JSON object on stdout."""
    print(json.dumps(value, indent=2, allow_nan=False))
