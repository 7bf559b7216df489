"""Make the parts of README and docs that follow from the code anew: results, gaits, stages, config keys.

    python scripts/refresh_docs.py [--check | --picture]

Each such part stands between `<!-- made by scripts/refresh_docs.py: NAME -->` and `<!-- end -->`. With --check nothing
is written, and the exit code is 1 if a part is not what it would be made to. With --picture the README's picture is
drawn too; its bytes depend on the version of matplotlib, so that it is not checked.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from walkerlab.config.loader import load
from walkerlab.config.reference import as_text
from walkerlab.stages.graph import PIPELINE
from walkerlab.stages.runner import execute
from walkerlab.store.runfolder import RunFolder

ROOT = Path(__file__).parent.parent
DOCUMENTS = ("README.md", "docs/theory.md", "docs/pipeline.md", "docs/config.md")
PICTURE = "figure-06.png"
PART = re.compile(r"(<!-- made by scripts/refresh_docs\.py: ([a-z-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


class Results:
    """Summaries of stages, run in a folder when they are asked for."""

    def __init__(self, runs: Path) -> None:
        """Run in, and reuse what is in, the folder of runs."""
        self.runs = runs
        self.summary = cache(self._summary)

    def _summary(self, stage: str, *sets: str) -> dict[str, Any]:
        loaded = load(None, sets)
        return execute(loaded.config, stage, RunFolder(self.runs, loaded.run_name)).summary

    def picture(self) -> bytes:
        """The README's picture, as `walkerlab plot` draws it."""
        loaded = load(None, ())
        execute(loaded.config, "plot", RunFolder(self.runs, loaded.run_name))
        return (RunFolder(self.runs, loaded.run_name).figures / PICTURE).read_bytes()


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def number(value: float, digits: int) -> str:
    """A number with so many decimals, with a true minus sign."""
    return f"{value:.{digits}f}".replace("-", "−")


def stages(_results: Results) -> str:
    """What the stages are, what they need under the paper config, and what they read."""
    config = load(None, ()).config
    rows = [
        [f"`{stage.name}`", stage.purpose, ", ".join(stage.inputs(config)) or "nothing", ", ".join(stage.reads)]
        for stage in PIPELINE.stages
    ]
    return table(["stage", "purpose", "needs (paper config)", "reads of the config"], rows)


def config_keys(_results: Results) -> str:
    """What `walkerlab schema` prints."""
    return as_text().rstrip("\n") + "\n"


def gaits(results: Results) -> str:
    """The gaits of the paper's walker: both sets of equations, and the slope of Goswami et al."""
    paper = results.summary("fixedpoint")["equation_sets"]
    rows = [
        gait_row("0.0174 rad, corrected", paper["corrected"]),
        gait_row("0.0174 rad, as printed", paper["as-printed"]),
        gait_row("3 degrees, corrected", results.summary("fixedpoint", "slope_deg=3")),
    ]
    head = [
        "slope, equations",
        "theta_1, theta_2 (rad)",
        "dtheta_1, dtheta_2 (rad/s)",
        "T (s)",
        "step (m)",
        "multipliers",
    ]
    return table(head, rows)


def gait_row(name: str, gait: dict[str, Any]) -> list[str]:
    """A gait in a row of a table."""
    state = [number(value, 6) for value in gait["state"]]
    return [
        name,
        ", ".join(state[:2]),
        ", ".join(state[2:]),
        number(gait["period_s"], 6),
        number(gait["step_length_m"], 6),
        multipliers(gait["multipliers"]),
    ]


def multipliers(pairs: Sequence[Sequence[float]]) -> str:
    """Multipliers, complex pairs as one entry."""
    real = [number(re_, 4) for re_, im in pairs if im == 0.0]
    double = [f"{number(re_, 4)} ± {number(im, 4)} i" for re_, im in pairs if im > 0.0]
    return ", ".join([*double, *real])


COLUMNS = ("paper_matlab", "as_printed", "corrected", "paper_adams", "contact")
OURS = ("as_printed", "corrected", "contact")
PRINTED_DIGITS = {"theta_1": 4, "theta_2": 4, "dtheta_1": 2, "dtheta_2": 2}


