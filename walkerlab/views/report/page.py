"""Render pages of the report from templates. Figures are embedded as SVG, whose colours a page can change, or as
PNG."""

import base64
import hashlib
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from walkerlab.config.schema import Source
from walkerlab.errors import add_run_options
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.omissions import STOPPED, LeftOut
from walkerlab.views.report.blocks import CASES, COSTS, MAIN, Picture, Section
from walkerlab.views.report.numbers import CARET, POWER, power, to_superscript

PAGES = {"accuracy": COSTS, "stability": CASES}
"""Page of a figure by the first part of the figure's name. All other figures are on the main page."""
VIEW_BOX = re.compile(rb'\bviewBox="0 0 ([\d.]+) ([\d.]+)"')


def pictures(stored: Mapping[str, Content], folder: Path, *, numbered: bool = True) -> tuple[Picture, ...]:
    """Embed every figure that `plot` lists, in the same order.

    Raises FileNotFoundError if a listed file does not exist.
    """
    figures = stored["plot"].summary.get("figures", []) if "plot" in stored else []
    files = choose_images([(folder / figure["svg"], folder / figure["png"]) for figure in figures])
    return tuple(picture(figure, folder, file.suffix, numbered) for figure, file in zip(figures, files, strict=True))


def picture(figure: Mapping[str, Any], folder: Path, kind: str = ".svg", numbered: bool = True) -> Picture:
    """Embed the file of a figure: SVG inline, PNG as an image.

    Raises FileNotFoundError if it does not exist.
    """
    svg = folder / figure["svg"]
    with svg.open("rb") as file:
        # The attribute is in the root element, at the beginning of the file.
        box = VIEW_BOX.search(file.read(2000))
    # The size in CSS pixels reserves space while the page loads. An unknown size is 0.
    width, height = (round(float(box[1])), round(float(box[2]))) if box else (0, 0)
    number = f"Figure {figure['number']}. " if numbered and "number" in figure else ""
    title = f"{number}{figure['title']}."
    alt = f"{title} {figure.get('alt', '')}".strip()
    embedded = folder / figure[kind.removeprefix(".")]
    vector = embedded == svg
    links = [(name.upper(), str(figure[name])) for name in ("svg", "png") if name in figure]
    links += [(f"{stage}.h5", f"{stage}.h5") for stage in figure.get("results", ())]
    return Picture(
        title=title,
        caption=str(figure["caption"]),
        alt=alt,
        svg=inline(svg, alt) if vector else None,
        uri="" if vector else f"data:image/png;base64,{base64.b64encode(embedded.read_bytes()).decode()}",
        width=width,
        height=height,
        name=svg.stem,
        links=tuple(links),
        page=PAGES.get(svg.stem.partition("-")[0], MAIN),
    )


MAX_BYTES = 1_400_000
"""Maximum size of all images together."""


def choose_images(drawings: Sequence[tuple[Path, Path]], most: int = MAX_BYTES) -> list[Path]:
    """Choose the SVG of each drawing, then replace the largest ones by PNG until all fit in `most` bytes.

    drawings  SVG and PNG file of each drawing
    Raises FileNotFoundError if a file is missing.
    """
    chosen = [svg for svg, _ in drawings]
    sizes = [svg.stat().st_size for svg in chosen]
    for index in sorted(range(len(drawings)), key=lambda index: -sizes[index]):
        if sum(sizes) <= most:
            break
        png = drawings[index][1]
        # The SVG of a simple drawing is smaller than its PNG.
        if png.stat().st_size < sizes[index]:
            chosen[index], sizes[index] = png, png.stat().st_size
    return chosen


