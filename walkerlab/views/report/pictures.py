"""Embeds figures in the page, as compact SVG in colours that the page can change, or as PNG."""

import base64
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from markupsafe import Markup, escape

from walkerlab.pipeline.store.content import Content
from walkerlab.views.report.blocks import CASES, COSTS, MAIN, Picture

PAGES = {"accuracy": COSTS, "stability": CASES}
"""Page of each figure by the first part of its name; all other figures are on the main page."""
VIEW_BOX = re.compile(rb'\bviewBox="0 0 ([\d.]+) ([\d.]+)"')


def pictures(stored: Mapping[str, Content], folder: Path, *, numbered: bool = True) -> tuple[Picture, ...]:
    """Embed every figure listed by `plot`, in its order.

    Raises FileNotFoundError if a listed file does not exist.
    """
    figures = stored["plot"].summary.get("figures", []) if "plot" in stored else []
    files = fitting([(folder / figure["svg"], folder / figure["png"]) for figure in figures])
    return tuple(picture(figure, folder, file.suffix, numbered) for figure, file in zip(figures, files, strict=True))


def picture(figure: Mapping[str, Any], folder: Path, kind: str = ".svg", numbered: bool = True) -> Picture:
    """Embed a figure's file of this kind: SVG inline, PNG as an image.

    Raises FileNotFoundError if it does not exist.
    """
    svg = folder / figure["svg"]
    with svg.open("rb") as file:
        box = VIEW_BOX.search(file.read(2000))
    # size in CSS pixels, to reserve space while loading; 0 if unknown
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
"""Maximum size of all images together; the largest drawings are embedded as PNG until all fit."""


def fitting(drawings: Sequence[tuple[Path, Path]], most: int = MAX_BYTES) -> list[Path]:
    """Choose SVG files, or PNG for the largest until all fit in `most` bytes.

    Raises FileNotFoundError if one is missing.
    """
    chosen = [svg for svg, _ in drawings]
    sizes = [svg.stat().st_size for svg in chosen]
    for index in sorted(range(len(drawings)), key=lambda index: -sizes[index]):
        if sum(sizes) <= most:
            break
        png = drawings[index][1]
        if png.stat().st_size < sizes[index]:
            chosen[index], sizes[index] = png, png.stat().st_size
    return chosen


SVG = "{http://www.w3.org/2000/svg}"
XLINK = "{http://www.w3.org/1999/xlink}"
SVG_ELEMENTS = frozenset(
    {"svg", "g", "path", "rect", "circle", "line", "polyline", "polygon", "text", "tspan", "use", "defs", "clipPath"}
    | {"pattern", "image"}
)
"""Elements and attributes that are copied; none of them runs or loads anything."""
ATTRIBUTES = frozenset(
    {"viewBox", "d", "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "width", "height", "points", "transform"}
    | {"style", "id", "clip-path", "preserveAspectRatio", "patternUnits", "fill", "stroke"}
)
ROLES = {
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
    used = {value.removeprefix("url(").strip("#)") for value in references}
    inside = Markup("").join(markup(child, used) for child in root)
    box = root.get("viewBox", "0 0 1 1")
    return Markup('<svg viewBox="{}" role="img" aria-label="{}">{}</svg>').format(box, alt, inside)


def markup(element: ET.Element, used: set[str]) -> Markup:
    """Copy an allowed element with its children, keeping only ids in `used`, and return nothing for other elements."""
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
        wanted = value.startswith(("#", "data:image/png;base64,")) if local == "href" else local in ATTRIBUTES
        if wanted and (local != "id" or value in used) and not EXTERNAL_REFERENCE.search(value):
            attributes += Markup(' {}="{}"').format(Markup(local), shorten_attribute(local, value))
    return Markup("<{0}{1}>{2}</{0}>").format(Markup(name), attributes, inside)


def text_content(text: str | None, name: str) -> Markup:
    """Escape the text of a text element, and return nothing for other elements."""
    return escape(text.strip()) if text and name in ("text", "tspan") else Markup("")


def shorten_attribute(name: str, value: str) -> str:
    """Shorten an attribute: coordinates to a hundredth of a point, colours to CSS variables."""
    if name in ("id", "href", "clip-path"):
        return value.strip()
    if name == "style":
        return WHITESPACE.sub(" ", COLOUR.sub(role, value)).replace("; ", ";").replace(": ", ":")
    return WHITESPACE.sub(" ", LONG_DECIMALS.sub(r"\1", value)).strip()


def role(match: re.Match[str]) -> str:
    """Return the CSS variable of a colour, or the colour itself."""
    name = ROLES.get(match[0].lower())
    return match[0] if name is None else f"var({name})"
