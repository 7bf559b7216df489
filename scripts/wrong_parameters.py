"""Identify walkers whose fixed parameter is wrong, and count how often the answer warns where it must.

Usage: python scripts/wrong_parameters.py [WALKS, 100 by default] [steps | angles]

One of hip mass, leg length and slope is held fixed at a value that is off by 2, 5 or 12 %; the other two are fitted.
The answer must warn where an estimate is off by more than two of its standard errors and freeing the fixed parameter
raises the log-likelihood by more than 3.
"""

import itertools
import sys
from pathlib import Path

from identification_coverage import Truth

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.errors import WalkerlabError
from walkerlab.scene.identification import identify_walk

KEYS = ("slope_deg", "walker.leg_length_m", "walker.hip_mass_kg")
SHARES = (0.02, -0.02, 0.05, -0.05, 0.12, -0.12)
WALKERS = ("paper", "slope-3deg")
OFF, DECISIVE = 2.0, 3.0  # standard errors; gain of the log-likelihood


def verdict_of(name, truth, measured, wrong, share):
    """Return whether the answer must warn, whether it does, and a line about it."""
    values = dict(zip(KEYS, truth.values, strict=True))
    config = load(Path(name), (f"{wrong}={values[wrong] * (1.0 + share)}",)).config
    gait = run_in_memory("fixedpoint", config).summary
    kept = [key for key in KEYS if key != wrong]
    fixed, free = (identify_walk(config, measured, gait, Identify(fit=dict.fromkeys(keys))) for keys in (kept, KEYS))
    off = max(abs(each.value - values[each.key]) / (each.standard_error or float("inf")) for each in fixed.estimates)
    gain = free.verdict.log_likelihood - fixed.verdict.log_likelihood
    warns = fixed.verdict.fit != "fits"
    line = f"off by {off:.1f} standard errors, gain {gain:.1f}, {fixed.verdict.fit}: {'; '.join(fixed.verdict.reasons)}"
    return off > OFF and gain > DECISIVE, warns, line


def main(walks, level):
    counts = {True: [], False: []}
    truths = {name: Truth(name, KEYS, level) for name in WALKERS}
    cases = itertools.cycle(itertools.product(WALKERS, KEYS, SHARES))
    for seed, (name, wrong, share) in zip(range(walks), cases, strict=False):
        truth = truths[name]
        walk = truth.walk(seed)
        if walk is None:
            continue
        try:
            must, warns, line = verdict_of(name, truth, walk[0], wrong, share)
        except WalkerlabError as error:
            print(f"{seed} {name} {wrong} {share:+.0%}: refused: {error}", flush=True)
            continue
        counts[must].append(warns)
        print(f"{seed} {name} {wrong} {share:+.0%}: {line}", flush=True)
    for must, warnings in counts.items():
        print(f"{'must' if must else 'need not'} warn: {sum(warnings)} of {len(warnings)} do")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, sys.argv[2] if len(sys.argv) > 2 else "steps")
