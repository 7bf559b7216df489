"""Compare gaits with independently known values, and check the rules of the search."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigid_physics import momentum_of_masses

from walkerlab.config.loader import load
from walkerlab.config.walkers import StraightLegs, Torso
from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.rigid import rigid_on_slope
from walkerlab.physics.orbits.fixed_point import (
    RANDOM_START,
    SEARCH_TOLERANCES,
    SHORTEST_MOVE,
    RigidGait,
    Search,
    SlopeBranch,
    choose_gait,
    map_over_slope,
    slope_branches,
)
from walkerlab.physics.orbits.fixed_point import find_gaits as find_gaits_of_model
from walkerlab.physics.orbits.newton import Effort, Evaluated, NotConverged, newton
from walkerlab.physics.orbits.rigid_map import NEW_GAIT, NO_GAIT, RigidStepper, strike_section
from walkerlab.physics.orbits.small_slope import LONG_PERIOD, SHORT_PERIOD, seeds
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.stepping import RHS
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker


def find_gaits(walker, *rest, **options):
    return find_gaits_of_model(assembled(walker), *rest, **options)


PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)
PRINTED = PAPER._replace(c21_sign=AS_PRINTED)


def on_slope(degrees, walker=PAPER):
    return walker._replace(slope=np.deg2rad(degrees))


TIGHT = Tolerances("dop853", 1e-13, 1e-15, 10**5)


class Counted(RigidStepper):
    """Step map that counts how often it is evaluated."""

    def __init__(self, like, tolerances):
        super().__init__(like, tolerances)
        self.steps, self.evaluations = 0, 0

    def walk(self, section, z, steps=1, derived=True):
        walked = super().walk(section, z, steps, derived)
        self.steps += 1
        self.evaluations += int((self.memory.varied if derived else self.plain).counts[RHS])
        return walked


def shooting(walker):
    return Counted(assembled(walker), TIGHT)


def solve(shooting, walker, z, tolerance):
    """Run Newton's method for a walker in its natural units, and count the steps."""
    section = strike_section(assembled(walker))

    def mismatch(z):
        step = shooting.walk(section, z)
        if step.outcome is not Outcome.WALKED:
            return Evaluated(step.outcome, z, np.eye(z.size), step)
        return Evaluated(step.outcome, step.z[0] - z, step.DP[0] - np.eye(z.size), step)

    return newton(mismatch, np.array(z), Effort(tolerance, 60, SHORTEST_MOVE))


# from two independent integrations of the same equations
KNOWN = {
    1.0: ((-0.2044455, 0.1695390, -0.6057394, -0.8617140), 0.7036485, 0.3718088, 0.36256 + 0.46032j, 0.21568),
    3.0: ((-0.3233886, 0.2186688, -0.3773739, -1.0923836), 0.7343464, 0.5354454, -0.19973 + 0.54448j, 0.13157),
}


@pytest.mark.parametrize("degrees", KNOWN)
def test_gait_has_the_known_state_period_length_and_multipliers(degrees):
    state, period, length, pair, single = KNOWN[degrees]
    gait = find_gaits(on_slope(degrees)).gait
    assert gait.state == pytest.approx(state, abs=6e-8)
    assert (gait.period, gait.step_length) == pytest.approx((period, length), abs=6e-8)
    assert gait.multipliers == pytest.approx((pair, pair.conjugate(), single), abs=6e-6)
    assert gait.stable


def test_gait_at_three_degrees_has_the_published_period():
    # Goswami, Thuilot, Espiau 1996
    assert find_gaits(on_slope(3.0)).gait.period == pytest.approx(0.735, abs=1e-3)


def test_gait_loses_stability_by_period_doubling_a_little_above_the_published_slope():
    # Goswami, Thuilot and Espiau (1996) print 4.37 deg. For these equations it is 0.02 deg higher.
    before, after = (find_gaits(on_slope(degrees)).gaits[-1] for degrees in (4.39, 4.392))
    assert before.stable
    assert not after.stable
    assert after.multipliers[0] == pytest.approx(-1.0, abs=2e-3)


