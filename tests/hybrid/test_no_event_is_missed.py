"""Events that lie close together are all found, on every terrain; the right answers are a plain integration's."""

from pathlib import Path

import numpy as np
import pytest
from contact_walks import TOLERANCE, settings, walked
from kneed_walks import RIGID_ANGLES, RIGID_RATES

from walkerlab.config.loader import load
from walkerlab.hybrid.contact_events import leaves_side
from walkerlab.hybrid.outcome import Outcome
from walkerlab.hybrid.recorded_walk import take_walk
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.events import new_crossing_finder
from walkerlab.solvers.registry import Tolerances

AFTER_MID_SWING = "contact.terrain=after-mid-swing"
HINGED = ("contact.stance=pinned", "walker.foot_radius_m=0", "slope_deg=0.7")
BOUNCING = ("contact.damping=10", "contact.exponent=1.3")
SWITCHING = ("slope_deg=2.8", "contact.exponent=1.3", "contact.full_damping_penetration=0.26")


# of this walker's feet the force law lets go at the instant at which they lift
LETS_GO = (
    "walker.thigh.length_m=0.31605", "walker.thigh.mass_kg=3.8692", "walker.thigh.mass_below_hip_m=0.20839",
    "walker.thigh.mass_ahead_m=7.6409e-05", "walker.thigh.inertia_kg_m2=0.0020891", "walker.shank.length_m=0.29345",
    "walker.shank.mass_kg=0.37339", "walker.shank.mass_below_knee_m=0.084164", "walker.shank.mass_ahead_m=-0.00017211",
    "walker.shank.inertia_kg_m2=0.00012246", "walker.hip_mass_kg=3.9603", "walker.foot_radius_m=0", "slope_deg=3.8186",
    "gravity_m_s2=6.2554", "contact.stiffness=594.19", "contact.exponent=1.7485", "contact.damping=32.138",
    "contact.full_damping_penetration=0.039468", "contact.static_friction=0.45749", "contact.dynamic_friction=0.28989",
    "contact.stiction_velocity=1.6003", "contact.friction_velocity=6.7064", "contact.terrain=plane",
)  # fmt: skip


def from_the_gait(*sets, steps=4, base=None, tolerance=TOLERANCE):
    config = load(base, sets).config
    gait = find_gaits(rigid_walker(config, "corrected"), config.seed).gait
    scene = contact_scene(config, gait.step_length)
    start = start_state(scene, gait.state)
    return scene.walk(start, steps, settings(tolerance))


@pytest.mark.parametrize(
    ("sets", "periods"),
    [
        (HINGED, (0.698474, 0.705916)),
        (BOUNCING, (0.711005, 0.723931, 0.718791, 0.711621)),
        (SWITCHING, (0.739270, 0.744060, 0.733988, 0.737583)),
    ],
    ids=["feet pass as the foot lifts", "stance foot bounces", "law switches as the foot lifts"],
)
def test_after_mid_swing_the_walk_is_the_right_one(sets, periods):
    walk = from_the_gait(*sets, AFTER_MID_SWING, steps=len(periods))
    assert walk.outcome is Outcome.WALKED
    np.testing.assert_allclose(walk.periods_s, periods, atol=6e-7)


@pytest.mark.parametrize("sets", [(), ("contact.stiction_velocity=1", "contact.friction_velocity=10")])
def test_on_both_grounds_a_walk_that_scuffs_no_pad_is_the_same(sets):
    pads, plane = walked(*sets, steps=6), walked(*sets, AFTER_MID_SWING, steps=6)
    np.testing.assert_allclose(plane.touch_time_s, pads.touch_time_s, atol=1e-8)
    np.testing.assert_allclose(plane.slip_m, pads.slip_m, atol=1e-8)
    np.testing.assert_allclose(plane.rolling_m, pads.rolling_m, atol=1e-8)


def test_slips_are_the_same_on_both_grounds_where_the_law_switches_as_the_foot_lifts():
    pads, plane = from_the_gait(*SWITCHING), from_the_gait(*SWITCHING, AFTER_MID_SWING)
    np.testing.assert_allclose(plane.slip_m, pads.slip_m, atol=1e-7)


def test_a_lift_at_the_instant_at_which_the_force_law_lets_go_is_noticed_at_once():
    """A lift noticed a step later adds what the foot moves meanwhile, up to 0.05 mm."""
    exact = from_the_gait(*LETS_GO, steps=8, base=Path("kneed"), tolerance=1e-10)
    assert exact.slip_m[[0, 2, 4, 6]] == pytest.approx([1.2121e-3, 1.1332e-3, 1.1529e-3, 1.1495e-3], abs=5e-8)
    for tolerance in (1e-6, 1e-7, 3e-8, 1e-8):
        walk = from_the_gait(*LETS_GO, steps=8, base=Path("kneed"), tolerance=tolerance)
        # a solver's error of some times the tolerance, at the velocities of some m/s
        np.testing.assert_allclose(walk.slip_m, exact.slip_m, atol=10.0 * tolerance)


def test_a_signal_that_starts_on_its_zero_leaves_its_side_at_once():
    finder = new_crossing_finder(3)
    finder.values[0] = finder.nodes
    assert leaves_side(finder, 0, -1, False) == 0.0
    assert leaves_side(finder, 0, 1, False) > 1.0
    finder.values[0] = finder.nodes * (finder.nodes - 0.25)
    assert leaves_side(finder, 0, -1, False) == pytest.approx(0.25)


def test_a_knee_strikes_at_its_time_at_any_tolerance():
    """Also where the way to it, cut short of the step in which it was seen, takes more than one step."""
    walker = rigid_walker(load(Path("kneed")).config, "corrected")
    start = (*RIGID_ANGLES, *RIGID_RATES)

    def strike(rtol):
        return take_walk(walker, Tolerances("dop853", rtol, 1e-2 * rtol, 10_000), start, 1).knee_strike_time_s[0]

    exact, tolerances = strike(1e-13), np.geomspace(1e-12, 1e-7, 101)
    late = np.array([strike(float(rtol)) - exact for rtol in tolerances])
    assert (np.abs(late) < 100.0 * tolerances).all()
