"""Identify walkers with a wrong fixed parameter, and count how often the answer warns when it must.

Usage: python scripts/wrong_parameters.py [WALKS, 100 by default] [steps | angles] [--first SEED] [--right]
       [--guess SHARE]

One of hip mass, leg length and slope is held fixed at a value that is off by 2, 5 or 12 %; the other two are fitted.
The answer must warn where an estimate is off by more than two of its standard errors and freeing the fixed parameter
raises the log-likelihood by more than 3. With `--right`, the fixed parameter is right, and the answer should not warn.
The fit starts from the right values, or with `--guess` from random ones that are off by up to this share.
"""

import argparse
import itertools
from pathlib import Path

import numpy as np
from identification_coverage import Truth

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.errors import WalkerlabError
from walkerlab.scene.identification import identify_walk

KEYS = ("slope_deg", "walker.leg_length_m", "walker.hip_mass_kg")
SHARES = (0.02, -0.02, 0.05, -0.05, 0.12, -0.12)
WALKERS = ("paper", "slope-3deg")
# error of an estimate in standard errors, and gain of the log-likelihood, above which a warning must appear
OFF, DECISIVE = 2.0, 3.0


def verdict_of(name, truth, measured, wrong, share, guesses=(0.0, 0.0, 0.0)):
    """Return whether the answer must warn, whether it does, and a line that describes the case."""
    values = dict(zip(KEYS, truth.values, strict=True))
    shares = dict(zip(KEYS, guesses, strict=True)) | {wrong: share}
    config = load(Path(name), tuple(f"{key}={values[key] * (1.0 + shares[key])}" for key in KEYS)).config
    gait = run_in_memory("fixedpoint", config).summary
    kept = [key for key in KEYS if key != wrong]
    fixed = identify_walk(config, measured, gait, Identify(fit=dict.fromkeys(kept)))
    off = max(abs(each.value - values[each.key]) / (each.standard_error or float("inf")) for each in fixed.estimates)
    gain = 0.0
    if share:
        free = identify_walk(config, measured, gait, Identify(fit=dict.fromkeys(KEYS)))
        gain = free.verdict.log_likelihood - fixed.verdict.log_likelihood
    warns = fixed.verdict.fit != "fits"
    line = f"off by {off:.1f} standard errors, gain {gain:.1f}, {fixed.verdict.fit}: {'; '.join(fixed.verdict.reasons)}"
    return off > OFF and gain > DECISIVE, warns, line


def main(options):
    counts = {True: [], False: []}
    truths = {name: Truth(name, KEYS, options.level) for name in WALKERS}
    cases = itertools.cycle(itertools.product(WALKERS, KEYS, SHARES))
    for seed, (name, wrong, share) in zip(range(options.first, options.first + options.walks), cases, strict=False):
        share = 0.0 if options.right else share
        truth = truths[name]
        walk = truth.walk(seed)
        if walk is None:
            continue
        guesses = options.guess * np.random.default_rng(seed).uniform(-1.0, 1.0, len(KEYS))
        try:
            must, warns, line = verdict_of(name, truth, walk[0], wrong, share, guesses)
        except WalkerlabError as error:
            print(f"{seed} {name} {wrong} {share:+.0%}: refused: {error}", flush=True)
            continue
        counts[must].append(warns)
        print(f"{seed} {name} {wrong} {share:+.0%}: {line}", flush=True)
    for must, warnings in counts.items():
        print(f"{'must' if must else 'need not'} warn: {sum(warnings)} of {len(warnings)} do")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("walks", type=int, nargs="?", default=100)
    parser.add_argument("level", nargs="?", default="steps", choices=("steps", "angles"))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--right", action="store_true")
    parser.add_argument("--guess", type=float, default=0.0)
    main(parser.parse_args())
