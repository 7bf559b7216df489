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
from walkerlab.evidence.check.causes import generate_families, generate_mistakes
from walkerlab.evidence.check.gaits import CheckedStep, gait_near
from walkerlab.evidence.check.plain_walker import STANCE, PlainWalker
from walkerlab.evidence.check.section import COLUMNS, headline, is_short, remarks, source_of
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker

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

This one, of a walker with round feet, is in a script that many programs have copied. It prints 15 digits, of which
at most the first four are right:

{story}

The cause is one term. In the heel strike of the script, the balance of the trailing leg about the hip subtracts a
term that should not be there: the leg's moment of inertia about its centre of mass, I, times the rate at which the
angle between the legs changes. With this mistake all digits follow. A later script of the same hand has the right
strike ([passivewalker-sim](published-right.md#passivewalker-sim)). Type this to see it for yourself, or any other
name from the table below:

```
walkerlab check published/passivewalker-2009.yaml
```

Two more stories: a much-quoted state of a walker with knees is not periodic, and the cause is unknown
([hsu-chen-2007](#hsu-chen-2007)). And the paper that this project reproduces has a wrong sign in its equations,
which its own fixed point shows ([adams-compass](#adams-compass)).

Next come the gaits that differ, one by one. Those that are right have [a page of their own](published-right.md),
and [known mistakes](known-mistakes.md) shows how each mistake changes a gait. To check yours, see [whose third
digit is right](check.md).

## Gaits that differ

{overview}

*Right* means that two independent models agree on a value: the compiled one that all of walkerlab uses, and a plain
one that shares no equations with it. For each value there is a verdict:

- *Reproduced*: the printed and the right value are equal after both are rounded, or cut off, to all printed digits,
  or to at least three that are at least half of them. If not all digits agree, the table shows how many do, and how
  far off the printed value is, in units of its last digit. Otherwise the value is *different*.
- If values differ, the program looks for one cause that gives all of them: a convention, a mistake that is known
  from programs, or a misprint. The gait is *explained* if there is one, and *partly explained* if a cause gives
  some of the values to their last digit.

The signs and angles of each source are kept, and the right values are written in its convention. *One exact step* is a
step of the right equations from the printed state, without a noticeable numerical error. If the state is periodic,
the step leads back to it.
"""
TAIL = """## The longest case

The study that this project reproduces prints 38 values; [the study](study.md) judges each with its evidence. Its
words *reproduced* and *explained* mean what they mean here. *Contradicted* is a different value that other values
of the paper refute, and *not reproduced* is a value that is different and unexplained, or that cannot be compared.
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
your values ([whose third digit is right](check.md)), and how much it changes a gait.

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
    """A printed gait: its name, source, finding, count of reproduced values, table and paragraphs."""

    name: str
    source: str
    finding: str
    reproduced: str
    table: str
    paragraphs: tuple[str, ...]


def entry_of(file: Path) -> Entry:
    """Check a printed gait, and return what the pages say of it."""
    summary = check_gait(load(file).config)
    source = summary["source"]
    rows = summary["values"]
    table = table_of(
        [column.title for column in COLUMNS], [[column.cell(row).text for column in COLUMNS] for row in rows]
    )
    reproduced = [row for row in rows if row["verdict"] == REPRODUCED]
    short = sum(map(is_short, rows))
    note = f" ({short} not to the last digit)" if short else ""
    in_the_table = ("The right gait", "Two independent")
    return Entry(
        name=file.stem,
        source=", ".join(str(source[key]) for key in ("authors", "year") if source[key]) or source["title"],
        finding=finding_of(summary),
        reproduced=f"{len(reproduced)} of {len(rows)}{note}",
        table=table,
        paragraphs=(
            comment_of(file),
            f"**{headline(summary)}**",
            table,
            *(text for text in remarks(summary) if not text.startswith(in_the_table)),
            source_of(source),
        ),
    )


def table_of(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [heads, ["---"] * len(heads), *rows])


def finding_of(summary: Mapping) -> str:
    """Return what was found; partly explained if a cause gives some of the values that differ."""
    unexplained = summary["finding"] not in ("explained", "reproduced")
    return "partly explained" if unexplained and summary["explanations"] else summary["finding"]


def pages() -> dict[str, str]:
    """Return the text of each page by its file name."""
    entries = [entry_of(file) for file in sorted(FOLDER.glob("*.yaml"))]
    entries.sort(key=lambda entry: (ORDER.index(entry.finding), entry.name))
    right = [entry for entry in entries if entry.finding == REPRODUCED]
    wrong = [entry for entry in entries if entry.finding != REPRODUCED]
    counts = {"all": len(entries), "right": len(right), "wrong": len(wrong), "made": MADE}
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
        # The page begins with the table of this gait.
        above = each.table if each.name == STORY else None
        paragraphs = [text for text in each.paragraphs if text and text != above]
        texts.append("\n\n".join([f"## {each.name}", *paragraphs]) + "\n")
    return texts


def walkers_with_mistakes(name: str) -> tuple[CheckedStep, list[tuple[str, PlainWalker]]]:
    """Return the right gait of a config's walker, and its walkers with mistakes."""
    config = load(Path(name)).config
    right = Checked(config, Check(), find_gaits(rigid_walker(config))).right
    known = [(each.what, each.walker) for each in generate_mistakes(right.walker)]
    known += [(each.what.format(f"{TYPICAL:g}"), each.of_size(TYPICAL)) for each in generate_families(right.walker)]
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
