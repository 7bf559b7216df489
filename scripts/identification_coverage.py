"""Identify walkers from synthetic walks, and compare errors with the spread of the estimates.

Usage: python scripts/identification_coverage.py [WALKS, 1000 by default] [steps | angles | contact] [CONFIG ...]
       [--disturbed-by floor | kicks | pushes | slope] [--noise normal | correlated | heavy-tailed]

Walks start off the gait, are disturbed on their way, and are measured with noise; `contact` are steps of the contact
model. The disturbance is a rough floor, random changes of the rates at each heel strike, random pushes at the hip in
the middle of each swing, or a slope that varies smoothly along the ramp. Correlated noise forgets its past within
`MEMORY` values, and heavy-tailed noise is Student's t with three degrees of freedom. For each walker the script prints
the number of walks that took all steps and that the model fits, the share without doubt, the share whose 95 % region
contains the truth, with its binomial error, and for each parameter the mean standard error over the spread of the
estimates.
"""

import argparse
import itertools
import os

# Matrices are small: threads that share one would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import math
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import f as fisher

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.estimation.measurements import MeasuredWalk, split_into_steps
from walkerlab.physics.hybrid.rigid_record import new_observer
from walkerlab.physics.mechanics.impact import push_at_hip
from walkerlab.physics.mechanics.rigid_model import step_lengths
from walkerlab.physics.orbits.family_search import CONTACT, RIGID
from walkerlab.physics.orbits.rigid_map import state_on_section, unit_kicks
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
"""Number of steps, and noise: of periods (s, for a leg of 1 m on Earth) and lengths (leg lengths), of angles (rad), and
of the last parameter (relative).
"""

DISTURBANCE, DISTURBANCES = (0.01, 1e-4), {"simplest": (0.002, 5e-5)}
"""Disturbance of the start, as a fraction of the coordinates of the gait, and of the floor, in leg lengths. They are
smaller for the simplest walker, which survives less.
"""


KICK, RAMP, WAVE, PUSH, MIDDLE = 2e-3, 1e-4, 7.0, 5e-4, 0.4
"""Other disturbances: changes of the rates at heel strikes (relative), the largest change in the rise per step of a
varying slope (leg lengths), the wavelength of the slope (steps), and pushes, as a fraction of m sqrt(g l), with their
time as a fraction of a step.
"""


MEMORY = 10


def noise_of(kind, draw, shape):
    """Draw noise of unit variance, (values, ...), of one of the three kinds."""
    if kind == "heavy-tailed":
        return draw.standard_t(3, shape) / math.sqrt(3.0)
    white = draw.normal(size=shape)
    if kind == "normal":
        return white
    kept = math.exp(-1.0 / MEMORY)
    rows = [white[0]]
    for row in white[1:]:
        rows.append(kept * rows[-1] + math.sqrt(1.0 - kept**2) * row)
    return np.array(rows)


def kicked_walk(walks, z, p, kick, draw):
    """Walk on even ground with random changes of the rates after each heel strike but the first."""
    unit = walks._unit_at(p)

    def kicked(start, step):
        kicks = unit_kicks(unit.walker, unit.section, start)
        return start + (kick * draw.normal(size=len(kicks)) @ kicks if step else 0.0)

    return walk_in_parts(walks, unit, z, lambda start, step: [(0.0, kicked(start, step))])


def pushed_walk(walks, z, p, push, draw):
    """Walk on even ground with a random push at the hip, along the slope, in the middle of each swing."""
    unit = walks._unit_at(p)

    def halves(start, _):
        time = np.array([MIDDLE * walks.step(z, p).period_s / unit.units.time])
        observer = new_observer(time, start.size)
        walks._exact.walk(unit.section, z, 1, False, start=start, observer=observer)
        return [(0.0, start), (time[0], push_at_hip(unit.walker, observer.states[0], push * draw.normal()))]

    return walk_in_parts(walks, unit, z, halves)


