"""The swing of the kneed walker, its stance foot pinned and its knee free, by every engine that is installed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.benchmarks.engines.adapter import Stepping
from walkerlab.benchmarks.engines.planar import HINGED, chain_of, planar_model
from walkerlab.benchmarks.engines.registry import ENGINES
from walkerlab.benchmarks.engines.runs import SwingTask
from walkerlab.mechanics.parts import Particle
from walkerlab.mechanics.rigid import standing
from walkerlab.mechanics.standing import rates
from walkerlab.mechanics.walkers import Arc, Limb, kneed_legs

THIGH, SHANK, HIP_MASS = Limb(0.5, 0.5, 0.325, 0.01, 0.004), Limb(0.5, 0.05, 0.125, -0.01, 0.0008), 0.5
GRAVITY, SLOPE = 9.81, 0.0504
# swing thigh, stance leg, swing shank: just after the heel strike of its gait
START = np.array((-0.289, 0.188, -0.289, -0.0571481063, -1.1095873312, -0.0571481063))
SWING_S, COARSE_S = 0.24, 4e-3
KNEED = kneed_legs(THIGH, SHANK, HIP_MASS, Arc())


def with_a_straight_stance_leg():
    """The parts with the stance leg made one body of its thigh and shank."""
    thigh, shank = (next(body for body in KNEED.bodies if body.name == f"{name} 2") for name in ("thigh", "shank"))
    at = np.array(shank.centre_m) - (0.0, THIGH.length_m)
    whole = thigh.mass_kg + shank.mass_kg
    centre = (thigh.mass_kg * np.array(thigh.centre_m) + shank.mass_kg * at) / whole
    apart = thigh.mass_kg * shank.mass_kg / whole * float(((at - thigh.centre_m) ** 2).sum())
    leg = replace(
        thigh, mass_kg=whole, centre_m=tuple(centre), inertia_kg_m2=thigh.inertia_kg_m2 + shank.inertia_kg_m2 + apart
    )
    kept = {body.name: body for body in KNEED.bodies}
    foot = replace(KNEED.feet[1], body="thigh 2", centre_m=(0.0, -THIGH.length_m - SHANK.length_m))
    return replace(
        KNEED,
        bodies=(kept["thigh 1"], leg, kept["shank 1"]),
        joints=KNEED.joints[:2],
        feet=(KNEED.feet[0], foot),
        knees=KNEED.knees[:1],
        legs=(KNEED.legs[0], KNEED.legs[1][:1]),
        particles=(Particle("hip", HIP_MASS, "thigh 2", (0.0, 0.0)),),
    )


@pytest.fixture(scope="module")
def ours():
    """State at the swing's end, by our rates and a library's method."""
    model = standing(KNEED, GRAVITY, SLOPE)

    def derivative(_, y):
        return (*y[3:], *rates(model, model.bent, tuple(y)))

    return solve_ivp(derivative, (0.0, SWING_S), START, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


@pytest.mark.parametrize("name", ENGINES)
def test_the_swing_with_a_free_knee_converges_to_ours_with_the_order_that_is_promised(name, ours):
    engine = ENGINES[name]
    pytest.importorskip(engine.module, reason=f"{name} is not installed: {engine.install_line}")
    parts = with_a_straight_stance_leg()
    model = planar_model(parts, "thigh 2", parts.feet[1].centre_m, HINGED, GRAVITY, SLOPE)
    chain = chain_of(parts, "thigh 2")
    for integrator, entry in engine.adapter().INTEGRATORS.items():
        if entry.adapts:
            continue
        errors = []
        for step_s in (COARSE_S, 0.5 * COARSE_S):
            task = SwingTask(name, Stepping(integrator, step_s), model, chain, SLOPE, START, SWING_S, 10_000)
            errors.append(float(np.max(np.abs(task.run().end - ours))))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(entry.order, abs=0.25), integrator
