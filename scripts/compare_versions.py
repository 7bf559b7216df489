"""Compare this checkout with another version of the package: its answers or, with --speed, its run times.

    python scripts/compare_versions.py --other CHECKOUT [--only PATTERN] [--jobs N] [--text] [--reference-results DIR]
    python scripts/compare_versions.py --other CHECKOUT --speed [--rounds N]

The other version is a checkout (--other), or the package that another Python has installed (--python). Both versions
run about ninety cases, each command in a process of its own and with the version's own compiled code: every built-in
config and type of walker, terrain, friction law, pinned and free stance, many methods, every outcome, families, basins,
adjustments, sweeps, and configs that are refused. The script compares exit codes, the output of `--json`, and every
stored result: names, shapes, units, and values within the tolerances of scripts/differences.py. It ignores times,
digests, versions and paths, and exits with 1 if anything differs. With --reference-results the answers of the other
version are kept in a folder and computed only once.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from differences import NEW, Difference, of_artifacts, of_names, of_values
from version_speed import print_speed

CHECKOUT = Path(__file__).resolve().parent.parent
BUILT_IN = (
    "paper", "paper-as-printed", "slope-3deg", "contact-si", "sliding-feet", "rigid-only", "simplest", "round-feet",
    "kneed", "kneed-round-feet", "torso", "parts",
)  # fmt: skip
WALKS = ("fixedpoint", "simulate", "contact-sim")
RIGID = ("fixedpoint", "simulate")
CONTACT = ("contact-sim",)
# The rigid model is not stiff, so it is solved more accurately. This factor makes its tolerances tighter.
RIGID_ALLOWED = 0.01
SHOWN = 12  # maximum number of differences printed for a case


@dataclass(frozen=True)
class Version:
    """A version of the package, and the way to run it."""

    name: str
    python: str
    checkout: Path | None  # None for the package that its Python has installed
    cache: Path

    def environment(self) -> dict[str, str]:
        """Environment of the version's processes."""
        given = {**os.environ, "WALKERLAB_CACHE": str(self.cache), "COLUMNS": "100"}
        return given | ({"PYTHONPATH": str(self.checkout)} if self.checkout else {})

    def sources_digest(self) -> str:
        """Return the digest (hex) of the package's sources and built-in configs, wherever they are installed."""
        asked = "import walkerlab, pathlib; print(pathlib.Path(walkerlab.__file__).parent)"
        # Python looks for packages in the current folder first, so run in one that has none.
        there = {"cwd": tempfile.gettempdir(), "env": self.environment()}
        package = Path(subprocess.check_output([self.python, "-c", asked], text=True, **there).strip())
        files = [*package.rglob("*.py"), *package.rglob("*.yaml"), *(package.parent / "configs").glob("*.yaml")]
        told = hashlib.sha256()
        for file in sorted(files):
            told.update(str(file.relative_to(package.parent)).encode() + b"\0" + file.read_bytes())
        return told.hexdigest()


@dataclass(frozen=True)
class Case:
    """A config with changes, and the commands that run on it one after another in a separate folder."""

    commands: tuple[str, ...]
    config: str
    changes: tuple[str, ...] = ()
    looser: float = 1.0  # factor by which all tolerances are multiplied

    @property
    def name(self) -> str:
        """Name of the case, also for its folder."""
        changes = (re.sub(r"^[\w.]+\.", "", change) for change in self.changes)
        return re.sub(r"[^\w.=@+-]+", "_", "@".join((self.commands[-1], self.config, *changes)))

    def lines(self) -> Iterator[list[str]]:
        """Commands as a user types them."""
        changes = [part for change in self.changes for part in ("--set", change)]
        for command in self.commands:
            yield [*command.split(), "-c", self.config, *changes]


def cases() -> Iterator[Case]:
    """Return all cases, beginning with those that take longest."""
    yield from long_cases()
    for name in BUILT_IN:
        yield Case((*WALKS, "compare"), name)
    yield from rigid_cases()
    yield from contact_cases()
    yield from refused_cases()


