"""Tests of families of gaits: flips by another method, cascades, folds, and the reported ends of branches."""

from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.outcome import Outcome
from walkerlab.physics.mechanics.rigid_model import change_slope
from walkerlab.physics.orbits.attractors import (
    Lyapunov,
    close_returns,
    feigenbaum_ratios,
    find_period,
    independent_blocks,
    largest_exponent,
    may_diverge,
    settle,
    standard_error,
    sweep_attractor,
)
from walkerlab.physics.orbits.bifurcations import GaitEquations, bialternate_product, eigenvector
from walkerlab.physics.orbits.continuation import CurvePoint, Segment, StepControl, correct, root_along, step_along
from walkerlab.physics.orbits.families import (
    NO_WALKER,
    BranchFollower,
    Seed,
    ValueSpan,
    describe_loss,
    half_cycle_difference,
)
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.newton import Effort, Evaluated, NotConverged
from walkerlab.physics.orbits.rigid_map import RigidMap, coordinates_of
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import Cycle, gait_near, multipliers_of, walk_steps
from walkerlab.physics.orbits.two_parameters import CURVE_CONTROL, Plane, follow_curve

A, L, M, M_H, G = 0.5, 1.0, 5.0, 10.0, 9.81


def map_of(walker_at, scale):
    def model_at(value):
        walker = walker_at(value)
        return None if walker is None else assembled(walker)

    return RigidMap(model_at, scale, assembled(paper_walker(0.05)))


def paper_walker(slope):
    return RigidWalker(L, A, M, M_H, 0.0, G, slope, CORRECTED) if 0.0 <= slope < 1.0 else None


def simplest_walker(slope):
    return RigidWalker(1.0, 1e-9, 1e-9, 1.0, 0.0, 1.0, slope, CORRECTED)


def seeds_at(walker_at, slope):
    walker = walker_at(slope)
    _, units = unit_walker(assembled(walker))
    return [
        Seed(np.array([gait.state[1], gait.state[2] * units.time, gait.state[3] * units.time]), slope)
        for gait in find_gaits(assembled(walker)).gaits
    ]


def period_three_start(follower):
    """Find a point of the chaotic attractor that nearly returns after three steps."""
    one = next(b for b in compass_family() if b.period == 1 and b.stable_ranges)
    for slope in np.radians(np.linspace(5.06, 5.19, 8)):
        chaotic = settle(follower.step_map, one.points[-1].z, slope, 400, 200)
        if not isinstance(chaotic, Outcome):
            for seed in close_returns(follower.step_map, chaotic, (3,), 3000):
                gait = gait_near(follower.step_map, seed.z, slope, Effort(1e-12, 20), 3)
                if isinstance(gait, Cycle) and np.max(np.abs(gait.steps[0].z - gait.z)) > 1e-3:
                    return Seed(gait.z, slope, 3)
    raise AssertionError("no gait of three steps was found")


@cache
def family(walker_at, least, most, at, periods):
    follower = BranchFollower(map_of(walker_at, most - least), ValueSpan(least, most))
    return follower.family(seeds_at(walker_at, at), periods)


def compass_family():
    return family(paper_walker, 1e-4, 0.1, 0.05, 8)


def flips_of(branches):
    return {
        (branch.period, kind.kind): kind.value for branch in branches for kind in branch.bifurcations
    }  # fmt: skip


def compass_step(z, slope):
    """Take a step by Lagrange's equations with SciPy, from and to (theta_2, dtheta_1, dtheta_2)."""

    def mass(cos_d):
        b = L - A
        return np.array([[M * b * b, -M * L * b * cos_d], [-M * L * b * cos_d, M_H * L * L + M * (L * L + A * A)]])

    def rates(_t, y):
        b, d = L - A, y[1] - y[0]
        forces = np.array(
            [
                -M * L * b * np.sin(d) * y[3] ** 2 - G * M * b * np.sin(y[0]),
                M * L * b * np.sin(d) * y[2] ** 2 + G * (M * (L + A) + M_H * L) * np.sin(y[1]),
            ]
        )
        return np.concatenate((y[2:], np.linalg.solve(mass(np.cos(d)), forces)))

    def strike(_t, y):
        return y[0] + y[1] + 2.0 * slope if y[0] > y[1] else 1.0

    strike.terminal, strike.direction = True, -1.0
    start = np.array([-2.0 * slope - z[0], z[0], z[1], z[2]])
    walk = solve_ivp(rates, (0.0, 3.0), start, method="DOP853", rtol=1e-13, atol=1e-15, events=strike, max_step=0.1)
    y = walk.y_events[0][0]
    return impact_by_momenta(y)


