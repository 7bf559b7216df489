#!/usr/bin/env python3
"""Compare ten steps of exported walkers in MuJoCo with our contact model.

The results are in docs/exchange-details.md and docs/legs-reference.md.

Usage: python scripts/mujoco_walks.py [CONFIG [KEY=VALUE ...]], by default the walkers of both tables

For each walker the script prints periods and lengths of the last two steps here and in MuJoCo, and the largest
difference in any step.
"""

import sys

import mujoco
import numpy as np
from mujoco_means import exported, take_steps

from walkerlab.exchange.mujoco_script import Walk

PADS = "contact.terrain=checkerboard"
FIRM = "stiffness: 300000, damping: 270, stiction_velocity: 10, friction_velocity: 100"
WALKERS = (
    ("kneed",),
    ("kneed-round-feet",),
    ("kneed-level",),
    ("level",),
    ("paper", "walker.leg_2={leg_mass_kg: 5.5}"),
    ("prosthesis", PADS),
    ("round-feet", PADS, "walker.leg_2={leg_length_m: 0.4005}"),
    ("kneed-round-feet", "walker.leg_2={shank: {mass_kg: 0.052}, foot_radius_m: 0.21}"),
    ("one-knee", f"contact={{{FIRM}, terrain: checkerboard}}"),
)


def main(walkers):
    for walker in walkers:
        text, steps, *_ = exported(*walker)
        mujoco.set_mjcb_control(None)
        walk = Walk(mujoco.MjModel.from_xml_string(text))
        taken, differences, _ = take_steps(walk, steps)
        here = steps.periods_s[-2:], steps.lengths_m[-2:]
        there = (np.diff(touches)[-2:] for touches in (walk.touches_s, walk.touches_m))
        print(f"{' '.join(walker)}: {taken} of {steps.steps} steps, differences up to {100.0 * max(differences):.2f} %")
        for unit, ours, theirs in zip(("s", "m"), here, there, strict=True):
            print(f"  {np.round(ours, 4)} {unit} here, {np.round(theirs, 4)} {unit} in MuJoCo", flush=True)


if __name__ == "__main__":
    main([sys.argv[1:]] if sys.argv[1:] else WALKERS)
