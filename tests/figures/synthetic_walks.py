"""Walks made by hand in the layout that the stages store: legs that swing like pendulums, feet on the slope."""

import numpy as np

from walkerlab.store.artifact import Stored
from walkerlab.store.content import Group, Variable
from walkerlab.store.key import Identity
from walkerlab.store.provenance import Provenance

LEG_LENGTH, SLOPE, HALF_ANGLE = 1.0, 0.0174, 0.187
STEP_LENGTH = 2.0 * LEG_LENGTH * np.sin(HALF_ANGLE)
SAMPLES = 40  # of a step
ORIGIN = Provenance(
    config="name: paper\n",
    command_line="walkerlab plot",
    seed=0,
    started_utc="2024-05-01T10:00:00.000+00:00",
    ended_utc="2024-05-01T10:00:01.250+00:00",
    platform="Linux",
    package_version="0.1.0",
    library_versions={"numpy": "2.0.0"},
    git_commit="0123456789abcdef",
)


def stored(stage, groups, summary):
    walker = {"type": "compass", "leg_length_m": LEG_LENGTH, "foot_radius_m": 0.001}
    asked = {"walker": walker, "slope_rad": SLOPE, "contact": {"terrain": "after-mid-swing"}}
    identity = Identity(stage, asked, {}, "c0de")
    return Stored(groups, summary, identity=identity, provenance=ORIGIN, complete=True, seal="5ea1")


def motion(steps, period, jumps):
    """Time, step, angle and velocity of the legs; `jumps` has both sides of each heel strike among the samples."""
    phase = np.linspace(0.0, 1.0, SAMPLES)
    turn = np.pi * phase
    pieces = []
    for step in range(steps):
        time = period * (step + phase)
        if jumps:
            time[-1] = np.nextafter(period * (step + 1), -np.inf)
        swing = (-SLOPE - HALF_ANGLE * np.cos(turn), HALF_ANGLE * np.pi / period * np.sin(turn) + 0.2 * phase)
        stance = (-SLOPE + HALF_ANGLE * np.cos(turn), -HALF_ANGLE * np.pi / period * np.sin(turn) - 0.1 * phase)
        legs = (swing, stance) if step % 2 == 0 else (stance, swing)
        here = slice(None) if jumps or step == 0 else slice(1, None)
        angle, velocity = (np.column_stack([leg[i] for leg in legs])[here] for i in (0, 1))
        pieces.append((time[here], np.full(time[here].size, step), angle, velocity))
    return [np.concatenate(parts) for parts in zip(*pieces, strict=True)]


def energies(time, level):
    kinetic = 4.0 + np.cos(9.0 * time)
    return {
        "kinetic_J": Variable(kinetic, ("time",), "J", "kinetic energy"),
        "potential_J": Variable(level - kinetic, ("time",), "J", "potential energy"),
        "mechanical_J": Variable(np.full(time.size, level), ("time",), "J", "mechanical energy"),
    }


def states(time, stance, angle, velocity):
    return {
        "time": Variable(time, ("time",), "s", "time"),
        "stance_leg": Variable(stance, ("time",), "1", "leg that stands"),
        "angle": Variable(angle, ("time", "leg"), "rad", "angle of the leg"),
        "velocity": Variable(velocity, ("time", "leg"), "rad/s", "angular velocity of the leg"),
    }


def joints(step, stance, angle):
    tilted = angle + SLOPE
    from_hip = LEG_LENGTH * np.stack((np.sin(tilted), -np.cos(tilted)), axis=-1)
    hip = np.stack((step * STEP_LENGTH, 0.0 * step), axis=-1) - from_hip[np.arange(step.size), stance]
    feet = hip[:, None] + from_hip
    return {
        "hip_along_m": Variable(hip[:, 0], ("time",), "m", "hip along the slope"),
        "hip_height_m": Variable(hip[:, 1], ("time",), "m", "hip over the slope"),
        "foot_along_m": Variable(feet[..., 0], ("time", "leg"), "m", "foot along the slope"),
        "foot_height_m": Variable(feet[..., 1], ("time", "leg"), "m", "foot over the slope"),
    }