def long_cases() -> Iterator[Case]:
    """Yield families, adjustments, basins, sweeps and extreme cases."""
    yield Case(("stability",), "paper", (), 20.0)
    yield Case(("tune",), "paper", ("tune.cells=15",))
    yield Case(("tune",), "kneed", ("tune.cells=5",), 10.0)
    yield family("paper", "slope_deg", 0.5, 4.6, "continuation.periods=2")
    yield family("paper-as-printed", "slope_deg", 1.0, 3.0, "continuation.periods=1")
    yield family("simplest", "slope_rad", 0.004, 0.0165, "continuation.periods=2")
    yield family("kneed", "walker.hip_mass_kg", 0.4, 0.7, "continuation.periods=1")
    yield family("torso", "walker.torso.mass_kg", 3.0, 8.0, "continuation.periods=1")
    yield family("round-feet", "walker.foot_radius_m", 0.1, 0.14, "continuation.periods=1")
    yield family("parts", "slope_rad", 0.04, 0.06, "continuation.periods=1")
    yield family("slope-3deg", "slope_deg", 2.5, 3.5, "continuation.periods=1", "continuation.model=both")
    yield family("paper", "contact.stiffness", 8e4, 1.2e5, "continuation.periods=1", "continuation.model=contact")
    second = ("continuation.second={over: walker.hip_mass_kg, from: 9.0, to: 11.0}", "continuation.periods=1")
    yield family("paper", "slope_deg", 4.0, 5.0, *second)
    for name in ("paper", "simplest", "kneed", "round-feet"):
        yield Case(("basin",), name, ("basin.cells=[60, 60]", "basin.refine=2"))
    yield Case(("basin",), "paper", ("basin.plane=[theta_2, dtheta_1, dtheta_2]", "basin.cells=[10, 10, 10]"))
    yield Case(("basin",), "slope-3deg", ("basin.model=contact", "basin.cells=[6, 6]", "basin.refine=1"))
    yield Case(("sweep --over slope_deg=0.5:3:4 --stage fixedpoint",), "paper")
    yield Case(("sweep --over contact.stiction_velocity=[50,100] --stage contact-sim",), "paper")


def family(config: str, over: str, first: float, last: float, *changes: str) -> Case:
    """Build the case of a family of gaits over a range of a key."""
    span = (f"continuation.over={over}", f"continuation.from={first}", f"continuation.to={last}")
    return Case(("continuation",), config, (*span, "continuation.points=60", *changes))


def rigid_cases() -> Iterator[Case]:
    """Yield cases of gaits and rigid walks: steep slopes, starts that fall, and all kinds of walkers and methods."""
    for slope in (0.2, 4.5, 8.0, 40.0):
        yield Case(RIGID, "paper", (f"slope_deg={slope}",))
    yield Case(("fixedpoint",), "kneed", ("slope_deg=12",))
    yield Case(RIGID, "torso", ("equations=as-printed",))
    yield Case(RIGID, "paper", ("equations=as-printed", "seed=3", "outputs=[states]"))
    for start in ("[-0.2, 0.165, -0.3, -0.3]", "[-0.2, 0.165, -3.0, -3.0]", "[-0.3, 0.27, -0.6, -5.0]"):
        yield Case(("simulate", "contact-sim"), "paper", (f"start={start}",))
    bent = "start=[-0.289, 0.1882, -0.289, -0.0457, -0.8877, -0.0457]"
    yield Case(("simulate", "contact-sim"), "kneed", (bent,))
    for method in ("radau5", "scipy-dop853", "scipy-lsoda"):
        yield Case(("simulate",), "paper", (f"solver.rigid.method={method}", "strides=2"))
    yield Case(("simulate",), "kneed", ("solver.rigid.method=radau5",))
    yield Case(("simulate",), "paper", ("solver.rigid.rtol=1e-6", "solver.rigid.atol=1e-8", "strides=30"))
    yield Case(("simulate",), "simplest", ("slope_rad=0.0186", "strides=8"), 1e4)  # chaotic


def contact_cases() -> Iterator[Case]:
    """Yield cases of the contact model: walkers, knees, terrains, stances, laws, methods and outcomes."""
    for terrain in ("checkerboard", "after-mid-swing", "plane"):
        for stance in ("free", "pinned"):
            yield Case(CONTACT, "slope-3deg", (f"contact.terrain={terrain}", f"contact.stance={stance}"))
    for changes in (
        ("contact.friction=none",),
        ("contact.pad_pitch=own", "strides=10"),
        ("contact.static_friction=0.3", "contact.dynamic_friction=0.2"),
        ("contact.static_friction=0.1", "contact.dynamic_friction=0.1"),
        ("contact.stiffness=1.0e7", "contact.damping=9000", "strides=2"),
        ("walker.foot_radius_m=0", "walker.leg_inertia_kg_m2=0.2"),
        ("solver.contact.method=scipy-radau", "strides=1"),
        ("slope_deg=8",),
    ):
        yield Case(CONTACT, "paper", changes)
    # At its limit of stability, an explicit method is no more accurate than its tolerance.
    yield Case(CONTACT, "paper", ("solver.contact.method=dop853", "strides=1"), 100.0)
    yield Case(CONTACT, "paper", ("solver.contact.rtol=1e-4", "solver.contact.atol=1e-6"), 100.0)
    for knee in ("lock=compliant", "at_heel_strike=free", "release=touch"):
        yield Case(WALKS, "kneed", (f"walker.knee.{knee}",))
    yield Case(CONTACT, "kneed", ("walker.knee.lock=compliant", "contact.stance=pinned"), 10.0)
    yield Case(CONTACT, "kneed", ("contact.stance=pinned", "contact.terrain=after-mid-swing"))
    yield Case(WALKS, "kneed", ("walker.torso={mass_kg: 0.2, above_hip_m: 0.1}",))
    yield Case(WALKS, "kneed", ("slope_rad=0.07", "walker.shank.mass_ahead_m=0.002"))
    yield Case(CONTACT, "contact-si", ("contact.exponent=1.3", "contact.stiffness=1.0e6", "contact.damping=3000"))
    yield Case(WALKS, "parts", ("walker.knee={lock: compliant}", "slope_rad=0.055"))
    yield Case(CONTACT, "round-feet", ("contact.terrain=after-mid-swing", "contact.friction=none"))
    yield Case(WALKS, "round-feet", ("walker.torso={mass_kg: 1.0, above_hip_m: 0.1}",))
    yield Case(WALKS, "round-feet", ("walker.leg_mass_ahead_m=0.001", "walker.foot_centre_ahead_m=0.005"))


