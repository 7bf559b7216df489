#!/usr/bin/env bash
# nolds gives another Lyapunov exponent at each call, and yet another one if scikit-learn is not installed.
#
# What one would guess: lyap_r is Rosenstein's method, as studies of the stability of gait use it: a straight line fitted to the
# mean logarithmic divergence. One series with one set of arguments has one exponent, whatever else is installed.
# What happens: the line is fitted by RANSAC, which draws random numbers from NumPy's global state. Of 20 calls on one series of
# 1,000 values of the logistic map (exponent ln 2 = 0.693 per step) some give 0.66, others 0.07. RANSAC takes for outliers either
# the rise or the plateau after it, which the default of 20 steps includes. In an environment without scikit-learn the same call
# is a fit by least squares, 0.35, with a RuntimeWarning. hurst_rs scatters, too.
# Instead: fit="poly" and a trajectory_len that ends before the plateau: with 6 steps, 0.693 at each call.
# Versions: nolds 0.6.2 (0.6.3 cannot be imported by Python 3.11: its issue 80), scikit-learn 1.9.1, numpy 2.4.6, November 2026.
# Source: issues 22 and 71 of nolds. In the latter, still open, least squares shall become the default for results to be repeated.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check nolds==0.6.2 numpy==2.4.6
cat > exponent.py <<'EOF'
import sys
import warnings
from importlib.metadata import version

import nolds
import numpy as np

warnings.simplefilter("ignore")


def logistic_map(steps):
    series = np.empty(steps)
    value = 0.4
    for step in range(steps):
        value = 4 * value * (1 - value)
        series[step] = value
    return series


series = logistic_map(1000)
exponents = []
for seed in range(20):
    np.random.seed(seed)
    exponents.append(nolds.lyap_r(series, emb_dim=2, lag=1))
short = [nolds.lyap_r(series, emb_dim=2, lag=1, trajectory_len=6, fit="poly") for _ in range(3)]
print(f"nolds {version('nolds')}, {sys.argv[1]}: expected one value, actual {np.unique(np.round(exponents, 3))}")
print(f"  fit='poly', trajectory_len=6: {np.unique(np.round(short, 3))}; true {np.log(2):.3f}")
assert np.ptp(short) == 0 and abs(short[0] - np.log(2)) < 0.005, "behaviour has changed"
if sys.argv[1] == "without scikit-learn":
    assert np.ptp(exponents) == 0 and 0.3 < exponents[0] < 0.4, "behaviour has changed"
else:
    assert min(exponents) < 0.1 and max(exponents) > 0.6, "behaviour has changed"
EOF
venv/bin/python exponent.py "without scikit-learn"
venv/bin/pip install -q --disable-pip-version-check scikit-learn==1.9.1 scipy==1.17.1
venv/bin/python exponent.py "with scikit-learn 1.9.1"
