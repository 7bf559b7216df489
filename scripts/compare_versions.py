"""Results of two versions of the package, held against each other: what a change of how it computes must not change.

    python scripts/compare_versions.py hold FOLDER              # with the version that this Python imports
    python scripts/compare_versions.py compare OLD NEW          # two such folders; exits 1 if a number differs

Some seventy commands are run, each as a process of its own: every built-in config and type of walker, terrain, law of
friction, hinged and free stance, every outcome, gaits with multipliers, families, basins, adjustments. Kept are what
`--json` prints, the exit code, and all stored numbers. Counts of work, drift and residuals at rounding, timings and
chaotic values are exempt; every other quantity has its tolerance.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

BUILT_IN = (
    "paper", "paper-as-printed", "slope-3deg", "contact-si", "sliding-feet", "rigid-only", "simplest", "round-feet",
    "kneed", "kneed-round-feet", "torso", "parts",
)  # fmt: skip
WITH_CONTACT = tuple(name for name in BUILT_IN if name not in ("rigid-only", "simplest"))
SMALL_BASIN = ("basin.cells=[24, 24]",)

# command, config, keys that are set
Case = tuple[str, str, tuple[str, ...]]


def cases() -> Iterator[Case]:
    """All that is compared."""
    for name in BUILT_IN:
        yield "fixedpoint", name, ()
        yield "simulate", name, ()
    for name in WITH_CONTACT:
        yield "contact-sim", name, ()
    for slope in (0.2, 3.0, 4.5, 8.0):
        yield "fixedpoint", "paper", (f"slope_deg={slope}",)
        yield "simulate", "paper", (f"slope_deg={slope}",)
    yield "simulate", "paper", ("start=[-0.2, 0.165, -0.3, -0.3]",)
    yield "simulate", "paper", ("start=[-0.2022, 0.1674, -0.6, -0.84]", "solver.rigid.method=radau5")
    yield "simulate", "kneed", ("solver.rigid.method=scipy-dop853",)
    yield "simulate", "simplest", ("slope_rad=0.0186", "strides=20")
    for terrain in ("checkerboard", "after-mid-swing", "plane"):
        for stance in ("free", "pinned"):
            yield "contact-sim", "paper", (f"contact.terrain={terrain}", f"contact.stance={stance}")
            yield "contact-sim", "slope-3deg", (f"contact.terrain={terrain}", f"contact.stance={stance}")
    yield "contact-sim", "kneed", ("contact.stance=pinned",)
    yield "contact-sim", "kneed", ("walker.knee.release=touch",)
    yield "contact-sim", "kneed", ("walker.knee.lock=compliant",)
    yield "contact-sim", "kneed", ("contact.terrain=after-mid-swing",)
    yield "contact-sim", "round-feet", ("contact.terrain=after-mid-swing", "contact.friction=none")
    yield "contact-sim", "paper", ("contact.friction=none",)
    yield "contact-sim", "paper", ("contact.pad_pitch=own", "strides=10")
    yield "contact-sim", "paper", ("strides=8",)
    yield "contact-sim", "paper", ("contact.static_friction=0.3", "contact.dynamic_friction=0.2")
    yield "contact-sim", "paper", ("start=[-0.2021, 0.1670, -1.02, -3.20]",)
    yield "contact-sim", "paper", ("contact.stiffness=1.0e7", "contact.damping=9000", "strides=2")
    yield "contact-sim", "paper", ("solver.contact.method=dop853", "strides=2")
    yield "contact-sim", "paper", ("solver.contact.method=scipy-radau", "strides=1")
    yield "compare", "paper", ()
    yield "tune", "paper", ()
    yield "tune", "kneed", ()
    yield "continuation", "paper", span("slope_deg", 0.5, 5.0)
    yield "continuation", "simplest", span("slope_rad", 0.004, 0.0185)
    yield "continuation", "kneed", span("walker.hip_mass_kg", 0.4, 0.7)
    yield "basin", "paper", SMALL_BASIN
    yield "basin", "slope-3deg", SMALL_BASIN
    yield "basin", "simplest", SMALL_BASIN


def span(over: str, first: float, last: float) -> tuple[str, ...]:
    """A family's parameter and its values."""
    return (f"continuation.over={over}", f"continuation.from={first}", f"continuation.to={last}")


# What a name's last part is compared by: the first row that fits. None: exempt.
TOLERANCES: tuple[tuple[str, tuple[float, float] | None], ...] = (
    # counts of work, and what is rounding or wall clock by nature
    (r".*(evaluations|accepted|rejected|jacobians|newton|solves).*|work|steps_tried|trajectories_per_s", None),
    (r".*residual.*|.*drift.*|.*wall.*|.*(_per_s|seconds)$|.*cpu.*|iterations|rounding|spent.*|.*saves.*", None),
    (r"lyapunov.*|exponent_uncertainty|uncertainty|.*attractor.*|chaotic.*", None),
    (r"numerical_error.*|.*step_error.*|.*objective.*", None),
    # multipliers come of a derivative: a digit or two fewer than the gait
    (r".*multiplier.*|.*radius.*|.*eigen.*|stable_range|value", (1e-6, 1e-7)),
    (r".*force.*|.*dissipat.*|.*power.*|.*work_J", (1e-4, 1e-4)),
    (r".*slip.*|.*rolling.*|.*penetration.*|.*velocity.*|.*rate.*", (1e-5, 1e-6)),
    (r".*", (1e-6, 2e-7)),
)
NOT_COMPARED = {
    "run_dir", "artifact", "reused", "wall_s", "stages", "left_out", "command", "created", "versions", "platform",
    "commit",
}  # fmt: skip