def refused_cases() -> Iterator[Case]:
    """Yield cases that end in an error: configs that are refused, and walkers without a gait."""
    for changes in (
        ("walker.leg_masss_kg=3",), ("walker.leg_mass_kg=-3",), ("slope_deg=1", "slope_rad=0.1"),
        ("contact.terrain=grass",), ("start=[1, 2]",), ("solver.contact.method=radau6",), ("strides=0",),
    ):  # fmt: skip
        yield Case(("simulate",), "paper", changes)
    yield Case((*WALKS, "tune", "compare"), "paper", ("slope_deg=0",))
    yield Case(RIGID, "paper", ("slope_deg=-1",))
    yield Case(("fixedpoint",), "no-such-config")
    yield Case(("tune",), "simplest")
    yield Case(("continuation",), "paper", ("continuation.over=walker.knees",))
    yield Case(("basin",), "paper", ("slope_deg=40", "basin.cells=[4, 4]"))
    yield Case(("sweep --over slope_deg=0:1:2 --stage simulate",), "paper")


def answers_of(version: Version, case: Case, folder: Path, text: bool) -> dict[str, Any]:
    """Return what a version answers to the commands of a case. Answers that are already in the folder are reused."""
    asked, kept = [*case.lines(), str(text)], folder / "answers.json"
    if kept.exists():
        told: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        if told["asked"] == asked:
            return dict(told["answers"])
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    answers = {}
    for line in case.lines():
        command = [version.python, "-m", "walkerlab", *line, "--runs", "runs", "--jobs", "1", "-q"]
        answers[line[0]] = answer(version, [*command, "--json"], folder)
        if text:
            answers[as_text(line[0])] = answer(version, command, folder)
    kept.write_text(json.dumps({"asked": asked, "answers": answers}), encoding="utf-8")
    return answers


def answer(version: Version, command: list[str], folder: Path) -> dict[str, Any]:
    """Return the exit code and the output of a command, with the name of the folder removed. JSON is parsed."""
    done = subprocess.run(command, capture_output=True, text=True, env=version.environment(), cwd=folder)
    said = [text.replace(str(folder), "FOLDER") for text in (done.stdout, done.stderr)]
    if "--json" in command and said[0].startswith("{"):
        return {"exit": done.returncode, "json": json.loads(said[0])}
    if version.checkout:
        said = [text.replace(str(version.checkout), "CHECKOUT") for text in said]
    return {"exit": done.returncode, "stdout": said[0], "stderr": said[1]}


def as_text(command: str) -> str:
    """Name the answer of a command without `--json`."""
    return f"{command}, as text"


def artifacts_in(folder: Path) -> dict[str, Path]:
    """Return stored results by name, with digests removed from the names. Chunks of merged results are skipped."""
    files = sorted((folder / "runs").rglob("*.h5"))
    named = {re.sub(r"-[0-9a-f]{8}\b", "", str(file.relative_to(folder / "runs"))): file for file in files}
    return {name: file for name, file in named.items() if "sweep-chunks" not in name}


def differences_in(case: Case, answers: Sequence[dict[str, Any]], folders: Sequence[Path]) -> Iterator[Difference]:
    """List all differences, however small, between the answers of two versions to a case."""
    for command in case.lines():
        allowed = case.looser * (RIGID_ALLOWED if command[0] in RIGID else 1.0)
        for asked in (command[0], as_text(command[0])):
            yield from of_values(answers[0].get(asked), answers[1].get(asked), asked, allowed)
    stored = [artifacts_in(folder) for folder in folders]
    yield from of_names(*stored, "stored")
    for name in stored[0].keys() & stored[1].keys():
        allowed = case.looser * (RIGID_ALLOWED if Path(name).stem in RIGID else 1.0)
        yield from of_artifacts(stored[0][name], stored[1][name], name, allowed)


