"""The page of `walkerlab explore`: the report's player and style, and a script that queries the server."""

from pathlib import Path

from jinja2 import FileSystemLoader
from markupsafe import Markup

from walkerlab.config.files import DEFAULT, builtin_names
from walkerlab.views.explore.walks import ExploredConfig
from walkerlab.views.report import page as report
from walkerlab.views.report.blocks import Player

TEMPLATES = Path(__file__).parent / "templates"
SEEN = (
    "Wide outline: rigid model; narrow: contact model. Each leg is a line from hip to foot;"
    " leg 2 is hollow. Arrows are ground forces; a red arrow is a push-off."
)


LONGEST_NAME = 60


def start_name(base: ExploredConfig) -> str:
    name = base.called or base.config or DEFAULT
    changed = f"{name} with {', '.join(base.sets)}"
    return name if base.called or not base.sets else changed if len(changed) <= LONGEST_NAME else f"{name}, changed"


def choices(base: ExploredConfig) -> list[str]:
    """List the other configs to choose from: built-in ones, and the YAML files in the working folder."""
    own = sorted(path.name for path in Path().glob("*.yaml"))
    return [name for name in (*builtin_names(), *own) if name != start_name(base)]


def render_page(base: ExploredConfig) -> tuple[str, str]:
    """Return the page's HTML and its content security policy."""
    own = (TEMPLATES / "explore.js").read_text(encoding="utf-8").strip()
    script = f'\n"use strict";\n{report.source("player.js")}\n{own}\n'
    environment = report.environment()
    environment.loader = FileSystemLoader([report.TEMPLATE_FOLDER, TEMPLATES])
    html = environment.get_template("explore.html.j2").render(
        start_name=start_name(base),
        configs=choices(base),
        anchor="walk",
        # An empty player, which the script fills.
        block=Player(
            title="The walk.",
            caption=SEEN,
            alt="The walker",
            walkers=(),
            slope_rad=0.0,
            leg_m=1.0,
            foot_radii_m=(0.0, 0.0),
            closeup_m=1.0,
            view=(0, 0, 1, 1),
        ),
        # Markup only for the package's own files; all other texts are escaped.
        style=Markup(report.source("style.css") + (TEMPLATES / "explore.css").read_text(encoding="utf-8")),
        script=Markup(script),
    )
    allowed = "default-src 'none'; img-src data: blob:; connect-src 'self'; style-src 'unsafe-inline'"
    return html, f"{allowed}; script-src 'sha256-{report.digest_of(script)}'; base-uri 'none'; form-action 'none'"