SVG = "{http://www.w3.org/2000/svg}"
XLINK = "{http://www.w3.org/1999/xlink}"
SVG_ELEMENTS = frozenset(
    {"svg", "g", "path", "rect", "circle", "line", "polyline", "polygon", "text", "tspan", "use", "defs", "clipPath"}
    | {"pattern", "image"}
)
"""Elements and attributes that may be copied, because none of them runs or loads anything."""
ATTRIBUTES = frozenset(
    {"viewBox", "d", "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "width", "height", "points", "transform"}
    | {"style", "id", "clip-path", "preserveAspectRatio", "patternUnits", "fill", "stroke"}
)
COLOUR_VARIABLES = {
    "#ffffff": "--fig-paper",
    "#000000": "--fig-ink",
    "#ededed": "--fig-pale",
    "#7f7f7f": "--fig-grey",
    "#0072b2": "--rigid",
    "#e69f00": "--contact",
    "#009e73": "--leg-1",
    "#cc79a7": "--leg-2",
    "#d55e00": "--fig-red",
}
"""Colours in drawings that the page may replace (in dark mode), with their CSS variables."""
COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
LONG_DECIMALS = re.compile(r"(-?\d+\.\d{2})\d+")
WHITESPACE = re.compile(r"\s+")
EXTERNAL_REFERENCE = re.compile(r"url\((?!#)|@import|expression|javascript:", re.IGNORECASE)


def inline(file: Path, alt: str) -> Markup:
    """Inline an SVG file, described by `alt`.

    Raises FileNotFoundError if it is missing, ParseError for malformed XML.
    """
    root = ET.fromstring(file.read_bytes())
    values = [value for element in root.iter() for value in element.attrib.values()]
    references = [reference for value in values for reference in re.findall(r"url\(#[^)]*\)|^#.*$", value)]
    # Only ids that something refers to are kept, because the others could clash with those of other drawings on the
    # page.
    used = {value.removeprefix("url(").strip("#)") for value in references}
    inside = Markup("").join(markup(child, used) for child in root)
    box = root.get("viewBox", "0 0 1 1")
    return Markup('<svg viewBox="{}" role="img" aria-label="{}">{}</svg>').format(box, alt, inside)


def markup(element: ET.Element, used: set[str]) -> Markup:
    """Copy an element and its children, keeping only the ids in `used`, or return an empty string if the element is
    not allowed."""
    name = element.tag.removeprefix(SVG)
    if name not in SVG_ELEMENTS:
        return Markup("")
    inside = text_content(element.text, name)
    for child in element:
        inside += markup(child, used) + text_content(child.tail, name)
    if name in ("g", "defs") and not inside:
        return Markup("")
    attributes = Markup("")
    for key, value in element.attrib.items():
        local = "href" if key in (f"{XLINK}href", "href") else key
        is_copied = value.startswith(("#", "data:image/png;base64,")) if local == "href" else local in ATTRIBUTES
        if is_copied and (local != "id" or value in used) and not EXTERNAL_REFERENCE.search(value):
            attributes += Markup(' {}="{}"').format(Markup(local), shorten_attribute(local, value))
    return Markup("<{0}{1}>{2}</{0}>").format(Markup(name), attributes, inside)


def text_content(text: str | None, name: str) -> Markup:
    """Escape the text of a text element, or return an empty string for any other element."""
    return escape(text.strip()) if text and name in ("text", "tspan") else Markup("")


def shorten_attribute(name: str, value: str) -> str:
    """Shorten the value of an attribute: round coordinates to 0.01 pt, and replace colours by CSS variables."""
    if name in ("id", "href", "clip-path"):
        return value.strip()
    if name == "style":
        return WHITESPACE.sub(" ", COLOUR.sub(role, value)).replace("; ", ";").replace(": ", ":")
    return WHITESPACE.sub(" ", LONG_DECIMALS.sub(r"\1", value)).strip()


def role(match: re.Match[str]) -> str:
    """Return the CSS variable of a colour, or the colour itself."""
    name = COLOUR_VARIABLES.get(match[0].lower())
    return match[0] if name is None else f"var({name})"


TEMPLATE_FOLDER = Path(__file__).parent / "templates"
COMMENT_LINE = re.compile(r"^ *//.*\n", re.MULTILINE)
CODE_SPAN = re.compile(r"`([^`]*)`")
"""Pattern of code in a text, between backticks."""


@dataclass(frozen=True)
class Page:
    """One HTML file of the report. Its texts are plain text."""

    title: str
    sections: tuple[Section, ...]
    lead: tuple[str, ...] = ()  # paragraphs under the title
    file: str = MAIN
    study: Source | None = None  # the study that the run reproduces, or None
    relation: str = "Redoes"  # first word of the line about the study; 'After' if the scene differs from the study's
    # results that were not computed yet when the page was written or the command was stopped
    pending: tuple[LeftOut, ...] = ()
    run: str = ""  # name of the run for suggested commands; empty for the default run


def render(page: Page) -> str:
    """Render a page as HTML.

    Raises ValueError if two sections have the same anchor.
    """
    anchors = [section.anchor for section in page.sections]
    if len(set(anchors)) != len(anchors):
        raise ValueError(f"two sections of the report share an anchor: {anchors}")
    script = f"\n{source('page.js')}\n{source('player.js')}\n"
    # Only files of this package count as markup. All other texts are escaped.
    trusted = {"style": Markup(source("style.css")), "script": Markup(script), "script_digest": digest_of(script)}
    return environment(page.run).get_template("page.html.j2").render(page=page, home=MAIN, stopped=STOPPED, **trusted)


def digest_of(script: str) -> str:
    """Return the hash by which a page's content security policy allows its script."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def environment(run: str = "") -> Environment:
    """Create the template environment, which escapes all text and adds the run's options to suggested commands."""
    template_environment = Environment(
        loader=FileSystemLoader(TEMPLATE_FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    options = f" -c {shlex.quote(run)}" if run else ""
    template_environment.filters["to_markup"] = lambda text: to_markup(add_run_options(text, lambda _: options))
    return template_environment


def to_markup(text: str) -> Markup:
    """Convert a text to markup. Text in backticks becomes code, and all powers of ten get the same notation."""
    parts = [escape(CARET.sub(to_superscript, POWER.sub(power, part))) for part in CODE_SPAN.split(text)]
    parts[1::2] = [Markup("<code>%s</code>") % code for code in CODE_SPAN.findall(text)]
    return Markup("").join(parts)


def source(name: str) -> str:
    """Read a file to embed in the page, without its comment lines."""
    return COMMENT_LINE.sub("", (TEMPLATE_FOLDER / name).read_text(encoding="utf-8")).strip()
