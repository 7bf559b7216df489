"""Check that events close together are all found on every terrain, against a plain integration."""

from pathlib import Path

import numpy as np
import pytest
from contact_walks import TOLERANCE, settings, walked
from kneed_walks import RIGID_ANGLES, RIGID_RATES

from walkerlab.config.loader import load
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.contact_crossings import leaves_side
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.solvers.events import new_crossing_finder
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

AFTER_MID_SWING = "contact.terrain=after-mid-swing"
PINNED = ("contact.stance=pinned", "walker.foot_radius_m=0", "slope_deg=0.7")
BOUNCING = ("contact.damping=10", "contact.exponent=1.3")
SWITCHING = ("slope_deg=2.8", "contact.exponent=1.3", "contact.full_damping_penetration=0.26")


# With this walker, the force vanishes at the instant at which a foot lifts.
LETS_GO = (
    "walker.thigh.length_m=0.31605", "walker.thigh.mass_kg=3.8692", "walker.thigh.mass_below_hip_m=0.20839",
    "walker.thigh.mass_ahead_m=7.6409e-05", "walker.thigh.inertia_kg_m2=0.0020891", "walker.shank.length_m=0.29345",
    "walker.shank.mass_kg=0.37339", "walker.shank.mass_below_knee_m=0.084164", "walker.shank.mass_ahead_m=-0.00017211",
    "walker.shank.inertia_kg_m2=0.00012246", "walker.hip_mass_kg=3.9603", "walker.foot_radius_m=0", "slope_deg=3.8186",
    "gravity_m_s2=6.2554", "contact.stiffness=594.19", "contact.exponent=1.7485", "contact.damping=32.138",
    "contact.full_damping_penetration=0.039468", "contact.static_friction=0.45749", "contact.dynamic_friction=0.28989",
    "contact.stiction_velocity=1.6003", "contact.friction_velocity=6.7064", "contact.terrain=plane",
)  # fmt: skip


# walks with lightly damped feet that bounce, and how and when they end by a plain integration
STICKING_STRAIGHT = {
    "leg_length_m": 0.54769, "leg_mass_kg": 1.8689, "leg_mass_below_hip_m": 0.27905, "leg_inertia_kg_m2": 0.0056486,
    "hip_mass_kg": 0.0, "foot_radius_m": 0.18666,
}  # fmt: skip
BOUNCING_FEET = {
    "compass": (
        None,
        ("slope_deg=1", "contact.terrain=plane", "contact.stiffness=1e7", "contact.damping=5",
         "contact.full_damping_penetration=.35", "contact.stiction_velocity=30", "contact.friction_velocity=220"),
        ("fell", 0, 1.124423),
    ),
    "kneed": (
        Path("kneed"), ("contact.stiffness=1e6", "contact.damping=0.3"), ("lifted-off", 1, 0.645038607),
    ),
    "straight-legs": (
        None,
        (f"walker={{type: straight-legs, {', '.join(f'{key}: {value}' for key, value in STICKING_STRAIGHT.items())}}}",
         "slope_deg=1.1808", "gravity_m_s2=11.607", "contact.stiffness=3010400", "contact.exponent=2.0068",
         "contact.damping=0.99795", "contact.full_damping_penetration=0.093905", "contact.static_friction=0.92471",
         "contact.dynamic_friction=0.90164", "contact.stiction_velocity=39.249", "contact.friction_velocity=620.59",
         "contact.terrain=plane"),
        ("fell", 0, 0.669021),
    ),
}  # fmt: skip
# The exponent is below two. The force on a foot vanishes, returns just below the surface, and the foot lifts.
GRIPS_AGAIN = (
    "walker={type: straight-legs, leg_length_m: 1.0341, leg_mass_kg: 6.7135, leg_mass_below_hip_m: 0.32298, "
    "leg_inertia_kg_m2: 0.017306, hip_mass_kg: 0.0, foot_radius_m: 0.44521}",
    "slope_deg=1.6438", "gravity_m_s2=9.268", "contact.stiffness=133000", "contact.exponent=1.9076",
    "contact.damping=2.254", "contact.full_damping_penetration=0.077053", "contact.static_friction=1.1527",
    "contact.dynamic_friction=1.0395", "contact.stiction_velocity=26.758", "contact.friction_velocity=229.6",
)  # fmt: skip
GRIPS_AGAIN_START = (-0.3128194902392747, 0.2554400457507091, -0.8426534582609259, -1.284466381888272)


def from_the_gait(*sets, steps=4, base=None, tolerance=TOLERANCE, method="radau5", start=None):
    config = load(base, sets).config
    gait = find_gaits(rigid_walker(config, "corrected"), config.seed).gait
    scene = contact_scene(config, gait.step_length)
    return scene.walk(start_state(scene, start or gait.state), steps, settings(tolerance, method))


