"""Compare the swing with a free knee in every installed engine with that of the rigid model."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.evidence.benchmarks.engines.adapter import Stepping
from walkerlab.evidence.benchmarks.engines.registry import PHYSICS_ENGINES
from walkerlab.evidence.benchmarks.engines.runs import swing
from walkerlab.exchange.planar import PINNED, planar_model
from walkerlab.physics.mechanics.parts import Anchor
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.mechanics.rigid_model import BENT, STANCE, Mode
from walkerlab.physics.solvers.system import derivative
from walkerlab.scene.parts import Arc, Limb, kneed_legs

KNEED = kneed_legs(Limb(0.5, 0.5, 0.325, 0.01, 0.004), Limb(0.5, 0.05, 0.125, -0.01, 0.0008), 0.5, Arc())
GRAVITY, SLOPE = 9.81, 0.0504
# state of swing thigh, stance leg and swing shank just after the heel strike of a gait
START = (-0.289, 0.188, -0.289, -0.0571481063, -1.1095873312, -0.0571481063)
SWING_S, COARSE_S = 0.24, 4e-3


def body_by_body(y):
    """Return angles and velocities of both thighs and both shanks, with a straight stance leg."""
    return np.array((*y[:3], y[STANCE], *y[3:], y[3 + STANCE]))


@pytest.fixture(scope="module")
def ours():
    """Integrate our right-hand side with a library's method, and return the state at the end of the swing."""
    model = rigid_on_slope(KNEED, GRAVITY, SLOPE)

    def rate(t, y):
        f = np.zeros(6)
        derivative(Mode(model, BENT), t, y, f)
        return f

    return body_by_body(solve_ivp(rate, (0.0, SWING_S), START, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1])


@pytest.mark.parametrize("name", PHYSICS_ENGINES)
def test_free_knee_swing_converges_to_the_rigid_model_at_the_stated_order(name, ours):
    engine = PHYSICS_ENGINES[name]
    pytest.importorskip(engine.module, reason=f"{name} is not installed: {engine.install_line}")
    foot = KNEED.feet[STANCE]
    gravity = float(GRAVITY * np.sin(SLOPE)), float(GRAVITY * np.cos(SLOPE))
    model = planar_model(KNEED, Anchor(foot.body, foot.centre_m), PINNED, gravity, KNEED.knees[STANCE:])
    for integrator, entry in engine.adapter().INTEGRATORS.items():
        if entry.adapts:
            continue
        errors = []
        for step_s in (COARSE_S, 0.5 * COARSE_S):
            stepping = Stepping(integrator, step_s)
            end = swing(name, stepping, model, SLOPE, body_by_body(START), SWING_S, 10_000).end
            errors.append(float(np.max(np.abs(end - ours))))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(entry.order, abs=0.25), integrator
