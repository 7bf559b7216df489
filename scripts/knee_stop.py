"""Measure how a compliant knee stop approaches the ideal lock as it stiffens, and the order of convergence.

    python scripts/knee_stop.py             # the built-in kneed walker
    python scripts/knee_stop.py my.yaml --steps 40

The contact model walks from the rigid gait, once with the ideal lock and then with ever stiffer stops, whose damping
grows as the root of the stiffness, so that the damping ratio stays equal. The script compares the periods of the last
steps and the times at which the knees lock in them, and prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

STIFFNESSES = (1e3, 1e4, 1e5, 1e6, 1e7)  # N m/rad
DAMPING, AT = 90.0, 1e5  # damping (N m s/rad) at a stiffness (N m/rad): the config's defaults
RTOL, ATOL, BUDGET = 1e-10, 1e-12, 20_000_000
HEAD = ("stop (N m/rad)", "period (s)", "knee locks after (s)", "period off (s)", "order", "lock off (s)", "order")


def config_of(file: str, *sets: str) -> Config:
    """Load the config of a file or of a built-in name."""
    return load(Path(file), sets).config


def last_step(config: Config, steps: int) -> tuple[float, float]:
    """Return the period of the last step (s), and the time from its touch to the lock of the knee (s)."""
    gait = find_gaits(rigid_walker(config, "corrected"), config.seed).gait
    if gait is None:
        raise SystemExit("the rigid model has no gait to start from")
    scene = contact_scene(config, gait.step_length, gait.step_length)
    walk = scene.walk(start_state(scene, gait.state), steps, Tolerances("radau5", RTOL, ATOL, BUDGET))
    if walk.touch_time_s.size < steps or walk.touch_time_s.size < 2:
        raise SystemExit(f"{walk.outcome.label} after {walk.touch_time_s.size} of {steps} steps: nothing to compare")
    return float(walk.periods_s[-1]), float(walk.knee_strike_time_s[-1] - walk.touch_time_s[-2])


def rows(file: str, steps: int) -> Iterator[list[str]]:
    """Yield a row of the table for the ideal lock, then one for each stiffness."""
    period, lock = last_step(config_of(file, "walker.knee.lock=ideal"), steps)
    yield ["ideal", f"{period:.6f}", f"{lock:.6f}", "", "", "", ""]
    before: tuple[float, float] | None = None
    for stiffness in STIFFNESSES:
        stop = (f"stop_stiffness={stiffness}", f"stop_damping={DAMPING * math.sqrt(stiffness / AT)}")
        config = config_of(file, "walker.knee.lock=compliant", *(f"walker.knee.{one}" for one in stop))
        found = last_step(config, steps)
        off = (abs(found[0] - period), abs(found[1] - lock))
        order = ["", ""] if before is None else [f"{math.log10(a / b):.2f}" for a, b in zip(before, off, strict=True)]
        yield [
            f"{stiffness:.0e}",
            f"{found[0]:.6f}",
            f"{found[1]:.6f}",
            f"{off[0]:.1e}",
            order[0],
            f"{off[1]:.1e}",
            order[1],
        ]
        before = off


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("config", nargs="?", default="kneed", help="a config's file or built-in name")
    parser.add_argument("--steps", type=int, default=30)
    options = parser.parse_args(arguments)
    print(f"| {' | '.join(HEAD)} |\n{'|---' * len(HEAD)}|")
    for row in rows(options.config, options.steps):
        print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
