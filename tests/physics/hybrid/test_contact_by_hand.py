"""Compare the first contact step with SciPy's solution of docs/theory.md, written anew with the hip as root."""

import numpy as np
import pytest
from contact_walks import FIXED_POINT, RIGID_STEP, walked
from scipy.integrate import solve_ivp

LEG, B, LEG_MASS, HIP_MASS, RADIUS, GRAVITY, SLOPE = 1.0, 0.5, 5.0, 10.0, 0.001, 9.81, np.pi / 180.0
STIFFNESS, EXPONENT, DAMPING, FULL = 1e5 * 1000.0**2.2, 2.2, 9e4, 1e-4
STATIC, DYNAMIC, STICTION, SLIDING = 0.9, 0.7, 0.1, 1.0
WEIGHT = GRAVITY * np.array([np.sin(SLOPE), -np.cos(SLOPE)])


def cubic(x, x0, h0, x1, h1):
    share = np.clip((x - x0) / (x1 - x0), 0.0, 1.0)
    return h0 + (h1 - h0) * share**2 * (3.0 - 2.0 * share)


def friction(slip):
    if abs(slip) <= STICTION:
        return cubic(slip, -STICTION, -STATIC, STICTION, STATIC)
    return np.sign(slip) * cubic(abs(slip), STICTION, STATIC, SLIDING, DYNAMIC)


def upward(angle):
    """Return the direction from foot to hip along a leg and its derivative by the angle, in axes along and normal to
    the slope.
    """
    return np.array([-np.sin(angle + SLOPE), np.cos(angle + SLOPE)]), -np.array(
        [np.cos(angle + SLOPE), np.sin(angle + SLOPE)]
    )


def foot(y, leg):
    """Return the centre of a foot's ball and the velocity of its lowest point. y has the hip's position, the angles,
    and their rates.
    """
    up, turned = upward(y[2 + leg])
    centre = y[:2] - (LEG - RADIUS) * up
    return centre, y[4:6] + y[6 + leg] * (np.array([RADIUS, 0.0]) - (LEG - RADIUS) * turned)


def on_pad(leg, along):
    """Whether a foot is over its pads, which are as long as a step. The swing leg has them one step behind the start
    and at every second step from there.
    """
    from_middle = (along + (RIGID_STEP if leg == 0 else 0.0)) % (2.0 * RIGID_STEP)
    return min(from_middle, 2.0 * RIGID_STEP - from_middle) <= 0.5 * RIGID_STEP


def motion(_t, y):
    mass = np.diag([HIP_MASS + 2.0 * LEG_MASS] * 2 + [LEG_MASS * B**2] * 2)
    force = np.append((HIP_MASS + 2.0 * LEG_MASS) * WEIGHT, [0.0, 0.0])
    for leg in range(2):
        up, turned = upward(y[2 + leg])
        lever, towards_hip = -B * turned, B * up * y[6 + leg] ** 2
        mass[2 + leg, :2] = mass[:2, 2 + leg] = LEG_MASS * lever
        force[:2] -= LEG_MASS * towards_hip
        force[2 + leg] += LEG_MASS * lever @ (WEIGHT - towards_hip)
        centre, velocity = foot(y, leg)
        depth = RADIUS - centre[1]
        if depth > 0.0 and on_pad(leg, centre[0]):
            normal = max(0.0, STIFFNESS * depth**EXPONENT - DAMPING * cubic(depth, 0.0, 0.0, FULL, 1.0) * velocity[1])
            push = np.array([-friction(velocity[0]) * normal, normal])
            arm = centre - np.array([0.0, RADIUS]) - y[:2]
            force[:2] += push
            force[2 + leg] += arm[0] * push[1] - arm[1] * push[0]
    return np.concatenate([y[4:], np.linalg.solve(mass, force)])


def swing_foot_comes_down(_t, y):
    centre, _ = foot(y, 0)
    return centre[1] - RADIUS if centre[0] > 0.5 * RIGID_STEP else 1.0


swing_foot_comes_down.terminal, swing_foot_comes_down.direction = True, -1.0


def test_first_step_ends_as_hand_formulas_predict():
    y = np.array([0.0, 0.0, *FIXED_POINT[:2], 0.0, 0.0, *FIXED_POINT[2:]])
    centre, velocity = foot(y, 1)
    y[:2] += np.array([0.0, RADIUS]) - centre
    y[4:6] -= velocity
    run = solve_ivp(motion, (0.0, 1.0), y, "Radau", rtol=1e-9, atol=1e-11, events=swing_foot_comes_down, max_step=5e-3)
    step = walked(steps=1, tolerance=1e-9)
    # ten times the tolerance requested from SciPy
    assert run.t[-1] == pytest.approx(step.touch_time_s[0], abs=1e-8)
    assert foot(run.y[:, -1], 0)[0][0] == pytest.approx(step.touch_along_m[0], abs=1e-8)
    assert run.y[2:4, -1] == pytest.approx(step.end_state[2:4], abs=1e-8)
    assert run.y[6:, -1] == pytest.approx(step.end_state[6:], abs=1e-8)
