#!/usr/bin/env bash
# The Kalman filter of scikit-kinematics drifts off by 67 degrees on data without errors, and farther with a faster sensor.
#
# What one would guess: a Kalman filter weighs a prediction by the gyroscope against accelerometer and magnetometer. With exact
# data for all three it follows a swinging leg at least as well as Madgwick's and Mahony's filters of the same package, an error
# that it once has dies out, more samples per second help, and its argument D tunes it.
# What happens: for a leg that swings by 20 degrees once a second, imus.kalman is off by 48, 67 and 119 degrees after 10 s at 50,
# 100 and 400 Hz, and stays so. Madgwick, Mahony and imus.analytical follow within 2 degrees. After 2 s of rest it is off by 12
# degrees. D has no effect at all. Nothing is printed; angles look smooth and have the right period.
# Why: the correction is the gain times the difference between this measurement and the *one before*, not the prediction. So a
# constant measurement corrects nothing, and motion is counted twice. D is overwritten by 0.4 in the next lines.
# Instead: imus.Madgwick or imus.Mahony, sample by sample, or another package.
# Versions: scikit-kinematics 0.10.4 (the last for Python 3.11; 0.12.0 gives the same), numpy 2.4.6, November 2026.
# Source: issues 31 and 36 of scikit-kinematics, both open since 2019; issue 30, which asked for D.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check scikit-kinematics==0.10.4 numpy==2.4.6
cat > leg.py <<'EOF'
from importlib.metadata import version

import numpy as np
from skinematics import imus

SECONDS = 12
AMPLITUDE = np.radians(20)
FREQUENCY = 2 * np.pi


def leg(rate, rest=0.0):
    """Return the angle of a leg about y (rad) and what sensors in its hip measure: angular velocity, acceleration and north."""
    time = np.arange(0, SECONDS, 1 / rate)
    phase = FREQUENCY * np.clip(time - rest, 0, None)
    angle = AMPLITUDE * np.sin(phase)
    rate_of_angle = np.where(time < rest, 0, AMPLITUDE * FREQUENCY * np.cos(phase))
    nothing = np.zeros_like(time)
    gyroscope = np.column_stack([nothing, rate_of_angle, nothing])
    acceleration = 9.81 * np.column_stack([-np.sin(angle), nothing, np.cos(angle)])
    north = np.column_stack([np.cos(angle), nothing, np.sin(angle)])
    return angle, gyroscope, acceleration, north


def kalman(rate, gyroscope, acceleration, north, **options):
    return imus.kalman(rate, acceleration, gyroscope, north, **options)


def one_by_one(new_filter):
    def run(rate, gyroscope, acceleration, north):
        state = new_filter(rate)
        quaternions = []
        for sample in zip(gyroscope, acceleration, north, strict=True):
            state.Update(*sample)
            quaternions.append(np.array(state.Quaternion))
        return np.array(quaternions)

    return run


def analytical(rate, gyroscope, acceleration, north):
    return imus.analytical(np.eye(3), gyroscope, np.zeros(3), acceleration, rate)[0]


FILTERS = {
    "Madgwick": one_by_one(lambda rate: imus.Madgwick(rate=rate, Beta=0.1)),
    "Mahony": one_by_one(lambda rate: imus.Mahony(rate=rate)),
    "analytical": analytical,
    "kalman": kalman,
}


def largest_error(name, rate, rest=0.0):
    """Return the largest error of the angle (degrees) in the last two seconds."""
    angle, *measured = leg(rate, rest)
    quaternions = FILTERS[name](rate, *measured)
    error = np.degrees(2 * np.arctan2(quaternions[:, 2], quaternions[:, 0]) - angle)
    return np.abs((error + 180) % 360 - 180)[-2 * rate :].max()


print(f"scikit-kinematics {version('scikit-kinematics')}")
for name in ("Madgwick", "Mahony", "analytical"):
    error = largest_error(name, 100)
    print(f"{name:10s} at 100 Hz: error {error:6.2f} degrees")
    assert error < 2, "behaviour has changed"
for rate, rest, least in ((50, 0.0, 40), (100, 0.0, 60), (400, 0.0, 110), (100, 2.0, 10)):
    error = largest_error("kalman", rate, rest)
    print(f"kalman     at {rate} Hz after {rest:.0f} s of rest: expected below 2, actual {error:.2f} degrees")
    assert error > least, "behaviour has changed"
_, *measured = leg(100)
is_tuned = not np.array_equal(kalman(100, *measured), kalman(100, *measured, D=[0.004] * 3))
print(f"D changes the result: expected True, actual {is_tuned}")
assert not is_tuned, "behaviour has changed"
EOF
venv/bin/python leg.py
