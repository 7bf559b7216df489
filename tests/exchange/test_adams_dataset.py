"""Check the reader of ADAMS datasets that other tests use, on motions known from elsewhere."""

import math

import numpy as np
import pytest
from adams_dataset import Dataset
from scipy.special import ellipk

HEAD = (
    "a title\nUNITS/\n, FORCE = NEWTON\n, MASS = KILOGRAM\n, LENGTH = {}\n, TIME = SECOND\n"
    "PART/1\n, GROUND\nMARKER/1\n, PART = 1\n"
)
TAIL = "ACCGRAV/\n, IGRAV = 0\n, JGRAV = {}\n, KGRAV = 0\nEND\n"

# Revolute_Case01 as computed by ADAMS, rotated from the x-z to the x-y plane (projectchrono/chrono,
# data/testing/joints).
CHRONO = {1.0: (-0.892381, -1.78988), 2.0: (-1.95112, -0.439479), 4.0: (1.29696, -1.52246), 5.0: (-1.99968, -0.0355587)}
PENDULUM = """PART/2
, MASS = 1
, CM = 21
, IP = 0.04, 0.1, 0.1
MARKER/21
, PART = 2
, QP = 2, 0, 0
MARKER/22
, PART = 2
JOINT/1
, REVOLUTE
, I = 1
, J = 22
"""
BALL = """PART/2
, QG = 0, {height}, 0
, VX = 0, VY = {speed}, VZ = 0
, MASS = 2
, CM = 21
, IP = 1, 1, 1
MARKER/21
, PART = 2
MARKER/91
, PART = 1
, FLOATING
VARIABLE/1
, FUNCTION = {force}
GFORCE/1
, I = 21
, JFLOAT = 91
, RM = 1
, FX = 0\\
, FY = VARVAL(1)\\
, FZ = 0\\
, TX = 0\\
, TY = 0\\
, TZ = 0
"""


def pendulum(unit="METER", gravity=-9.80665):
    return Dataset(HEAD.format(unit) + PENDULUM + TAIL.format(gravity))


def ball(force, height=0.0, speed=0.0, gravity=0.0):
    return Dataset(HEAD.format("METER") + BALL.format(**locals()) + TAIL.format(gravity))


def test_pendulum_falls_as_adams_computed_it():
    dataset = pendulum()
    solution = dataset.integrate(5.0)
    for time, place in CHRONO.items():
        q = solution.sol(time)[:3]
        assert dataset.place(q, 21)[0] == pytest.approx(place, abs=1e-5)


def test_period_of_a_pendulum_is_the_elliptic_integral():
    dataset = pendulum()

    def lowest(t, q, u):
        return dataset.place(q, 21)[0][0]

    def still(t, q, u):
        return u[2]

    times = dataset.integrate(2.0, events=(lowest, still)).t_events
    quarter = math.sqrt((0.1 + 4.0) / (9.80665 * 2.0)) * ellipk(0.5)
    assert times[0][0] == pytest.approx(quarter, abs=1e-8)
    assert times[1][-1] == pytest.approx(2.0 * quarter, abs=1e-8)


def test_linear_contact_lasts_half_an_oscillation():
    k, m, v = 5e3, 2.0, 0.3
    dataset = ball(f"IMPACT(DY(21,1,1), VY(21,1,1,1), 1.0, {k}, 1.0, 0, 0.1)", height=1.0, speed=-v)

    def leaves(t, q, u):
        return q[1] - 1.0 if t > 1e-4 else -1.0

    leaves.direction = 1.0
    solution = dataset.integrate(0.1, events=(leaves,))
    assert solution.t_events[0][0] == pytest.approx(math.pi * math.sqrt(m / k), abs=1e-7)
    assert solution.y_events[0][0][4] == pytest.approx(v, abs=1e-7)


def test_ball_rests_where_the_force_equals_its_weight():
    # from k d^2.2 = m g, in millimetres
    text = HEAD.format("MILLIMETER") + BALL.format(
        height=1.0 - (2.0 * 9.80665 / 1e5) ** (1 / 2.2), speed=0.0,
        force="IMPACT(DY(21,1,1), VY(21,1,1,1), 1.0, 1.0E5, 2.2, 90, 0.1)",
    ) + TAIL.format(-9806.65)  # fmt: skip
    dataset = Dataset(text)
    q, u = dataset.start
    # In millimetres, a newton accelerates a kilogram by 1000 mm/s^2.
    assert dataset.rate(0.0, np.concatenate([q, u]))[4] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("IF(TIME - 2: 1, 2, 3)", 1.0), ("IF(2 - 2: 1, 2, 3)", 2.0), ("IF(IF(1: 5, 6, -7): 8, 9, 10)", 8.0),
        ("STEP(0.25, 0, 1, 1, 3)", 1.0 + 2.0 * 0.15625), ("STEP(-1, 0, 1, 1, 3)", 1.0), ("STEP(2, 0, 1, 1, 3)", 3.0),
        ("SIGN(2, -3)", -2.0), ("2**3 - 4*MAX(1, 2)", 0.0), ("COS(PI) + SQRT(4.0E+00)", 1.0),
    ],
)  # fmt: skip
def test_adams_expressions_are_evaluated_correctly(text, value):
    dataset = ball(text)
    assert dataset.value(dataset.variables[1], 0.0, *dataset.start) == pytest.approx(value)


def rate_at_start(text):
    dataset = Dataset(text)
    return dataset.rate(0.0, np.concatenate(dataset.start))


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("FY = VARVAL(1)\\", "FY = VARVAL(1)"), ("VARVAL(1)", "VARVALUE(1)"), ("MARKER/91", "MARKER/21"), ("END\n", "\n")],
)
def test_damaged_dataset_is_rejected(wrong, right):
    text = HEAD.format("METER") + BALL.format(force="0", height=0, speed=0) + TAIL.format(0)
    with pytest.raises((AssertionError, IndexError)):
        rate_at_start(text.replace(wrong, right))


def test_coupler_keeps_a_body_on_the_bisector():
    parts = "".join(
        f"PART/{n}\n, QG = 0, 0, 0\n, REULER = {turn}, 0, 0\n, WX = 0, WY = 0, WZ = {spin}\n, VX = {vx}\n, VY = {vy}\n"
        f", MASS = {n}\n, CM = {n}1\n, IP = 1, 1, {0.1 * n}\nMARKER/{n}1\n, PART = {n}\n, QP = 0, -0.5, 0\n"
        f"MARKER/{n}2\n, PART = {n}\n"
        for n, turn, spin in ((2, 0.3, 1.0), (3, -0.1, -0.4), (4, 0.1, 0.3))
        for vx, vy in [(0.5 * spin * math.cos(turn), 0.5 * spin * math.sin(turn))]
    )
    joints = "JOINT/1\n, REVOLUTE\n, I = 22\n, J = 1\nJOINT/2\n, REVOLUTE\n, I = 32\n, J = 22\nJOINT/3\n, REVOLUTE\n"
    joints += ", I = 42\n, J = 22\n"
    coupler = "COUPLER/1\n, JOINTS = 2, 3\n, TYPE = R:R\n, SCALES = -0.5, 1\n"
    dataset = Dataset(HEAD.format("METER") + parts + joints + coupler + TAIL.format(-9.81))
    assert dataset.degrees_of_freedom() == 2
    y = dataset.integrate(1.0).y
    assert np.abs(y[8] - 0.5 * (y[2] + y[5])).max() < 1e-9
    assert np.abs(y[2] - y[2, 0]).max() > 0.1