def test_corrected_gait_at_the_slope_of_the_paper_is_reproduced():
    gait = find_gaits(PAPER).gait
    assert gait.state == pytest.approx((-0.204200, 0.169400, -0.605819, -0.861041), abs=6e-7)
    assert gait.period == pytest.approx(0.703597, abs=6e-7)
    assert gait.energy == pytest.approx(150.241, abs=6e-4)


def test_printed_equations_have_the_fixed_point_of_the_paper():
    gait = find_gaits(PRINTED).gait
    assert gait.state == pytest.approx((-0.202216, 0.167416, -0.600581, -0.846575), abs=6e-7)
    assert gait.period == pytest.approx(0.706384, abs=6e-7)
    # equation (11), to the digits that it prints, where -0.84 is cut off and not rounded
    assert [round(value, 4) for value in gait.state[:2]] == [-0.2022, 0.1674]
    assert [np.trunc(100 * value) / 100 for value in gait.state[2:]] == [-0.60, -0.84]


def test_energy_with_printed_equations_is_that_of_table_3():
    gait = find_gaits(PRINTED).gait
    assert gait.energy == pytest.approx(150.142, abs=6e-4)
    assert gait.energy_drift == pytest.approx(150.183 - 150.054, abs=1e-3)


@pytest.mark.parametrize("walker", [PAPER, PRINTED, on_slope(10.0), on_slope(1e-4)])
def test_every_gait_is_solved_to_rounding(walker):
    search = find_gaits(walker)
    assert search.gaits
    for gait in search.gaits:
        assert gait.residual <= 1e-11


def test_both_search_strategies_find_the_gait():
    search = find_gaits(PAPER)
    assert {LONG_PERIOD, RANDOM_START} <= set(search.gait.found_by)
    assert search.random_hits[search.chosen] > 0


def test_short_period_gait_is_found_and_unstable():
    search = find_gaits(PAPER)
    short = next(gait for gait in search.gaits if SHORT_PERIOD in gait.found_by)
    assert short.period < search.gait.period
    assert not short.stable


def test_same_seed_draws_the_same_starts():
    assert find_gaits(PAPER, seed=3) == find_gaits(PAPER, seed=3)


def test_following_a_seed_costs_at_most_thirty_steps():
    walker = Search(assembled(PAPER)).walker
    step_map = map_over_slope(walker, SEARCH_TOLERANCES)
    counted = step_map._exact = Counted(walker, SEARCH_TOLERANCES)
    assert SlopeBranch(step_map, seeds(walker)[0]).follow(walker.slope)[1] is not None
    # A step takes about 200 right-hand sides.
    assert counted.steps <= 30
    assert counted.evaluations < 30 * 200


@pytest.mark.parametrize("degrees", [0.0, -1.0, -40.0])
def test_there_is_no_gait_without_a_downhill_slope(degrees):
    search = find_gaits(on_slope(degrees))
    assert search.gait is None
    assert "standing still is no gait" in search.reason


def test_printed_equations_have_no_gait_on_level_ground():
    search = find_gaits(on_slope(0.0, PRINTED))
    assert search.gait is None
    assert "none of 1100 random starting values" in search.reason


def test_gait_that_needs_a_pulling_ground_is_excluded():
    search = find_gaits(on_slope(20.0))
    assert search.gait is None
    assert "pull" in search.reason
    assert all(gait.objections for gait in search.gaits)


PULLED = StraightLegs(
    type="straight-legs", leg_length_m=1.0174, leg_mass_kg=4.9709, leg_mass_below_hip_m=0.43864,
    leg_inertia_kg_m2=0.26881, foot_radius_m=0.32168, foot_centre_ahead_m=0.036211,
    torso=Torso(mass_kg=5.5663, above_hip_m=0.21971, inertia_kg_m2=0.17558),
)  # fmt: skip
PAPER_WALKER, ROUND, KNEED = (load(Path(name)).config.walker for name in ("paper", "round-feet", "kneed"))


