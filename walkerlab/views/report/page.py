"""Pages: sections set in the template, style and script included, so that the file needs nothing but itself."""

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
from walkerlab.views.report.blocks import MAIN, Section
from walkerlab.views.report.symbols import CARET, POWER, power, raised

TEMPLATES = Path(__file__).parent / "templates"
COMMENT = re.compile(r"^ *//.*\n", re.MULTILINE)
TYPED = re.compile(r"`([^`]*)`")
"""What is to be typed, or stands in a file, as texts mark it."""


@dataclass(frozen=True)
class Page:
    """One file of the report; texts are plain.

    title     its heading
    lead      paragraphs under it
    study     what is redone; None if that is not said
    redone    how the scene stands to that study, in a word or two
    pending   the results that are still being computed
    run       name of the run, for commands that the page advises; empty for the run that these have without options
    """

    title: str
    sections: tuple[Section, ...]
    lead: tuple[str, ...] = ()
    file: str = MAIN
    study: Source | None = None
    redone: str = "Redoes"
    pending: tuple[str, ...] = ()
    run: str = ""


def render(page: Page) -> str:
    """The HTML of a page.

    Raises ValueError if two sections have one anchor.
    """
    anchors = [section.anchor for section in page.sections]
    if len(set(anchors)) != len(anchors):
        raise ValueError(f"two sections of the report have one anchor: {anchors}")
    script = f"\n{source('page.js')}\n{source('player.js')}\n"
    # The only texts that are markup already: files of this package.
    own = {"style": Markup(source("style.css")), "script": Markup(script), "script_digest": digest_of(script)}
    return environment(page.run).get_template("page.html.j2").render(page=page, home=MAIN, **own)


def digest_of(script: str) -> str:
    """What a page's header knows the one script by that may run."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def environment(run: str = "") -> Environment:
    """Where templates are found, that every text is escaped, and which run it is about."""
    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    options = f" -c {shlex.quote(run)}" if run else ""
    made.filters["said"] = lambda text: said(add_run_options(text, options))
    return made


def said(text: str) -> Markup:
    """A text with what is to be typed set as code, and powers of ten written in one way."""
    parts = TYPED.split(text)
    set_apart = [
        Markup("<code>%s</code>") % part if index % 2 else escape(CARET.sub(raised, POWER.sub(power, part)))
        for index, part in enumerate(parts)
    ]
    return Markup("").join(set_apart)


def source(name: str) -> str:
    """Read a file that goes into the page, without its lines of comment."""
    return COMMENT.sub("", (TEMPLATES / name).read_text(encoding="utf-8")).strip()
