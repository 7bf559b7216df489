"""Tests of the contact code on problems with known answers. The answers are checked by one more method."""

import math

import pytest
from scipy.integrate import solve_ivp

from walkerlab.evidence.verification import references
from walkerlab.evidence.verification.known_problems import PROBLEMS


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.args[0])
def test_contact_code_reproduces_known_answers(problem):
    answer = problem()
    assert answer.error <= answer.limit


def test_closed_form_of_the_bounce_agrees_with_integration():
    mass, stiffness, drop, gravity = 1.0, 1e4, 0.1, 9.81
    speed = math.sqrt(2.0 * gravity * drop)

    def out(_t, y):
        return y[0]

    out.terminal, out.direction = True, -1.0
    found = solve_ivp(
        lambda _t, y: (y[1], gravity - stiffness / mass * y[0]),
        (0.0, 1.0),
        (1e-15, speed),
        events=out,
        rtol=1e-11,
        atol=1e-13,
    )
    period = found.t[-1] + 2.0 * speed / gravity
    assert references.linear_bounce_period(mass, stiffness, drop, gravity) == pytest.approx(period, rel=1e-8)


def test_wheel_has_the_same_speed_at_every_impact():
    spokes, slope, gravity, inertia = 8, 0.08, 9.81, 1e-3
    half = math.pi / spokes
    after = references.wheel_speed(spokes, slope, gravity, inertia)
    before = math.sqrt(after**2 + 2.0 * gravity * (math.cos(half - slope) - math.cos(half + slope)) / (1.0 + inertia))
    kept = (math.cos(2.0 * half) + inertia) / (1.0 + inertia)
    assert kept * before == pytest.approx(after, rel=1e-12)