@pytest.mark.parametrize(
    ("walker", "gravity", "degrees"),
    [(PULLED, 11.514, 0.44654), (PAPER_WALKER, 9.81, 1.0), (ROUND, 9.81, 0.57), (KNEED, 9.81, 2.9)],
    ids=["torso", "compass", "round-feet", "kneed"],
)
def test_strike_impulse_equals_the_momentum_change_of_the_masses(walker, gravity, degrees):
    assembly, slope = assembly_of(walker, rigid=True), np.radians(degrees)
    model = rigid_on_slope(assembly, gravity, slope)
    for gait in find_gaits_of_model(model).gaits:
        step = take_walk(model, TIGHT, gait.state, 1)
        changes = np.subtract(*(momentum_of_masses(assembly, slope, y) for y in (step.after[0], step.before[0])))
        if gait.knee_strike is None:
            assert gait.min_normal_impulse == pytest.approx(changes[1], abs=1e-9)
            ratio = abs(changes[0]) / changes[1] if changes[1] > 0.0 else None
            assert gait.max_impulse_ratio == (None if ratio is None else pytest.approx(ratio, rel=1e-9))
        else:  # or that of the knee strike
            assert gait.min_normal_impulse <= changes[1] + 1e-9
        assert any("in a strike" in one for one in gait.objections) == (gait.min_normal_impulse < 0.0)


def test_gait_whose_strike_needs_a_pull_is_excluded():
    search = find_gaits_of_model(rigid_on_slope(assembly_of(PULLED, rigid=True), 11.514, np.radians(0.44654)))
    (pulled,) = (gait for gait in search.gaits if gait.objections)
    assert pulled.spectral_radius == pytest.approx(2.391, abs=1e-3)
    assert pulled.min_normal_impulse == pytest.approx(-0.0055, abs=5e-5)
    assert search.gait is not pulled


def test_gait_whose_feet_meet_on_the_ground_is_excluded():
    config = load(Path("level"), ["walker.hip.spring_N_m_per_rad=20"]).config
    walker = rigid_walker(config)
    *others, symmetric = find_gaits_of_model(walker).gaits
    assert not any(gait.objections for gait in others)
    (objection,) = symmetric.objections
    assert "meet on the ground" in objection
    faster = [*symmetric.state]
    faster[2] += 1e-7
    step = take_walk(walker, TIGHT, tuple(faster), 1)
    assert step.lengths_m[0] < 1e-6 * symmetric.step_length  # The swing foot lands as it swings back.


def test_strongly_unstable_gait_can_be_simulated():
    search = find_gaits(on_slope(15.0))
    assert search.gait is not None
    assert search.gait.spectral_radius > 10.0
    assert "least unstable" in search.reason
    rejected = next(gait for gait in search.gaits if gait.objections)
    assert rejected.objections == ("the trailing foot would have to pass through the ground",)


# (stance angle from the normal, its velocity, period, largest multiplier) for a hip of mass 1, tiny masses in the feet,
# g = L = 1 and slope 0.009 (Garcia et al. 1998), recomputed by two independent routes
SIMPLEST = {
    LONG_PERIOD: (0.200310900544, -0.199832473005, 3.882464, -0.1900998 + 0.5575988j),
    SHORT_PERIOD: (0.193937369810, -0.203866927442, 3.096106, 4.003864),
}


@pytest.mark.parametrize("name", SIMPLEST)
@pytest.mark.parametrize("foot_mass", [1e-7, 1e-10])
def test_simplest_walker_has_the_published_gaits(foot_mass, name):
    angle, velocity, period, multiplier = SIMPLEST[name]
    walker = RigidWalker(1.0, 0.0, foot_mass, 1.0, 0.0, 1.0, 0.009, CORRECTED)
    gait = next(gait for gait in find_gaits(walker).gaits if name in gait.found_by)
    # effect of the mass of the feet
    small = max(2e-9, 2.0 * foot_mass)
    assert (gait.state[1] + walker.slope, gait.state[3]) == pytest.approx((angle, velocity), abs=small)
    assert gait.period == pytest.approx(period, abs=1e-6)
    assert gait.multipliers[0] == pytest.approx(multiplier, abs=3e-6)


