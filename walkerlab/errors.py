"""Failures that a user can act on, each with its exit code; any other exception is a bug."""

import re
import unicodedata
from collections.abc import Callable
from typing import Any, ClassVar, Final

COMMAND_PATTERN: Final = re.compile(r"`(walkerlab (?!schema|open|init)[a-z-]+(?: [A-Za-z0-9-]+)*)`")
"""Pattern for commands in a message, except those that do not act on a run."""

CONTROLS: Final = ("Cc", "Cf", "Zl", "Zp")
"""Categories of control characters in Unicode, with those that change the direction of writing."""


def add_run_options(text: str, options_of: Callable[[str], str]) -> str:
    """Append the options that select the run to every command in a message; `options_of` returns those of a command."""
    return COMMAND_PATTERN.sub(lambda match: f"`{match[1]}{options_of(match[1].split()[1])}`", text)


def escape_controls(text: str) -> str:
    """Escape characters that could control a terminal, such as those in a column name of somebody else's file."""
    return "".join(
        ascii(letter)[1:-1] if unicodedata.category(letter) in CONTROLS and letter not in "\n\t" else letter
        for letter in text
    )


class WalkerlabError(Exception):
    """Failure that the user can act on, with a message about what happened and advice, which may be empty."""

    exit_code: ClassVar[int] = 1

    def __init__(self, message: str, advice: str = "") -> None:
        self.message = escape_controls(message)
        self.advice = escape_controls(advice)
        super().__init__(self.message)

    def as_json(self) -> dict[str, Any]:
        return {"message": self.message, "advice": self.advice, "exit_code": self.exit_code}


class ConfigError(WalkerlabError):
    """The config (file, `extends`, `--set`) is invalid; nothing was run. `key` is the path of the key at fault."""

    exit_code = 3

    def __init__(self, message: str, advice: str = "", key: tuple[int | str, ...] = ()) -> None:
        super().__init__(message, advice)
        self.key = key


class NoAnswer(WalkerlabError):  # noqa: N818 (no answer is a result, not an error)
    """The computation has no answer (no gait found, solver failed, ...); `partial` may hold unfinished results."""

    exit_code = 4

    def __init__(self, message: str, advice: str = "", partial: object | None = None) -> None:
        super().__init__(message, advice)
        self.partial = partial


class StorageError(WalkerlabError):
    """A result could not be stored: full disk, read-only folder."""

    exit_code = 4


class StaleError(WalkerlabError):
    """An artifact is stale or missing (`status --check`)."""

    exit_code = 5


class LockedError(WalkerlabError):
    """Another process holds the run folder (with `--no-wait`)."""

    exit_code = 6


class StoppedError(WalkerlabError):
    """The user interrupted the command (Ctrl-C)."""

    exit_code = 130
