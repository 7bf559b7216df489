"""Blocks and sections of the page, and the stored results from which sections are made."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, ClassVar, Literal

from markupsafe import Markup

from walkerlab.config.schema import Config
from walkerlab.pipeline.headlines import claims
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.report.tables import Table, Tone
from walkerlab.views.report.tracks import Track

MAIN = "report.html"
PAPER_PAGE = "report-paper.html"
CASES = "report-stability.html"
COSTS = "report-accuracy.html"
"""The report and the pages linked from it."""


@dataclass(frozen=True)
class Paragraph:
    """Running text. The tone marks a statement, or a placeholder for a pending result."""

    text: str
    tone: Tone | Literal["waiting"] = "plain"

    def __bool__(self) -> bool:
        return bool(self.text)


@dataclass(frozen=True)
class Statements:
    """Statements shown together, in one of four layouts."""

    items: "tuple[Statement, ...]"
    layout: Literal["list", "cards", "lines", "columns"] = "list"


@dataclass(frozen=True)
class Statement:
    """A statement about a subject, with an optional verdict."""

    about: str  # subject, in bold type
    text: str
    badge: str = ""  # one-word verdict, or empty
    tone: Tone = "plain"


@dataclass(frozen=True)
class Shares:
    """Counts that make up a whole, shown as a bar with a legend."""

    title: str
    parts: tuple[tuple[str, int, Tone], ...]  # label, count and tone of each part


@dataclass(frozen=True)
class Picture:
    """An embedded figure in a gallery."""

    title: str
    caption: str
    alt: str  # description for readers who cannot see it
    svg: Markup | None = None  # sanitised drawing; None if too large
    uri: str = ""  # data URI of the image, for a drawing that is too large
    width: int = 0
    height: int = 0
    name: str = ""  # file name without suffix
    links: tuple[tuple[str, str], ...] = ()  # label and file of the drawing and its data
    page: str = MAIN  # file of the page that shows it


@dataclass(frozen=True)
class Gallery:
    """Figures in columns. A click on a figure enlarges it."""

    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class Cards:
    """Links to other pages: file, title, and a one-sentence summary."""

    items: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True)
class Terms:
    """Terms and their meanings."""

    meanings: Mapping[str, str]


@dataclass(frozen=True)
class Code:
    """Text for copying."""

    title: str
    text: str

    def __bool__(self) -> bool:
        return bool(self.text)


Pad = tuple[float, float, int]
"""Start and end of a pad along the slope (m), and index of the leg in whose lane it lies."""


@dataclass(frozen=True)
class Walker:
    """Motion and style of one walker in a player."""

    name: str
    style: str
    track: Track  # thinned motion
    strikes: tuple[float, ...]  # times of the heel strikes (s)
    # postures, each a line through the joints, in mm along the slope and mm normal to it (positive downward)
    stills: tuple[tuple[tuple[int, int], ...], ...]
    ends: str = ""  # how the walk failed, in words; empty if it did not
    pushes: bool = False  # whether the trailing foot pushes off as the other foot lands

    @property
    def meta(self) -> dict[str, object]:
        """Metadata that the script needs to decode the samples."""
        channels = tuple(self.track.channels)
        samples = int(self.track["t"].size)
        return {
            "name": self.name, "style": self.style, "channels": channels, "samples": samples, "strikes": self.strikes,
            "pushes": self.pushes,
        }  # fmt: skip


@dataclass(frozen=True)
class Player:
    """The animated walk. In print and without scripts, the page shows stills."""

    title: str
    caption: str
    alt: str
    walkers: tuple[Walker, ...]
    slope_rad: float
    leg_m: float
    foot_radii_m: tuple[float, float]  # radius of each leg's foot
    closeup_m: float  # height of the close-up of a foot
    view: tuple[int, int, int, int]  # left, top, width and height of the stills (mm, y down), after the slope is tilted
    torso_m: float = 0.0
    ordinary_force: float = 1.0  # force (N) that an arrow of the standard length shows
    pads: tuple[Pad, ...] = ()
    ground: tuple[tuple[float, float], ...] = ()  # where each ground level starts along the slope, and its height (m)

    @property
    def slope_deg(self) -> float:
        return round(math.degrees(self.slope_rad), 3)

    @property
    def shows_forces(self) -> bool:
        """Whether any walker has ground forces. Also true of a player without walkers, which is filled later."""
        return not self.walkers or any("n0" in walker.track.channels for walker in self.walkers)

    @property
    def scene(self) -> dict[str, object]:
        names = ("slope_rad", "leg_m", "foot_radii_m", "torso_m", "ordinary_force", "closeup_m", "pads", "ground")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True)
class GaitMark:
    """A point of a diagram whose gait the player can show."""

    x: float  # position in diagram units; likewise y
    y: float
    stable: bool
    walker: Walker  # motion of the gait, with the gait's description as its name
    slope_rad: float


@dataclass(frozen=True)
class Diagram:
    """Branches of gaits over a parameter. Selecting a mark loads its gait into the page's player."""

    WIDTH: ClassVar[int] = 720
    HEIGHT: ClassVar[int] = 340
    LEFT: ClassVar[int] = 62
    RIGHT: ClassVar[int] = 12
    TOP: ClassVar[int] = 12
    BOTTOM: ClassVar[int] = 46
    title: str
    caption: str
    titles: tuple[str, str]  # of the two axes
    # points of each line, and whether the gaits on it are stable
    curves: tuple[tuple[tuple[tuple[float, float], ...], bool], ...]
    # position and text of the ticks of both axes
    ticks: tuple[tuple[tuple[float, str], ...], tuple[tuple[float, str], ...]]
    gaits: tuple[GaitMark, ...]