def tolerance(name: str) -> tuple[float, float] | None:
    """Relative and absolute tolerance of a quantity; None if it is exempt."""
    return next(allowed for pattern, allowed in TOLERANCES if re.fullmatch(pattern, name))


def folder_of(case: Case) -> str:
    """A name for a case that a folder can have."""
    stage, config, sets = case
    return re.sub(r"[^\w.=@+-]+", "_", "@".join((stage, config, *sets)))


def hold(folder: Path, wanted: str) -> None:
    """Run all cases and keep what they say."""
    folder.mkdir(parents=True, exist_ok=True)
    for case in cases():
        stage, config, sets = case
        kept = folder / f"{folder_of(case)}.json"
        if kept.exists() or not re.search(wanted, kept.stem):
            continue
        options = [part for each in sets for part in ("--set", each)]
        command = [sys.executable, "-m", "walkerlab", stage, "-c", config, *options, "--runs", str(folder / "runs")]
        done = subprocess.run([*command, "--json", "-q"], capture_output=True, text=True, env=dict(os.environ))
        answer = json.loads(done.stdout) if done.stdout.strip() else {}
        stored = numbers_in(Path(answer["artifact"])) if answer.get("artifact") else {}
        kept.write_text(json.dumps({"exit": done.returncode, "json": answer, "stored": stored, "said": done.stderr}))
        print(f"{kept.stem}: exit {done.returncode}, {len(stored)} datasets", flush=True)


def numbers_in(artifact: Path) -> dict[str, Any]:
    """Every numeric dataset of an artifact, by its path."""
    found: dict[str, Any] = {}
    if not artifact.is_file():
        return found
    with h5py.File(artifact) as file:

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
                found[name] = np.asarray(item).tolist()

        file.visititems(visit)
    return found


def differences(old: Any, new: Any, name: str) -> Iterator[str]:
    """Where two answers differ by more than they may; what only the new one has is no difference."""
    last = name.rsplit("/", 1)[-1]
    if last in NOT_COMPARED:
        return
    if isinstance(old, dict) and isinstance(new, dict):
        for key, value in old.items():
            if key in NOT_COMPARED or tolerance(key) is None:
                continue
            if key not in new:
                yield f"{name}/{key}: is gone"
            else:
                yield from differences(value, new[key], f"{name}/{key}")
    elif isinstance(old, list) and isinstance(new, list):
        if is_numeric(old) and is_numeric(new):
            yield from apart(np.asarray(old, float), np.asarray(new, float), name)
        elif len(old) != len(new):
            yield f"{name}: {len(old)} and {len(new)} items"
        else:
            for i, (one, other) in enumerate(zip(old, new, strict=True)):
                yield from differences(one, other, f"{name}[{i}]")
    elif isinstance(old, int | float) and isinstance(new, int | float) and not isinstance(old, bool):
        yield from apart(np.asarray([old], float), np.asarray([new], float), name)
    elif old != new and tolerance(last) is not None and not isinstance(old, str):
        yield f"{name}: {old!r} and {new!r}"
    elif isinstance(old, str) and last == "outcome" and old != new:
        yield f"{name}: {old} and {new}"


def is_numeric(values: list[Any]) -> bool:
    """Whether nested lists hold numbers alone, in rows of one length."""
    try:
        return np.asarray(values).dtype.kind in "fiu"
    except ValueError:
        return False


def apart(old: Any, new: Any, name: str) -> Iterator[str]:
    """How far two arrays are apart, if too far."""
    allowed = tolerance(re.sub(r"\[\d+\]$", "", name.rsplit("/", 1)[-1]))
    if allowed is None:
        return
    if old.shape != new.shape:
        yield f"{name}: shapes {old.shape} and {new.shape}"
        return
    relative, absolute = allowed
    scale = float(np.max(np.abs(old), initial=0.0))
    off = float(np.max(np.abs(old - new), initial=0.0))
    if not math.isfinite(off) or off > absolute + relative * scale:
        yield f"{name}: {off:.2e} apart, of at most {scale:.4g}"


def compare(old: Path, new: Path) -> int:
    """Print what differs; the number of cases that do."""
    wrong = 0
    for case in cases():
        kept = f"{folder_of(case)}.json"
        if not (old / kept).exists() or not (new / kept).exists():
            print(f"{kept}: not in both")
            wrong += 1
            continue
        one, other = (json.loads((folder / kept).read_text()) for folder in (old, new))
        found = [] if one["exit"] == other["exit"] else [f"exit codes {one['exit']} and {other['exit']}"]
        found += differences(one["json"], other["json"], "json")
        found += differences(one["stored"], other["stored"], "stored")
        wrong += bool(found)
        for line in found[:20]:
            print(f"{Path(kept).stem}: {line}")
    print(f"{wrong} of {len(list(cases()))} cases differ")
    return wrong


def main() -> None:
    """Hold or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, dest="command")
    holding = commands.add_parser("hold")
    holding.add_argument("folder", type=Path)
    holding.add_argument("--only", default="", help="regular expression that a case's name must contain")
    comparing = commands.add_parser("compare")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    chosen = parser.parse_args()
    if chosen.command == "hold":
        hold(chosen.folder, chosen.only)
    else:
        sys.exit(1 if compare(chosen.old, chosen.new) else 0)


if __name__ == "__main__":
    main()