def paper_and_ours(results: Results) -> str:
    """What the paper prints beside what the tool computes: starts, steps, energy, stability, slip."""
    compared, walk = results.summary("compare"), results.summary("contact-sim")
    starts, ends = compared["table2"], compared["table3"]
    single = {entry["quantity"]: entry for entry in compared["paper_numbers"]}
    rows = [
        *(beside(f"start {name} ({starts[name]['unit']})", starts[name], PRINTED_DIGITS[name]) for name in starts),
        beside("left step, t_left (s)", ends["t_left"], 2),
        beside("right step, t_right (s)", ends["t_right"], 2),
        printed_once("step length (m)", single["length of one complete step"]),
        beside("speed, v_com (m/s)", ends["v_com"], 4),
        beside("mean energy, E_avg (J)", ends["E_avg"], 2),
        printed_once("largest multiplier", single["largest eigenvalue of P of a stable gait"]),
        ["slip of the stance foot in a step (mm)", *[""] * 4, number(1e3 * walk["slip_per_step_m"], 2)],
        ["rolling of the stance foot in a step (mm)", *[""] * 4, number(1e3 * walk["rolling_per_step_m"], 2)],
        ["steps", *[""] * 4, f"{walk['steps']}, {walk['outcome']}"],
    ]
    head = ["", "paper: MATLAB", "rigid, as printed", "rigid, corrected", "paper: ADAMS", "contact as in ADAMS"]
    return table(head, rows)


def printed_once(title: str, entry: dict[str, Any]) -> list[str]:
    """A row of a number that the paper prints for both of its models in one."""
    ours = {name: "" if entry[name] is None else number(entry[name], 4) for name in OURS}
    return [title, entry["printed"], ours["as_printed"], ours["corrected"], entry["printed"], ours["contact"]]


def beside(title: str, row: dict[str, Any], printed_digits: int) -> list[str]:
    """A row of the paper's tables: its own columns with the digits it prints, ours with four."""
    cells = [number(row[name], printed_digits if name.startswith("paper") else 4) for name in COLUMNS]
    return [title, *cells]


def errata(results: Results) -> str:
    """The paper's errata."""
    rows = [
        [cell(entry[name]) for name in ("where", "printed", "right", "evidence")]
        for entry in results.summary("compare")["errata"]
    ]
    return table(["where", "printed", "right", "because"], rows)


def cell(text: str) -> str:
    """A text that may stand in a table's cell."""
    return text.replace("|", "\\|").replace("*", "\\*")


PARTS: dict[str, Callable[[Results], str]] = {
    "stages": stages,
    "config-keys": config_keys,
    "gaits": gaits,
    "paper-and-ours": paper_and_ours,
    "errata": errata,
}


def refreshed(text: str, results: Results) -> str:
    """A document with its parts made anew; KeyError for a part that there is no maker of."""
    return PART.sub(lambda found: found[1] + PARTS[found[2]](results) + found[4], text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Refresh or check all documents; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a document is not current")
    parser.add_argument("--picture", action="store_true", help="draw the README's picture too")
    parser.add_argument("--runs", type=Path, help="folder of runs to reuse; default: a temporary one")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        results = Results(options.runs or Path(temporary))
        if options.picture:
            (ROOT / "docs" / "images" / PICTURE).write_bytes(results.picture())
        stale = [path for name in DOCUMENTS if not refresh(path := ROOT / name, results, write=not options.check)]
    for path in stale:
        print(f"{path.relative_to(ROOT)}: {'not current' if options.check else 'made anew'}")
    return 1 if stale and options.check else 0


def refresh(path: Path, results: Results, write: bool) -> bool:
    """Whether a document was current; it is afterwards if `write`."""
    old = path.read_text(encoding="utf-8")
    new = refreshed(old, results)
    if write and new != old:
        path.write_text(new, encoding="utf-8")
    return new == old


if __name__ == "__main__":
    sys.exit(main())
