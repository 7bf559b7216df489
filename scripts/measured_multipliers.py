"""Measure how noise biases multipliers that are estimated by least squares over many trials.

Usage: python scripts/measured_multipliers.py [CONFIG, round-feet by default] [TRIALS, 63 by default]

Each trial starts off the gait by 0.03 rad (standard deviation), and by as much in the rates of the unit walker. The
states at a heel strike and at the next one are measured with noise. Least squares on all pairs gives the map from one
to the next. Noise in the first state biases the map; the errors-in-variables estimate first subtracts the known
covariance of that noise. For each noise the script prints the moduli of the multipliers, as median and spread over
repeated experiments.
"""

import sys
from pathlib import Path

import numpy as np

from walkerlab.api.memory import run_in_memory
from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.family_search import RIGID
from walkerlab.scene.identification import ConfigFamily, step_map_of
from walkerlab.scene.subject import find_model_gait

START, NOISES_RAD, EXPERIMENTS = 0.03, (0.0, 0.002, 0.005, 0.01, 0.02), 200


def pairs_of(walks, p, z, trials, draw):
    """Return the states (trials, d) at two successive heel strikes. Trials that fall are skipped."""
    pairs = []
    while len(pairs) < trials:
        start = z + START * draw.normal(size=z.size)
        step = walks.step(start, p, derived=False)
        if step.outcome is Outcome.WALKED:
            pairs.append((start, step.z))
    return np.swapaxes(pairs, 0, 1)


def multipliers(before, after, noise=0.0):
    """Return the moduli (d,) of the multipliers of the linear map, the largest first."""
    before, after = before - before.mean(axis=0), after - after.mean(axis=0)
    covariance = before.T @ before - len(before) * noise**2 * np.eye(before.shape[1])
    return np.sort(np.abs(np.linalg.eigvals(np.linalg.pinv(covariance) @ before.T @ after)))[::-1]


def main(name, trials):
    config = load(Path(name)).config
    subject = find_model_gait(RIGID, config, run_in_memory("fixedpoint", config).summary, lambda _: None)
    family, draw = ConfigFamily(config, ()), np.random.default_rng(0)
    walks, z = step_map_of(subject, family), subject.z
    own = np.sort(np.abs(np.linalg.eigvals(walks.step(z, ()).DP)))[::-1]
    print(f"{name}, {trials} trials: the walker's own multipliers: {' '.join(f'{value:.2f}' for value in own)}")
    for noise in NOISES_RAD:
        found = []
        for _ in range(EXPERIMENTS):
            pairs = pairs_of(walks, (), z, trials, draw)
            before, after = pairs + noise * draw.normal(size=pairs.shape)
            found.append((multipliers(before, after), multipliers(before, after, noise)))
        for method, each in zip(("least squares", "errors-in-variables"), np.swapaxes(found, 0, 1), strict=True):
            # Take the median: a covariance from which noise is subtracted may be nearly singular, which gives wild
            # values.
            low, middle, high = np.percentile(each, (16, 50, 84), axis=0)
            values = "  ".join(f"{m:.2f} ± {h:.2f}" for m, h in zip(middle, (high - low) / 2, strict=True))
            print(f"  noise {noise:.3f} rad, {method:20s} {values}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "round-feet", int(sys.argv[2]) if len(sys.argv) > 2 else 63)
