#!/usr/bin/env bash
# A walk that starts on its own Poincare section returns at once in four integrators, and after a period in the fifth.
#
# What one would guess: the return map of an orbit starts on the section and finds the *next* crossing. An event that is zero
# at the start has not crossed anything, so all integrators skip it.
# What happens, for an oscillator that starts at x = 0 with v > 0, and the terminal event x = 0 upwards:
#   SciPy, CyRK, diffrax, heyoka   stop at t = 0; the map is the identity, every gait is a fixed point, and all say success
#   CVODE (scikit-SUNDAE)          stops at t = 2 pi
# Worse in practice: the state at a found event is zero but for rounding, so a map that is iterated repeats some of its steps.
# From x = -1e-17 all five stop at once, from x = +1e-17 none does.
# Instead: integrate a little way off the section before the event is watched, or watch for the opposite crossing first.
# Versions: scipy 1.17.1, CyRK 0.20.0, diffrax 0.7.2 (jax 0.10.2), heyoka 7.13.2, scikit-sundae 1.2.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check scipy==1.17.1 CyRK==0.20.0 diffrax==0.7.2 optimistix==0.1.0 jax==0.10.2 \
    heyoka==7.13.2 scikit-sundae==1.2.0 numpy==2.4.6
cat > section.py <<'EOF'
from importlib.metadata import version

import CyRK
import diffrax
import heyoka
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from scipy.integrate import solve_ivp
from sksundae.cvode import CVODE

jax.config.update("jax_enable_x64", True)
TOLERANCE = 1e-9
END = 10.0


def with_scipy(start):
    def crossing(t, y):
        return y[0]

    crossing.terminal = True
    crossing.direction = 1
    walk = solve_ivp(
        lambda t, y: [y[1], -y[0]], (0, END), start, method="DOP853", events=crossing, rtol=TOLERANCE, atol=TOLERANCE
    )
    assert walk.success
    return walk.t_events[0][0]


def with_cyrk(start):
    def crossing(t, y):
        return y[0]

    crossing.terminal = True
    crossing.direction = 1
    walk = CyRK.pysolve_ivp(
        lambda t, y: np.array([y[1], -y[0]]),
        (0.0, END),
        np.array(start),
        method="DOP853",
        events=(crossing,),
        rtol=TOLERANCE,
        atol=TOLERANCE,
    )
    assert walk.success
    return walk.t_events[0][0]


def with_diffrax(start):
    walk = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda t, y, args: jnp.array([y[1], -y[0]])),
        diffrax.Dopri8(),
        0.0,
        END,
        None,
        jnp.array(start),
        stepsize_controller=diffrax.PIDController(rtol=TOLERANCE, atol=TOLERANCE),
        event=diffrax.Event(lambda t, y, args, **kw: y[0], optimistix.Newton(1e-10, 1e-10), direction=True),
    )
    return float(walk.ts[-1])


def with_heyoka(start):
    x, v = heyoka.make_vars("x", "v")
    upwards = heyoka.t_event(x, direction=heyoka.event_direction.positive)
    walk = heyoka.taylor_adaptive([(x, v), (v, -x)], start, t_events=[upwards])
    walk.propagate_until(END)
    return walk.time


def with_cvode(start):
    def rates(t, y, dy):
        dy[:] = y[1], -y[0]

    def crossing(t, y, events):
        events[0] = y[0]

    crossing.terminal = [True]
    crossing.direction = [1]
    solver = CVODE(rates, rtol=TOLERANCE, atol=TOLERANCE, eventsfn=crossing, num_events=1)
    walk = solver.solve([0, END], np.array(start))
    return float(np.ravel(walk.t_events)[0])


print({name: version(name) for name in ("scipy", "CyRK", "diffrax", "heyoka", "scikit-sundae")})
ON_SECTION = [0.0, 1.0]
AFTER_SECTION = [1e-17, 1.0]
BEFORE_SECTION = [-1e-17, 1.0]
for name, integrate, expected in (
    ("SciPy", with_scipy, 0.0),
    ("CyRK", with_cyrk, 0.0),
    ("diffrax", with_diffrax, 0.0),
    ("heyoka", with_heyoka, 0.0),
    ("CVODE", with_cvode, 2 * np.pi),
):
    on = integrate(ON_SECTION)
    after = integrate(AFTER_SECTION)
    before = integrate(BEFORE_SECTION)
    print(f"{name:8s} expected t = 6.2832 (2 pi); from x = 0: t = {on:.4f}; 1e-17: t = {after:.4f}; -1e-17: t = {before:.4f}")
    assert abs(on - expected) < 1e-5, "behaviour has changed"
    assert abs(after - 2 * np.pi) < 1e-5 and abs(before) < 1e-5, "behaviour has changed"
EOF
venv/bin/python section.py