def per_step(period, count, strikes, **more):
    columns = {"period_s": np.full(count, period), "length_m": np.full(count, STEP_LENGTH), strikes: more.pop(strikes)}
    return Group({name: Variable(values, ("step",), "1", name) for name, values in {**columns, **more}.items()})


def rigid(steps=10, period=0.7, outcome="walked", completed=None):
    """The result of `simulate`; `completed` steps, and the rest of the time on the way to no heel strike."""
    time, step, angle, velocity = motion(steps, period, jumps=True)
    done = steps if completed is None else completed
    trajectory = {
        **states(time, 1 - step % 2, angle, velocity),
        **energies(time, 150.24),
        **joints(step, 1 - step % 2, angle),
        "step": Variable(step, ("time",), "1", "step"),
    }
    groups = {"trajectory": Group(trajectory)}
    if done:
        times = period * np.arange(1, done + 1)
        groups["steps"] = per_step(period, done, "heel_strike_time_s", heel_strike_time_s=times)
    return stored("simulate", groups, {"outcome": outcome, "steps": done, "slope_rad": SLOPE})


def contact(steps=10, period=0.71, outcome="walked", pads=True):
    """The result of `contact-sim`."""
    time, step, angle, velocity = motion(steps, period, jumps=False)
    touches = period * np.arange(1, steps + 1)
    stance = 1 - step % 2
    trajectory = {
        **states(time, stance, angle, velocity),
        **energies(time, 150.0),
        **joints(step, stance, angle),
    }
    landings = STEP_LENGTH * np.arange(1, steps + 1)
    groups = {
        "trajectory": Group(trajectory),
        "steps": per_step(period, steps, "touch_time_s", touch_time_s=touches, touch_along_m=landings),
    }
    if pads:
        groups["terrain"] = pads_group(steps)
    summary = {"outcome": outcome, "steps": steps, "slope_rad": SLOPE, "pitch_m": STEP_LENGTH}
    return stored("contact-sim", groups, summary)


def pads_group(steps):
    numbers = np.arange(-2, steps + 3)
    edges = {"left_m": (numbers - 0.5) * STEP_LENGTH, "right_m": (numbers + 0.5) * STEP_LENGTH}
    lanes = {"leg": 1 - numbers % 2}
    return Group({name: Variable(values, ("pad",), "1", name) for name, values in {**edges, **lanes}.items()})


def compared(steps=10, period=0.7, aligned=True):
    """The result of `compare`, as far as a figure needs it."""
    time, phase = np.linspace(0.0, steps * period - 1e-9, 500), np.linspace(0.0, 1.0, 60)
    raw = 0.05 * np.stack((np.sin(3.0 * time), np.cos(3.0 * time)), axis=-1)
    in_phase = 0.004 * np.ones((steps, 1, 1)) * np.stack((np.sin(6.0 * phase), np.cos(6.0 * phase)), axis=-1)
    groups = {
        "errors": Group(
            {
                "time": Variable(time, ("time",), "s", "time"),
                "raw_angle_error_rad": Variable(raw, ("time", "leg"), "rad", "angle"),
                "raw_velocity_error_rad_s": Variable(9.0 * raw, ("time", "leg"), "rad/s", "velocity"),
            }
        )
    }
    if aligned:
        dims = ("step", "phase", "leg")
        groups["aligned"] = Group(
            {
                "phase": Variable(phase, ("phase",), "1", "phase"),
                "aligned_angle_error_rad": Variable(in_phase, dims, "rad", "angle"),
                "aligned_velocity_error_rad_s": Variable(9.0 * in_phase, dims, "rad/s", "velocity"),
            }
        )
    return stored("compare", groups, {})


def without(result, group, *names):
    """The result as it is stored when no one asked for some variables."""
    left = {name: variable for name, variable in result[group].variables.items() if name not in names}
    return stored(result.identity.stage, {**result.groups, group: Group(left)}, result.summary)


def both_models(**changed):
    return {"simulate": rigid(), "contact-sim": contact(), "compare": compared(), **changed}


def rigid_alone(**changed):
    return {"simulate": rigid(), **changed}
