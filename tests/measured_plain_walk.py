"""Synthetic measurements of walks by the plain integration, which shares no code with the estimation of parameters."""

import numpy as np
from plain_rigid_walk import plain_walk

from walkerlab.outcome import Outcome
from walkerlab.physics.mechanics.rigid_model import STANCE, SWING


def measure_steps(walker, start, rng, steps=20, roughness=1e-4, noise=1e-3):
    """Return periods (s) and lengths (m) of steps over a rough floor, measured with noise.

    start      state just after a heel strike
    roughness  standard deviation of the footholds' heights, m
    noise      standard deviation of the measurement, s and m
    """
    strikes, outcome, lengths = plain_walk(walker, start, rng.normal(0.0, roughness, steps + 1))
    assert outcome is Outcome.WALKED
    periods = np.diff(strikes[:, 0], prepend=0.0)
    return periods + rng.normal(0.0, noise, steps), np.array(lengths) + rng.normal(0.0, noise, steps)


def measure_angles(walker, start, rng, steps=10, rate_change=0.0, noise=3.5e-3, rate_hz=240.0):
    """Return times (samples,), angles (samples, 2) of both legs with noise (rad), and heel strikes (steps + 1,) in s.

    rate_change  standard deviation of the relative change of each rate at each heel strike

    The leg that swings first comes first.
    """
    pieces = []

    def disturb(y):
        n = len(y) // 2
        return np.append(y[:n], y[n:] * (1.0 + rng.normal(0.0, rate_change, n)))

    strikes, outcome, _ = plain_walk(walker, start, np.zeros(steps + 1), disturb=disturb, pieces=pieces)
    assert outcome is Outcome.WALKED
    times = np.arange(0.0, strikes[-1, 0], 1.0 / rate_hz)
    piece = np.searchsorted([part.t[-1] for part in pieces], times)
    angles = np.array([pieces[at].sol(t)[[SWING, STANCE]] for at, t in zip(piece, times, strict=True)])
    swapped = np.searchsorted(strikes[:, 0], times) % 2 == 1
    angles[swapped] = angles[swapped, ::-1]
    return times, angles + rng.normal(0.0, noise, angles.shape), np.append(0.0, strikes[:, 0])


def measure_limp(plain, start, rng, steps=20, roughness=1e-4, noise=1e-3):
    """Return periods (s) and lengths (m) of the steps of a plain unequal walker over a rough floor, with noise."""
    walked, _ = plain.stride(start, rng.normal(0.0, roughness, steps))
    return (walked + rng.normal(0.0, noise, walked.shape)).T


def measure_limping_angles(plain, start, rng, steps=10, noise=3.5e-3, rate_hz=240.0):
    """Return times (samples,) and angles (samples, 2) from the vertical of leg 1 and leg 2 with noise (rad).

    plain  an unequal walker without knees
    """
    swings = []
    walked, _ = plain.stride(start, [0.0] * steps, swings=swings)
    touches = np.append(0.0, np.cumsum(walked[:, 0]))
    times = np.arange(0.0, touches[-1], 1.0 / rate_hz)
    step = np.searchsorted(touches, times, "right") - 1
    angles = np.array([swings[k](t - touches[k])[[k % 2, 1 - k % 2]] for k, t in zip(step, times, strict=True)])
    return times, angles - plain.slope + rng.normal(0.0, noise, angles.shape)
