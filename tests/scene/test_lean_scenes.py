"""Check that each reduced scene gives the same results as the full scene, except for the omitted part."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compass_parts import CompassParts, compass_assembly
from hypothesis import given
from hypothesis import strategies as st
from system_rates import gradient_of, rate_of

from walkerlab.config.loader import load
from walkerlab.physics.ground.compliant import contact_walker
from walkerlab.physics.ground.friction import Coulomb, Frictionless, switching_count
from walkerlab.physics.ground.walker import FootMotion, feet_motion, foot_force, place_on_ground
from walkerlab.physics.hybrid.contact_state import FRICTION_SWITCHES, MATERIAL
from walkerlab.physics.mechanics.parts import Assembly, Body, Particle
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.runner import Options, execute
from walkerlab.pipeline.stages import contact_sim, simulate
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.scene import omissions
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_scene

START = (-0.2042, 0.1694, -0.6, -0.86)
NO_FRICTION = Coulomb(0.0, 0.0, 0.1, 1.0)
BOTH = (True, True)
EPS = np.finfo(float).eps
angles, rates = st.floats(-0.5, 0.5), st.floats(-3.0, 3.0)


def walker_with(radius=0.001, friction=None):
    scene = contact_scene(load(None, (f"walker.foot_radius_m={radius}",)).config, 0.3714)
    return scene.walker if friction is None else scene.walker._replace(friction=friction)


def over(walker, foot, height, theta, omega, velocity):
    """Return the state in which the lowest point of a foot is at a height above the ground."""
    state = (0.0, 1.0, *theta, *velocity, *omega)
    return (0.0, 1.0 + height - feet_motion(walker.whole, state)[foot].height, *state[2:])


def same_to_rounding(found, expected, scale):
    assert np.abs(np.subtract(found, expected)).max() <= 64 * EPS * (scale + np.abs(expected).max())


def stiffest(walker, y):
    """Return the factor by which the ground magnifies rounding of a foot's height, which is force gradient over
    mass.
    """
    J = gradient_of(place_on_ground(walker, BOTH), y)
    return np.abs(J).max()


states = st.tuples(
    st.sampled_from((0, 1)), st.floats(-1e-3, 1e-3), st.tuples(angles, angles), st.tuples(rates, rates),
    st.tuples(rates, rates),
)  # fmt: skip


@given(state=states, radius=st.sampled_from((0.0, 0.001, 0.1)))
def test_frictionless_ground_acts_like_a_coefficient_of_zero(state, radius):
    zero, none = (walker_with(radius, law) for law in (NO_FRICTION, Frictionless()))
    y = over(zero, *state)
    assert rate_of(place_on_ground(none, BOTH), y) == rate_of(place_on_ground(zero, BOTH), y)
    found, expected = gradient_of(place_on_ground(none, BOTH), y), gradient_of(place_on_ground(zero, BOTH), y)
    np.testing.assert_array_equal(found, expected)


def rates_with_point_feet(walker, y):
    """Return the rates of the state for feet that are described without a radius, with the force laws of the
    package.
    """
    whole, n = walker.whole, int(walker.whole.bodies)
    angle, omega = np.array(y[2 : 2 + n]) + walker.slope, np.array(y[4 + n :])
    s, c = np.sin(angle), np.cos(angle)
    A, B, delta = whole.A[:n, :n], whole.B[:n, :n], angle[None, :] - angle[:, None]
    push, torques = np.zeros(2), (A * np.sin(delta) - B * np.cos(delta)) @ omega**2
    for foot in range(2):
        d_x, d_y = whole.foot_x[foot, :n], whole.foot_y[foot, :n]
        forward, upward = c * d_x - s * d_y, s * d_x + c * d_y
        height = y[1] + upward.sum()
        slip, vertical_velocity = y[2 + n] - omega @ upward, y[3 + n] + omega @ forward
        if height < 0.0:
            force = foot_force(walker, FootMotion(y[0] + forward.sum(), height, slip, vertical_velocity))
            push += (force.along, force.normal.force)
            torques = torques - force.along * upward + force.normal.force * forward
    turning = np.linalg.solve(A * np.cos(delta) + B * np.sin(delta), torques)
    gravity = np.array((walker.gravity_along, -walker.gravity_down))
    return (*y[2 + n :], *(gravity + push / walker.mass), *turning)


@given(state=states)
def test_point_foot_is_a_ball_of_radius_zero(state):
    walker = walker_with(radius=0.0)
    y = over(walker, *state)
    same_to_rounding(rate_of(place_on_ground(walker, BOTH), y), rates_with_point_feet(walker, y), stiffest(walker, y))


@given(state=states, clearance=st.floats(1e-9, 0.5))
def test_foot_in_the_air_moves_as_if_there_were_no_ground(state, clearance):
    walker = walker_with()
    foot, _, *rest = state
    y = over(walker, foot, clearance, *rest)
    has_ground = (foot != 0, foot != 1)
    assert rate_of(place_on_ground(walker, has_ground), y) == rate_of(place_on_ground(walker, BOTH), y)


@given(state=states)
def test_leg_without_inertia_is_a_point_mass_on_a_massless_bar(state):
    """The leg is described in two ways, as a body with zero inertia and as a particle."""
    legs = compass_assembly(CompassParts(1.0, 0.5, 5.0, 10.0, 0.0, 0.001))
    particles = tuple(Particle(f"mass of {leg.name}", leg.mass_kg, leg.name, leg.centre_m) for leg in legs.bodies)
    bars = tuple(Body(leg.name, 0.0, (0.0, 0.0)) for leg in legs.bodies)
    points = Assembly(bars, legs.joints, (*particles, *legs.particles), legs.feet)
    one = walker_with()
    other = contact_walker(points, one.normal, one.friction, 9.81, one.slope)
    y = over(one, *state)
    found = rate_of(place_on_ground(other, BOTH), y)
    expected = rate_of(place_on_ground(one, BOTH), y)
    same_to_rounding(found, expected, stiffest(one, y))


def test_walk_on_frictionless_ground_equals_that_with_zero_coefficients():
    """Steps are equal to the last bit, because no solver step ends at a switching point of the friction law."""
    ends = []
    for law in (NO_FRICTION, Frictionless()):
        scene = contact_scene(load(None, ()).config, 0.3714)
        ground = scene.ground._replace(frame=scene.ground.frame._replace(locate_switching=False))
        scene = replace(scene, walker=scene.walker._replace(friction=law), ground=ground)
        walk = scene.walk(start_state(scene, START), 2, Tolerances("radau5", 1e-7, 1e-9, 10**6), 0.01)
        ends.append((walk.outcome, walk.end_time_s, walk.end_state, walk.samples.states.tolist(), walk.work))
    assert ends[0] == ends[1]


def test_frictionless_ground_has_four_fewer_switching_points():
    assert switching_count(Coulomb(0.9, 0.7, 0.1, 1.0)) == MATERIAL - FRICTION_SWITCHES == 4
    assert switching_count(Frictionless()) == 0


@pytest.fixture(scope="module")
def walks():
    """Return walks of both models, by stage and by requested outputs."""
    given = ("strides=1", f"start={list(START)}", "contact.pad_pitch=0.3714")

    def walk(stage, outputs):
        config = load(None, (*given, f"outputs=[{','.join(outputs)}]")).config
        return stage.run(config, {}, Silent())

    everything = ("states", "energies", "forces")
    wanted = [everything, *((one,) for one in everything), ()]
    return {stage: {asked: walk(stage, asked) for asked in wanted} for stage in (simulate, contact_sim)}


@pytest.mark.parametrize("stage", [simulate, contact_sim], ids=lambda stage: stage.__name__)
def test_requested_outputs_equal_those_of_the_full_result(walks, stage):
    full, *parts = walks[stage].values()
    seen = set()
    for part in parts:
        for path, group in part.groups.items():
            for name in group.variables:
                np.testing.assert_array_equal(group[name], full[path][name])
                seen.add((path, name))
        same = {key: value for key, value in part.summary.items() if key != "left_out"}
        assert same == {key: value for key, value in full.summary.items() if key != "left_out"}
    assert seen == {(path, name) for path, group in full.groups.items() for name in group.variables}


@pytest.mark.parametrize(
    ("stage", "numbers"),
    [(simulate, omissions.RIGID_NUMBERS), (contact_sim, omissions.CONTACT_NUMBERS)],
    ids=["simulate", "contact_sim"],
)
@pytest.mark.parametrize("output", ["states", "energies", "forces"])
def test_stated_size_of_an_output_is_correct(walks, stage, numbers, output):
    group = walks[stage][(output,)]["trajectory"]
    samples = group["time"].size
    columns = [variable.values.size / samples for variable in group.variables.values() if variable.units != "1"]
    assert sum(columns) - 1 == numbers[output]  # The time itself is not counted.


def test_stated_savings_of_omitted_computations_are_correct():
    said = omissions.contact_walk_omissions(
        load(None, ("contact.friction=none", "contact.stance=pinned", "outputs=[]")).config
    )
    saved = {entry["what"]: entry["saves"] for entry in said}
    assert saved["tangential velocity and friction force"].startswith(
        f"{MATERIAL - FRICTION_SWITCHES} of a foot's {MATERIAL} event functions"
    )
    scene = contact_scene(load(None, ("contact.stance=pinned",)).config, 0.3714)
    free, pinned = scene.walker.size, 2 * int(scene.walker.forms[1, 0].bodies)
    assert saved["floating base and stance contact in the first step"].startswith(f"{free - pinned} of {free} ")
    config = load(None, ("outputs=[]",)).config
    rigid, angles = (
        omissions.rigid_walk_omissions(config),
        len(rigid_scene(config, config.ground, ()).walker.zero_state),
    )
    assert rigid[0]["saves"].startswith(f"{free - angles} of {free} ")
    assert all(entry["what"] and entry["why"] and entry["saves"] for entry in (*said, *rigid))


@pytest.mark.parametrize("sets", [("outputs=[]", "contact.friction=none"), ("walker.leg_inertia_kg_m2=0.1",)])
def test_preview_lists_the_same_omissions_as_the_result(tmp_path, sets):
    """The preview derives them from the config before anything has run."""
    found = load(None, (*sets, "strides=1", f"start={list(START)}", "contact.pad_pitch=0.3714"))
    folder = RunFolder(tmp_path, found.run_name)
    before = execute(found.config, "contact-sim", folder, Options(dry=True)).left_out
    assert execute(found.config, "contact-sim", folder).left_out == before
    assert any(entry.saves for entry in before)


@pytest.mark.parametrize(
    ("name", "sets", "angles"),
    [("paper", (), 2), ("torso", (), 3), ("kneed", (), 3), ("kneed", ("walker.knee.lock=compliant",), 4)],
)
def test_pinned_step_integrates_only_the_angles_that_can_change(name, sets, angles):
    config = load(Path(name), (*sets, "contact.stance=pinned")).config
    scene = contact_scene(config, 0.4)
    # The stance knee is locked, so a kneed walker has one body less.
    assert scene.walker.forms[1, 2 if scene.walker.kneed else 0].bodies == angles
    said = next(one for one in omissions.contact_walk_omissions(config) if "pinned" in one["why"])
    assert f"{angles} angles suffice" in said["why"]
    assert said["saves"].startswith(f"4 of {2 * angles + 4} equations")