PageBlock = Paragraph | Statements | Shares | Gallery | Cards | Terms | Code | Player | Diagram | Table
"""A part of a section. The template of a class is the file of the same name in templates/blocks."""


@dataclass(frozen=True)
class Section:
    """A part of a page under a heading."""

    anchor: str  # id, unique on the page
    title: str
    blocks: tuple[PageBlock, ...] = ()
    finding: str = ""  # brief result; if there is one, the section is folded and shows only this
    page: str = MAIN  # file of the page

    @classmethod
    def create(
        cls, anchor: str, title: str, blocks: Iterable[PageBlock | None], finding: str = "", page: str = MAIN
    ) -> "Section | None":
        """Create a section of the blocks that are not empty, or return None if all are empty."""
        filled = tuple(block for block in blocks if block)
        return cls(anchor, title, filled, finding, page) if filled else None


@dataclass(frozen=True, eq=False)
class Results:
    """Results of a run, and what is missing, as the report uses them."""

    config: Config
    stored: Mapping[str, Content] = field(default_factory=dict)  # up-to-date results by stage
    pictures: tuple[Picture, ...] = ()  # embedded figures of `plot`
    absent: tuple[LeftOut, ...] = ()  # missing results, with reasons
    # results that were not computed yet when the page was written or the command was stopped
    pending: tuple[LeftOut, ...] = ()
    failed: frozenset[str] = frozenset()  # stages that were run and failed

    @property
    def departures(self) -> Sequence[str] | None:
        """Differences between this scene and the paper's, or None if they were not compared."""
        departures: Sequence[str] | None = self.summary("compare").get("departures")
        return departures

    @property
    def claims(self) -> Sequence[Mapping[str, Any]]:
        """Values that a study claims for this scene, with verdicts, or () if no study covers it."""
        return claims(self.summary("compare"))

    def summary(self, stage: str) -> Mapping[str, Any]:
        """Return the summary of a stage's result, or an empty one if there is no result."""
        return self.stored[stage].summary if stage in self.stored else {}

    def group(self, stage: str, path: str) -> Group | None:
        """Return a group of a stage's result, or None if it does not exist."""
        return self.stored[stage].groups.get(path) if stage in self.stored else None


SectionMaker = Callable[[Results], Section | None]


def stage_section(stage: str, needed: str = "") -> Callable[[Callable[..., Section | None]], SectionMaker]:
    """Return a decorator for a function that makes a section from the summary of a stage. If the summary is empty or
    lacks the key `needed`, there is no section.
    """

    def section_of(make: Callable[..., Section | None]) -> SectionMaker:
        @wraps(make)
        def section(results: Results) -> Section | None:
            summary = results.summary(stage)
            return make(results, summary) if (summary.get(needed) if needed else summary) else None

        return section

    return section_of
