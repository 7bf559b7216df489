"""Compare derivatives of step maps, from variational equations, with differences, and use them in Newton's method."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config import loader
from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled
from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.contact_map import AdaptivePads, step_from_section
from walkerlab.physics.orbits.fixed_point import find_gaits as find_gaits_of_model
from walkerlab.physics.orbits.newton import Effort, newton
from walkerlab.physics.orbits.rigid_map import RigidMap
from walkerlab.physics.orbits.similarity import unit_walker
from walkerlab.physics.orbits.step_map import gait_near, walk_steps
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import contact_scene


def find_gaits(walker, *rest, **options):
    return find_gaits_of_model(assembled(walker), *rest, **options)


# central differences of order six, the Richardson extrapolation of those of order two with steps 1, 2 and 3
STENCIL = {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}
AGREEMENT = 1e-7
ROUNDING = 1e-13


def slope_of(ends, z, steps):
    """Return the derivative of the map `ends` at z by differences, with one of `steps` for each coordinate."""
    columns = []
    for j, h in enumerate(steps):
        along = h * np.eye(z.size)[j]
        rises = [weight * (ends(z + k * along) - ends(z - k * along)) for k, weight in STENCIL.items()]
        columns.append(sum(rises) / h)
    return np.column_stack(columns)


def is_quadratic(residuals):
    """Whether there are at least three residuals, each of the order of the square of the previous one, down to
    rounding.
    """
    seen = [residual for residual in residuals if residual > ROUNDING]
    factors = [after / before**2 for before, after in pairwise(seen)]
    return len(seen) >= 3 and max(factors) < 100.0


# ---- rigid ---------------------------------------------------------------------------------------------------------

PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)
PRINTED = PAPER._replace(c21_sign=AS_PRINTED)
STEEP = PAPER._replace(slope=np.deg2rad(4.0))
WALKERS = {"corrected": PAPER, "as printed": PRINTED, "four degrees": STEEP}
OFF_THE_GAIT = {"at the gait": (0.0, 0.0, 0.0), "wider": (5e-3, -2e-2, 1e-2), "slower": (-2e-3, 3e-2, 2e-2)}


def unit_map(walker):
    """Return the step map of a walker that has unit size."""
    unit = unit_walker(assembled(walker))[0]
    return RigidMap(lambda _: unit, 1.0, unit, Tolerances("dop853", 1e-13, 1e-15, 10**5))


def beside_the_gait(walker, offset):
    """Return the coordinates of a walker's gait, in those of its unit walker, with an offset."""
    in_units = [1.0] + [unit_walker(assembled(walker))[1].time] * 2
    return in_units * np.add(find_gaits(walker).gait.state[1:], OFF_THE_GAIT[offset])


@pytest.mark.parametrize("offset", OFF_THE_GAIT)
@pytest.mark.parametrize("name", WALKERS)
def test_rigid_step_derivative_equals_finite_differences(name, offset):
    """The derivative passes the swing by the variational equations, and the heel strike by the saltation matrix."""
    walker = WALKERS[name]
    step_map, z = unit_map(walker), beside_the_gait(walker, offset)

    def ends(z):
        step = step_map.step(z, 0.0)
        assert step.outcome is Outcome.WALKED
        return step.z

    DP = step_map.step(z, 0.0).DP
    np.testing.assert_allclose(DP, slope_of(ends, z, [1e-3] * 3), rtol=0.0, atol=AGREEMENT)


@pytest.mark.parametrize("name", WALKERS)
def test_newton_converges_quadratically_on_the_rigid_step_map(name):
    walker = WALKERS[name]
    step_map, z, residuals = unit_map(walker), beside_the_gait(walker, "wider"), []
    while not residuals or residuals[-1] > ROUNDING:
        # This makes one move only, because the search stops at the first smaller residual.
        found = gait_near(step_map, z, 0.0, Effort(0.999 * residuals[-1] if residuals else 1.0))
        z = found.z
        residuals.append(found.residual)
    assert is_quadratic(residuals)


# ---- contact -------------------------------------------------------------------------------------------------------

RIGID_STEP = 0.3718088  # step length of the rigid gait at one degree
PITCH = 0.3687  # about the step length of the contact gait
NEAR_THE_GAIT = np.array([0.74974553, 0.00538217, 0.43231631, 0.00982748, 1.3485189, -0.29964029])
ASIDE = np.array([1e-5, 2e-3, 1e-3, 1e-4, 5e-3, -5e-3])
# The force changes over a fraction of the penetration, which is a tenth of a millimetre, so the step must be smaller.
STEPS = (7e-7, 3e-5, 3e-5, 3e-5, 3e-5, 3e-5)


@pytest.fixture(scope="module")
def scene():
    return contact_scene(loader.load(Path("paper"), ["slope_deg=1"]).config, RIGID_STEP, RIGID_STEP)


def stepped(scene, z, tolerance):
    tolerances = Tolerances("radau5", tolerance, 1e-2 * tolerance, 10**6)
    step = step_from_section(scene, tolerances, z, PITCH)
    assert step.outcome is Outcome.WALKED
    return step


@pytest.mark.parametrize("z", [NEAR_THE_GAIT, NEAR_THE_GAIT + ASIDE], ids=["at the gait", "off it"])
def test_contact_step_derivative_equals_finite_differences(scene, z):
    """The derivative passes touches, releases and all other switching points of the force law, where the Jacobian
    jumps.
    """
    slope = slope_of(lambda z: stepped(scene, z, 1e-12).z, z, STEPS)
    np.testing.assert_allclose(stepped(scene, z, 1e-12).DP, slope, rtol=0.0, atol=AGREEMENT)


def test_contact_derivative_converges_with_the_tolerance(scene):
    """The derivative does not converge if a switching point is passed on the wrong side."""
    exact = stepped(scene, NEAR_THE_GAIT, 1e-12).DP
    errors = [np.abs(stepped(scene, NEAR_THE_GAIT, tolerance).DP - exact).max() for tolerance in (1e-9, 1e-11)]
    assert errors[0] < 1e-5
    assert errors[1] < AGREEMENT


def test_newton_converges_quadratically_on_the_contact_step_map(scene):
    # The error of the walk has to be below the last residual.
    tolerances = Tolerances("radau5", 1e-11, 1e-13, 10**6)

    def moves(tolerance):
        pads = AdaptivePads(lambda _: scene.walker, scene.ground, tolerances, PITCH)
        found = newton(lambda z: walk_steps(pads, z, 0.0, 1).mismatch(), NEAR_THE_GAIT + ASIDE, Effort(tolerance))
        return found.corrections, found.evaluated.residual

    # Tolerances between two residuals show each residual in turn.
    residuals = dict(moves(10.0**-digits) for digits in range(2, 11))
    assert is_quadratic([residuals[move] for move in sorted(residuals)])
    assert max(residuals) <= 4
