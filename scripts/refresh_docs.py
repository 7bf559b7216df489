"""Keep README and docs up to date: write the parts that are generated from the code, and try the examples.

    python scripts/refresh_docs.py [--check | --pictures | --downloads]
    python scripts/refresh_docs.py --examples [--slow] [DOCUMENT ...]

A generated part stands between `<!-- made by scripts/refresh_docs.py: NAME -->` and `<!-- end -->`. With --check
nothing is written, and the exit code is 1 if a part or a picture is out of date. --pictures draws the pictures of
docs/images, see pictures.py, and --downloads writes the models in docs/downloads; their bytes depend on versions and
platform, so they are not compared.

An example is a fenced block: `console` has commands after `$` and what they print below them, `pycon` has Python after
`>>>`, and a `yaml` block that begins with `# NAME.yaml` or `name: NAME` is written to NAME.yaml. `...` stands for
anything. Examples of a document run in order in one folder, which contains the downloads that the document links. Those
below `<!-- takes minutes -->` run only with --slow.
"""

from __future__ import annotations

import argparse
import contextlib
import doctest
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, fields
from functools import cache
from pathlib import Path
from typing import Any

from walkerlab.api import export_model
from walkerlab.config.fields import block_of
from walkerlab.config.loader import load
from walkerlab.config.reference import KeyReference, keys
from walkerlab.config.schema import Config
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.run.runner import execute
from walkerlab.pipeline.store.runs import RunFolder

sys.path.insert(0, str(Path(__file__).parent))

from pictures import stale_pictures, write_pictures