def test_missing_gait_is_reported_with_the_search_effort():
    search = find_gaits(PAPER._replace(leg_inertia=1e9))
    assert search.gait is None
    assert search.reason.startswith("none found: ")
    assert len(search.lost) == 2
    assert f"followed from a vanishing slope, {'; '.join(search.lost)}" in search.reason
    assert f"none of {search.random_starts} random starting values" in search.reason


@pytest.mark.parametrize(
    "changes",
    [
        {"foot_to_mass": 1e-9, "hip_mass": 0.0},
        {"foot_to_mass": 1.0 - 1e-9, "leg_mass": 1e-6, "hip_mass": 1e4},
        {"foot_to_mass": 0.6, "hip_mass": 0.0, "leg_mass": 1e5},
        {"foot_to_mass": 1.0 - 1e-9, "leg_inertia": 1e6},
        {"leg_mass": 1e-6, "hip_mass": 1e6, "leg_inertia": 1e-9},
    ],
)
def test_degenerate_walkers_are_searched_without_errors(changes):
    for gait in find_gaits(PAPER._replace(**changes)).gaits:
        assert np.isfinite(gait.state).all()
        assert gait.residual <= 1e-11


def test_search_reports_that_a_slope_has_only_unstable_gaits():
    search = find_gaits(on_slope(5.0))
    assert not search.gait.stable
    assert "no gait is stable" in search.reason


def gait_with(radius, pull=0.0):
    return RigidGait(
        (0.0, 0.0, -1.0, -1.0),
        1.0,
        0.4,
        (radius, 0.0, 0.0),
        (radius**2, 0.0, 0.0),
        ((1.0, 0.4),) * 2,
        0.0,
        150.0,
        0.0,
        100.0 - pull,
        0.2,
        0.0,
        6.0,
        0.2,
        True,
        None,
        {},
        0.0,
        0.13,
    )


def test_stable_walkable_gait_is_chosen():
    assert choose_gait((gait_with(2.0), gait_with(0.5)))[0] == 1
    assert choose_gait((gait_with(2.0), gait_with(0.5, pull=200.0)))[0] == 0
    assert choose_gait((gait_with(0.5, pull=200.0),))[0] is None
    assert choose_gait(())[0] is None


@settings(max_examples=10)
@given(st.floats(0.05, 20.0), st.floats(0.1, 10.0), st.floats(0.5, 50.0), st.floats(0.2, 4.0))
def test_scaled_walkers_have_the_same_scaled_gait(length, mass, gravity, degrees):
    walker = on_slope(degrees)
    scaled = walker._replace(
        leg_length=length,
        foot_to_mass=0.5 * length,
        leg_mass=5.0 * mass,
        hip_mass=10.0 * mass,
        gravity=gravity,
    )
    gait, twin = find_gaits(walker).gait, find_gaits(scaled).gait
    time = np.sqrt((length / 1.0) / (gravity / 9.81))
    assert twin.period == pytest.approx(time * gait.period, rel=1e-9)
    assert twin.step_length == pytest.approx(length * gait.step_length, rel=1e-9)
    rates = [value / time for value in gait.state[2:]]
    assert twin.state == pytest.approx((*gait.state[:2], *rates), rel=1e-8)
    assert twin.multipliers == pytest.approx(gait.multipliers, abs=1e-7)
    assert twin.energy == pytest.approx(mass * length * gravity / 9.81 * gait.energy, rel=1e-9)


@settings(max_examples=10)
@given(
    st.floats(0.3, 0.7), st.floats(0.5, 5.0), st.floats(0.0, 0.05), st.floats(0.1, 3.0), st.sampled_from([-1.0, 1.0])
)
def test_gaits_of_random_walkers_are_periodic(fraction, hip, inertia, degrees, sign):
    walker = RigidWalker(1.0, fraction, 5.0, 5.0 * hip, 5.0 * inertia, 9.81, np.deg2rad(degrees), sign)
    for gait in find_gaits(walker).gaits:
        z = np.array(gait.state[1:])
        step = shooting(walker).walk(strike_section(assembled(walker)), z)
        assert step.outcome is Outcome.WALKED
        assert step.time[0] == pytest.approx(gait.period, rel=1e-10)
        assert np.abs(step.z[0] - z).max() < 1e-11 * np.sqrt(9.81)


