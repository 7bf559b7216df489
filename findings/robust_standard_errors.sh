#!/usr/bin/env bash
# A user would guess: a fit with loss='soft_l1' states standard errors that match the scatter of its estimates, and SciPy
# and lmfit, which calls SciPy, state the same ones.
# What happens: with 10 % outliers of 20 standard deviations, scipy.optimize.curve_fit states errors 2.4 times and
# lmfit.Model.fit 7.4 times as large as the scatter of the very estimates that they return, while the estimates themselves
# are equal. lmfit takes the noise from the plain residuals, outliers included, and SciPy from the robust cost. Without
# outliers SciPy's errors are 1.1 times and lmfit's 1.3 times the scatter.
# Versions: SciPy 1.16.2 (optimize/_minpack_py.py, curve_fit: s_sq = cost / (M - N) with the cost of the loss),
# lmfit 1.3.4 (minimizer.py: redchi from the residuals, covariance from the Jacobian that SciPy has scaled for the loss).
set -euo pipefail
cd "$(mktemp -d)"
python3 -m venv venv
venv/bin/pip install --quiet numpy==2.3.3 scipy==1.16.2 lmfit==1.3.4
cat > errors.py <<'PYTHON'
import lmfit
import numpy as np
import scipy
from scipy.optimize import curve_fit

NOISE, WALKS = 1e-3, 300


def line(x, a, b):
    return a + b * x


def by_scipy(x, y):
    values, covariance = curve_fit(line, x, y, (0.5, 0.0), method="trf", loss="soft_l1", f_scale=NOISE)
    return values, np.sqrt(np.diag(covariance))


def by_lmfit(x, y):
    options = {"loss": "soft_l1", "f_scale": NOISE}
    fit = lmfit.Model(line).fit(y, x=x, a=0.5, b=0.0, method="least_squares", fit_kws=options)
    return [fit.params[name].value for name in "ab"], [fit.params[name].stderr for name in "ab"]


def ratio(fit, outliers):
    rng, x = np.random.default_rng(0), np.linspace(0.0, 1.0, 40)
    values, errors = [], []
    for _ in range(WALKS):
        y = line(x, 0.7, 0.1) + rng.normal(0.0, NOISE, x.size)
        y[rng.choice(x.size, outliers, replace=False)] += 20.0 * NOISE * rng.choice([-1, 1], outliers)
        value, error = fit(x, y)
        values.append(value)
        errors.append(error)
    spread = np.std(values, axis=0, ddof=1)
    return float(np.mean(np.sqrt(np.mean(np.square(errors), axis=0)) / spread)), spread


print(f"SciPy {scipy.__version__}, lmfit {lmfit.__version__}: mean stated standard error over scatter of the estimates")
seen = {}
for outliers in (0, 4):
    for name, fit in (("curve_fit", by_scipy), ("lmfit", by_lmfit)):
        seen[name, outliers], spread = ratio(fit, outliers)
        print(f"{name}, {outliers} of 40 values are outliers: expected 1, got {seen[name, outliers]:.2f}; scatter {spread}")
assert seen["curve_fit", 4] > 2.0, "curve_fit states other errors now"
assert seen["lmfit", 4] > 5.0, "lmfit states other errors now"
PYTHON
venv/bin/python errors.py