def walk_in_parts(walks, unit, z, parts_of):
    """Walk on even ground. `parts_of` maps state and number of a step to the beginnings and the states of its parts."""
    start, periods, lengths, parts = np.array(state_on_section(unit.walker, z)), [], [], []
    for step in range(STEPS):
        own = parts_of(start, step)
        begun, last = own[-1]
        walk = walks._exact.walk(unit.section, z, 1, False, start=last)
        if walk.outcome is not Outcome.WALKED:
            return None
        parts.append([*own, (begun + walk.time[0], None)])
        periods.append((begun + walk.time[0]) * unit.units.time)
        first = own[0][1][None]
        lengths.append(step_lengths(unit.walker, first, walk.strikes.before)[0] * unit.units.length)
        start = walk.strikes.after[0]
    touches = np.append(0.0, np.cumsum(periods))

    def sampled(times):
        angles = []
        for step, own in enumerate(parts):
            since = (times[(times >= touches[step]) & (times < touches[step + 1])] - touches[step]) / unit.units.time
            for (begin, state), (end, _) in itertools.pairwise(own):
                observer = new_observer(since[(since >= begin) & (since < end)] - begin, state.size)
                walks._exact.walk(unit.section, z, 1, False, start=state, observer=observer)
                angles.append(observer.states[:, [0, 1] if step % 2 == 0 else [1, 0]])
        return np.concatenate(angles)

    return np.array(periods), np.array(lengths), sampled


class Truth:
    """A walker of a config, and synthetic walks of it."""

    def __init__(self, name, keys, level="steps", disturbed_by="floor", noise="normal"):
        self.config, self.keys, self.level = load(Path(name)).config, keys, level
        self.gait = run_in_memory("fixedpoint", self.config).summary
        self.model = CONTACT if level == "contact" else RIGID
        subject = find_model_gait(self.model, self.config, self.gait, lambda _: None)
        self.family = ConfigFamily(self.config, keys)
        self.walks = step_map_of(subject, self.family)
        self.z, self.leg = subject.z, self.config.walker.leg_length_m
        self.values, self.clock = np.array(self.family.start), math.sqrt(self.leg / (self.config.gravity_m_s2 / 9.81))
        self.start_change, self.roughness = DISTURBANCES.get(name, DISTURBANCE)
        self.disturbed_by, self.noise = disturbed_by, noise

    def walk(self, seed):
        """Measure a walk, or return None if it ends early. Also return a separate measurement of the last parameter."""
        draw = np.random.default_rng(seed)
        heights = draw.normal(0.0, self.roughness * self.leg, STEPS + 1)
        z = self.z * (1.0 + self.start_change * draw.normal(0.0, 1.0, self.z.size))
        z = self.walks.rest_on_ground(z, tuple(self.values))
        weighed = self.values[-1] * (1.0 + PRIOR * draw.normal())
        walked = self.take_disturbed_walk(z, heights, draw)
        if walked is None:
            return None
        periods, lengths, sampled = walked
        noisy = periods + NOISE[0] * self.clock * noise_of(self.noise, draw, STEPS)
        if self.level != "angles":
            return MeasuredWalk(noisy, lengths + NOISE[1] * self.leg * noise_of(self.noise, draw, STEPS)), weighed
        touches = np.append(0.0, np.cumsum(periods))
        times = np.arange(0.0, touches[-1] * (1.0 - 1e-9), 2e-3 * self.clock)
        angles = sampled(times)
        return split_into_steps(
            times, angles + ANGLE_NOISE * noise_of(self.noise, draw, angles.shape), touches
        ), weighed

    def take_disturbed_walk(self, z, heights, draw):
        """Return periods, lengths and a function that samples the angles of a walk, or None if it ends early."""
        p, relative = tuple(self.values), self.roughness / DISTURBANCE[1]
        if self.disturbed_by == "kicks":
            return kicked_walk(self.walks, z, p, KICK * relative, draw)
        if self.disturbed_by == "pushes":
            return pushed_walk(self.walks, z, p, PUSH * relative, draw)
        if self.disturbed_by == "slope":
            heights = (
                RAMP
                * relative
                * self.leg
                * np.cumsum(np.sin(2.0 * np.pi * (np.arange(STEPS + 1) / WAVE + draw.uniform())))
            )
        walk = self.walks.take_disturbed_walk(z, p, heights)
        if walk.durations_s.size < STEPS:
            return None
        return walk.durations_s, walk.lengths_m, lambda times: self.walks.sample_legs(z, p, heights, times)

    def identify(self, measured, weighed):
        prior = {self.keys[-1]: [weighed, PRIOR * self.values[-1]]}
        question = Identify(fit=dict.fromkeys(self.keys), prior=prior, model=self.model)
        return identify_walk(self.config, measured, self.gait, question)


