"""Write docs/published.md from the configs in configs/published, with a table of mistakes that are known from programs.

python scripts/published.py            writes the page
python scripts/published.py --check    exits 1 if it is not what the code gives
"""

import re
import sys
from collections.abc import Mapping
from pathlib import Path

from walkerlab.config.check import Check
from walkerlab.config.loader import load
from walkerlab.evidence.check.answer import Checked, check_gait
from walkerlab.evidence.check.causes import families_of, mistakes_of
from walkerlab.evidence.check.gaits import CheckedStep, gait_near
from walkerlab.evidence.check.plain_walker import STANCE, PlainWalker
from walkerlab.evidence.check.section import COLUMNS, headline, remarks, source_of
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "published.md"
ORDER = ("explained", "partly explained", "different, unexplained", "reproduced")
TYPICAL = 1e-3  # size of mistakes that have one, rad or s
FOLDER = ROOT / "configs" / "published"
HEAD = """# Published gaits, checked

Papers and programs print gaits. This page compares them with the right ones. Three stories first:

- A script that many programs have copied prints 15 digits of a gait with round feet. They are wrong from the fourth
  on, because its heel strike subtracts one term with the legs' inertia too often
  ([passivewalker-2009](#passivewalker-2009)). A later script of the same hand has the right strike
  ([passivewalker-sim](#passivewalker-sim)).
- A much-quoted state of a walker with knees is not periodic ([hsu-chen-2007](#hsu-chen-2007)). The cause is unknown.
- The paper that this project reproduces has a wrong sign in its equations, and its own fixed point shows it
  ([adams-compass](#adams-compass)).

*Right* means that two independent models agree on a value: the compiled one that all of walkerlab uses, and a plain
one that shares no equations with it. A value is *reproduced* if the right value, rounded or cut off, has its digits:
all of them, or at least three that are also at least half. Otherwise it is *different*. If values differ, the program
looks for one cause that gives all of them: a convention, a mistake that is known from programs, or a misprint. It is
*explained* if there is one, and *partly explained* if a cause gives some of the values to their last digit.

To check a gait of your own, write its config with `walkerlab init my-gait.yaml --check` and type `walkerlab check
my-gait.yaml` ([how to](howto.md#find-out-whose-third-digit-is-right)). The last section lists
[mistakes that are known](#known-mistakes), and how each changes a gait.

<!-- made by scripts/published.py from configs/published -->
"""
TAIL = """## Known mistakes

A mistake changes the gait of the compass at 3 degrees (config `slope-3deg`) or of a walker with round feet
(`passivewalker-2009`) by this much. `I` is the inertia of a leg.

{mistakes}

## The longest case

The study that this project reproduces prints 38 values; [the study](study.md) judges each with its evidence. Its
words are the same: *reproduced* and *explained* mean what they mean here. *Contradicted* is a different value that
other values of the paper refute, and *not reproduced* is a value that is different and unexplained, or that cannot be
compared.
"""


def comment_of(file: Path) -> str:
    """Return the comment at the top of a config as a paragraph."""
    lines = []
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        lines.append(line.removeprefix("# "))
    return " ".join(lines)


def entry(file: Path, checks: dict) -> list[str]:
    """Return the lines of one printed gait."""
    summary = check_gait(load(file).config)
    source = summary["source"]
    title = ", ".join(str(source[key]) for key in ("authors", "year") if source[key]) or source["title"]
    checks[file.stem] = (title, finding_of(summary))
    heads = [column.title for column in COLUMNS]
    table = [f"| {' | '.join(heads)} |", f"|{' --- |' * len(heads)}"]
    rows = ([column.cell(row).text for column in COLUMNS] for row in summary["values"])
    table += [f"| {' | '.join(cells)} |" for cells in rows]
    told = [text for text in remarks(summary) if not text.startswith(("The right gait", "Two independent"))]
    parts = [f"## {file.stem}", source_of(source), comment_of(file), "\n".join(table), f"**{headline(summary)}**"]
    command = f"```\nwalkerlab check published/{file.name}\n```"
    return [*parts, *told, command]


def finding_of(summary: Mapping) -> str:
    """Return what was found; partly explained if a cause gives some of the values that differ."""
    unexplained = summary["finding"] not in ("explained", "reproduced")
    return "partly explained" if unexplained and summary["explanations"] else summary["finding"]


def page() -> str:
    checks: dict[str, tuple[str, str]] = {}
    entries = {file.stem: entry(file, checks) for file in sorted(FOLDER.glob("*.yaml"))}
    names = sorted(checks, key=lambda name: (ORDER.index(checks[name][1]), name))
    rows = [f"| [{name}](#{name}) | {checks[name][0]} | {checks[name][1]} |" for name in names]
    overview = ["| gait | source | finding |\n| --- | --- | --- |\n" + "\n".join(rows)]
    parts = [part for name in names for part in entries[name] if part]
    return HEAD + "\n" + "\n\n".join([*overview, *parts, TAIL.format(mistakes=mistakes())])


def walkers_with_mistakes(name: str) -> tuple[CheckedStep, list[tuple[str, PlainWalker]]]:
    """Return the right gait of a config's walker, and its walkers with mistakes."""
    config = load(Path(name)).config
    right = Checked(config, Check(), find_gaits(rigid_walker(config))).right
    known = [(each.what, each.walker) for each in mistakes_of(right.walker)]
    known += [(each.what.format(f"{TYPICAL:g}"), each.of_size(TYPICAL)) for each in families_of(right.walker)]
    return right, known


def mistakes() -> str:
    """Return the table of known mistakes, with the changes of a gait that each of them causes."""
    lines = ["| mistake | walker | stance angle | stance rate | period |", "| --- | --- | --- | --- | --- |"]
    listed: set[str] = set()
    for name, title in {"slope-3deg": "compass", str(FOLDER / "passivewalker-2009.yaml"): "round feet"}.items():
        right, known = walkers_with_mistakes(name)
        for what, walker in known:
            if what in listed:
                continue
            listed.add(what)
            gait = gait_near(walker, right.start)
            changes = ("no gait near", "", "")
            if gait is not None:
                pairs = [(gait[0][k], right.start[k]) for k in (STANCE, 2 + STANCE)]
                pairs.append((gait[1].period, right.step.period))
                changes = tuple(f"{100.0 * (wrong / true - 1.0):+.2g} %" for wrong, true in pairs)
            lines.append(f"| {what} | {title} | {' | '.join(changes)} |")
    return "\n".join(lines)


def main() -> int:
    text = re.sub(r"[ \t]+\n", "\n", page())
    if "--check" in sys.argv[1:]:
        return int(text != PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
