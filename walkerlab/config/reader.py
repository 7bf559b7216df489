"""Parse YAML into trees with positions.

ruamel.yaml splits the input. Plain scalars follow the core schema of YAML 1.2 (section 10.3.2): 1e7 is a number, `no`
is a string. Anchors, aliases, tags, duplicate keys, deep nesting and very long input are errors, so that the cost of
parsing is proportional to the length of the input.
"""

import math
import re
from collections.abc import Iterator
from itertools import takewhile
from typing import Any, Final, NoReturn

from walkerlab.config.problems import Problem, printable, problem_error, problems_error
from walkerlab.config.tree import BlockNode, ListNode, Node, Position, Scalar

MAX_CHARACTERS: Final = 64 * 1024
MAX_DEPTH: Final = 12
MAX_DIGITS: Final = 300

_NOT_YAML = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_SPELLED: Final = {"null": None, "true": True, "false": False, ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf}
_WORDS: Final = {
    **{text: value for word, value in _SPELLED.items() for text in (word, word.title(), word.upper())},
    **dict.fromkeys(("", "~"), None),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
_INTEGER = re.compile(r"[-+]?[0-9]+")
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


def value_of(text: str) -> str | int | float | bool | None:
    """Convert a plain scalar to a value by the rules of YAML 1.2."""
    if text in _WORDS:
        return _WORDS[text]
    # Longer integers stay text, because Python takes quadratic time to convert them.
    if _INTEGER.fullmatch(text) and len(text) <= MAX_DIGITS:
        return int(text)
    if _OTHER_BASE.fullmatch(text) and len(text) <= MAX_DIGITS:
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text) + 0.0  # no negative zero, so that equal numbers have equal strings and keys
    return text


def read(text: str, source: str, column: int = 1) -> Node | None:
    """Parse the text of a single document to a tree, or return None if it is empty.

    Positions name the `source` (a file or option). `column` is the column at which the text starts. Raises ConfigError
    with the position of anything that is not plain YAML.
    """
    if len(text) > MAX_CHARACTERS:
        raise problem_error(Position(source, 1, column), f"longer than {MAX_CHARACTERS} characters: not a config")
    strange = _NOT_YAML.search(text)
    if strange:
        lines = text[: strange.start()].split("\n")
        where = Position(source, len(lines), len(lines[-1]) + (column if len(lines) == 1 else 1))
        raise problem_error(where, f"character {printable(strange.group())} cannot be in a config, which is text")
    return _Composer(source, column, _events(text, source, column)).document()


def _events(text: str, source: str, column: int) -> Iterator[Any]:
    from ruamel.yaml import YAML

    try:
        yield from YAML(typ="safe", pure=True, plug_ins=[]).parse(text)
    except Exception as error:  # the parser fails in many ways on input that is not a config
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        where = _position(mark, source, column) if mark else Position(source, 1, column)
        reason = getattr(error, "problem", None) or getattr(error, "context", None) or type(error).__name__
        # The message of the parser only says that the character cannot start a token.
        if r"'\t'" in str(reason):
            raise problem_error(where, "a tab: YAML is indented by spaces", advice="Replace tabs by spaces.") from None
        raise problem_error(where, f"not YAML: {printable(str(reason))}") from None


def _position(mark: Any, source: str, column: int) -> Position:
    return Position(source, mark.line + 1, mark.column + (column if mark.line == 0 else 1))


class _Composer:
    """Builds a tree of limited depth from the parser's events."""

    def __init__(self, source: str, column: int, events: Iterator[Any]) -> None:
        self._source = source
        self._column = column
        self._events = events
        self._twice: list[Problem] = []

    def document(self) -> Node | None:
        root = None
        documents = 0
        for event in self._events:
            name = type(event).__name__
            if name == "DocumentStartEvent":
                documents += 1
                if documents > 1:
                    self._refuse(event, "a second document begins; a config has only one")
                if event.version not in (None, (1, 2)):
                    self._refuse(event, "a config must be YAML 1.2")
            elif name not in ("StreamStartEvent", "StreamEndEvent", "DocumentEndEvent"):
                root = self._node(event, 0)
        if self._twice:
            raise problems_error(self._twice)
        return root

    def _node(self, event: Any, depth: int) -> Node:
        name = type(event).__name__
        position = _position(event.start_mark, self._source, self._column)
        if name == "AliasEvent":
            self._refuse(
                event, f"alias *{printable(event.anchor)}: aliases are not supported; repeat the value, or use extends"
            )
        if event.anchor is not None:
            self._refuse(event, f"anchor &{printable(event.anchor)}: anchors are not supported; use extends instead")
        if event.tag is not None:
            self._refuse(event, f"tag {printable(event.tag)}: tags are not supported; types follow from the keys")
        if name == "ScalarEvent":
            return Scalar(position, value_of(event.value) if event.implicit[0] else event.value, event.value)
        if depth == MAX_DEPTH:
            self._refuse(event, f"nested deeper than {MAX_DEPTH} levels")
        if name == "SequenceStartEvent":
            return ListNode(position, [self._node(item, depth + 1) for item in self._read_until("SequenceEndEvent")])
        block = BlockNode(position)
        for word in self._read_until("MappingEndEvent"):
            if type(word).__name__ in ("MappingStartEvent", "SequenceStartEvent"):
                self._refuse(word, "a key must be a word, not a list or a block")
            key = self._node(word, depth + 1)
            value = self._node(next(self._events), depth + 1)
            assert isinstance(key, Scalar), "a key that is a list or a block was refused"
            if key.text in block.keys:
                first = block.keys[key.text]
                self._twice.append(Problem(key.position, f"{printable(key.text)}: duplicate key, first at {first}"))
            else:
                block.put(key.text, value, key.position)
        return block

    def _read_until(self, end: str) -> Iterator[Any]:
        return takewhile(lambda event: type(event).__name__ != end, self._events)

    def _refuse(self, event: Any, reason: str) -> NoReturn:
        raise problems_error([*self._twice, Problem(_position(event.start_mark, self._source, self._column), reason)])
