"""Identify walkers from synthetic walks and compare errors with the spread of the estimates.

Usage: python scripts/identification_coverage.py [WALKS, 1000 by default] [steps | angles | contact] [CONFIG ...]

Walks go over a rough floor from a disturbed start, and are measured with noise; `contact` are steps of the contact
model. Printed for each walker: the number of walks that took all steps and that the model fits; the share of these
whose 95 % region holds the truth, with the binomial error of that share; and for each parameter the mean standard
error over the spread of the estimates.
"""

import os

# Matrices are small: threads that share one would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import math
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import f as fisher

from walkerlab.api import in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.physics.estimation.measurements import MeasuredWalk, split_into_steps
from walkerlab.physics.orbits.family_search import CONTACT, RIGID
from walkerlab.scene.identification import ConfigFamily, identify_walk, step_map_of
from walkerlab.scene.subject import find_model_gait

WALKERS = {
    "paper": ("slope_deg", "walker.leg_length_m", "walker.hip_mass_kg"),
    "slope-3deg": ("slope_deg", "walker.leg_length_m"),
    "simplest": ("slope_deg", "walker.leg_length_m"),
    "round-feet": ("slope_deg", "walker.leg_length_m", "walker.foot_radius_m"),
    "kneed": ("slope_deg", "walker.shank.length_m"),
}
STEPS, NOISE, ANGLE_NOISE, PRIOR = 20, (1e-3, 1e-3), 2e-3, 0.01
"""Steps of a walk; s for a leg of 1 m on Earth, and leg lengths; rad; shares of the last parameter's value."""

DISTURBANCE, DISTURBANCES = (0.01, 1e-4), {"simplest": (0.002, 5e-5)}
"""Of the start, in shares of the gait's coordinates, and of the floor, in leg lengths; the simplest walker survives
less."""


class Truth:
    """A walker of a config, and synthetic walks of it."""

    def __init__(self, name, keys, level="steps"):
        self.config, self.keys, self.level = load(Path(name)).config, keys, level
        self.gait = in_memory("fixedpoint", self.config).summary
        self.model = CONTACT if level == "contact" else RIGID
        subject = find_model_gait(self.model, self.config, self.gait, lambda _: None)
        self.family = ConfigFamily(self.config, keys)
        self.walks = step_map_of(subject, self.family)
        self.z, self.leg = subject.z, self.config.walker.leg_length_m
        self.values, self.clock = np.array(self.family.start), math.sqrt(self.leg / (self.config.gravity_m_s2 / 9.81))
        self.start_change, self.roughness = DISTURBANCES.get(name, DISTURBANCE)

    def walk(self, seed):
        """Measure a walk; None if it ends early. Returns also a weighing of the last parameter."""
        draw = np.random.default_rng(seed)
        heights = draw.normal(0.0, self.roughness * self.leg, STEPS + 1)
        z = self.z * (1.0 + self.start_change * draw.normal(0.0, 1.0, self.z.size))
        z = self.walks.settled(z, tuple(self.values))
        walk = self.walks.disturbed(z, tuple(self.values), heights)
        weighed = self.values[-1] * (1.0 + PRIOR * draw.normal())
        if walk.durations_s.size < STEPS:
            return None
        periods = walk.durations_s + draw.normal(0.0, NOISE[0] * self.clock, STEPS)
        lengths = walk.lengths_m + draw.normal(0.0, NOISE[1] * self.leg, STEPS)
        if self.level != "angles":
            return MeasuredWalk(periods, lengths), weighed
        touches = np.append(0.0, np.cumsum(walk.durations_s))
        times = np.arange(0.0, touches[-1] * (1.0 - 1e-9), 2e-3 * self.clock)
        angles = self.walks.sampled(z, tuple(self.values), heights, times)
        return split_into_steps(times, angles + draw.normal(0.0, ANGLE_NOISE, angles.shape), touches), weighed

    def identify(self, measured, weighed):
        prior = {self.keys[-1]: [weighed, PRIOR * self.values[-1]]}
        question = Identify(fit=dict.fromkeys(self.keys), prior=prior, model=self.model)
        return identify_walk(self.config, measured, self.gait, question)


def region_holds(result, truth):
    """Whether the 95 % region of the estimates holds the truth."""
    known = result.information
    error = np.array([estimate.value for estimate in result.estimates]) - truth
    distance = error @ np.linalg.pinv(known.covariance, hermitian=True) @ error
    return distance / error.size < fisher.ppf(0.95, error.size, known.freedom)


def coverage(truth, seeds):
    """Return whether regions cover, estimates and standard errors of the walks of these seeds that the model fits."""
    inside, estimates, errors = [], [], []
    for seed in seeds:
        walk = truth.walk(seed)
        if walk is None:
            continue
        result = truth.identify(*walk)
        if not result.verdict.usable:
            continue
        inside.append(region_holds(result, truth.values))
        estimates.append([estimate.value for estimate in result.estimates])
        errors.append(np.sqrt(np.diag(result.information.covariance)))
    return np.array(inside), np.array(estimates), np.array(errors)


def coverage_on_all_cores(name, level, walks):
    """Return the same for seeds 0 to walks, with a process for each core."""
    cores = os.process_cpu_count() if hasattr(os, "process_cpu_count") else os.cpu_count()
    with ProcessPoolExecutor(cores) as pool:
        parts = pool.map(coverage_of, [(name, level, range(core, walks, cores)) for core in range(cores)])
        return (np.concatenate(columns) for columns in zip(*parts, strict=True))


def coverage_of(task):
    name, level, seeds = task
    return coverage(Truth(name, WALKERS[name], level), seeds)


def main(walks, level, names):
    for name in names:
        begun = time.perf_counter()
        inside, estimates, errors = coverage_on_all_cores(name, level, walks)
        share, spread = inside.mean(), estimates.std(axis=0, ddof=1)
        ratios = np.sqrt((errors**2).mean(axis=0)) / spread
        print(
            f"{name}: {inside.size} of {walks} walks fitted, {100 * share:.1f} % inside "
            f"(+- {196 * np.sqrt(0.95 * 0.05 / inside.size):.1f} %), standard error over spread "
            f"{' '.join(f'{ratio:.2f}' for ratio in ratios)}, {time.perf_counter() - begun:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    count, level, *names = [*sys.argv[1:], *("1000", "steps")[len(sys.argv) - 1 :]]
    main(int(count), level, names or WALKERS)