def impact_by_momenta(y):
    """Return the state after the impact, from the angular momenta about the new foothold and of the trailing leg about
    the hip.
    """
    theta = y[:2]
    hip_to_foot = [np.array([np.sin(t), -np.cos(t)]) for t in theta]  # of the swing leg, then of the stance leg
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])

    def velocities(omega, standing):
        """Return the velocities of the hip and of both leg masses, with one foot at rest."""
        hip = -L * omega[standing] * (turn @ hip_to_foot[standing])
        return hip, [hip + (L - A) * omega[k] * (turn @ hip_to_foot[k]) for k in range(2)]

    def momenta(omega, standing):
        hip, legs = velocities(omega, standing)
        foothold = L * hip_to_foot[0]  # position measured from the hip
        whole = M_H * cross(-foothold, hip) + sum(
            M * cross((L - A) * hip_to_foot[k] - foothold, legs[k]) for k in range(2)
        )
        return np.array([whole, M * cross((L - A) * hip_to_foot[1], legs[1])])

    before = momenta(y[2:], 1)
    after = np.linalg.solve(np.column_stack([momenta(unit, 0) for unit in np.eye(2)]), before)
    return np.array([theta[0], after[1], after[0]])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def simplest_step(z, slope):
    """Take a step of the simplest walker (Garcia et al. 1998), from and to (theta, dtheta), measured from the slope's
    normal.
    """

    def rates(_t, y):
        theta, phi, omega, rate = y
        fall = np.sin(theta - slope)
        return [omega, rate, fall, fall + np.sin(phi) * (omega**2 - np.cos(theta - slope))]

    def strike(_t, y):
        return y[1] - 2.0 * y[0] if y[0] < -0.05 else -1.0

    strike.terminal, strike.direction = True, 1.0
    c = np.cos(2.0 * z[0])
    start = np.array([z[0], 2.0 * z[0], z[1], (1.0 - c) * z[1]])
    walk = solve_ivp(rates, (0.0, 8.0), start, method="DOP853", rtol=1e-13, atol=1e-15, events=strike, max_step=0.1)
    theta, _, omega, _ = walk.y_events[0][0]
    return np.array([-theta, np.cos(2.0 * theta) * omega])


def multiplier_by_differences(step, z, slope):
    """Return the smallest real multiplier of the gait near z, found by Newton's method with central differences."""

    def derivative(at):
        h = 1e-5
        return np.column_stack(
            [(step(at + h * e, slope) - step(at - h * e, slope)) / (2.0 * h) for e in np.eye(z.size)]
        )

    for _ in range(3):
        DP = derivative(z)
        z = z + np.linalg.solve(np.eye(z.size) - DP, step(z, slope) - z)
    return float(np.min(np.linalg.eigvals(derivative(z)).real)), z


@pytest.mark.parametrize(
    ("walker_at", "step", "span", "coordinates", "printed"),
    [
        (
            paper_walker,
            compass_step,
            (1e-4, 0.1, 0.05),
            lambda z, _: z * [1.0, np.sqrt(G / L), np.sqrt(G / L)],
            np.radians(4.37),
        ),
        (
            simplest_walker,
            simplest_step,
            (5e-3, 0.0185, 0.012),
            lambda z, slope: np.array([z[0] + slope, z[2]]),
            0.0151,
        ),
    ],
    ids=["compass", "simplest"],
)
def test_first_flip_agrees_with_an_independent_integration(walker_at, step, span, coordinates, printed):
    branch = next(b for b in family(walker_at, *span, 8) if b.period == 1 and any(p.stable for p in b.points))
    (flip,) = branch.bifurcations
    z = coordinates(flip.point.x[:-1], flip.value)
    slopes, values = [flip.value - 2e-6, flip.value + 2e-6], []
    for slope in slopes:
        value, z = multiplier_by_differences(step, z, slope)
        values.append(value + 1.0)
    elsewhere = slopes[0] - values[0] * (slopes[1] - slopes[0]) / (values[1] - values[0])
    assert flip.kind == "flip"
    assert abs(flip.value - elsewhere) < 1e-7
    assert flip.value == pytest.approx(printed, rel=6e-3)  # Goswami et al. 1996, Garcia et al. 1998


