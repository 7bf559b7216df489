"""Write the pages on published gaits and known mistakes from the configs in configs/published.

python scripts/published.py            writes published.md, published-right.md and known-mistakes.md in docs
python scripts/published.py --check    exits 1 if a page is not what the code gives
"""

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkerlab.config.check import Check
from walkerlab.config.loader import load
from walkerlab.evidence.check.answer import Checked, check_gait
from walkerlab.evidence.check.gaits import CheckedStep, gait_near
from walkerlab.evidence.check.plain_walker import STANCE, PlainWalker, list_mistakes
from walkerlab.evidence.check.section import COLUMNS, headline, is_partly_reproduced, remarks, source_of
from walkerlab.views.report.numbers import number

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
REPRODUCED = "reproduced"
ORDER = ("explained", "partly explained", "different, unexplained", REPRODUCED)
TYPICAL = 1e-3  # size of mistakes that have one, rad or s
FOLDER = ROOT / "configs" / "published"
MADE = "<!-- made by scripts/published.py from configs/published -->"
STORY = "passivewalker-2009"
HEAD = """# Published gaits, checked

Papers and programs print gaits, and other programs copy the digits. On this page {all} printed gaits are computed
again: {right} are right, {wrong} are not.

{made}

This one, of a walker with round feet, is from a script that many programs have copied. The script prints 15 digits,
of which at most the first four are right:

{story}

The cause is one term. In its heel strike, the script computes the angular momentum of the trailing leg about the hip,
and adds a term that should not be there:

```
-I * (rate of the trailing leg - rate of the leading leg)
```

Here I is the leg's moment of inertia about its centre of mass. With this mistake we get all digits of the
script. A later script of the same family has the right heel strike
([passivewalker-sim](published-right.md#passivewalker-sim)). To see it for yourself, type this (other names from the
tables work as well):

```
walkerlab check published/passivewalker-2009.yaml
```

There are two more stories. A much-quoted state of a walker with knees is not periodic, and we do not know why
([hsu-chen-2007](#hsu-chen-2007)). And the paper that this project reproduces has a wrong sign in its equations, as its
own printed state shows ([adams-compass](#adams-compass)).

Below are the gaits that differ, one by one. Those that are right have [a page of their own](published-right.md), and
[known mistakes](known-mistakes.md) shows how each mistake changes a gait. To check yours, see [check a gait](check.md).

## Gaits that differ

Each gait has its source: author, *title* and year, as far as they are known. The author of a program is the one that
its file names, or else the GitHub account that publishes it.

*Right* means that two independent models agree on a value: the compiled one that all of walkerlab uses, and a plain
one that shares no equations with it. For all {all} gaits they agree: after a step of the plain model from the gait of
the compiled one, the state and the period differ by {routes} at most (angles in rad, times in units
of the pendulum time sqrt(L/g)). Each printed value gets a verdict:

- *Reproduced*: it agrees with the right one in all printed digits, after rounding or cutting off (-0.6058 may be
  printed as -0.61 or -0.60).
- *Reproduced to n digits*: its first n digits agree; n is at least three and at least half of those printed. "Off by
  4.9 units" counts in units of the last printed digit.
- *Different*: anything else.

If values differ, the program looks for one cause: another convention, a mistake known from programs, or a misprint.

- *Explained*: the cause gives all printed values, to the last digit.
- *Partly explained*: it gives some of them.

The signs and angles of each source are kept, and the right values are converted to them. *One exact step* is a step of
the right equations from the printed state, without a noticeable numerical error. If the state is periodic, the step
leads back to it.

{overview}
"""
TAIL = """## The longest case

The study that this project reproduces prints 38 values, and [the study](study.md) judges each of them. *Reproduced* and
*explained* have the same meaning there. Two more verdicts are *contradicted*, for a value that other values of the
paper refute, and *not reproduced*, for a value that differs without an explanation or cannot be compared.
"""
RIGHT = """# Published gaits that are right

These {right} gaits are reproduced, most of them to the last printed digit. You can test your own program with them:
the column *right* often has more digits than the source.

{made}

{overview}

`walkerlab check published/NAME.yaml` computes one of them again. [Published gaits, checked](published.md) has those
that differ, and says what *reproduced* means.
"""
MISTAKES = """# Known mistakes in programs for walkers

Your gait is close to the right one, but not equal to it. Each row below is a mistake that `walkerlab check` tries on
your values ([check a gait](check.md)), and how much it changes a gait.

{made}

## Compass

The compass at 3 degrees (config `slope-3deg`), in order of the change of the period:

{compass}

## Round feet

The walker `published/passivewalker-2009.yaml`, whose legs have inertia. *I* is the moment of inertia of a leg
about its centre of mass.

{round}
"""


def comment_of(file: Path) -> str:
    """Return the comment at the top of a config as a paragraph."""
    lines = []
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        lines.append(line.removeprefix("# "))
    return " ".join(lines)


@dataclass(frozen=True)
class Entry:
    """A printed gait as the pages show it: what was found, how many values are reproduced, and how far both routes
    differ.
    """

    name: str
    source: str
    finding: str
    reproduced: str
    routes: float
    table: str
    paragraphs: tuple[str, ...]