def region_holds(result, truth):
    """Whether the 95 % region of the estimates contains the truth."""
    known = result.information
    error = np.array([estimate.value for estimate in result.estimates]) - truth
    distance = error @ np.linalg.pinv(known.covariance, hermitian=True) @ error
    return distance / error.size < fisher.ppf(0.95, error.size, known.freedom)


def coverage(truth, seeds):
    """Return, for the seeds whose walks the model fits, whether regions contain the truth, estimates, and standard
    errors.
    """
    inside, estimates, errors, fits = [], [], [], []
    for seed in seeds:
        walk = truth.walk(seed)
        if walk is None:
            continue
        result = truth.identify(*walk)
        if not result.verdict.usable:
            continue
        fits.append(result.verdict.fit == "fits")
        inside.append(region_holds(result, truth.values))
        estimates.append([estimate.value for estimate in result.estimates])
        errors.append(np.sqrt(np.diag(result.information.covariance)))
    return np.array(inside), np.array(estimates), np.array(errors), np.array(fits)


def coverage_on_all_cores(name, level, walks, disturbed_by, noise):
    """Return the same for the seeds below `walks`, with a process for each core."""
    cores = os.process_cpu_count() if hasattr(os, "process_cpu_count") else os.cpu_count()
    with ProcessPoolExecutor(cores) as pool:
        tasks = [(name, level, disturbed_by, noise, range(core, walks, cores)) for core in range(cores)]
        parts = pool.map(coverage_of, tasks)
        return (np.concatenate(columns) for columns in zip(*parts, strict=True))


def coverage_of(task):
    name, level, disturbed_by, noise, seeds = task
    return coverage(Truth(name, WALKERS[name], level, disturbed_by, noise), seeds)


def main(walks, level, names, disturbed_by, noise):
    for name in names:
        begun = time.perf_counter()
        inside, estimates, errors, fits = coverage_on_all_cores(name, level, walks, disturbed_by, noise)
        share, spread = inside.mean(), estimates.std(axis=0, ddof=1)
        ratios = np.sqrt((errors**2).mean(axis=0)) / spread
        print(
            f"{name}: {inside.size} of {walks} walks fitted, {100 * fits.mean():.0f} % without doubt, "
            f"{100 * share:.1f} % inside (+- {196 * np.sqrt(0.95 * 0.05 / inside.size):.1f} %), standard error over "
            f"spread {' '.join(f'{ratio:.2f}' for ratio in ratios)}, {time.perf_counter() - begun:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("walks", type=int, nargs="?", default=1000)
    parser.add_argument("level", nargs="?", default="steps", choices=("steps", "angles", "contact"))
    parser.add_argument("configs", nargs="*")
    parser.add_argument("--disturbed-by", default="floor", choices=("floor", "kicks", "pushes", "slope"))
    parser.add_argument("--noise", default="normal", choices=("normal", "correlated", "heavy-tailed"))
    options = parser.parse_args()
    main(options.walks, options.level, options.configs or WALKERS, options.disturbed_by, options.noise)
