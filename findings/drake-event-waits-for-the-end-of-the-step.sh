#!/usr/bin/env bash
# Drake 1.51.1: with fixed steps an impact happens at the end of the step, until the *context* has an accuracy.
#
# What one would guess: a witness function (of a heel strike, say) is located within the step, as it is for every integrator.
# How finely is set by SimulatorConfig.accuracy, the only accuracy of a simulation that its users see.
# What happens: a fixed-step run finds no instant at all: a ball that is dropped from 1 m with runge_kutta5 and steps of 10 ms
# bounces 8 ms late, 38 mm below the ground, whatever `accuracy` says. Errors are of order one whatever the integrator.
# context.SetAccuracy(any value), which fixed steps otherwise ignore, switches the search on: 1e-2 gives 2 micrometres.
# With error control the same call is required, the error says so, and its value, not the integrator's accuracy, decides:
# with 1e-2 the ball is 0.3 mm deep even if the integrator works with 1e-8.
# Versions: drake 1.51.1, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check drake==1.51.1 numpy==2.2.6
cat > bounce.py <<'EOF'
from importlib.metadata import version

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import LeafSystem, UnrestrictedUpdateEvent, WitnessFunctionDirection

FALL_S = np.sqrt(2 / 9.81)


class Ball(LeafSystem):
    """A ball that falls from 1 m and bounces at height zero."""

    def __init__(self):
        super().__init__()
        self.DeclareContinuousState(1, 1, 0)
        self.bounces = []
        self.ground = self.MakeWitnessFunction(
            "ground",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            lambda context: context.get_continuous_state_vector()[0],
            UnrestrictedUpdateEvent(self.bounce),
        )

    def DoCalcTimeDerivatives(self, context, derivatives):
        speed = context.get_continuous_state_vector()[1]
        derivatives.get_mutable_vector().SetFromVector([speed, -9.81])

    def DoGetWitnessFunctions(self, context):
        return [self.ground]

    def bounce(self, context, event, state):
        height, speed = context.get_continuous_state_vector().CopyToVector()
        self.bounces.append((context.get_time(), height))
        state.get_mutable_continuous_state().get_mutable_vector().SetFromVector([height, -speed])


def first_bounce(scheme, step_s, has_error_control, accuracy, context_accuracy):
    ball = Ball()
    simulator = Simulator(ball)
    config = SimulatorConfig(
        integration_scheme=scheme, max_step_size=step_s, use_error_control=has_error_control, accuracy=accuracy
    )
    ApplySimulatorConfig(config, simulator)
    context = simulator.get_mutable_context()
    context.SetContinuousState([1.0, 0.0])
    if context_accuracy:
        context.SetAccuracy(context_accuracy)
    simulator.Initialize()
    simulator.AdvanceTo(0.6)
    time, height = ball.bounces[0]
    print(f"{scheme} {step_s * 1e3:.0f} ms, error control {has_error_control}, accuracy {accuracy}, of the context", end=" ")
    print(f"{context_accuracy}: expected 0 ms late, 0 mm deep, actual {(time - FALL_S) * 1e3:.4f} ms, {-height * 1e3:.4f} mm")
    return -height


print("drake", version("drake"))
for scheme in ("runge_kutta2", "runge_kutta3", "runge_kutta5"):
    for accuracy in (1e-2, 1e-8):
        depth = first_bounce(scheme, 0.01, False, accuracy, None)
        assert abs(depth - 0.0379) < 1e-4, "behaviour has changed"
assert abs(first_bounce("runge_kutta5", 0.003, False, 1e-2, None) - 0.00655) < 1e-4, "behaviour has changed"
assert first_bounce("runge_kutta5", 0.01, False, 1e-2, 1e-2) < 1e-5, "behaviour has changed"
assert 1e-4 < first_bounce("runge_kutta3", 0.1, True, 1e-8, 1e-2) < 1e-3, "behaviour has changed"
assert first_bounce("runge_kutta3", 0.1, True, 1e-8, 1e-6) < 1e-7, "behaviour has changed"
try:
    first_bounce("runge_kutta3", 0.1, True, 1e-8, None)
except RuntimeError as error:
    print("error control without an accuracy of the context:", str(error)[:95])
else:
    raise AssertionError("behaviour has changed")
EOF
venv/bin/python bounce.py
