"""Compare gaits of random walkers with different legs with the plain integration in the tests.

    python scripts/legs_campaign.py              # 100 walkers
    python scripts/legs_campaign.py 12 --seed 7

The walkers have straight legs, round feet, knees, knees and round feet, or one knee; every third one, unless it has one
knee, pushes off with a different impulse of each leg. The script looks for a gait of each and integrates a stride from
its state with SciPy (tests/plain_unequal_walk.py), where heel strikes follow from balances of angular momentum.
Durations and lengths of both steps and the state after them may differ by 1e-10 (of leg length and pendulum time).
Multipliers may differ by 1e-5 from those of central differences of plain strides. Prints a table in Markdown; exits 1
if a gait differs.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from plain_unequal_walk import Walker
from unequal_walkers import KINDS, draw_walker, legs_of, model_of

from walkerlab.physics.orbits.fixed_point import SearchSettings, find_gaits

ALLOWED = 1e-10  # difference of a stride, in leg lengths and pendulum times
ALLOWED_MULTIPLIER = 1e-5
STEPS = (
    2e-5,
    3e-6,
)  # steps of central differences, rad and rad per pendulum time; the second is tried if the first differs
STARTS = SearchSettings(20, 100)
PUSHES = (0.002, 0.006)  # N s per kg, range of push-offs


def draw(number: int, seed: int) -> tuple[str, Walker]:
    kind = KINDS[number % len(KINDS)]
    plain = draw_walker(kind, 1000 * seed + number)
    if number % 3 or kind == "one knee":
        return kind, plain
    die = np.random.default_rng([seed, number])
    mass = plain.hip_mass + sum(segment.mass for leg in plain.legs for segment in leg.segments)
    first, second = (mass * die.uniform(*PUSHES) for _ in range(2))
    return f"{kind}, driven", replace(plain, push_offs=(first, second))


def on_slope(plain: Walker, stance: float) -> float:
    """Return the angle of leg 1 behind leg 2 with both feet on the slope."""
    swing = plain.swing(0)
    height = lambda angle: swing.foot_height(0.0, np.array([angle, stance + plain.slope, 0.0, 0.0]))  # noqa: E731
    upright = -plain.legs[0].centre_ahead / plain.legs[0].length
    return float(brentq(height, upright - 0.8, upright - 1e-3, xtol=1e-15)) - plain.slope


def differences(plain: Walker, state: NDArray[np.float64], tau: float, step: float) -> NDArray[np.complex128]:
    """Return the multipliers of a stride by central differences over stance angle and both rates."""
    columns = []
    for k, scale in ((1, 1.0), (2, 1.0 / tau), (3, 1.0 / tau)):
        ends = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[k] += sign * step * scale
            moved[0] = on_slope(plain, moved[1])
            ends.append(plain.stride(moved)[1])
        columns.append((ends[0] - ends[1])[1:] / (2.0 * step * scale))
    return np.linalg.eigvals(np.array(columns).T)


def apart(plain: Walker) -> tuple[float, float] | None:
    """Return the largest differences of a stride and of a multiplier, or None if no gait is found."""
    walker = model_of(plain)
    gait = find_gaits(walker, settings=STARTS).gait
    if gait is None:
        return None
    tau = float(np.sqrt(walker.leg_length / walker.gravity))
    state = legs_of(gait.state)
    steps, end = plain.stride(gait.state)
    of_steps = np.abs(steps - gait.steps) / (tau, float(walker.leg_length))
    of_state = np.abs(end - state) * (1.0, 1.0, tau, tau)
    own = np.array(gait.stride_multipliers)
    for step in STEPS:
        nearest = np.abs(own[:, None] - differences(plain, state, tau, step)).min(axis=1)
        off = float(nearest.max() / max(1.0, np.abs(own).max()))
        if off < ALLOWED_MULTIPLIER:
            break
    return float(max(of_steps.max(), of_state.max())), off


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("walkers", type=int, nargs="?", default=100)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    found: dict[str, list[tuple[float, float]]] = {}
    without = dict[str, int]()
    for number in range(asked.walkers):
        kind, plain = draw(number, asked.seed)
        result = apart(plain)
        found.setdefault(kind, [])
        if result is None:
            without[kind] = without.get(kind, 0) + 1
        else:
            found[kind].append(result)
            if result[0] > ALLOWED or result[1] > ALLOWED_MULTIPLIER:
                print(f"differs: {kind}, walker {number} of seed {asked.seed}: {result}", flush=True)
    print("| walkers | gaits | without a gait | stride | multipliers |\n|---|---|---|---|---|")
    for kind, results in sorted(found.items()):
        most = np.max(results, axis=0) if results else np.zeros(2)
        print(f"| {kind} | {len(results)} | {without.get(kind, 0)} | {most[0]:.1e} | {most[1]:.1e} |")
    wrong = [
        each for results in found.values() for each in results if each[0] > ALLOWED or each[1] > ALLOWED_MULTIPLIER
    ]
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
