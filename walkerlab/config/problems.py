"""Problems with a config: position, value, allowed values and nearest key."""

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from walkerlab.config.tree import BlockNode, Node, Position, Scalar
from walkerlab.errors import ConfigError

SHOWN_LENGTH = 60
SHOWN_PROBLEMS = 20


@dataclass(frozen=True, slots=True)
class Problem:
    position: Position | None  # None for a value passed from Python
    text: str  # what is wrong, with key and value
    allowed: str = ""  # allowed values, or empty if `text` names them
    nearest: str = ""  # word that was probably meant, or empty if no word is similar

    def __str__(self) -> str:
        where = f"{self.position}: " if self.position else ""
        near = f"; did you mean {self.nearest}?" if self.nearest else ""
        allowed = f"{' Allowed' if near else '; allowed'}: {self.allowed}" if self.allowed else ""
        return f"{where}{self.text}{near}{allowed}"


BEYOND_SCOPE: Final = {
    r"control|feedback|\bpid\b|\blqr\b": "walkerlab has no controllers; push_off and walker.hip drive a walker",
    r"runner|running|hopp|jump": "walkerlab has no running: its walkers always have a foot on the ground",
    r"3-?d\b|three-?d|spatial|lateral": "walkerlab is planar: its walkers move in one vertical plane",
    r"quadruped|four-?leg|hexapod|monoped": "walkerlab's walkers have two legs",
}
"""Patterns that match words for features that walkerlab lacks, each with an explanation."""
KEYS_ARE_LISTED = "`walkerlab schema` lists every key with its unit, bounds and default"


def problems_error(problems: Sequence[Problem], advice: str = KEYS_ARE_LISTED) -> ConfigError:
    """Build one error that lists all `problems`, one per line."""
    lines = list(dict.fromkeys(str(problem) for problem in problems))
    if len(lines) > SHOWN_PROBLEMS:
        lines[SHOWN_PROBLEMS:] = [f"and {len(lines) - SHOWN_PROBLEMS} more"]
    return ConfigError("\n".join(lines), advice)


def problem_error(
    position: Position | None, text: str, allowed: str = "", near: str = "", advice: str = KEYS_ARE_LISTED
) -> ConfigError:
    """Build the error for a single problem. The arguments before `advice` are the fields of `Problem`."""
    return problems_error([Problem(position, text, allowed, near)], advice)


def explain_missing_feature(word: str) -> str:
    """Explain in a sentence why walkerlab lacks the feature that `word` names, or return '' if no pattern matches."""
    return next((reason for pattern, reason in BEYOND_SCOPE.items() if re.search(pattern, word.lower())), "")


def nearest(word: str, candidates: Iterable[str]) -> str:
    """Return the candidate most similar to `word`, or '' if none is similar."""
    spelled = {candidate.lower(): candidate for candidate in candidates}
    matches = difflib.get_close_matches(word[:SHOWN_LENGTH].lower(), spelled, n=1, cutoff=0.5)
    return spelled[matches[0]] if matches else ""


def suggestion(word: str, candidates: Iterable[str]) -> str:
    """Return ` Did you mean X?` for the nearest candidate, or '' if none is similar."""
    near = nearest(word, candidates)
    return f" Did you mean {near}?" if near else ""


def printable(text: str, length: int = SHOWN_LENGTH) -> str:
    """Shorten untrusted text, and escape control characters and lone surrogates."""
    cut = text if len(text) <= length else f"{text[: length - 1]}…"
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in cut)


def format_node(node: Node) -> str:
    """Format a value as in the config. Strings are quoted."""
    if isinstance(node, BlockNode):
        return "a block" if node.entries else "an empty block"
    if not isinstance(node, Scalar):
        return f"[{', '.join(format_node(item) for item in node.items[:6])}{', …' if len(node.items) > 6 else ''}]"
    if node.value is None:
        return "nothing" if not node.text else printable(node.text)
    return f"'{printable(node.text)}'" if isinstance(node.value, str) else printable(node.text)
