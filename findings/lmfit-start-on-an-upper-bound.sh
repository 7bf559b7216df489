#!/usr/bin/env bash
# lmfit 1.3.4: a parameter that starts on its upper bound gives a wrong fit, and lmfit says that the fit succeeded.
#
# What one would guess: a start on the bound is a poor start. The fit either gets away from it, or stays there and says so,
# as scipy.optimize.least_squares does, which moves the start inside.
# What happens: with both bounds lmfit fits arcsin of the scaled value, whose derivative is zero on a bound. Of 20 fits of a
# damping of 0.1 1/s that start at 1 with max=1, seven are wrong by more than 10 %, one gives 0.86, and standard errors are
# 8 times too large or more. All report `success`, 'Fit succeeded.' and error bars. From 0.999 all 20 find 0.1.
# Instead: start inside the bounds, and compare redchi with the noise that is known.
# Versions: lmfit 1.3.4, scipy 1.17.1, numpy 2.4.6, November 2026. Source: parameter.py, setup_bounds.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check lmfit==1.3.4 scipy==1.17.1 numpy==2.4.6
cat > swing.py <<'EOF'
import lmfit
import numpy as np
from scipy.optimize import least_squares

times = np.linspace(0, 10, 400)


def swing(t, amplitude, rate, damping):
    return amplitude * np.exp(-damping * t) * np.cos(rate * t)


def noisy_swing(seed):
    return swing(times, 0.3, 4.0, 0.1) + np.random.default_rng(seed).normal(0, 0.002, times.size)


def fit_from(start, angles):
    model = lmfit.Model(swing)
    parameters = model.make_params(amplitude=0.3, rate=4.02, damping={"value": start, "min": 0, "max": 1})
    return model.fit(angles, parameters, t=times)


def scipy_from(start, angles):
    bounds = ((-np.inf, -np.inf, 0), (np.inf, np.inf, 1))
    return least_squares(lambda p: swing(times, *p) - angles, (0.3, 4.02, start), bounds=bounds).x[2]


print(f"lmfit {lmfit.__version__}: a damping of 0.1 1/s, bounds 0 and 1 1/s, 20 noises of 0.002 rad")
walks = [noisy_swing(seed) for seed in range(20)]
from_inside = [fit_from(0.999, angles) for angles in walks]
on_bound = [fit_from(1.0, angles) for angles in walks]
from_scipy = [scipy_from(1.0, angles) for angles in walks]
for name, fits in (("start 0.999", from_inside), ("start 1.0", on_bound)):
    values = [fit.params["damping"].value for fit in fits]
    errors = [fit.params["damping"].stderr for fit in fits]
    print(f"{name:11s} damping {min(values):.3f} to {max(values):.3f}, expected 0.100;", end=" ")
    print(f"standard error {min(errors):.5f} to {max(errors):.5f}; all succeeded: {all(fit.success for fit in fits)}")
wrong = sum(abs(fit.params["damping"].value - 0.1) > 0.01 for fit in on_bound)
print(f"{wrong} of 20 fits from the bound are wrong by more than 10 %.")
print(f"SciPy's least_squares from the bound: damping {min(from_scipy):.3f} to {max(from_scipy):.3f}")
assert all(fit.success and fit.errorbars for fit in from_inside + on_bound), "behaviour has changed"
assert all(abs(fit.params["damping"].value - 0.1) < 1e-3 for fit in from_inside), "behaviour has changed"
assert np.allclose(from_scipy, 0.1, atol=1e-3), "SciPy from the same start"
assert wrong >= 3, "behaviour has changed"
EOF
venv/bin/python -W ignore swing.py
