"""Motions for the page's player: joints, ground forces, slip and energies, with fewer samples than were stored."""

import base64
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import RigidConfig
from walkerlab.pipeline.store.content import Group

SAMPLES_A_SECOND = 150
LEG_INDICES = (0, 1)
WALKER_CHANNELS = {
    "time": "t", "hip_along_m": "hx", "hip_height_m": "hy", "torso_angle": "u", "stance_leg": "s",
    "kinetic_J": "ke", "potential_J": "pe", "mechanical_J": "me",
}  # fmt: skip
LEG_CHANNELS = {
    "foot_along_m": "fx", "foot_height_m": "fy", "knee_along_m": "kx", "knee_height_m": "ky",
    "angle": "a", "velocity": "v", "shank_angle": "b",
    "normal_force_N": "n", "friction_force_N": "d", "penetration_m": "p",
}  # fmt: skip
"""Channel of each stored variable that has a value for each leg. The leg's index is appended to the channel's name."""

Array = NDArray[np.float64]
Channels = dict[str, Array]


@dataclass(frozen=True, eq=False)
class Track:
    """The motion of one walker, with an array for each channel."""

    # Channels by name, all of the same length. A final digit is the index of the leg.
    # t           time (s)
    # hx, fx, kx  positions of the hip, of the lowest points of the feet and of the knees, along the slope (m)
    # hy, fy, ky  heights of these points above the slope (m)
    # a, v        angle and angular velocity of the legs or thighs (rad, rad/s)
    # b, u        angles of the shanks and of the torso (rad)
    # s           stance leg
    # n, d        normal force and friction (N)
    # p, q        penetration, and slip since touchdown (m)
    # ke, pe, me  kinetic, potential and mechanical energy (J)
    channels: Channels

    def __getitem__(self, name: str) -> Array:
        return self.channels[name]

    @property
    def end(self) -> float:
        return float(self["t"][-1])

    def cut(self, time: float) -> "Track":
        """Return the part of the motion up to a time (s)."""
        inside = self["t"] <= time + 1e-9
        return Track({name: values[inside] for name, values in self.channels.items()})

    def thin(self, gap: float) -> "Track":
        """Keep the first and the most loaded sample of each interval of `gap` s, and both sides of every jump."""
        time = self["t"]
        first = np.flatnonzero(np.diff(np.floor(time / gap).astype(np.int64), prepend=-1))
        # A heel strike has two samples with the same time, before and after it.
        jumps = np.flatnonzero(np.diff(time) <= 0.0)
        samples = {*first.tolist(), *jumps.tolist(), *(jumps + 1).tolist(), time.size - 1}
        if "n0" in self.channels:
            load = self["n0"] + self["n1"]
            ends = [*first[1:].tolist(), time.size]
            samples |= {begin + int(load[begin:end].argmax()) for begin, end in zip(first.tolist(), ends, strict=True)}
        chosen = sorted(samples)
        return Track({name: values[chosen] for name, values in self.channels.items()})

    def pack(self) -> str:
        """Encode all channels, one after the other, as little-endian float32 in base64."""
        return base64.b64encode(np.concatenate(list(self.channels.values())).astype("<f4").tobytes()).decode()


def track_in(trajectory: Group | None) -> Track | None:
    """Read the motion from a stored trajectory, or return None if it lacks joint positions."""
    if trajectory is None or "hip_along_m" not in trajectory.variables or trajectory["time"].size < 2:
        return None
    names = trajectory.variables.keys()
    channels = {channel: trajectory[name] for name, channel in WALKER_CHANNELS.items() if name in names}
    if "stance_leg" in names:
        channels[WALKER_CHANNELS["stance_leg"]] = trajectory["stance_leg"] - 1
    by_leg = {name: channel for name, channel in LEG_CHANNELS.items() if name in names}
    channels |= {f"{channel}{leg}": trajectory[name][:, leg] for name, channel in by_leg.items() for leg in LEG_INDICES}
    if {"penetration_m", "slip_velocity_m_s"} <= names:
        for leg in LEG_INDICES:
            touching = trajectory["penetration_m"][:, leg] > 0.0
            velocity = trajectory["slip_velocity_m_s"][:, leg]
            channels[f"q{leg}"] = slip_since_touch(trajectory["time"], velocity, touching)
    return Track({name: np.asarray(values, dtype=np.float64) for name, values in channels.items()})


def slip_since_touch(time: Array, velocity: Array, touching: NDArray[np.bool_]) -> Array:
    """Return how far (m) a foot has slipped since it last touched down, or zero while the foot is in the air."""
    sliding = np.where(touching, velocity, 0.0)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (sliding[1:] + sliding[:-1]) * np.diff(time))))
    begins = touching & ~np.concatenate(([False], touching[:-1]))
    last_begin = np.maximum.accumulate(np.where(begins, np.arange(time.size), 0))
    return np.where(touching, way - way[last_begin], 0.0)


def sampling_gap(config: RigidConfig) -> float:
    """Return the time between samples (s), in proportion to the leg's pendulum time, because small walkers move
    faster."""
    return math.sqrt(9.81 / config.gravity_m_s2 * config.walker.leg_length_m) / SAMPLES_A_SECOND
