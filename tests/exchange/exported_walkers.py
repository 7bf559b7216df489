"""Walkers to export, each with its rigid gait: built-in ones, and random ones of every kind that can be exported."""

from functools import cache
from pathlib import Path

import numpy as np
from adams_dataset import Dataset

from walkerlab.api.memory import run_in_memory
from walkerlab.config.loader import load
from walkerlab.exchange.export import add_stops, export_model
from walkerlab.exchange.exported import GaitStart, prepare_export

PADS = "contact.terrain=checkerboard"


@cache
def with_gait(name, *sets):
    """Return the config with the start of its rigid gait."""
    config = load(Path(name), sets).config
    gait = run_in_memory("fixedpoint", config).summary
    return config, GaitStart(gait["step_length_m"], gait["state"], gait["asymmetry"]["step_length"])


@cache
def export_of(name, *sets):
    return prepare_export(*with_gait(name, *sets))


@cache
def files_of(kind, law, name, *sets):
    return export_model(*with_gait(name, *sets), kind, law)


LIMPING = (
    ("paper", "walker.leg_2={leg_mass_kg: 5.5}", "strides=2"),
    ("round-feet", PADS, "walker.leg_2={leg_length_m: 0.4005, foot_radius_m: 0.102}", "strides=2"),
    ("level", "walker.leg_2={leg_mass_kg: 5.1}", "push_off.leg_2={impulse_N_s: 3.9}", "strides=2"),
    (
        "kneed-round-feet", "walker.leg_2={shank: {mass_kg: 0.052}, foot_radius_m: 0.21}",
        "walker.knee.damping_N_m_s_per_rad=0.004", "strides=1",
    ),
)  # fmt: skip
"""One walker of each kind with legs that differ."""
ONE_KNEE = (
    "one-knee", "strides=1",
    "contact={stiffness: 300000, damping: 270, terrain: checkerboard, stiction_velocity: 10, friction_velocity: 100}",
)  # fmt: skip
PARTS = """
name: compass-by-parts
walker:
  type: parts
  leg_length_m: 1.0
  bodies:
    - {name: left leg, mass_kg: 5.0, centre_m: [0.0, -0.5]}
    - {name: right leg, mass_kg: 5.0, centre_m: [0.0, -0.5]}
  hinges:
    - {name: hip, parent: right leg, parent_point_m: [0.0, 0.0], child: left leg, child_point_m: [0.0, 0.0]}
  particles:
    - {name: hip, mass_kg: 10.0, body: right leg, at_m: [0.0, 0.0]}
  feet:
    - {body: left leg, centre_m: [0.0, -0.999], radius_m: 0.001}
    - {body: right leg, centre_m: [0.0, -0.999], radius_m: 0.001}
  legs: [[left leg], [right leg]]
slope_rad: 0.0174
strides: 2
contact: {terrain: checkerboard}
"""


def random_walker(seed):
    """Return name and settings of a random walker on pads at its step length. The kinds take turns."""
    draw = np.random.default_rng(seed)

    def about(key, value):
        return f"{key}={value * draw.uniform(0.95, 1.05):.6g}"

    pads = (PADS, "strides=2")
    springs = (about("walker.hip.spring_N_m_per_rad", 1.0), about("walker.hip.damping_N_m_s_per_rad", 0.02))
    kinds = (
        ("paper", about("walker.leg_mass_kg", 5.0), about("walker.foot_radius_m", 0.02), *springs, *pads),
        (
            "round-feet", about("walker.leg_inertia_kg_m2", 0.01), about("walker.foot_radius_m", 0.1),
            about("walker.foot_centre_ahead_m", 0.004), *pads,
        ),
        ("torso", about("walker.torso.mass_kg", 5.0), about("walker.torso.inertia_kg_m2", 0.1), *springs, *pads),
        ("level", about("push_off.impulse_N_s", 4.0), about("walker.hip_mass_kg", 10.0), *pads),
        ("paper", about("walker.hip.torque_N_m", 0.1), about("walker.leg_inertia_kg_m2", 0.1), *pads),
    )  # fmt: skip
    return kinds[seed % len(kinds)]


def random_kneed_walker(seed, strides):
    """Return name and settings of a random kneed walker. The kinds take turns."""
    draw = np.random.default_rng(seed)

    def about(key, value, spread=0.03):
        return f"{key}={value * draw.uniform(1.0 - spread, 1.0 + spread):.6g}"

    shared = (about("walker.hip_mass_kg", 0.5), about("walker.thigh.mass_kg", 0.5), f"strides={strides}")
    kinds = (
        ("kneed", *shared),
        ("kneed-round-feet", about("walker.foot_radius_m", 0.2), *shared),
        ("kneed-level", about("push_off.impulse_N_s", 0.2, 0.01), f"strides={strides}"),
        ("kneed-round-feet", "walker.knee.lock=compliant", about("walker.knee.stop_damping", 5.0), *shared),
        ("kneed-round-feet", PADS, "walker.knee.release=touch", *shared),
    )
    return kinds[seed % len(kinds)]


def run_kneed(name, *sets):
    """Run the ADAMS files of a kneed walker. Return the times of touches and of locks, and our walk."""
    dataset, commands = files_of("adm", "functions", name, *sets).files.values()
    config, start = with_gait(name, *sets)
    events = Dataset(dataset).run(commands)
    touches, locks = (
        np.array([time for sensor, time in events if sensor.endswith(ending)]) for ending in ("touches", "straight")
    )
    return touches, locks, prepare_export(add_stops(config), start).walk


def touches_of(dataset, export, count):
    """Integrate the model from the initial conditions in its text. Return the times at which a foot touches ahead of
    the other.
    """
    names = export.names[export.hip_link], export.names[0]
    parts = [next(k for k, part in dataset.parts.items() if part.label == name) for name in names]
    marked = {dataset.markers[s.id].part: s.id for s in dataset.of("MARKER") if s.label == "foot"}
    feet = [marked[part] for part in parts]
    radii = 1000.0 * export.scene.ours.whole.radius

    def sinking(foot):
        def height(t, q, u):
            return dataset.place(q, feet[foot])[0][1] - radii[foot]

        height.direction = -1.0
        return height

    end = export.touches_s[count - 1] + 1e-3
    solution = dataset.integrate(end, 1e-10, 1e-10, (sinking(0), sinking(1)), "LSODA")
    assert solution.success
    times = []
    for foot, events in enumerate(zip(solution.t_events, solution.y_events, strict=True)):
        for time, y in zip(*events, strict=True):
            ahead = dataset.place(y[: y.size // 2], feet[foot])[0] - dataset.place(y[: y.size // 2], feet[1 - foot])[0]
            if ahead[0] > 0.25 * 1000.0 * export.scene.ground.terrain.pitch and time > 0.1:
                times.append((time, foot))
    times.sort()
    # A leading foot that bounces touches again before it is the turn of the other foot.
    return np.array([time for k, (time, foot) in enumerate(times) if k == 0 or times[k - 1][1] != foot])
