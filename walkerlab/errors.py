"""Failures that a user can act on, each with its exit code. Any other exception is a bug."""

import re
import shlex
import unicodedata
from collections.abc import Callable
from typing import Any, ClassVar, Final

COMMAND_PATTERN: Final = re.compile(
    r"`(walkerlab (?!schema|open|init)([a-z-]+)(?: [A-Za-z0-9-]+)*?)(?: --set ([\w.]+)=([\w.+-]+))?`"
)
"""Pattern for commands that act on a run, as quoted in messages, with at most one `--set`."""

SLOPES: Final = ("slope_rad", "slope_deg")

CONTROLS: Final = ("Cc", "Cf", "Zl", "Zp")
"""Unicode categories of control characters, including those that change the direction of writing."""


def add_run_options(text: str, options_of: Callable[[str], str]) -> str:
    """Append the options that select the run to every command in a message. `options_of` returns them for a command.

    If the command already sets a key (`--set KEY=VALUE`), other settings of that key are left out.
    """

    def add_options(match: re.Match[str]) -> str:
        start, command, key, value = match.groups()
        options = options_of(command)
        return f"`{start}{options if key is None else f'{drop_key(options, key)} --set {key}={value}'}`"

    return COMMAND_PATTERN.sub(add_options, text)


def drop_key(options: str, key: str) -> str:
    """Return options, each preceded by a space, without the settings of a key. The two keys of the slope
    count as one."""
    words = shlex.split(options)
    same = SLOPES if key in SLOPES else (key,)
    settings = [index for index, word in enumerate(words[:-1]) if word == "--set"]
    dropped = [index for index in settings if words[index + 1].partition("=")[0].strip() in same]
    kept = (word for index, word in enumerate(words) if not {index, index - 1} & {*dropped})
    return "".join(f" {shlex.quote(word)}" for word in kept)


def escape_controls(text: str) -> str:
    """Escape characters that could control a terminal. A column name in somebody else's file may contain some."""
    return "".join(
        ascii(letter)[1:-1] if unicodedata.category(letter) in CONTROLS and letter not in "\n\t" else letter
        for letter in text
    )


class WalkerlabError(Exception):
    """Failure that the user can act on. The message says what happened. `advice` says what to do. It may be
    empty."""

    exit_code: ClassVar[int] = 1

    def __init__(self, message: str, advice: str = "") -> None:
        self.message = escape_controls(message)
        self.advice = escape_controls(advice)
        super().__init__(self.message)

    def as_json(self) -> dict[str, Any]:
        return {"message": self.message, "advice": self.advice, "exit_code": self.exit_code}


class ConfigError(WalkerlabError):
    """The config (file, `extends`, `--set`) is invalid. Nothing was run. `key` is the path of the key at fault."""

    exit_code = 3

    def __init__(self, message: str, advice: str = "", key: tuple[int | str, ...] = ()) -> None:
        super().__init__(message, advice)
        self.key = key


class NoAnswer(WalkerlabError):  # noqa: N818 (no answer is a result, not an error)
    """The computation has no answer (no gait found, solver failed, ...). `partial` may hold unfinished results."""

    exit_code = 4

    def __init__(self, message: str, advice: str = "", partial: object | None = None) -> None:
        super().__init__(message, advice)
        self.partial = partial


class StorageError(WalkerlabError):
    """A result could not be stored: full disk, read-only folder."""

    exit_code = 4


class StaleError(WalkerlabError):
    """A stored result is out of date or missing (`status --check`)."""

    exit_code = 5


class LockedError(WalkerlabError):
    """Another process is working in the run folder, and `--no-wait` was given."""

    exit_code = 6


class StoppedError(WalkerlabError):
    """The user interrupted the command (Ctrl-C)."""

    exit_code = 130
