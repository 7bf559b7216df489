"""Turns expected failures of a command into a message, advice and an exit code. Bugs keep their traceback."""

import contextlib
import errno
import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import typer

from walkerlab.errors import ConfigError, StoppedError, StorageError, WalkerlabError, add_run_options, escape_controls
from walkerlab.pipeline.run.interrupts import raise_on
from walkerlab.views.cli.request import Request

FULL_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


@contextlib.contextmanager
def exit_on_failure(request: Request) -> Iterator[None]:
    """Turn expected failures into a message on stderr and an exit code. With `--json`, also print a JSON object."""
    raise_on(signal.SIGTERM, KeyboardInterrupt)
    # background jobs of a script ignore SIGINT, and must go on doing so
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        raise_on(signal.SIGINT, KeyboardInterrupt)

    def print_failed(error: WalkerlabError) -> None:
        """With `--json`, print an object that describes the failure."""
        if request.as_json:
            run_dir = None if request.run_dir is None else str(request.run_dir)
            nothing: dict[str, Any] = {"artifact": None, "reused": False, "wall_s": 0.0, "left_out": []}
            print_json({"stage": request.command, "run_dir": run_dir, **nothing, "error": as_json(error, request)})

    try:
        yield
        sys.stdout.flush()
    except WalkerlabError as error:
        print_failed(error)
        print_error(error, request.typed_for)
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        stopped = StoppedError("interrupted", "Finished results are kept; the same command computes the rest.")
        print_failed(stopped)
        print(f"{stopped.message}\nadvice: {stopped.advice}", file=sys.stderr)
        raise typer.Exit(stopped.exit_code) from None
    except BrokenPipeError:
        discard_output()
        raise typer.Exit(0) from None
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            too_long = ConfigError(f"the name {error.filename[:60]!r}... is too long.", "Choose a shorter one.")
            print_failed(too_long)
            print_error(too_long)
            raise typer.Exit(too_long.exit_code) from None
        if error.errno not in FULL_DISK_ERRORS or error.filename is not None:
            raise
        discard_output()
        print_error(
            StorageError(f"the output could not be written: {error.strerror}.", "The results themselves are stored.")
        )
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
    print(f"error: {error.message}", file=sys.stderr)
    if error.advice:
        print(f"advice: {add_run_options(error.advice, options_of)}", file=sys.stderr)


def print_json(value: dict[str, Any]) -> None:
    print(json.dumps(value, indent=2, allow_nan=False))