def test_newton_gives_up_if_the_walker_completes_no_step():
    map_ = shooting(PAPER)
    found = solve(map_, PAPER, [0.17, 3.0, 3.0], 1e-12)
    assert isinstance(found, NotConverged)
    assert found.outcome is not Outcome.WALKED
    assert map_.steps == 1


def test_newton_stops_at_rounding_level():
    map_ = shooting(PAPER)
    found = solve(map_, PAPER, [0.168, -0.61, -0.86], 1e-16)
    assert found.evaluated.residual < 1e-14
    assert map_.steps <= 8


def test_gait_does_not_depend_on_earlier_searches():
    def starts_from_seeds(degrees):
        search = Search(assembled(on_slope(degrees)))
        search.follow_seeds()
        return [record.cycle.z.tolist() for record in search.records], search.lost

    slope_branches.cache_clear()
    after_others = [starts_from_seeds(degrees) for degrees in (4.0, 0.3, 7.0, 2.0)][-1]
    slope_branches.cache_clear()
    assert starts_from_seeds(2.0) == after_others


def test_parallel_searches_find_the_same_gaits_as_sequential_ones():
    walkers = [on_slope(degrees) for degrees in np.linspace(0.5, 4.0, 24)]
    alone = [find_gaits(walker) for walker in walkers]
    slope_branches.cache_clear()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            assert list(pool.map(find_gaits, walkers)) == alone
    finally:
        sys.setswitchinterval(interval)


def led(map_, walker, starts, gaits=()):
    return map_.solve_starts(strike_section(assembled(walker)), list(gaits), starts).tolist()


@pytest.mark.parametrize("walker", [PAPER, PRINTED, on_slope(4.0)])
def test_newton_from_a_start_reaches_the_gait_predicted_for_it(walker):
    map_ = shooting(walker)
    gait = np.array(find_gaits(walker).gait.state)[[1, 2, 3]]
    near = gait * [[1.02, 0.96, 1.03]]
    solved = solve(map_, walker, near[0], 1e-6).x
    assert led(map_, walker, near) == [NEW_GAIT]
    np.testing.assert_allclose([solved, near[0]], [gait, gait], atol=1e-5)
    assert int(map_.memory.varied.counts[RHS]) == map_.evaluations


def test_start_near_a_known_gait_is_not_followed_further():
    map_ = shooting(PAPER)
    gaits = [np.array(gait.state)[[1, 2, 3]] for gait in find_gaits(PAPER).gaits]
    derivatives = [map_.walk(strike_section(assembled(PAPER)), gait).DP[0] for gait in gaits]
    starts = np.array(gaits) * [1.001, 0.999, 1.001]
    before = starts.copy()
    assert led(map_, PAPER, starts, zip(gaits, derivatives, strict=True)) == [0, 1]
    np.testing.assert_array_equal(starts, before)


def test_search_from_a_start_that_falls_or_stops_finds_no_gait():
    together = -PAPER.slope + 1e-4
    assert led(shooting(PAPER), PAPER, np.array([[0.17, 3.0, 3.0], [together, 0.0, -1e-4]])) == [NO_GAIT, NO_GAIT]


@pytest.mark.parametrize("degrees", [0.5445378151260504, 2.7453781512605043, 7.147058823529412])
def test_knowing_two_gaits_does_not_hide_a_third(degrees):
    walker = assembled(on_slope(degrees))
    ignorant = Search(walker)
    ignorant.draw(np.random.default_rng(0), 100)
    search = Search(walker)
    search.follow_seeds()
    search.draw(np.random.default_rng(0), 100)
    periods = [sorted(round(record.gait.period, 6) for record in one.records) for one in (ignorant, search)]
    assert len(periods[0]) >= 2
    assert periods[1] == periods[0]