def verdict(case: Case, found: list[Difference], allow_new: bool) -> bool:
    """Print how the answers to a case compare, and return whether they differ."""
    found.sort(key=lambda one: (-one.share, one.name))
    wrong = [one for one in found if one.share > 1.0 and not (allow_new and one.words == NEW)]
    nearest = f", nearest {found[0].name}: {found[0].share:.1g} of what is allowed" if found and not wrong else ""
    print(f"{case.name}: {f'{len(wrong)} DIFFERENCES' if wrong else 'same'}{nearest}", flush=True)
    for one in wrong[:SHOWN]:
        print(f"    {one.name}: {one.words}" + (f" ({one.share:.3g} x allowed)" if one.share < math.inf else ""))
    if len(wrong) > SHOWN:
        print(f"    and {len(wrong) - SHOWN} more")
    return bool(wrong)


def compare(versions: Sequence[Version], chosen: Sequence[Case], places: Sequence[Path], options: Any) -> int:
    """Run all cases with both versions and print the differences. Return the number of cases that differ."""
    with ThreadPoolExecutor(options.jobs) as pool:

        def ask(case: Case) -> list[Future[dict[str, Any]]]:
            both = zip(versions, places, strict=True)
            return [pool.submit(answers_of, each, case, place / case.name, options.text) for each, place in both]

        asked = [ask(case) for case in chosen]
        wrong = 0
        for case, pair in zip(chosen, asked, strict=True):
            answers = [each.result() for each in pair]
            folders = [place / case.name for place in places]
            wrong += verdict(case, list(differences_in(case, answers, folders)), options.allow_new)
    return wrong


def reference_folder(folder: Path, version: Version) -> Path:
    """Return the folder of a version's answers.

    Exits if it contains those of another version.
    """
    mark, digest = folder / "sources-digest", version.sources_digest()
    if mark.exists() and mark.read_text() != digest:
        sys.exit(f"{folder} holds the answers of other sources than {version.name}: remove it, or name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    mark.write_text(digest)
    return folder


def two_versions(options: Any) -> tuple[Version, Version]:
    """Return the other version and this checkout."""
    kept = Path(tempfile.gettempdir()) / "walkerlab-versions"
    other = options.other.resolve() if options.other else None
    called = f"{other or options.python}"
    cache = kept / hashlib.sha256(called.encode()).hexdigest()[:12]
    own = kept / hashlib.sha256(str(CHECKOUT).encode()).hexdigest()[:12]
    return Version(called, options.python, other, cache), Version(str(CHECKOUT), sys.executable, CHECKOUT, own)


def main() -> None:
    """Compare the answers or the speed of two versions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--other", type=Path, help="checkout of the other version; default: the package that --python has installed"
    )
    parser.add_argument("--python", default=sys.executable, help="the other version's Python; default: this one")
    parser.add_argument("--only", default="", help="regular expression that the name of a case or figure contains")
    parser.add_argument("--jobs", type=int, default=2, help="commands at once; default: 2")
    parser.add_argument("--text", action="store_true", help="also compare what the terminal shows")
    parser.add_argument("--allow-new", action="store_true", help="ignore what only this checkout has")
    parser.add_argument(
        "--reference-results",
        type=Path,
        metavar="DIR",
        help="folder in which the answers of the other version are kept",
    )
    parser.add_argument("--list", action="store_true", help="print the cases without running them")
    parser.add_argument("--speed", action="store_true", help="compare run times instead, one command at a time")
    parser.add_argument("--rounds", type=int, default=3, help="with --speed: measurements of each; default: 3")
    options = parser.parse_args()
    chosen = [case for case in cases() if re.search(options.only, case.name)]
    if options.list:
        print(*(case.name for case in chosen), sep="\n")
        return
    if not options.other and options.python == sys.executable:
        parser.error("name the version to compare with by --other or --python")
    versions = two_versions(options)
    if options.speed:
        print_speed(versions, options.only, options.rounds)
        return
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="walkerlab-answers-") as scratch:
        old, new = Path(scratch) / "other", Path(scratch) / "this"
        if options.reference_results:
            old = reference_folder(options.reference_results.resolve(), versions[0])
        wrong = compare(versions, chosen, (old, new), options)
    print(f"{wrong} of {len(chosen)} cases differ; {time.perf_counter() - began:.0f} s")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
