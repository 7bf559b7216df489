"""What a section is made of; texts are plain text, and become HTML in the template only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from walkerlab.report.numbers import NONE

Tone = Literal["plain", "good", "fair", "bad"]


class Block:
    """A part of a section; `template` is its file in templates/blocks."""

    template: ClassVar[str]


@dataclass(frozen=True)
class Paragraph(Block):
    """Running text; a tone sets it off as a statement."""

    template: ClassVar[str] = "paragraph"
    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Findings(Block):
    """Statements one after another, each with what it is about and how it came out."""

    template: ClassVar[str] = "findings"
    items: tuple[Finding, ...]


@dataclass(frozen=True)
class Finding:
    """One statement.

    about  a few words, set bold
    text   whole sentences
    badge  how it came out, in a word; empty for none
    """

    about: str
    text: str
    badge: str = ""
    tone: Tone = "plain"


@dataclass(frozen=True)
class Shares(Block):
    """Counts that make up a whole, as a bar with its key."""

    template: ClassVar[str] = "shares"
    title: str
    parts: tuple[tuple[str, int, Tone], ...]

    @property
    def total(self) -> int:
        """The whole."""
        return sum(count for _, count, _ in self.parts)


@dataclass(frozen=True)
class Cell:
    """A table's cell; with a tone, its text is set as a badge."""

    text: str
    tone: Tone | None = None

    @property
    def empty(self) -> bool:
        """Whether there is nothing to say."""
        return self.text in ("", NONE)


@dataclass(frozen=True)
class Column:
    """A table's column: its head, and whether it holds numbers."""

    title: str
    numeric: bool = False
    wide: bool = False


@dataclass(frozen=True)
class Body:
    """Rows under a common head of their own, which may be empty."""

    title: str
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Table(Block):
    """A table; the first cell of a row is its head.

    wordy  it has cells with sentences in them: on a narrow screen each row becomes a card of its own
    note   what to know when reading it, below it
    """

    template: ClassVar[str] = "table"
    caption: str
    columns: tuple[Column, ...]
    bodies: tuple[Body, ...]
    wordy: bool = False
    note: str = ""

    def __post_init__(self) -> None:
        """Raise ValueError if a row has not one cell for each column."""
        for body in self.bodies:
            if any(len(row) != len(self.columns) for row in body.rows):
                raise ValueError(f"{self.caption!r}: a row has not {len(self.columns)} cells")


@dataclass(frozen=True)
class Picture(Block):
    """A drawn figure, embedded.

    title    'Figure 7', and what it shows, in a line
    caption  how to read it
    alt      what one sees, for those who do not see it
    uri      data: with the whole image
    """

    template: ClassVar[str] = "picture"
    title: str
    caption: str
    alt: str
    uri: str
    width: int = 0
    height: int = 0


@dataclass(frozen=True)
class Code(Block):
    """Text to be copied."""

    template: ClassVar[str] = "code"
    title: str
    text: str


@dataclass(frozen=True)
class Walker:
    """How one walker of a player moves, and how it is drawn.

    frames  for each instant: foot of leg 0, hip, foot of leg 1, as x and y in mm along and above the slope
    """

    name: str
    style: str
    frames: tuple[tuple[int, ...], ...]
    stills: tuple[int, ...]
    ends: str = ""


@dataclass(frozen=True)
class Player(Block):
    """The walk as stick figures: stills on paper and without scripts, moved by a slider with them.

    instants  s, equally spaced
    view      what is seen, mm: left, top, width, height, y downwards, after the slope is tilted
    """

    template: ClassVar[str] = "player"
    title: str
    caption: str
    walkers: tuple[Walker, ...]
    instants: tuple[float, ...]
    slope_deg: float
    view: tuple[int, int, int, int]


@dataclass(frozen=True)
class Section:
    """A part of the page under a heading; `anchor` is its id, unique on the page."""

    anchor: str
    title: str
    blocks: tuple[Block, ...] = field(default=())


def table(
    caption: str,
    columns: Sequence[Column],
    rows: Sequence[Sequence[str | Cell]],
    *,
    wordy: bool = False,
    note: str = "",
) -> Table:
    """A table whose rows are all under one head."""
    return Table(caption, tuple(columns), (body(rows),), wordy, note)


def body(rows: Sequence[Sequence[str | Cell]], title: str = "") -> Body:
    """Rows, with plain texts made into cells."""
    return Body(title, tuple(tuple(cell if isinstance(cell, Cell) else Cell(cell) for cell in row) for row in rows))