def test_compass_cascade_is_followed_automatically():
    flips = flips_of(compass_family())
    assert np.degrees(flips[(1, "flip")]) == pytest.approx(4.39, abs=5e-3)  # 0.02 deg above the printed value
    assert np.degrees(flips[(2, "flip")]) == pytest.approx(4.9, abs=0.03)  # Goswami et al. 1996
    assert np.degrees(flips[(4, "flip")]) == pytest.approx(5.01, abs=5e-3)  # Goswami et al. 1998
    ratios = feigenbaum_ratios([flips[(period, "flip")] for period in (1, 2, 4, 8)])
    assert abs(ratios[-1] - 4.669) < 0.02


def test_branches_begin_at_flips_with_multiplier_minus_one():
    branches = compass_family()
    for branch in branches:
        for one in branch.bifurcations:
            assert abs(one.multiplier + 1.0) < 1e-9
            children = [b for b in branches if b.ends[0].value == one.value and b.period == 2 * branch.period]
            assert len(children) == (2 * branch.period <= 8)


def test_every_point_of_a_branch_has_its_minimal_period():
    step_map = map_of(paper_walker, 0.1)
    for branch in compass_family():
        for point in branch.points[:: max(1, len(branch.points) // 4)]:
            cycle = walk_steps(step_map, point.z, point.value, branch.period)
            assert cycle.residual < 1e-9
            assert all(np.max(np.abs(step.z - point.z)) > 1e-6 for step in cycle.steps[:-1])


def test_stability_changes_only_at_bifurcations_and_the_branch_spans_the_whole_range():
    branches = compass_family()
    flips = flips_of(branches)
    stable = next(b for b in branches if b.period == 1 and b.stable_ranges)
    assert stable.stable_ranges == ((1e-4, flips[(1, "flip")]),)
    assert [end.reason for end in stable.ends] == ["end of the span"] * 2
    doubled = next(b for b in branches if b.period == 2)
    assert doubled.stable_ranges == ((flips[(1, "flip")], flips[(2, "flip")]),)


def test_doubled_branch_is_followed_away_from_its_flip():
    for branch in compass_family():
        if branch.period > 1:
            parted = [np.linalg.norm(half_cycle_difference(point)) for point in branch.points[:3]]
            assert 0.0 < parted[0] < parted[1] < parted[2]


def test_gait_equations_have_no_value_beyond_valid_parameters():
    seed = seeds_at(paper_walker, 0.03)[0]
    step_map = map_of(lambda value: paper_walker(value) if value == 0.03 else None, 1.0)
    here = GaitEquations(step_map, 1, 1.0)(np.append(seed.z, 0.03))
    assert here.outcome is None
    assert here.jacobian.shape == (3, 4)


def between_the_first_flip_and_the_branch_beyond_it():
    one = next(branch for branch in compass_family() if branch.period == 1 and branch.stable_ranges)
    two = next(branch for branch in compass_family() if branch.period == 2)
    slope = 0.5 * (two.ends[0].value + two.points[0].value)
    follower = BranchFollower(map_of(paper_walker, 0.1 - 1e-4), ValueSpan(1e-4, 0.1), max_points=12)
    walked = settle(follower.step_map, one.points[-1].z, slope, 400, 2)
    return follower, Seed(walked.last, slope, 2)


def test_gait_just_beyond_a_flip_is_on_the_doubled_branch():
    follower, seed = between_the_first_flip_and_the_branch_beyond_it()
    known = compass_family()
    assert follower.family([seed], 2, known) == known


def test_branch_followed_from_its_middle_reaches_its_flip_and_has_no_gaits_of_half_the_period():
    follower = BranchFollower(map_of(paper_walker, 0.01), ValueSpan(0.07, 0.08))
    one, doubled = follower.family([seeds_at(paper_walker, 0.072)[-1]], 2)
    (flip,) = (each for each in one.bifurcations if each.kind == "flip")
    middle = doubled.points[len(doubled.points) // 2]
    (again,) = follower.family([Seed(middle.z, middle.value, 2)], 1, (one,))[1:]
    begin = min(again.ends, key=lambda end: end.value)
    assert begin.reason == "closes on the gait of 1 step"
    assert begin.value == flip.value
    assert min(np.abs(half_cycle_difference(point)).max() for point in again.points) > 1e-6


def test_no_branch_is_followed_twice_from_a_shared_flip():
    follower, seed = between_the_first_flip_and_the_branch_beyond_it()
    branches = follower.family([seed, *seeds_at(paper_walker, 0.07)], 2)
    assert [branch.period for branch in branches] == [2, 1, 1]
    assert any(end.reason.startswith("closes") for end in branches[0].ends)


def test_walk_beyond_the_first_flip_settles_on_the_doubled_branch():
    step_map = map_of(paper_walker, 0.1)
    one, two = (next(b for b in compass_family() if b.period == n and b.stable_ranges) for n in (1, 2))
    slope = float(np.mean(two.stable_ranges[0]))
    nearest = min(one.points, key=lambda point: abs(point.value - slope))
    there = settle(step_map, nearest.z, slope, 300, 40)
    assert there.period == 2
    follower = BranchFollower(step_map, ValueSpan(1e-4, 0.1))
    assert follower.lies_on(two, gait_near(step_map, there.last, slope, Effort(1e-12), 2))


def test_lyapunov_exponent_is_positive_in_chaos_and_negative_on_a_stable_gait():
    step_map = map_of(paper_walker, 0.1)
    one = next(b for b in compass_family() if b.period == 1 and b.stable_ranges)
    gait = next(point for point in one.points if point.value > 0.03)
    calm = largest_exponent(step_map, gait.z, gait.value, 50, 300)
    assert calm.exponent == pytest.approx(np.log(abs(gait.multipliers[0])), abs=5e-3)
    chaotic = settle(step_map, one.points[-1].z, np.radians(5.15), 400, 200)
    assert chaotic.period == 0
    wild = largest_exponent(step_map, chaotic.last, chaotic.value, 50, 600)
    assert wild.exponent > 5.0 * wild.uncertainty > 0.0


@pytest.mark.parametrize("lasting", [0.0, 5.0, 20.0], ids="correlated over {:g} steps".format)
def test_standard_error_covers_the_error_even_for_correlated_steps(lasting):
    """Average normal noise with mean 0, whose correlation falls e-fold in some number of steps."""
    kept, noise = np.exp(-1.0 / lasting) if lasting else 0.0, np.random.default_rng(1).standard_normal((400, 6000))
    for step in range(1, noise.shape[1]):
        noise[:, step] += kept * noise[:, step - 1]
    blocks = [min(64, independent_blocks(walk)) for walk in noise]
    off = [abs(walk.mean()) / standard_error(walk, count) for walk, count in zip(noise, blocks, strict=True)]
    assert min(blocks) >= 10
    # For normal noise in ten blocks it is 0.077 (Student's distribution). Allow twice the standard error of 400 walks.
    assert np.mean(np.array(off) > 2.0) < 0.077 + 2.0 * np.sqrt(0.077 * 0.923 / 400)


def test_lyapunov_exponent_agrees_with_a_walk_fifty_times_longer():
    follower = BranchFollower(map_of(paper_walker, 0.01), ValueSpan(0.0, 0.1))
    start = seeds_at(paper_walker, 0.07)[-1].z  # The gait with the longer period is stable there.
    attractor = sweep_attractor(follower.step_map, start, np.linspace(0.07, np.radians(5.1856), 60), 300, 50).found[-1]
    short, long = (largest_exponent(follower.step_map, attractor.last, attractor.value, 96, n) for n in (1500, 75_000))
    assert abs(short.exponent - long.exponent) < 2.5 * short.uncertainty
    assert long.uncertainty < 0.3 * short.uncertainty


@pytest.mark.parametrize("beyond", [2e-6, 1.6e-5])
def test_lyapunov_exponent_just_beyond_a_flip_is_negative(beyond):
    step_map = map_of(paper_walker, 0.1)
    two = next(b for b in compass_family() if b.period == 2 and b.stable_ranges)
    flip = next(one for one in two.bifurcations if one.kind == "flip")
    exponent = largest_exponent(step_map, flip.point.x[:-1], flip.value + beyond, 96, 1500)
    assert exponent.exponent < -3.0 * exponent.uncertainty


def test_three_step_gait_appears_at_a_fold():
    follower = BranchFollower(map_of(paper_walker, 0.1), ValueSpan(1e-4, 0.1))
    start = period_three_start(follower)
    (branch,) = [b for b in follower.family([start], 3) if b.period == 3]
    (fold,) = [one for one in branch.bifurcations if one.kind == "fold"]
    values = branch.values
    assert abs(fold.multiplier - 1.0) < 1e-6
    assert fold.value <= values.min() + 1e-12
    assert fold.value == pytest.approx(0.0676036, abs=1e-6)


# slope, and section coordinates of the gaits of six steps of the simplest walker on it
SIX_STEPS = [
    (0.0184722331, [0.23890028, -0.21595813, -0.24810845]),
    (0.019, [0.24535244, -0.21996040, -0.25474270]),
    (0.019, [0.24554239, -0.21990045, -0.25472983]),
]


@pytest.mark.parametrize(("least", "most", "seed"), [(0.009, 0.0185, 0), (0.012, 0.019, 1), (0.012, 0.019, 2)])
def test_six_step_gaits_of_the_simplest_walker_begin_at_a_fold(least, most, seed):
    follower = BranchFollower(map_of(simplest_walker, most - least), ValueSpan(least, most))
    slope, z = SIX_STEPS[seed]
    (branch,) = follower.family([Seed(np.array(z), slope, 6)], 6)
    values = {one.kind: one.value for one in branch.bifurcations}
    assert values == pytest.approx({"fold": 0.0183105072, "flip": 0.0183378227}, abs=1e-9)
    assert branch.values.min() >= values["fold"] - 1e-12
    for point in branch.points:
        assert min(np.abs(step.z - point.z).max() for step in point.steps[:-1]) > 1e-4
    assert [end.value for end in branch.ends] == [most, most]


@pytest.mark.parametrize("order", [1, -1])
def test_family_found_on_both_sides_of_its_fold_is_listed_once(order):
    follower = BranchFollower(map_of(simplest_walker, 0.007), ValueSpan(0.012, 0.019))
    (branch,) = follower.family([Seed(np.array(z), slope, 6) for slope, z in SIX_STEPS[1:][::order]], 6)
    assert {one.kind for one in branch.bifurcations} == {"fold", "flip"}


def test_flip_curves_pass_through_flips_located_for_other_masses():
    def map_at(hip_mass):
        return map_of(lambda slope: paper_walker(slope)._replace(hip_mass=hip_mass), 0.1)

    branch = next(b for b in compass_family() if b.period == 1 and b.stable_ranges)
    (flip,) = branch.bifurcations
    curve = follow_curve(
        flip, 1, ValueSpan(1e-4, 0.1), Plane(map_at, ValueSpan(9.0, 12.0), 10.0), 40, lambda: None, CURVE_CONTROL
    )
    index = int(np.argmax(curve.second))
    heavy = curve.second[index]
    assert heavy == 12.0
    heavier = family(lambda slope: paper_walker(slope)._replace(hip_mass=12.0), 0.06, 0.09, 0.07, 1)
    (elsewhere,) = [one for b in heavier for one in b.bifurcations]
    assert curve.first[index] == pytest.approx(elsewhere.value, abs=1e-5)  # The end of the curve is interpolated.


def test_branch_ends_at_the_last_valid_parameter_value():
    def walker_at(mass):
        return paper_walker(0.05)._replace(hip_mass=mass) if mass < 13.0 else None

    follower = BranchFollower(map_of(walker_at, 10.0), ValueSpan(8.0, 18.0))
    branch = follower.family(seeds_at(walker_at, 10.0), 1)[0]
    assert branch.ends[1].reason == NO_WALKER == "the parameter's next value gives no valid walker"
    assert 12.5 < branch.ends[1].value < 13.0


@pytest.mark.parametrize("first", [8.0, 10.0])
def test_span_that_begins_at_the_first_valid_value_is_followed_to_its_end(first):
    def walker_at(mass):
        return paper_walker(0.05)._replace(hip_mass=mass) if mass >= 8.0 else None

    follower = BranchFollower(map_of(walker_at, 10.0), ValueSpan(8.0, 18.0))
    branch = follower.family(seeds_at(walker_at, first), 1)[0]
    assert [(end.value, end.reason) for end in branch.ends] == [(8.0, "end of the span"), (18.0, "end of the span")]
    assert (branch.values[0], branch.values[-1]) == (8.0, 18.0)
    assert np.all(np.diff(branch.values) > 1e-3)


def test_branch_that_ends_in_an_overlong_push_off_says_so():
    assert describe_loss(NotConverged(Outcome.REJECTED)) == "its push-off is not over when the feet pass each other"
    assert describe_loss(NotConverged(Outcome.FELL)).startswith("fell: ")


def test_branch_that_exhausts_its_points_says_so():
    follower = BranchFollower(map_of(paper_walker, 0.1), ValueSpan(1e-4, 0.1), max_points=5)
    branch = follower.family(seeds_at(paper_walker, 0.05), 1)[0]
    assert all(end.reason == "the limit of 5 points is reached" for end in branch.ends)


def test_closed_branch_is_traced_once_from_any_start():
    """The compass pushed uphill has gaits only between two impulses, and they form one closed curve."""
    uphill = change_slope(assembled(paper_walker(0.0)), np.radians(-0.25))
    pushed = RigidMap(lambda impulse: uphill.changed(push_off=impulse), 7.0, uphill)
    _, units = unit_walker(uphill)
    seeds = [
        Seed(coordinates_of(uphill, gait.state) * [1.0, units.time, units.time], 4.0)
        for gait in find_gaits(uphill.changed(push_off=4.0)).gaits
    ]
    assert len(seeds) > 1
    for seed in seeds:
        (branch,) = BranchFollower(pushed, ValueSpan(1.0, 8.0)).family([seed, *seeds], 1)
        assert [end.reason for end in branch.ends] == ["returns to its first point"] * 2
        assert branch.points[0] is branch.points[-1]
        folds = sorted(one.value for one in branch.bifurcations if one.kind == "fold")
        assert folds == pytest.approx([2.6594772, 2.8432054, 4.7852377, 6.0665538], abs=1e-6)
        assert len(branch.stable_ranges) == 2
        assert sum(one.stable != other.stable for one, other in pairwise(branch.points)) == 4


class Circle:
    """The equation x^2 + y^2 = 1, whose solutions fold twice over either unknown."""

    def __call__(self, x):
        return Evaluated(Outcome.WALKED, np.array([x @ x - 1.0]), 2.0 * x[None, :], None)


def test_continuation_traces_a_circle_and_finds_its_folds():
    control = StepControl(first=0.1, longest=0.3, turn=0.9)
    point = correct(Circle(), np.array([0.6, 0.8]), np.array([0.8, -0.6]), Effort(1e-14))
    folds, gone, length = [], 0.0, control.first
    while gone < 2.0 * np.pi:
        following, length = step_along(Circle(), point, length, control)
        gone += np.arccos(np.clip(point.x @ following.x, -1.0, 1.0))
        if point.x[1] * following.x[1] < 0.0:
            folds.append(root_along(Segment(Circle(), point, following, 1e-14), lambda solved: solved.x[1]).x)
        point = following
    assert isinstance(point, CurvePoint)
    assert np.sort([fold[0] for fold in folds])[[0, -1]] == pytest.approx([-1.0, 1.0], abs=1e-14)


def test_bialternate_product_has_products_of_multipliers_as_eigenvalues():
    DP = np.random.default_rng(0).standard_normal((5, 5))
    values = np.linalg.eigvals(DP)
    products = [values[i] * values[j] for i in range(5) for j in range(i)]
    found = np.linalg.eigvals(bialternate_product(DP))
    assert np.max([np.min(np.abs(found - product)) for product in products]) < 1e-10
    assert np.all(np.diff(np.abs(multipliers_of(DP))) <= 1e-12)


def test_direction_of_a_complex_pair_lies_in_the_plane_of_the_pair():
    """The direction lies in that plane even if another multiplier equals the real part of the pair."""
    pair = 1.2 * np.exp(1j)
    basis = np.random.default_rng(0).normal(size=(3, 3))
    turning = np.array([[pair.real, -pair.imag, 0.0], [pair.imag, pair.real, 0.0], [0.0, 0.0, pair.real]])
    A = basis @ turning @ np.linalg.inv(basis)
    direction = eigenvector(A, pair)
    assert np.linalg.norm(direction) > 0.5
    # In the plane, A satisfies the quadratic equation of the pair.
    squared = A @ A @ direction - 2.0 * pair.real * A @ direction + abs(pair) ** 2 * direction
    assert squared == pytest.approx(np.zeros(3), abs=1e-12)


def test_only_repeating_sequences_have_a_period():
    cycle = np.tile([[0.1, 0.2], [0.3, 0.1], [0.2, 0.5]], (8, 1))
    assert find_period(cycle) == 3
    assert find_period(np.random.default_rng(0).standard_normal((30, 2))) == 0


def test_walks_may_diverge_at_values_next_to_a_positive_lyapunov_exponent():
    exponents = [Lyapunov(4.0, -0.2, 0.01), Lyapunov(5.0, -0.1, 0.01), Lyapunov(6.0, 0.3, 0.01)]
    assert not may_diverge(exponents, 4.5)
    assert not may_diverge(exponents, 4.0)
    assert may_diverge(exponents, 5.2)
    assert may_diverge(exponents, 7.0)
    assert may_diverge([], 4.0)


def test_slowly_settling_walk_has_the_period_of_its_limit():
    settling = np.tile([[0.1, 0.2], [0.3, 0.1]], (48, 1)) + 5e-4 * 0.99 ** np.arange(96)[:, None]
    assert find_period(settling) == 2
    drifting = np.tile([[0.1, 0.2], [0.3, 0.1]], (48, 1)) + 1e-4 * 1.05 ** np.arange(96)[:, None]
    assert find_period(drifting) == 0


class LostBeyond:
    """Step map whose walks never settle, and fall beyond some value."""

    def __init__(self, most):
        self.most = most

    def iterate(self, z, value, steps, _tangent):
        rows = np.arange(steps, dtype=float)
        outcome = Outcome.WALKED if value <= self.most else Outcome.FELL
        return SimpleNamespace(outcome=outcome, points=rows[:, None] + z, periods_s=rows, angles=rows)


@pytest.mark.parametrize("values", [11, 14])
def test_loss_of_an_attractor_does_not_depend_on_the_grid(values):
    found = sweep_attractor(LostBeyond(7.13), np.zeros(1), np.linspace(2.0, 8.0, values), 4, 8)
    spacing = 6.0 / (values - 1)
    assert 0.0 < found.lost_at - 7.13 <= spacing / 2**6
    assert 0.0 <= 7.13 - found.found[-1].value <= spacing / 2**6
    assert found.reason == "fell"


def test_attractor_missing_at_the_first_value_is_reported_as_lost_there():
    found = sweep_attractor(LostBeyond(1.0), np.zeros(1), [2.0, 3.0], 4, 8)
    assert (found.found, found.lost_at) == ((), 2.0)
