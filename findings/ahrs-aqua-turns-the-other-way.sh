#!/usr/bin/env bash
# In the package ahrs, the filter AQUA gives the inverse rotation of all its other filters.
#
# What one would guess: filters of one package that take the same arguments, gyr and acc, answer the same question, so one can
# be put in place of another.
# What happens: for a leg that swings by 20 degrees about y, Madgwick, Mahony, Complementary, EKF, UKF and Tilt of ahrs 0.4.0
# give quaternions that turn the sensor's axes into the earth's: +20 degrees. AQUA's turn the earth's axes into the
# sensor's: -20 degrees, sample by sample. imufusion 1.3.3 agrees with the majority. Shank angles, knee angles and gravity
# removed from accelerations get the wrong sign; while the leg hangs, nothing shows.
# Instead: take the conjugate of AQUA's quaternion, w and -x, -y, -z.
# Versions: AHRS 0.4.0, imufusion 1.3.3, numpy 2.4.6, November 2026. Source: the paper on AQUA (Valenti et al. 2015) defines
# the orientation of the earth's frame in the sensor's, and the package keeps that.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check AHRS==0.4.0 imufusion==1.3.3 numpy==2.4.6
cat > swing.py <<'EOF'
from importlib.metadata import version

import ahrs
import imufusion
import numpy as np

RATE_HZ = 100.0
times = np.arange(0, 20, 1 / RATE_HZ)
angle = np.radians(20) * np.sin(np.pi * times)
rate = np.radians(20) * np.pi * np.cos(np.pi * times)
zero = np.zeros_like(times)
gyr = np.column_stack([zero, rate, zero])
acc = 9.81 * np.column_stack([-np.sin(angle), zero, np.cos(angle)])


def with_imufusion():
    filter_of_leg = imufusion.Ahrs()
    for turn, force in zip(gyr, acc):
        filter_of_leg.update_no_magnetometer(np.degrees(turn), force / 9.81)
        yield filter_of_leg.get_quaternion()


print({name: version(name) for name in ("AHRS", "imufusion")})
print("angle about y, as part of the true one after 5 s: expected 1.00 for each filter")
names = ("Madgwick", "Mahony", "Complementary", "EKF", "UKF", "AQUA")
found = {f"ahrs {name}": getattr(ahrs.filters, name)(gyr=gyr, acc=acc, frequency=RATE_HZ).Q for name in names}
found["ahrs Tilt"] = ahrs.filters.Tilt(acc=acc).Q
found["imufusion"] = np.array(list(with_imufusion()))
settled = times > 5
for name, quaternions in found.items():
    about_y = 2 * np.arctan2(quaternions[settled, 2], quaternions[settled, 0])
    part = np.polyfit(angle[settled], about_y, 1)[0]
    print(f"{name:18s} {part:+.2f}")
    assert abs(part - (-1 if name == "ahrs AQUA" else 1)) < 0.05, "behaviour has changed"
EOF
venv/bin/python -W ignore swing.py
