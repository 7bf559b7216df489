"""A small run for the report: a real walk, and summaries with round values in the layout of the stages."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkerlab.config.loader import load
from walkerlab.evidence.paper.study import Erratum
from walkerlab.pipeline.store.artifact import Identity, Stored
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.views.figures.stage import FIGURES

sys.path.append(str(Path(__file__).parent.parent / "figures"))
from real_results import first_steps
from synthetic_families import families
from synthetic_maps import stability_maps
from synthetic_methods import measured_methods
from synthetic_walks import ORIGIN, both_models

STEPS, PERIOD, LENGTH, SLOPE = 4, 0.7, 0.37, 0.0174
COORDINATES = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")


def stored(stage, groups=None, summary=None, **provenance):
    made = replace(ORIGIN, **{"command_line": "walkerlab report", **provenance})
    identity = Identity(stage, {"slope_rad": SLOPE}, {}, "c0de")
    return Stored(groups or {}, summary or {}, identity=identity, provenance=made, complete=True, seal="5ea1")


def column(values, dim, units="1", long_name="number"):
    return Variable(np.array(values), (dim,), units, long_name)


def texts(values, dim, long_name="text"):
    return Variable(np.array(values, dtype=object), (dim,), "", long_name)


def gait_summary(equations="corrected", **changed):
    return {
        "state": [-0.2042, 0.1694, -0.605819, -0.861041],
        "period_s": PERIOD,
        "step_length_m": LENGTH,
        "multipliers": [[0.3626, 0.4603], [0.3626, -0.4603], [0.2157, 0.0]],
        "spectral_radius": 0.586,
        "stable": True,
        "residual": 1e-15,
        "energy_J": 150.24,
        "equations": equations,
        "slope_rad": SLOPE,
        **changed,
    }


def fixedpoint(**changed):
    sets = {"corrected": gait_summary(), "as-printed": gait_summary("as-printed", stable=False, spectral_radius=1.5)}
    return stored("fixedpoint", {}, {**gait_summary(**changed), "equation_sets": sets, "gaits_found": 1})


def walk(outcome="walked", steps=STEPS, **changed):
    return {
        "outcome": outcome,
        "advice": "" if outcome == "walked" else "Start nearer to a gait.",
        "steps": steps,
        "step_periods_s": [PERIOD] * steps,
        "step_lengths_m": [LENGTH] * steps,
        "touch_times_s": [PERIOD * (step + 1) for step in range(steps)],
        **changed,
    }


def simulate(outcome="walked", steps=STEPS, **changed):
    checked = {
        "final_state": [-0.2, 0.17, -0.6, -0.86],
        "energy_drift_J": 1e-9,
        "mean_energy_J": 150.24,
        "min_normal_force_N": 166.0,
        "max_friction_ratio": 0.19,
        "max_scuff_depth_m": 0.00037,
    }
    trajectory = {"trajectory": first_steps("simulate", steps)}
    return stored("simulate", trajectory, walk(outcome, steps, **(checked | changed)))


def contact_sim(outcome="walked", steps=STEPS, hip=None, **changed):
    """Return the walk on compliant ground. If given, `hip` replaces the height of the hip at the end."""
    trajectory = first_steps("contact-sim", steps)
    if hip is not None:
        ends = trajectory.variables["hip_height_m"]
        lowered = replace(ends, values=np.append(ends.values[:-1], hip))
        trajectory = Group({**trajectory.variables, "hip_height_m": lowered}, trajectory.attrs)
    numbers = {
        "end_time_s": max(steps, 1) * PERIOD,
        "max_penetration_m": 1.2e-4,
        "slip_per_step_m": 9.3e-4,
        "slips_m": [9.3e-4] * steps,
        "energy_balance_residual_J": 7e-9,
        "dissipated_J": {"damping": 10.4, "friction": 1.0, "edges": 0.0},
        "rhs_evaluations": 27087,
        "static_penetration_m": 5.88e-5,
        "damping_ratio": 3.71,
        "pitch_m": LENGTH,
        "friction": "creeping friction of its own kind",
    }
    return stored("contact-sim", {"trajectory": trajectory}, walk(outcome, steps, **(numbers | changed)))


def families_that_move(walk):
    """Return a family of gaits. Two of them have the motion of a walk."""
    family = families()["continuation"]
    seen = walk.groups["trajectory"].variables
    two = {
        f"rigid/branch_0/motion_{place}": Group(seen, {"value": value, "slope_rad": slope, "steps": 1})
        for place, value, slope in ((0, 1.0, 0.02), (3, 5.0, 0.09))
    }
    return stored("continuation", {**family.groups, **two}, family.summary)


def paper_row(where, quantity, printed, verdict, evidence, **values):
    models = {"unit": "rad", "as_printed": None, "corrected": None, "contact": None}
    return {"where": where, "quantity": quantity, "printed": printed, "verdict": verdict, "evidence": evidence} | (
        models | values
    )


PAPER_ROWS = [
    paper_row("eq. 11", "x_p, theta_1", "-0.2022", "reproduced", "To the printed digits.", as_printed=-0.202216),
    paper_row("Table 3", "t_left", "0.60", "contradicted", "A gait of period one has equal steps.", corrected=0.7036),
    paper_row("Table 3", "t_right", "0.79", "contradicted", "A gait of period one has equal steps.", corrected=0.7036),
    paper_row("Table 2", "dtheta_2", "+74%", "explained", "Relative to the wrong one of both.", corrected=281.0),
]


def compare(rows=PAPER_ROWS):
    found = Erratum("A.5 row 2", "plus", "minus", "Lagrange's equations", "energy drifts by 0.13 J")
    numbers = {"raw": 0.11, "aligned": 0.017, "per_leg": {"raw": [0.1, 0.11]}}
    summary = {
        "paper_numbers": rows,
        "errata": [vars(found)],
        "table1": {"L": {"quantity": "length", "unit": "m", "paper": 1.0, "used": 1.0, "where": "Table 1"}},
        "table3": {"t_left": {"unit": "s", "paper_matlab": 0.6, "as_printed": None, "corrected": 0.7036}},
        "max_angle_error_rad": numbers,
        "max_velocity_error_rad_s": numbers,
        "orbit_distance": 0.014,
    }
    return stored("compare", {}, summary)


EVERYTHING = {"fixedpoint": fixedpoint, "simulate": simulate, "contact-sim": contact_sim, "compare": compare}


DRAWN = ("figure-06", "figure-07", "figure-08", "figure-09", "figure-13", "accuracy-rigid", "stability-step")
"""Figures of every form: with one axis, panels side by side, panels one above the other, equal scales, and a colour
bar.
"""


def plotted(folder):
    """Draw figures into the folder as `plot` does."""
    known = {**both_models(), **measured_methods(), **stability_maps(), "continuation": families()["continuation"]}
    figures = []
    for figure in (one for one in FIGURES if one.name in DRAWN):
        drawing = figure.render(known)
        files = {kind: f"{figure.name}.{kind}" for kind in ("svg", "png")}
        (folder / files["svg"]).write_bytes(drawing.svg)
        (folder / files["png"]).write_bytes(drawing.png)
        figures.append({"title": figure.title, "caption": drawing.caption, "alt": figure.say("seen"), **files})
    return stored("plot", {}, {"figures": figures})


def config(*sets, file=None):
    return load(file, ("strides=2", *sets)).config
