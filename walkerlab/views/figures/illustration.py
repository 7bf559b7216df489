"""Illustrations, with names, texts, required results and drawing functions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from walkerlab.pipeline.store.artifact import Identified
from walkerlab.views.figures.canvas import Drawing, figure_style, files_of, settle
from walkerlab.views.figures.style import POINT
from walkerlab.views.prose import Prose, f, percent

WORDS = Prose(Path(__file__).parent / "words", (f, percent), {})

Results = Mapping[str, Identified]
"""Results by stage."""
Drawn = tuple[Figure, tuple[Any, ...]]
"""A figure, and the arguments for the template of its caption."""
Draw = Callable[[Results], Drawn]


@dataclass(frozen=True)
class Need:
    """Variables that a figure needs from the result of a stage, and whether it needs the scene of a study."""

    stage: str
    group: str
    variables: tuple[str, ...]
    or_else: str  # reason to report if the result lacks them
    scene: str = ""

    def missing_in(self, results: Results, absent: Mapping[str, str]) -> str | None:
        """Return the reason why the results do not meet this need, or None if they do.

        absent  reasons why results are missing, by stage
        """
        if self.stage not in results:
            reason = absent.get(self.stage)
            return f"it needs {self.stage}" + (f": {reason}" if reason else "")
        result = results[self.stage]
        group = result.groups.get(self.group)
        is_complete = group is not None and all(name in group.variables for name in self.variables)
        is_complete = is_complete and (not self.scene or self.scene in result.summary["reference"])
        return None if is_complete else f"{self.stage}: {self.or_else}"


@dataclass(frozen=True)
class Illustration:
    """An illustration drawn from stored results."""

    name: str  # file name without suffix
    needs: tuple[Need, ...]  # required results; other results are drawn if available
    draw: Draw  # draws the figure in the current style, and returns it and the caption's arguments
    number: int | None = None  # number in the paper; None if the paper has no such figure
    words: str = ""  # file in `words/` with title, caption and text alternative; default: the figure's name
    scene: str = ""  # first argument of the templates, if one file serves several figures
    # title, caption and text alternative (`seen`) of an extension's figure, with {} for values; replaces `words`
    texts: Mapping[str, str] = field(default_factory=dict)

    def say(self, what: str, *values: Any) -> str:
        """Return one of the figure's texts, or '' if it has none.

        what  title, caption or seen (the text alternative, in one or two sentences)
        """
        if self.texts:
            return self.texts.get(what, "").format(*values)
        return WORDS(f"{self.words or self.name}.{what}", *([self.scene] if self.scene else []), *values)

    @property
    def title(self) -> str:
        return self.say("title")

    @property
    def stages(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(need.stage for need in self.needs))

    @property
    def reference(self) -> str:
        return f"figure {self.name if self.number is None else self.number}"

    def why_left_out(self, results: Results, absent: Mapping[str, str]) -> str | None:
        """Return the reason why the illustration cannot be drawn, or None if it can.

        absent  reasons why results are missing, by stage
        """
        reasons = (need.missing_in(results, absent) for need in self.needs)
        return next((reason for reason in reasons if reason is not None), None)

    @property
    def heading(self) -> str:
        """Title, preceded by the paper's figure number if it has one."""
        return self.title if self.number is None else f"Figure {self.number}. {self.title}"

    def render(self, results: Results) -> Drawing:
        """Draw the figure and return its files and caption. Equal results give equal bytes."""
        with figure_style():
            figure, caption_values = self.draw(results)
            svg, png = files_of(figure, self.name, self.heading)
        return Drawing(svg, png, self.say("caption", *caption_values))

    def figure(self, results: Results) -> Figure:
        """Draw the figure and lay it out, for a notebook or a script."""
        with figure_style():
            figure, _ = self.draw(results)
            settle(figure)
        return figure

    def as_file(self, results: Results, kind: str, width: float, dpi: int) -> bytes:
        """Return the figure as a file of the given kind and width (pt). Raster parts use `dpi`."""
        with figure_style(POINT * width):
            return files_of(self.draw(results)[0], self.name, self.heading, [kind], dpi)[0]


def paper_figure(number: int, needs: tuple[Need, ...], draw: Draw) -> Illustration:
    return Illustration(f"figure-{number:02d}", needs, draw, number)