@pytest.mark.parametrize(
    ("sets", "periods"),
    [
        (PINNED, (0.698474, 0.705916)),
        (BOUNCING, (0.711005, 0.723931, 0.718791, 0.711621)),
        (SWITCHING, (0.739270, 0.744060, 0.733988, 0.737583)),
    ],
    ids=["feet pass as the foot lifts", "stance foot bounces", "law switches as the foot lifts"],
)
def test_walk_on_ground_that_carries_after_mid_swing_agrees_with_the_reference(sets, periods):
    walk = from_the_gait(*sets, AFTER_MID_SWING, steps=len(periods))
    assert walk.outcome is Outcome.WALKED
    np.testing.assert_allclose(walk.periods_s, periods, atol=6e-7)


@pytest.mark.parametrize("sets", [(), ("contact.stiction_velocity=1", "contact.friction_velocity=10")])
def test_walk_without_scuffs_is_the_same_on_pads_and_on_a_plane(sets):
    pads, plane = walked(*sets, steps=6), walked(*sets, AFTER_MID_SWING, steps=6)
    np.testing.assert_allclose(plane.touch_time_s, pads.touch_time_s, atol=1e-8)
    np.testing.assert_allclose(plane.slip_m, pads.slip_m, atol=1e-8)
    np.testing.assert_allclose(plane.rolling_m, pads.rolling_m, atol=1e-8)


def test_slip_is_the_same_on_pads_and_plane_if_the_friction_law_switches_at_lift():
    pads, plane = from_the_gait(*SWITCHING), from_the_gait(*SWITCHING, AFTER_MID_SWING)
    np.testing.assert_allclose(plane.slip_m, pads.slip_m, atol=1e-7)


def test_lift_at_the_instant_of_zero_force_is_detected_at_once():
    """If the lift were noticed one solver step later, the slip would include up to 0.05 mm of motion in the air."""
    exact = from_the_gait(*LETS_GO, steps=8, base=Path("kneed"), tolerance=1e-10)
    assert exact.slip_m[[0, 2, 4, 6]] == pytest.approx([1.2121e-3, 1.1332e-3, 1.1529e-3, 1.1495e-3], abs=5e-8)
    for tolerance in (1e-6, 1e-7, 3e-8, 1e-8):
        walk = from_the_gait(*LETS_GO, steps=8, base=Path("kneed"), tolerance=tolerance)
        # the solver's error is several times the tolerance, and velocities are a few m/s
        np.testing.assert_allclose(walk.slip_m, exact.slip_m, atol=10.0 * tolerance)


@pytest.mark.parametrize("method", ["radau5", "dop853"])
@pytest.mark.parametrize("name", BOUNCING_FEET)
def test_solver_does_not_stall_when_bouncing_feet_reach_zero_force(name, method):
    base, sets, expected = BOUNCING_FEET[name]
    for tolerance in (1e-6, 1e-9):
        walk = from_the_gait(*sets, steps=6, base=base, tolerance=tolerance, method=method)
        assert (walk.outcome.label, walk.steps) == expected[:2]
        assert walk.end_time_s == pytest.approx(
            expected[2], abs=max(500.0 * tolerance, 1e-6)
        )  # Each bounce magnifies earlier errors.
        assert walk.work.rhs_evaluations < 400_000


def test_lift_after_an_unresolvable_switching_point_is_detected_at_once():
    for method, tolerance in (("radau5", 1e-7), ("radau5", 1e-8), ("dop853", 1e-8)):
        walk = from_the_gait(*GRIPS_AGAIN, steps=8, tolerance=tolerance, method=method, start=GRIPS_AGAIN_START)
        assert walk.slip_m == pytest.approx([0.0008590980], abs=2e-9)


def test_event_function_rising_from_zero_leaves_the_negative_side_at_once():
    finder = new_crossing_finder(3)
    finder.values[0] = finder.nodes
    assert leaves_side(finder, 0, -1, False) == 0.0
    assert leaves_side(finder, 0, 1, False) > 1.0
    finder.values[0] = finder.nodes * (finder.nodes - 0.25)
    assert leaves_side(finder, 0, -1, False) == pytest.approx(0.25)


def test_knee_strike_time_is_the_same_at_any_tolerance():
    """The solver may need several steps for the last part before the strike."""
    walker = rigid_walker(load(Path("kneed")).config, "corrected")
    start = (*RIGID_ANGLES, *RIGID_RATES)

    def strike(rtol):
        return take_walk(walker, Tolerances("dop853", rtol, 1e-2 * rtol, 10_000), start, 1).knee_strike_time_s[0]

    exact, tolerances = strike(1e-13), np.geomspace(1e-12, 1e-7, 101)
    late = np.array([strike(float(rtol)) - exact for rtol in tolerances])
    assert (np.abs(late) < 100.0 * tolerances).all()
