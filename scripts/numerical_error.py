"""Compare the numerical error that an answer states with its true error, and measure the cost.

    python scripts/numerical_error.py                 # 60 walks of the contact campaign, seeds 0 to 59
    python scripts/numerical_error.py --walks 6 --seed 3 --steps 10

Walks on compliant ground are drawn as in scripts/contact_campaign.py. Each is computed at the config's tolerances, at a
hundred times tighter ones, which give the numerical error, and at ten thousand times tighter ones, which give the true
error. The script prints a table in Markdown: for each walk both errors of the step period, of the step length and of
the end time, and the work of the second walk over that of the first. Below it stands how often the numerical error is
within a factor of the true one.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from contact_campaign import TIGHTER, Drawn, arguments, ours_at, scene_of, spread, tell_row, walks_of

from walkerlab.evidence.paper.tune import walk_summary
from walkerlab.labels import ERROR_OF_EACH_STEP
from walkerlab.pipeline.stages.walk import change

ERRORS = (*ERROR_OF_EACH_STEP.values(), "end_time_s")
FACTORS = (1.5, 10.0)
LEAST = 1e-11  # s or m; smaller errors are rounding, or the last digits of an event's time


def walked(drawn: Drawn, steps: int) -> tuple[list[dict[str, Any]], list[int]]:
    """Return summaries and counts of right-hand sides of the walk at each tolerance, beginning with the default."""
    config, scene = scene_of(drawn)
    walks = [ours_at(scene, config, drawn, steps, tighter) for tighter in TIGHTER]
    return [walk_summary(walk) for walk in walks], [int(walk.work[0]) for walk in walks]


def told(error: dict[str, Any], key: str) -> str:
    """Format an error for the table."""
    return f"{error[key]:.1e}" if key in error else "-"


def main() -> None:
    """Compute all walks, and print the table."""
    chosen = arguments(__doc__, walks=60, steps=6)
    ratios: dict[str, list[float]] = {key: [] for key in ERRORS}
    numerical: list[float] = []
    costs, unknown, missed = [], 0, 0
    tell_row("seed", "walk", "ends", "steps", *(f"{key}: numerical, true" for key in ERRORS), "cost")
    tell_row(*["---"] * (5 + len(ERRORS)))
    for seed, drawn in walks_of(chosen):
        (first, second, third), work = walked(drawn, chosen.steps)
        reported, true = change(first, second), change(first, third)
        unknown += "reason" in reported
        missed += "reason" in true and "reason" not in reported
        costs.append(work[1] / work[0])
        for key in ERRORS:
            if key in reported and key in true:
                ratios[key].append((reported[key] + LEAST) / (true[key] + LEAST))
        numerical += [reported["end_time_s"]] if "end_time_s" in reported else []
        numbers = (f"{told(reported, key)}, {told(true, key)}" for key in ERRORS)
        tell_row(seed, drawn.ground, first["outcome"], first["steps"], *numbers, f"{costs[-1]:.1f}")
    print(f"\n{chosen.walks} walks; {unknown} end otherwise in the second walk, {missed} more in the third")
    for key, found in ratios.items():
        near = ", ".join(f"{sum(1 / f <= r <= f for r in found)} within a factor of {f:g}" for f in FACTORS)
        print(f"{key}: of {len(found)} {near}; least ratio {min(found):.2g}, largest {max(found):.2g}")
    print("numerical error of the end (s):", spread(numerical))
    print("cost of the second walk:", spread(costs))


if __name__ == "__main__":
    main()
