"""Walks set by hand, in the layout of the stages: legs that swing like pendulums, with feet on the slope."""

import numpy as np

from walkerlab.pipeline.stages.walk import step_columns, variables_over_time
from walkerlab.pipeline.store.artifact import Identity, Stored
from walkerlab.pipeline.store.content import Group, Variable
from walkerlab.pipeline.store.provenance import Provenance

LEG_LENGTH, SLOPE, HALF_ANGLE = 1.0, 0.0174, 0.187
WEIGHT = 196.2
LAW = {"terrain": "after-mid-swing", "static_friction": 0.9, "dynamic_friction": 0.7}
STEP_LENGTH = 2.0 * LEG_LENGTH * np.sin(HALF_ANGLE)
SAMPLES = 40  # number of samples in a step
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
    walker = {"type": "compass", "leg_length_m": LEG_LENGTH, "foot_radius_m": 0.001, "hip": {}}
    asked = {"walker": walker, "slope_rad": SLOPE, "contact": LAW, "push_off": {"impulse_N_s": 0.0}}
    identity = Identity(stage, asked, {}, "c0de")
    return Stored(groups, summary, identity=identity, provenance=ORIGIN, complete=True, seal="5ea1")


def motion(steps, period, jumps):
    """Return time, step, angle and velocity of the legs. With `jumps`, both sides of each heel strike are samples."""
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
    return variables_over_time(kinetic_J=kinetic, potential_J=level - kinetic, mechanical_J=np.full(time.size, level))


def joints(step, stance, angle):
    tilted = angle + SLOPE
    from_hip = LEG_LENGTH * np.stack((np.sin(tilted), -np.cos(tilted)), axis=-1)
    hip = np.stack((step * STEP_LENGTH, 0.0 * step), axis=-1) - from_hip[np.arange(step.size), stance]
    feet = hip[:, None] + from_hip
    return variables_over_time(
        hip_along_m=hip[:, 0], hip_height_m=hip[:, 1], foot_along_m=feet[..., 0], foot_height_m=feet[..., 1]
    )


def trajectory(step, time, angle, velocity, level):
    stance = 1 - step % 2
    moving = variables_over_time(time=time, stance_leg=stance + 1, angle=angle, velocity=velocity)
    return {**moving, **energies(time, level), **joints(step, stance, angle)}


def walked(period, count, **more):
    """Return the stored variables of the steps, if there are any."""
    number = np.arange(1, count + 1)
    columns = step_columns(
        period * number,
        period_s=np.full(count, period),
        length_m=np.full(count, STEP_LENGTH),
        touch_along_m=STEP_LENGTH * number,
        **{name: np.full(count, value) for name, value in more.items()},
    )
    return {"steps": Group(columns)} if count else {}


def rigid(steps=10, period=0.7, outcome="walked", completed=None):
    """Return the result of `simulate` for a walk with `completed` steps. The rest of its time has no heel strike."""
    time, step, angle, velocity = motion(steps, period, jumps=True)
    done = steps if completed is None else completed
    numbered = {"step": Variable(step, ("time",), "1", "step")}
    groups = {"trajectory": Group(trajectory(step, time, angle, velocity, 150.24) | numbered), **walked(period, done)}
    return stored("simulate", groups, {"outcome": outcome, "steps": done, "slope_rad": SLOPE})


def contact(steps=10, period=0.71, outcome="walked", pads=True):
    """Return the result of `contact-sim`."""
    time, step, angle, velocity = motion(steps, period, jumps=False)
    moving = trajectory(step, time, angle, velocity, 150.0) | ground(step, time, period)
    groups = {"trajectory": Group(moving), **walked(period, steps, slip_m=5e-4, rolling_m=4e-4)}
    if pads:
        groups["terrain"] = pads_group(steps)
    summary = {"outcome": outcome, "steps": steps, "slope_rad": SLOPE, "pitch_m": STEP_LENGTH}
    return stored("contact-sim", groups, summary)


def ground(step, time, period):
    """Return forces on the stance foot and losses. At the beginning of each step 1 J is lost to damping and 0.1 J to
    friction.
    """
    load = np.zeros((time.size, 2))
    load[np.arange(time.size), 1 - step % 2] = WEIGHT
    begun = np.searchsorted(period * np.arange(1, steps_of(step) + 1), time, side="left").astype(float)
    gone = {"dissipated_damping_J": begun, "dissipated_friction_J": 0.1 * begun, "lost_at_edges_J": 0.0 * begun}
    gone["total_energy_J"] = 150.0 - 1.1 * begun
    energies = {name: Variable(values, ("time",), "J", name) for name, values in gone.items()}
    return variables_over_time(normal_force_N=load, friction_force_N=0.2 * load) | energies


def steps_of(step):
    return int(step.max()) + 1


def pads_group(steps):
    numbers = np.arange(-2, steps + 3)
    edges = {"left_m": (numbers - 0.5) * STEP_LENGTH, "right_m": (numbers + 0.5) * STEP_LENGTH}
    lanes = {"leg": Variable(2 - numbers % 2, ("pad",), "1", "leg")}
    return Group({**{name: Variable(values, ("pad",), "m", name) for name, values in edges.items()}, **lanes})


def compared(steps=10, period=0.7, aligned=True):
    """Return the parts of a result of `compare` that figures need."""
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
    return stored("compare", groups, {"paper_numbers": [{"printed": "10^-4"}]})


def without(result, group, *names):
    """Return the result as it is stored if the variables of a group were not requested."""
    left = {name: variable for name, variable in result[group].variables.items() if name not in names}
    return stored(result.identity.stage, {**result.groups, group: Group(left)}, result.summary)


def both_models(**changed):
    return {"simulate": rigid(), "contact-sim": contact(), "compare": compared(), **changed}


def rigid_alone(**changed):
    return {"simulate": rigid(), **changed}
