"""Renders sections as self-contained HTML pages that include style and script."""

import base64
import hashlib
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from walkerlab.config.schema import Source
from walkerlab.errors import add_run_options
from walkerlab.scene.omissions import STOPPED, LeftOut
from walkerlab.views.report.blocks import MAIN, Section
from walkerlab.views.report.symbols import CARET, POWER, power, to_superscript

TEMPLATE_FOLDER = Path(__file__).parent / "templates"
COMMENT_LINE = re.compile(r"^ *//.*\n", re.MULTILINE)
CODE_SPAN = re.compile(r"`([^`]*)`")
"""Code in a text, between backticks."""


@dataclass(frozen=True)
class Page:
    """One HTML file of the report. Its texts are plain text."""

    title: str
    sections: tuple[Section, ...]
    lead: tuple[str, ...] = ()  # paragraphs under the title
    file: str = MAIN
    study: Source | None = None  # the study reproduced, or None
    relation: str = "Redoes"  # first word of the line about the study: Redoes, or After if the scene differs
    pending: tuple[LeftOut, ...] = ()  # results still being computed, or not yet when the command was stopped
    run: str = ""  # name of the run for suggested commands; empty for the default run


def render(page: Page) -> str:
    """Render a page as HTML.

    Raises ValueError if two sections have the same anchor.
    """
    anchors = [section.anchor for section in page.sections]
    if len(set(anchors)) != len(anchors):
        raise ValueError(f"two sections of the report share an anchor: {anchors}")
    script = f"\n{source('page.js')}\n{source('player.js')}\n"
    # Markup only for the package's own files; all other texts are escaped.
    own = {"style": Markup(source("style.css")), "script": Markup(script), "script_digest": digest_of(script)}
    return environment(page.run).get_template("page.html.j2").render(page=page, home=MAIN, stopped=STOPPED, **own)


def digest_of(script: str) -> str:
    """Return the hash by which the page's content security policy recognises its own script."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def environment(run: str = "") -> Environment:
    """Create the template environment, which escapes all texts and adds the run's options to suggested commands."""
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
    """Convert a text to markup, with backticks as code elements and powers of ten in a single notation."""
    parts = [escape(CARET.sub(to_superscript, POWER.sub(power, part))) for part in CODE_SPAN.split(text)]
    parts[1::2] = [Markup("<code>%s</code>") % code for code in CODE_SPAN.findall(text)]
    return Markup("").join(parts)


def source(name: str) -> str:
    """Read a file to embed in the page, leaving out comment lines."""
    return COMMENT_LINE.sub("", (TEMPLATE_FOLDER / name).read_text(encoding="utf-8")).strip()
