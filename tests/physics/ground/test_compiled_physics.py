"""Check that machine code gives the same motion as the Python code from which it is compiled."""

import ground_walkers as ground
import numpy as np
import pytest
from system_rates import gradient_of, rate_of

from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.solvers.scipy_methods import jacobian_matrix, right_hand_side


def states_on_ground(walker, count):
    generator = np.random.default_rng(7)
    for _ in range(count):
        yield ground.placed(
            walker,
            int(generator.integers(2)),
            generator.choice([-0.01, 3e-5, 2e-4]),
            generator.uniform(-1.2, 1.2, 2),
            generator.uniform(-3.0, 3.0, 2),
            generator.choice([-1.5, -0.4, 0.01, 0.5]),
            generator.uniform(-0.05, 0.05),
        )


def check(system, state):
    y = np.array(state)
    rate, J = np.zeros(y.size), np.zeros((y.size, y.size))
    right_hand_side(system, 0.0, y, rate)
    jacobian_matrix(system, 0.0, y, J)
    expected, K = np.array(rate_of(system, state)), gradient_of(system, state)
    # A fused multiply-add rounds once where Python rounds twice, and the stiffness magnifies the rounding of the
    # height.
    assert np.abs(rate - expected).max() <= 1e-10 * (1.0 + np.abs(expected).max())
    assert np.abs(J - K).max() <= 1e-10 * (1.0 + np.abs(K).max())


@pytest.mark.parametrize("has_ground", [(True, True), (False, True), (False, False)])
def test_compiled_contact_walker_agrees_with_python(has_ground):
    walker = ground.compass(inertia=0.1)
    for state in states_on_ground(walker, 40):
        check(place_on_ground(walker, has_ground), state)


@pytest.mark.parametrize("has_ground", [False, True])
def test_compiled_pinned_walker_agrees_with_python(has_ground):
    walker = ground.compass()
    for state in states_on_ground(walker, 20):
        check(place_on_ground(walker, (has_ground, True), pinned=True), (*state[2:4], *state[6:]))
