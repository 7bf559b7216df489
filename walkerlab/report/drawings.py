"""Drawn figures as a part of the page: only their shapes and texts, small, and in colours that the page decides."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

from markupsafe import Markup, escape

SVG, XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
SHAPES = frozenset(
    {"svg", "g", "path", "rect", "circle", "line", "polyline", "polygon", "text", "tspan", "use", "defs", "clipPath"}
    | {"pattern", "image"}
)
"""Elements that are taken over, with these attributes; nothing that runs or fetches is among them."""
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
"""Colours of the drawings that the page may change, for the dark, and what they are called there."""
COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
DIGITS = re.compile(r"(-?\d+\.\d{2})\d+")
BLANKS = re.compile(r"\s+")
FETCHES = re.compile(r"url\((?!#)|@import|expression|javascript:", re.IGNORECASE)


def inline(file: Path, alt: str) -> Markup:
    """The drawing of an SVG file as markup, described by `alt`.

    Raises FileNotFoundError if it is not there, ParseError if it is no XML.
    """
    root = ET.fromstring(file.read_bytes())
    used = {value.removeprefix("url(").strip("#)") for value in references(root)}
    box = escape(root.get("viewBox", "0 0 1 1"))
    inside = Markup("").join(markup(child, used) for child in root)
    return Markup('<svg viewBox="{}" role="img" aria-label="{}">{}</svg>').format(box, alt, inside)


def references(root: ET.Element) -> list[str]:
    """Everything that refers to an id."""
    values = [value for element in root.iter() for value in element.attrib.values()]
    return [found for value in values for found in re.findall(r"url\(#[^)]*\)|^#.*$", value)]


def markup(element: ET.Element, used: set[str]) -> Markup:
    """An element with what it holds; nothing for one that has no place in a page."""
    name = element.tag.removeprefix(SVG)
    if name not in SHAPES:
        return Markup("")
    inside = words(element.text, name)
    for child in element:
        inside += markup(child, used) + words(child.tail, name)
    if name in ("g", "defs") and not inside:
        return Markup("")
    return Markup("<{0}{1}>{2}</{0}>").format(Markup(name), attributes(element, used), inside)


def words(text: str | None, name: str) -> Markup:
    """What an element says, if it is one that says something."""
    return escape(text.strip()) if text and name in ("text", "tspan") else Markup("")


def attributes(element: ET.Element, used: set[str]) -> Markup:
    """The attributes that are taken over, each in the fewest characters; ids only where something refers to them."""
    found = []
    for name, value in element.attrib.items():
        local = "href" if name in (f"{XLINK}href", "href") else name
        if local == "id" and value not in used:
            continue
        if local == "href" and not value.startswith(("#", "data:image/png;base64,")):
            continue
        if (local in ATTRIBUTES or local == "href") and not FETCHES.search(value):
            found.append(Markup(' {}="{}"').format(Markup(local), short(local, value)))
    return Markup("").join(found)


def short(name: str, value: str) -> str:
    """A value in fewer characters: places to a hundredth of a point, colours by their role."""
    if name in ("id", "href", "clip-path"):
        return value.strip()
    if name == "style":
        return BLANKS.sub(" ", COLOUR.sub(role, value)).replace("; ", ";").replace(": ", ":")
    return BLANKS.sub(" ", DIGITS.sub(r"\1", value)).strip()


def role(found: re.Match[str]) -> str:
    """A colour by its role on the page; itself if it has none."""
    name = ROLES.get(found[0].lower())
    return found[0] if name is None else f"var({name})"
