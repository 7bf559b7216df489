"""Write docs/published.md from the configs in configs/published, and the table of mistakes in docs/howto.md.

python scripts/published.py            writes both
python scripts/published.py --check    exits 1 if they are not what the code gives
"""

import re
import sys
from pathlib import Path

from walkerlab.config.check import Check
from walkerlab.config.loader import load
from walkerlab.evidence.check.answer import Checked, check_gait
from walkerlab.evidence.check.gaits import gait_near
from walkerlab.evidence.check.mistakes import families_of, mistakes_of
from walkerlab.evidence.check.plain_walker import STANCE, PlainWalker
from walkerlab.evidence.check.section import COLUMNS, headline, remarks, source_of
from walkerlab.evidence.check.walks import CheckedStep
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.rigid import rigid_walker

ROOT = Path(__file__).parent.parent
PAGE, HOW_TO = ROOT / "docs" / "published.md", ROOT / "docs" / "howto.md"
TYPICAL = 1e-3  # size of mistakes that have one, rad or s
FOLDER = ROOT / "configs" / "published"
HEAD = """# Published gaits, checked

This page sets gaits that papers and programs print beside the right ones. Right means that two independent models
agree on a value: the compiled one that all of walkerlab uses, and a plain one that shares no equations with it. To
check a gait of your own, write its config with `walkerlab init my-gait.yaml --check` and type `walkerlab check
my-gait.yaml` ([how to](howto.md#find-out-whose-third-digit-is-right)).

A value is *reproduced* if the right one rounds to it or is cut off to it, in all of its digits or in at least three
and half of them. Otherwise it is *different*. If values differ, the program looks for one cause that gives all of
them: a convention, a mistake that is known from programs, or a misprint.

<!-- made by scripts/published.py from configs/published -->
"""
TAIL = """## The longest case

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
    checks[file.stem] = (title, summary["finding"])
    heads = [column.title for column in COLUMNS]
    table = [f"| {' | '.join(heads)} |", f"|{' --- |' * len(heads)}"]
    rows = ([column.cell(row).text for column in COLUMNS] for row in summary["values"])
    table += [f"| {' | '.join(cells)} |" for cells in rows]
    told = [text for text in remarks(summary) if not text.startswith(("The right gait", "Two independent"))]
    parts = [f"## {file.stem}", source_of(source), comment_of(file), "\n".join(table), f"**{headline(summary)}**"]
    command = f"```\nwalkerlab check published/{file.name}\n```"
    return [*parts, *told, command]


def page() -> str:
    checks: dict[str, tuple[str, str]] = {}
    entries = [entry(file, checks) for file in sorted(FOLDER.glob("*.yaml"))]
    rows = [f"| [{name}](#{name}) | {title} | {finding} |" for name, (title, finding) in checks.items()]
    overview = ["| gait | source | finding |\n| --- | --- | --- |\n" + "\n".join(rows)]
    return HEAD + "\n" + "\n\n".join([*overview, *(part for each in entries for part in each if part), TAIL])


def walkers_with_mistakes(name: str) -> tuple[CheckedStep, list[tuple[str, PlainWalker]]]:
    """Return the right gait of a config's walker, and its walkers with mistakes."""
    config = load(Path(name)).config
    right = Checked(config, Check(), find_gaits(rigid_walker(config))).right
    known = [*mistakes_of(right.walker)]
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
    block = re.compile(r"(<!-- made by scripts/published.py: mistakes -->\n).*?(<!-- end -->)", re.DOTALL)
    texts = {
        PAGE: re.sub(r"[ \t]+\n", "\n", page()),
        HOW_TO: block.sub(lambda match: f"{match[1]}{mistakes()}\n{match[2]}", HOW_TO.read_text(encoding="utf-8")),
    }
    if "--check" in sys.argv[1:]:
        return int(any(text != path.read_text(encoding="utf-8") for path, text in texts.items()))
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