def entry_of(file: Path) -> Entry:
    """Check a printed gait, and return its entry on the pages."""
    summary = check_gait(load(file).config)
    source = summary["source"]
    rows = summary["values"]
    table = table_of(
        [column.title for column in COLUMNS], [[column.cell(row).text for column in COLUMNS] for row in rows]
    )
    reproduced = [row for row in rows if row["verdict"] == REPRODUCED]
    short = sum(map(is_partly_reproduced, rows))
    note = f", {short} of them not in all digits" if short else ""
    in_the_table = ("The right gait", "Two independent")
    return Entry(
        name=file.stem,
        source=short_source(source),
        finding=finding_of(summary),
        reproduced=f"{len(reproduced)} of {len(rows)}{note}",
        routes=difference_of_routes(summary),
        table=table,
        paragraphs=(
            comment_of(file),
            f"**{headline(summary)}**",
            table,
            *(text for text in remarks(summary) if not text.startswith(in_the_table)),
            source_of(source),
        ),
    )


def short_source(source: Mapping) -> str:
    """Return author, title and year of a source, leaving out what is not known."""
    title = f"*{source['title']}*"
    dated = f"{title} ({source['year']})" if source["year"] else title
    return f"{source['authors']}, {dated}" if source["authors"] else dated


def difference_of_routes(summary: Mapping) -> float:
    """Return the difference between the gaits of both routes. Exit with a message if they do not agree."""
    routes = summary["routes"]
    if routes is None or not routes["agree"]:
        sys.exit(f"the two routes do not agree on {summary['source']['title']}: {routes}")
    return routes["difference"]


def table_of(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [heads, ["---"] * len(heads), *rows])


def finding_of(summary: Mapping) -> str:
    """Return the finding, which is 'partly explained' if a cause reproduces some of the values that differ."""
    unexplained = summary["finding"] not in ("explained", "reproduced")
    return "partly explained" if unexplained and summary["explanations"] else summary["finding"]


def pages() -> dict[str, str]:
    """Return the text of each page by its file name."""
    entries = [entry_of(file) for file in sorted(FOLDER.glob("*.yaml"))]
    entries.sort(key=lambda entry: (ORDER.index(entry.finding), entry.name))
    right = [entry for entry in entries if entry.finding == REPRODUCED]
    wrong = [entry for entry in entries if entry.finding != REPRODUCED]
    counts = {"all": len(entries), "right": len(right), "wrong": len(wrong), "made": MADE}
    counts["routes"] = number(max(entry.routes for entry in entries), 1)
    story = next(entry.table for entry in entries if entry.name == STORY)
    compass, round_feet = mistakes()
    texts = {
        "published.md": [HEAD.format(story=story, overview=overview(wrong), **counts), *sections(wrong), TAIL],
        "published-right.md": [RIGHT.format(overview=overview(right), **counts), *sections(right)],
        "known-mistakes.md": [MISTAKES.format(compass=compass, round=round_feet, **counts)],
    }
    return {name: re.sub(r"[ \t]+\n", "\n", "\n".join(parts)) for name, parts in texts.items()}


def overview(entries: Sequence[Entry]) -> str:
    """Return a table with a row for each printed gait."""
    rows = [[f"[{each.name}](#{each.name})", each.source, each.reproduced, each.finding] for each in entries]
    return table_of(["gait", "source", "values reproduced", "finding"], rows)


def sections(entries: Sequence[Entry]) -> list[str]:
    """Return a section for each printed gait."""
    texts = []
    for each in entries:
        # The table of this gait already stands at the top of the page.
        above = each.table if each.name == STORY else None
        paragraphs = [text for text in each.paragraphs if text and text != above]
        texts.append("\n\n".join([f"## {each.name}", *paragraphs]) + "\n")
    return texts


def walkers_with_mistakes(name: str) -> tuple[CheckedStep, list[tuple[str, PlainWalker]]]:
    """Return the right gait of a config's walker, and its walkers with mistakes."""
    config = load(Path(name)).config
    right = Checked(config, Check()).right
    known = [(each.what.format(f"{TYPICAL:g}"), each.of_size(TYPICAL)) for each in list_mistakes(right.walker)]
    return right, known


def mistakes() -> list[str]:
    """Return a table of known mistakes for each walker, with the change of the gait that each mistake causes."""
    tables = []
    listed: set[str] = set()
    for name in ("slope-3deg", str(FOLDER / f"{STORY}.yaml")):
        right, known = walkers_with_mistakes(name)
        rows = []
        for what, walker in known:
            if what in listed:
                continue
            listed.add(what)
            gait = gait_near(walker, right.start)
            if gait is None:
                rows.append((0.0, [what, "no gait near", "", ""]))
                continue
            pairs = [(gait.start[k], right.start[k]) for k in (STANCE, 2 + STANCE)]
            pairs.append((gait.step.period, right.step.period))
            changes = [100.0 * (wrong / true - 1.0) for wrong, true in pairs]
            rows.append((abs(changes[-1]), [what, *(f"{change:+.2g} %" for change in changes)]))
        rows.sort(key=lambda row: -row[0])
        tables.append(table_of(["mistake", "stance angle", "stance rate", "period"], [cells for _, cells in rows]))
    return tables


def main() -> int:
    texts = pages()
    if "--check" in sys.argv[1:]:
        return int(any(text != (DOCS / name).read_text(encoding="utf-8") for name, text in texts.items()))
    for name, text in texts.items():
        (DOCS / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
