"""A small run as the report gets it: results made by hand, in the layout that the stages store."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkerlab.config.loader import load
from walkerlab.figures.registry import FIGURES
from walkerlab.paper.errata import Erratum
from walkerlab.stages.walk import legs, over_time
from walkerlab.store.artifact import Stored
from walkerlab.store.content import Group, Variable
from walkerlab.store.key import Identity

sys.path.append(str(Path(__file__).parent.parent / "figures"))
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
    return stored("simulate", {"trajectory": rigid_trajectory(steps)}, walk(outcome, steps, **(checked | changed)))


def rigid_trajectory(steps):
    """Legs that swing like clockwork, feet together at the heel strikes."""
    time = np.linspace(0.0, max(steps, 1) * PERIOD, 40 * max(steps, 1) + 1)
    step = np.minimum((time / PERIOD).astype(int), max(steps, 1) - 1)
    spread = math.asin(LENGTH / 2) * np.cos(np.pi * (time / PERIOD))
    angle = np.column_stack((-spread, spread)) - SLOPE
    stance = 1 - step % 2
    tilted = angle + SLOPE
    leg = np.stack((np.sin(tilted), -np.cos(tilted)), axis=-1)
    hip = np.column_stack((LENGTH * step, 0.0 * step)) - leg[np.arange(step.size), stance]
    feet = hip[:, None] + leg
    places = {"hip_along_m": hip[:, 0], "hip_height_m": hip[:, 1], "foot_along_m": feet[..., 0]}
    places |= {"foot_height_m": feet[..., 1]}
    seen = over_time(time=time, stance_leg=stance + 1, angle=angle, **places)
    return Group({**seen, **legs(), "step": column(step, "time")})


def contact_sim(outcome="walked", steps=STEPS, hip=0.98, **changed):
    time = np.linspace(0.0, max(steps, 1) * PERIOD, 60)
    feet = np.column_stack((0.5 * time - 0.1, 0.5 * time + 0.1))
    seen = over_time(
        time=time,
        angle=np.zeros((60, 2)),
        hip_along_m=0.5 * time,
        hip_height_m=np.linspace(0.98, hip, 60),
        foot_along_m=feet,
        foot_height_m=np.zeros((60, 2)),
    )
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
    return stored("contact-sim", {"trajectory": Group({**seen, **legs()})}, walk(outcome, steps, **(numbers | changed)))


def with_motion(result):
    """The same result, whose trajectory also has what the player's other views show: velocities, energies, forces."""
    trajectory = result.groups["trajectory"]
    time = trajectory["time"]
    wave = np.sin(9.0 * time)
    both = np.column_stack((wave, -wave))
    more = over_time(
        velocity=both, kinetic_J=4.0 + wave, potential_J=146.0 - wave, mechanical_J=np.full_like(wave, 150.0)
    )
    if result.identity.stage == "contact-sim":
        loaded = np.column_stack((wave > 0.0, wave <= 0.0))
        more |= over_time(
            angle=0.2 * both,
            normal_force_N=196.0 * loaded,
            friction_force_N=10.0 * both * loaded,
            penetration_m=6e-5 * np.abs(both) * loaded,
            slip_velocity_m_s=1e-3 * both,
        )
    groups = {**result.groups, "trajectory": Group({**trajectory.variables, **more})}
    return stored(result.identity.stage, groups, result.summary)


def families_that_move(walk):
    """A family of gaits, two of which move as a walk does."""
    family = families()["continuation"]
    seen = walk.groups["trajectory"].variables
    time = seen["time"].values
    feet = np.column_stack((0.6 * time, 0.5 * time))
    joints = over_time(
        hip_along_m=0.5 * time,
        hip_height_m=np.full_like(time, 0.98),
        foot_along_m=feet,
        foot_height_m=np.zeros_like(feet),
    )
    two = {
        f"rigid/branch_0/motion_{place}": Group({**seen, **joints}, {"value": value, "slope_rad": slope, "steps": 1})
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


def plotted(folder):
    """Figures, drawn into the folder as `plot` draws them."""
    known, figures = (
        {**both_models(), **measured_methods(), **stability_maps(), "continuation": families()["continuation"]},
        [],
    )
    for figure in (one for one in FIGURES if one.why_left_out(known, {}) is None):
        drawing = figure.drawn(known)
        files = {kind: f"{figure.name}.{kind}" for kind in ("svg", "png")}
        (folder / files["svg"]).write_bytes(drawing.svg)
        (folder / files["png"]).write_bytes(drawing.png)
        figures.append({"title": drawing.title, "caption": drawing.caption, "alt": figure.seen, **files})
    return stored("plot", {}, {"figures": figures})


def config(*sets, file=None):
    return load(file, ("strides=2", *sets)).config