ROOT = Path(__file__).parent.parent
DOCUMENTS = ("README.md", "docs/study.md", "docs/theory.md", "docs/pipeline.md", "docs/config.md")
EXAMPLE = re.compile(r"^(<!-- takes minutes -->\n)?```(console|pycon|yaml)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
DOWNLOAD = re.compile(r"\]\((downloads/[^)]+)\)")
LOOSELY = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
TERMINAL = {"COLUMNS": "100"}
Run = Callable[[str, int], tuple[str, int]]
"""Runs a command and returns its output and exit code. The second argument is the exit code of the previous command."""
PART = re.compile(r"(<!-- made by scripts/refresh_docs\.py: ([a-z-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


class Results:
    """Summaries of stages, each computed in a folder of runs when it is first used."""

    def __init__(self, runs: Path) -> None:
        """Compute in this folder of runs, and reuse the results in it."""
        self.runs = runs
        self.summary = cache(self._summary)

    def _summary(self, stage: str, *sets: str) -> dict[str, Any]:
        loaded = load(None, sets)
        return execute(loaded.config, stage, RunFolder(self.runs, loaded.run_name)).summary


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Format a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def number(value: float, digits: int) -> str:
    """Format a number with a fixed number of decimals and a true minus sign."""
    return f"{value:.{digits}f}".replace("-", "−")


def stages(_results: Results) -> str:
    """Tabulate the stages, with the stages that they need under the paper config and the keys that they read."""
    config = load(None, ()).config
    rows = [
        [f"`{stage.name}`", stage.purpose, ", ".join(stage.inputs(config)) or "nothing", ", ".join(stage.reads(config))]
        for stage in PIPELINE.stages
    ]
    return table(["stage", "purpose", "needs (paper config)", "reads of the config"], rows)


def config_keys(_results: Results) -> str:
    """Tabulate every config key. A key that means the same for each type of walker is listed once."""
    rows: dict[tuple[str, ...], None] = {}
    for reference in keys():
        key, *rest = astuple(reference)
        rows[(re.sub(r"^walker\([a-z-]+\)(?=\.(torso|hip|knee)\.)", "walker", key), *rest)] = None
    head = [field.name for field in fields(KeyReference)]
    optional = [name for name, field in Config.model_fields.items() if block_of(field) and field.default is None]
    blocks = f"{', '.join(f'`{name}`' for name in optional[:-1])} and `{optional[-1]}`"
    note = (
        "The keys of `walker.torso` and `walker.hip` are the same for every type of walker, those of `walker.knee` for "
        f"`kneed` and `parts`.\n\nThe blocks {blocks} are optional. Stages that need a missing block are skipped.\n"
    )
    return "\n".join([table(head, [[cell(text) for text in row] for row in rows]), note])


def gaits(results: Results) -> str:
    """Tabulate the gaits of the paper's walker: both sets of equations, and the slope of Goswami et al."""
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
    """Format a gait as a row of a table."""
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
    """Format multipliers, with a complex pair as one entry."""
    real = [number(re_, 4) for re_, im in pairs if im == 0.0]
    double = [f"{number(re_, 4)} ± {number(im, 4)} i" for re_, im in pairs if im > 0.0]
    return ", ".join([*double, *real])


COLUMNS = ("paper_matlab", "as_printed", "corrected", "paper_adams", "contact")
OURS = ("as_printed", "corrected", "contact")
PRINTED_DIGITS = {"theta_1": 4, "theta_2": 4, "dtheta_1": 2, "dtheta_2": 2}


def paper_and_ours(results: Results) -> str:
    """Tabulate printed and computed values: starts, steps, energy, stability, slip."""
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


def study_in_five_rows(results: Results) -> str:
    """Tabulate how start, step period, step length, stability and energy of the paper compare with both models."""
    compared = results.summary("compare")
    single = {entry["quantity"]: entry for entry in compared["paper_numbers"]}
    cells = [
        beside("stance angle at the start (rad)", compared["table2"]["theta_2"], PRINTED_DIGITS["theta_2"]),
        beside("left step period (s)", compared["table3"]["t_left"], 2),
        printed_once("step length (m)", single["length of one complete step"]),
        printed_once("largest multiplier", single["largest eigenvalue of P of a stable gait"]),
        beside("mean energy (J)", compared["table3"]["E_avg"], 2),
    ]
    rows = [[title, paper, printed, corrected, contact] for title, paper, printed, corrected, _, contact in cells]
    head = ["", "paper (MATLAB)", "rigid model, printed equations", "rigid model, sign corrected", "contact model"]
    return re.sub(r" *\| *", "|", table(head, rows))


def printed_once(title: str, entry: dict[str, Any]) -> list[str]:
    """Format the row of a value that the paper prints once for both of its models."""
    ours = {name: "" if entry[name] is None else number(entry[name], 4) for name in OURS}
    return [title, entry["printed"], ours["as_printed"], ours["corrected"], entry["printed"], ours["contact"]]


def beside(title: str, row: dict[str, Any], printed_digits: int) -> list[str]:
    """Format a row of the paper's tables, with the printed digits in the paper's columns and four digits in ours."""
    cells = [number(row[name], printed_digits if name.startswith("paper") else 4) for name in COLUMNS]
    return [title, *cells]


def errata(results: Results) -> str:
    """Tabulate the paper's errata."""
    rows = [
        [cell(entry[name]) for name in ("where", "printed", "right", "evidence")]
        for entry in results.summary("compare")["errata"]
    ]
    return table(["where", "printed", "right", "because"], rows)


def cell(text: str) -> str:
    """Escape a text for a cell of a table."""
    return text.replace("|", "\\|").replace("*", "\\*")


PARTS: dict[str, Callable[[Results], str]] = {
    "stages": stages,
    "config-keys": config_keys,
    "gaits": gaits,
    "paper-and-ours": paper_and_ours,
    "study-in-five-rows": study_in_five_rows,
    "errata": errata,
}


def refreshed(text: str, results: Results) -> str:
    """Return a document with its generated parts brought up to date. Raises KeyError for a part without a generator."""
    return PART.sub(lambda found: found[1] + PARTS[found[2]](results) + found[4], text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Refresh or check all documents, and return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("documents", nargs="*", type=Path, help="whose examples to try; default: all")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a document is out of date")
    parser.add_argument("--examples", action="store_true", help="try the examples; exit with 1 if one prints otherwise")
    parser.add_argument("--slow", action="store_true", help="those that take minutes too")
    parser.add_argument("--pictures", action="store_true", help="draw the pictures of docs/images too; takes minutes")
    parser.add_argument("--downloads", action="store_true", help="write docs/downloads too")
    parser.add_argument("--runs", type=Path, help="folder of runs to reuse; default: a temporary one")
    options = parser.parse_args(arguments)
    if options.examples:
        return try_examples(options.documents or with_examples(), options.slow)
    with tempfile.TemporaryDirectory() as temporary:
        results = Results(options.runs or Path(temporary))
        if options.downloads:
            write_downloads()
        if options.pictures:
            write_pictures(results.runs)
        stale = [path for name in DOCUMENTS if not refresh(path := ROOT / name, results, write=not options.check)]
        if options.check:
            stale += stale_pictures(results.runs)
    for path in stale:
        print(f"{path.relative_to(ROOT)}: {'out of date' if options.check else 'written'}")
    return 1 if stale and options.check else 0


def write_downloads() -> None:
    """Write the paper's walker for ADAMS and MuJoCo."""
    for ending in ("adm", "cmd", "xml"):
        for path in export_model(ROOT / "docs" / "downloads" / f"paper.{ending}", name="paper", slope_rad=0.0174):
            # The file is part of the next commit, whose digest is not known yet.
            text = re.sub(r", commit \w+(-dirty)?", "", path.read_text(encoding="utf-8"))
            path.write_text(text, encoding="utf-8")


def refresh(path: Path, results: Results, write: bool) -> bool:
    """Return whether a document was current. With `write`, bring it up to date."""
    old = path.read_text(encoding="utf-8")
    new = refreshed(old, results)
    if write and new != old:
        path.write_text(new, encoding="utf-8")
    return new == old


def with_examples() -> list[Path]:
    """Return the documents that have examples."""
    documents = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [path for path in documents if EXAMPLE.search(path.read_text(encoding="utf-8"))]


def try_examples(documents: Sequence[Path], slow: bool) -> int:
    """Print how the output of examples differs from the documents. Return 1 if any differs."""
    found = []
    for path in documents:
        with tempfile.TemporaryDirectory() as folder:
            found += [f"{path}: {difference}" for difference in differences(path.resolve(), Path(folder), slow)]
    print("\n".join(found) or "all examples print what the documents say")
    return 1 if found else 0


def differences(path: Path, folder: Path, slow: bool = False, run: Run | None = None) -> Iterator[str]:
    """Yield, for each example of a document whose output differs, the command, the text shown and the output."""
    run = run or run_in_shell
    names: dict[str, Any] = {}
    exit_code = 0
    page = path.read_text(encoding="utf-8")
    for link in set(DOWNLOAD.findall(page)):
        shutil.copy(path.parent / link, folder)
    with contextlib.chdir(folder):
        for takes_minutes, kind, text in EXAMPLE.findall(page):
            if kind == "yaml" and (named := re.match(r"(?:# (\S+)\.yaml|name: (\S+))\n", text)):
                Path(f"{named[1] or named[2]}.yaml").write_text(text, encoding="utf-8")
            elif kind == "console" and (slow or not takes_minutes):
                for command, shown in COMMAND.findall(text):
                    printed, exit_code = run(command, exit_code)
                    if not doctest.OutputChecker().check_output(shown, printed, LOOSELY):
                        yield f"$ {command}\nshown:\n{shown}printed:\n{printed}"
            elif kind == "pycon" and (slow or not takes_minutes):
                test = doctest.DocTestParser().get_doctest(text, names, path.name, None, None)
                said = io.StringIO()
                doctest.DocTestRunner(optionflags=LOOSELY).run(test, out=said.write, clear_globs=False)
                names = test.globs
                if said.getvalue():
                    yield said.getvalue()


def run_in_shell(command: str, exit_code_before: int) -> tuple[str, int]:
    """Run a command after one with this exit code. Return its answer (with errors if it fails), and its exit code."""
    environment = os.environ | {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
        **TERMINAL,
    }
    done = subprocess.run(
        ["bash", "-c", f"(exit {exit_code_before}); {command}"], env=environment, capture_output=True, text=True
    )
    return answer_of(done), done.returncode


def answer_of(done: subprocess.CompletedProcess[str]) -> str:
    """Return the output of a command, with its errors if it failed."""
    return (done.stdout + (done.stderr if done.returncode else "")).replace("\u00a0", " ")


if __name__ == "__main__":
    sys.exit(main())
