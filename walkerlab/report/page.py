"""The page: sections set in the template, style and script included, so that the file needs nothing but itself."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from walkerlab.report.blocks import Section

TEMPLATES = Path(__file__).parent / "templates"


def render(title: str, lead: Sequence[str], sections: Sequence[Section]) -> str:
    """The HTML of the whole page.

    title  its heading; plain text, as all texts of the blocks
    lead   paragraphs under the heading

    Raises ValueError if two sections have one anchor.
    """
    anchors = [section.anchor for section in sections]
    if len(set(anchors)) != len(anchors):
        raise ValueError(f"two sections of the report have one anchor: {anchors}")
    script = f"\n{source('player.js')}\n"
    template = environment().get_template("page.html.j2")
    return template.render(
        title=title,
        lead=lead,
        sections=sections,
        # The only texts that are markup already: files of this package.
        style=Markup(source("style.css")),
        script=Markup(source("player.js")),
        script_digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )


def environment() -> Environment:
    """Where templates are found, and that every text is escaped."""
    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def source(name: str) -> str:
    """A file that goes into the page as it is."""
    return (TEMPLATES / name).read_text(encoding="utf-8").strip()
