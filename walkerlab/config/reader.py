"""YAML text to a tree with positions.

ruamel.yaml splits the text; what plain scalars mean is the core schema of YAML 1.2 (section 10.3.2): 1e7 is a number,
`no` is a text. A config is a small, plain tree: anchors, aliases, tags, duplicate keys, deep nesting and large texts
are refused, so that no text can cost more than its own length.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final

from walkerlab.config.problems import Problem, refusal, shown
from walkerlab.config.tree import Mapping, Node, Position, Scalar, Sequence

MAX_CHARACTERS: Final = 64 * 1024
MAX_DEPTH: Final = 12
MAX_DIGITS: Final = 300

_NOT_YAML = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_NULL = re.compile(r"null|Null|NULL|~|")
_TRUE = re.compile(r"true|True|TRUE")
_FALSE = re.compile(r"false|False|FALSE")
_INTEGER = re.compile(r"[-+]?[0-9]+")
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"[-+]?(\.inf|\.Inf|\.INF)")
_NAN = re.compile(r"\.nan|\.NaN|\.NAN")


def value_of(text: str) -> str | int | float | bool | None:
    """What a plain scalar means in YAML 1.2."""
    if _NULL.fullmatch(text):
        return None
    if _TRUE.fullmatch(text) or _FALSE.fullmatch(text):
        return text[0] in "tT"
    if _INTEGER.fullmatch(text) and len(text) <= MAX_DIGITS:
        return int(text)
    if _OTHER_BASE.fullmatch(text) and len(text) <= MAX_DIGITS:
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text) + 0.0  # no negative zero: one number, one text, one key
    if _INFINITE.fullmatch(text) or _NAN.fullmatch(text):
        return float(text.lower().replace(".", ""))
    return text


def read(text: str, source: str, column: int = 1) -> Node | None:
    """Tree of a YAML text, or None if there is nothing in it.

    text    of one document
    source  file or option it is from, for positions
    column  of its first character, for a text inside a longer one

    Raises ConfigError with the position of whatever is not a plain YAML tree.
    """
    if len(text) > MAX_CHARACTERS:
        raise refusal([Problem(Position(source, 1, column), f"longer than {MAX_CHARACTERS} characters: not a config")])
    strange = _NOT_YAML.search(text)
    if strange:
        where = _place(text, strange.start(), source, column)
        raise refusal([Problem(where, f"character {shown(strange.group())} cannot be in a config, which is text")])
    composer = _Composer(source, column)
    for event in _events(text, source, column):
        composer.take(event)
    if composer.problems:
        raise refusal(composer.problems)
    return composer.root


def _events(text: str, source: str, column: int) -> Iterator[Any]:
    from ruamel.yaml import YAML

    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except Exception as error:  # a parser of arbitrary bytes fails in many ways; every one of them is a bad config
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        where = _position(mark, source, column) if mark else Position(source, 1, column)
        reason = getattr(error, "problem", None) or getattr(error, "context", None) or type(error).__name__
        if r"'\t'" in str(reason):
            raise refusal([Problem(where, "a tab: YAML is indented by spaces")], "Replace tabs by spaces.") from None
        raise refusal([Problem(where, f"not YAML: {shown(str(reason))}")]) from None


def _position(mark: Any, source: str, column: int) -> Position:
    return Position(source, mark.line + 1, mark.column + (column if mark.line == 0 else 1))


def _place(text: str, index: int, source: str, column: int) -> Position:
    before = text[:index]
    line = before.count("\n")
    return Position(source, line + 1, index - (before.rfind("\n") + 1) + (column if line == 0 else 1))


class _Composer:
    """Builds the tree from events, without recursion."""

    def __init__(self, source: str, column: int) -> None:
        self.root: Node | None = None
        self.problems: list[Problem] = []
        self._source = source
        self._column = column
        self._open: list[Mapping | Sequence] = []
        self._keys: list[Scalar | None] = []
        self._documents = 0

    def take(self, event: Any) -> None:
        """Take the next event of the parser."""
        name = type(event).__name__
        if name == "DocumentStartEvent":
            self._start_document(event)
        elif name == "ScalarEvent":
            self._refuse_properties(event)
            value = value_of(event.value) if event.implicit[0] else event.value
            self._add(Scalar(self._at(event), value, event.value))
        elif name == "MappingStartEvent":
            self._descend(event, Mapping(self._at(event)))
        elif name == "SequenceStartEvent":
            self._descend(event, Sequence(self._at(event)))
        elif name in ("MappingEndEvent", "SequenceEndEvent"):
            self._open.pop()
            self._keys.pop()
        elif name == "AliasEvent":
            self._refuse(event, f"alias *{shown(event.anchor)}: a config has none; write the value out, or use extends")

    def _start_document(self, event: Any) -> None:
        self._documents += 1
        if self._documents > 1:
            self._refuse(event, "a second document begins: a config is one")
        if event.version not in (None, (1, 2)):
            self._refuse(event, "a config is YAML 1.2")

    def _descend(self, event: Any, node: Mapping | Sequence) -> None:
        self._refuse_properties(event)
        if len(self._open) == MAX_DEPTH:
            self._refuse(event, f"nested deeper than {MAX_DEPTH} levels")
        self._add(node)
        self._open.append(node)
        self._keys.append(None)

    def _add(self, node: Node) -> None:
        if not self._open:
            self.root = node
            return
        parent = self._open[-1]
        if isinstance(parent, Sequence):
            parent.items.append(node)
            return
        name = self._keys[-1]
        if name is not None:
            self._keys[-1] = None
            self._enter(parent, name, node)
        elif isinstance(node, Scalar):
            self._keys[-1] = node
        else:
            raise refusal([Problem(node.position, "a key is a word, not a list or a block")])

    def _enter(self, parent: Mapping, name: Scalar, node: Node) -> None:
        first = parent.keys.get(name.text)
        if first is None:
            parent.put(name.text, node, name.position)
        else:
            self.problems.append(Problem(name.position, f"{shown(name.text)}: given a second time, first at {first}"))

    def _refuse_properties(self, event: Any) -> None:
        if event.anchor is not None:
            self._refuse(event, f"anchor &{shown(event.anchor)}: a config has none; use extends to share values")
        if event.tag is not None:
            self._refuse(event, f"tag {shown(event.tag)}: a config has none; types are known from the keys")

    def _refuse(self, event: Any, reason: str) -> None:
        raise refusal([*self.problems, Problem(self._at(event), reason)])

    def _at(self, event: Any) -> Position:
        return _position(event.start_mark, self._source, self._column)
