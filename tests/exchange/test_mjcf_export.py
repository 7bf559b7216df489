"""Check that exported MJCF compiles without warnings, and that the model sinks in and walks like our contact model."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from exported_walkers import LIMPING, ONE_KNEE, PADS, PARTS, export_of, files_of, with_gait

from walkerlab.config.loader import load
from walkerlab.errors import ConfigError
from walkerlab.exchange.engine_scene import contact_target
from walkerlab.exchange.export import export_model
from walkerlab.exchange.exported import prepare_export
from walkerlab.exchange.mjcf import inverse_weights, script_text, walker_text
from walkerlab.physics.ground.knees import lock_knee

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'walkerlab[engines]'")

STEPS = 10
BLOCK = 4  # number of time steps between two checks of the feet
TORSO = ("torso", PADS, "contact.pad_pitch=own")
WALKERS = [("paper",), ("round-feet", PADS), TORSO]
HEAVY_LEGS = ("paper", "walker.foot_to_mass_m=0.2", "walker.leg_inertia_kg_m2=0.2", "walker.leg_mass_kg=8")
BY_PARTS = ("compass-by-parts",)
SPRUNG = ("paper", "walker.hip.spring_N_m_per_rad=1", "walker.hip.damping_N_m_s_per_rad=0.02")
KNEED, ROUND_KNEED, LEVEL_KNEED = ("kneed",), ("kneed-round-feet",), ("kneed-level",)
STOPPED = ("kneed", "walker.knee.lock=compliant", "walker.knee.stop_stiffness=1e4", "walker.knee.stop_damping=9")
AT_TOUCH = ("kneed", "walker.knee.release=touch")
KNEED_TORSO = ("kneed", "walker.torso.mass_kg=0.2", "walker.torso.above_hip_m=0.2")
WEIGHED = [*WALKERS, ("level",), HEAVY_LEGS, SPRUNG, BY_PARTS, KNEED, ROUND_KNEED, LIMPING[1], LIMPING[3]]


@pytest.fixture(autouse=True)
def no_callback():
    """Remove the callback. MuJoCo's callbacks are global, and no model compiles while a Python callback is set."""
    yield
    mujoco.set_mjcb_control(None)


def text_of(*walker):
    return next(iter(files_of("mjcf", "contact", *walker).files.values()))


def model_of(*walker):
    return mujoco.MjModel.from_xml_string(text_of(*walker))


def at_start(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("gait").id)
    mujoco.mj_forward(model, data)
    return data


def walked(model, steps):
    """Return the touches (s) and positions (m) of a swing foot that meets its pads ahead of the stance foot."""
    data, stance, touches = at_start(model), 1, []
    feet = [model.geom(f"foot_{foot}").id for foot in (1, 2)]
    while len(touches) < steps and data.time < 1.2 * steps:
        mujoco.mj_step(model, data, BLOCK)
        along, swing = data.geom_xpos[feet, 0], 1 - stance
        if along[swing] > along[stance] and feet[swing] in data.contact.geom[: data.ncon]:
            stance = swing
            touches.append((data.time, along[swing]))
    assert not any(warning.number for warning in data.warning)
    return np.array(touches)


@pytest.fixture(params=WEIGHED, ids=" ".join)
def weighed(request, tmp_path_factory):
    """Return a walker to export: one of each type that can be exported, and some with other masses and drives."""
    if request.param is not BY_PARTS:
        return request.param
    path = tmp_path_factory.getbasetemp() / "compass-by-parts.yaml"
    path.write_text(PARTS)
    return (str(path),)


def normal_force(model, foot, depth, weight):
    """Return MuJoCo's force (N) on a foot at `depth` (m) if the joints hold the walker in the pose of the gait."""
    data = at_start(model)
    geom = model.geom(f"foot_{foot}").id
    pad = next(pad for pad in range(model.ngeom) if model.geom_conaffinity[pad] == model.geom_contype[geom])
    model.geom_contype[np.arange(model.ngeom) != geom] = 0
    meets = (np.sort((model.pair_geom1, model.pair_geom2), axis=0) == np.sort((pad, geom))[:, None]).all(axis=0)
    assert meets.sum() == 1
    model.pair_margin[~meets] = -1.0
    ground = model.geom_pos[pad, 2] + model.geom_size[pad, 2]
    data.qvel[:] = 0.0
    data.qpos[0] += model.geom_pos[pad, 0] - data.geom_xpos[geom, 0]
    data.qpos[1] += ground + model.geom_size[geom, 0] - depth - data.geom_xpos[geom, 2]
    mujoco.mj_forward(model, data)
    lever = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, lever, None, data.geom_xpos[geom], model.geom_bodyid[geom])
    # With this force of the ground, no body would accelerate.
    data.qfrc_applied[:] = data.qfrc_bias - data.qfrc_passive - weight * lever[2]
    mujoco.mj_forward(model, data)
    assert data.contact.geom.tolist() == [[pad, geom]] or data.contact.geom.tolist() == [[geom, pad]]
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, force)
    return force[0]


@pytest.mark.parametrize("foot", [1, 2])
def test_static_penetration_of_a_foot_equals_that_of_the_contact_law(weighed, foot):
    scene = export_of(*weighed).scene
    weight = scene.ours.mass * scene.ours.gravity_down
    depth = contact_target(scene).penetration
    assert normal_force(model_of(*weighed), foot, depth, weight) == pytest.approx(weight, rel=1e-6)


def test_inverse_weights_equal_those_computed_by_mujoco(weighed):
    compiled, weights = model_of(*weighed), inverse_weights(export_of(*weighed).model)
    assert weights.bodies == pytest.approx(compiled.body_invweight0[1:, 0], rel=1e-9)
    assert weights.joints == pytest.approx(compiled.dof_invweight0[2:], rel=1e-9)


def test_inverse_weights_of_the_paper_legs_follow_from_their_masses():
    assert inverse_weights(export_of("paper").model).bodies == pytest.approx([7.0 / 180.0, 1.0 / 12.0], rel=1e-12)


@pytest.mark.parametrize("walker", [*WALKERS, ("level",)], ids=lambda walker: walker[0])
def test_model_compiles_without_warnings_and_survives_saving(walker, tmp_path, capfd):
    model = model_of(*walker)
    first, second = tmp_path / "first.xml", tmp_path / "second.xml"
    mujoco.mj_saveLastXML(str(first), model)
    again = mujoco.MjModel.from_xml_path(str(first))
    mujoco.mj_saveLastXML(str(second), again)
    assert first.read_text() == second.read_text()
    for field in ("body_mass", "body_ipos", "body_inertia", "geom_pos", "geom_size", "geom_solref", "key_qpos"):
        # MuJoCo saves at least six digits.
        assert getattr(again, field) == pytest.approx(getattr(model, field), rel=1e-5, abs=1e-6), field
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("walker", WALKERS, ids=lambda walker: walker[0])
def test_plain_simulation_takes_ten_steps_on_the_pads(walker):
    export = export_of(*walker)
    assert export.walk.steps == STEPS
    touches = walked(model_of(*walker), STEPS)
    assert len(touches) == STEPS
    # MuJoCo has another contact law, which is tuned to ours. The remaining difference is less than half a per cent.
    periods, lengths = np.diff(touches, axis=0)[-4:].T
    assert periods == pytest.approx(export.walk.periods_s[-4:], rel=0.002)
    assert lengths == pytest.approx(export.walk.lengths_m[-4:], rel=0.005)


def test_paper_walker_takes_the_same_steps_in_mujoco():
    """The last step of our contact model takes 0.7110 s and is 0.3608 m long."""
    touches = walked(model_of("paper"), STEPS)
    assert np.diff(touches, axis=0)[-1] == pytest.approx([0.7111, 0.3604], abs=1e-4)


def test_mujoco_walk_starts_from_the_same_state():
    export, model = export_of(*TORSO), model_of(*TORSO)
    data = at_start(model)
    angles = np.array(export.scene.start[2:5]) + export.scene.ours.slope
    names = [body.name for body in export.scene.assembly.bodies]
    matrices = [data.body(name.replace(" ", "_")).xmat.reshape(3, 3) for name in names]
    assert [np.arctan2(m[2, 0], m[0, 0]) for m in matrices] == pytest.approx(angles, abs=1e-12)
    assert mujoco.mj_getTotalmass(model) == pytest.approx(export.scene.ours.mass, rel=1e-12)
    centre = data.subtree_com[1]
    assert centre[[0, 2]] == pytest.approx(export.scene.start[:2], abs=1e-12)
    velocity = np.zeros((3, model.nv))
    mujoco.mj_jacSubtreeCom(model, data, velocity, 1)
    assert (velocity @ data.qvel)[[0, 2]] == pytest.approx(export.scene.start[5:7], abs=1e-12)


def test_torso_stays_on_the_bisector():
    model = model_of(*TORSO)
    data = at_start(model)
    for _ in range(5000):
        mujoco.mj_step(model, data)
    assert data.joint("hinge of torso").qpos[0] == pytest.approx(0.5 * data.joint("hip").qpos[0], abs=2e-4)


def test_hip_spring_and_damper_are_joint_properties():
    model = model_of("paper", "walker.hip.spring_N_m_per_rad=1", "walker.hip.damping_N_m_s_per_rad=0.02")
    hip = model.joint("hip")
    assert (float(hip.stiffness[0]), float(model.dof_damping[hip.dofadr[0]])) == (1.0, 0.02)


def script_in(folder, name, files):
    """Write exported files, and import the script among them."""
    for file, text in files.items():
        (folder / file).write_text(text)
    spec = importlib.util.spec_from_file_location(f"{name}_script", folder / f"{name}.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


def steps_of(walk, steps, until_s=12.0):
    """Return periods (s) and lengths (m) of a walk with the callback of the script."""
    while len(walk.touches_s) < steps and walk.data.time < until_s:
        mujoco.mj_step(walk.model, walk.data)
    return np.diff(walk.touches_s, prepend=0.0), np.diff(walk.touches_m, prepend=0.0)


def walk_of(folder, *walker, slope="gravity"):
    exported = export_model(*with_gait(*walker), "mjcf", slope=slope)
    text = next(iter(exported.files.values()))
    script = script_in(folder, "walker", {"walker.py": script_text()})
    mujoco.set_mjcb_control(None)
    return script.Walk(mujoco.MjModel.from_xml_string(text))


def test_driven_walker_walks_with_the_exported_script(tmp_path, capsys):
    files = files_of("mjcf", "contact", "level").files
    assert list(files) == ["level.xml", "level.py"]
    steps = 5
    script_in(tmp_path, "level", files).main(str(tmp_path / "level.xml"), steps, False)
    *lines, last = capsys.readouterr().out.splitlines()
    assert len(lines) == steps
    touches = np.array([[float(word) for word in line.replace(",", "").split() if "." in word] for line in lines])
    walk = export_of("level").walk
    periods, lengths = np.diff(touches, axis=0, prepend=0.0).T
    assert periods == pytest.approx(walk.periods_s[:steps], rel=0.002)
    assert lengths == pytest.approx(walk.lengths_m[:steps], rel=0.003)
    assert last.endswith(f"in walkerlab: {walk.periods_s[steps - 1]:.4f} s, {walk.lengths_m[steps - 1]:.4f} m")
    assert "mujoco" in sys.modules


def test_walker_that_falls_takes_fewer_steps_than_requested(tmp_path, capsys):
    files = files_of("mjcf", "contact", "level").files
    script = script_in(tmp_path, "level", files)
    script.Walk.drive = lambda walk, swing: None
    script.main(str(tmp_path / "level.xml"), 3, False)
    assert capsys.readouterr().out.splitlines()[-1] == "it walked 1 of 3 steps"


# The first steps suffice here. docs/exchange-details.md has all ten.
@pytest.mark.parametrize(
    ("walker", "steps"), [(KNEED, 2), (ROUND_KNEED, 2), (LEVEL_KNEED, 3), (STOPPED, 2), (AT_TOUCH, 2)]
)
def test_kneed_walker_takes_the_same_steps_with_the_exported_script(walker, steps, tmp_path):
    walk = export_of(*walker).walk
    periods, lengths = steps_of(walk_of(tmp_path, *walker), steps)
    assert periods == pytest.approx(walk.periods_s[:steps], rel=0.01)
    assert lengths == pytest.approx(walk.lengths_m[:steps], rel=0.01)


@pytest.mark.parametrize("walker", [*LIMPING, ONE_KNEE], ids=lambda walker: walker[0])
def test_walker_whose_legs_differ_takes_the_same_steps_in_mujoco(walker, tmp_path):
    walk = export_of(*walker).walk
    periods, lengths = steps_of(walk_of(tmp_path, *walker), walk.steps)
    assert periods == pytest.approx(walk.periods_s, rel=0.004)
    assert lengths == pytest.approx(walk.lengths_m, rel=0.004)
    assert with_gait(*walker)[1].asymmetry != 0.0


def test_damping_of_each_knee_is_a_property_of_its_joint():
    model = model_of(
        "kneed", "walker.knee.damping_N_m_s_per_rad=0.02", "walker.leg_2={knee: {damping_N_m_s_per_rad: 0}}"
    )
    assert [float(model.joint(f"knee_{leg}").damping[0]) for leg in (1, 2)] == [0.02, 0.0]


def test_exported_script_reacts_to_the_state_and_not_to_time(tmp_path):
    """The walk starts with 1.02 times the rates of the gait, so touches and locks do not come at the times of
    our walk.
    """
    walk = walk_of(tmp_path, *KNEED)
    walk.data.qvel *= 1.02
    periods, _ = steps_of(walk, 2)
    assert len(periods) == 2
    assert abs(periods[0] - export_of(*KNEED).walk.periods_s[0]) > 0.001


def test_locked_knee_stays_straight_under_load(tmp_path):
    walk, bends = walk_of(tmp_path, *KNEED), []
    while walk.data.time < 0.3:
        mujoco.mj_step(walk.model, walk.data)
        bends.append(walk.data.joint("knee_2").qpos[0])
    assert np.abs(bends).max() < 1e-6


@pytest.mark.parametrize("walker", [KNEED, KNEED_TORSO], ids=["kneed", "torso"])
def test_knee_lock_in_mujoco_equals_our_plastic_impact(walker, tmp_path):
    """Velocities after the lock equal those of `lock_knee`, up to the time step in which the knee became straight."""
    export, walk = export_of(*walker), walk_of(tmp_path, *walker)
    data, lock = walk.data, walk.lock
    seen = []

    def watched(leg):
        before = data.qvel.copy()
        lock(leg)
        seen.append((data.qpos.copy(), before, data.qvel.copy()))

    walk.lock = watched
    while not seen:
        mujoco.mj_step(walk.model, data)
    q, before, after = seen[0]
    ours, scene = export.scene.ours, export.scene
    state = scene.about_centre(q, before)
    expected = lock_knee(ours.whole, ours.forms[0, 3], state).state
    assert scene.about_centre(q, after) == pytest.approx(expected, rel=1e-4, abs=1e-4)
    assert np.abs(after - before).max() > 1.0


def test_knee_stop_in_mujoco_has_the_same_torque_as_ours():
    """The exported stiffness and damping must allow for `dof_invweight0`, by which MuJoCo scales a limit."""
    export, model = export_of(*STOPPED), model_of(*STOPPED)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    stop, knee = export.scene.ours.stop, model.joint("knee_1")
    model.pair_margin[:] = -1.0
    data.qvel[:] = 0.0
    data.qpos[1] += 1.0
    data.qpos[knee.qposadr], data.qvel[knee.dofadr] = 1e-3, 0.5
    mujoco.mj_forward(model, data)
    # The impedance adds a thousandth of the inertia, which resists the acceleration.
    expected = -(stop.stiffness * 1e-3 + stop.damping * 0.5)
    assert data.qfrc_constraint[knee.dofadr] == pytest.approx(expected, rel=0.01)


def test_reset_to_the_keyframe_restarts_the_same_walk(tmp_path):
    walk = walk_of(tmp_path, *KNEED)
    first = np.array(steps_of(walk, 1))
    mujoco.mj_resetDataKeyframe(walk.model, walk.data, 0)
    walk.data.time = 0.0
    mujoco.mj_step(walk.model, walk.data)
    assert walk.touches_s == []
    assert np.array(steps_of(walk, 1)) == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize(("walker", "steps"), [(("paper",), 2), (("level",), 2), (KNEED, 1)])
def test_tilted_ground_and_tilted_gravity_give_the_same_walk(walker, steps, tmp_path):
    walks = [walk_of(tmp_path, *walker, slope=slope) for slope in ("gravity", "geometry")]
    gravity, ground = (walk.model.opt.gravity for walk in walks)
    assert ground == pytest.approx([0.0, 0.0, -np.linalg.norm(gravity)], abs=1e-15)
    assert walks[0].model.key_qpos == pytest.approx(walks[1].model.key_qpos, abs=0.0)
    found = []
    for walk in walks:
        mujoco.set_mjcb_control(walk.control)
        found.append(np.array(steps_of(walk, steps)))
    # The stiffness of the contact magnifies rounding.
    assert found[1] == pytest.approx(found[0], abs=1e-8)
    mujoco.mj_kinematics(walks[1].model, walks[1].data)
    hip = walks[1].data.xanchor[walks[1].hip.id]
    slope = export_of(*walker).scene.ours.slope
    assert hip @ (np.cos(slope), 0.0, -np.sin(slope)) == pytest.approx(walks[1].data.qpos[0], abs=1e-12)


RADII = (0.0, 0.001, 0.02, 0.1, 0.3)


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("walker", [("round-feet", PADS), KNEED], ids=["compass", "kneed"])
def test_legs_touch_only_the_ground_of_their_lane(walker, radius):
    """In programs that ignore collision bits and pairs, every shape collides with every other."""
    name, *sets = walker
    config = load(Path(name), (*sets, f"walker.foot_radius_m={radius}")).config
    export = prepare_export(config, with_gait(*walker)[1])
    model = mujoco.MjModel.from_xml_string(walker_text(export, []))
    data = mujoco.MjData(model)
    feet = [model.geom(f"foot_{foot}").id for foot in (1, 2)]
    limbs = [geom for geom in range(model.ngeom) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE]
    pads = [geom for geom in range(model.ngeom) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX]
    for lean in np.linspace(-0.6, 0.6, 7):
        data.qpos[:] = 0.0
        data.qpos[2], data.qpos[3] = lean, -2.0 * lean
        mujoco.mj_kinematics(model, data)
        data.qpos[1] -= min(data.geom_xpos[foot, 2] - model.geom_size[foot, 0] for foot in feet)
        data.qpos[1] += model.geom_pos[pads[0], 2] + model.geom_size[pads[0], 2]
        mujoco.mj_kinematics(model, data)
        for foot in feet:
            others = [pad for pad in pads if model.geom_contype[foot] != model.geom_conaffinity[pad]]
            across = abs(data.geom_xpos[foot, 1] - model.geom_pos[others, 1])
            assert (across > model.geom_size[foot, 0] + model.geom_size[others, 1]).all()
            legs = [limb for limb in limbs if np.sign(data.geom_xpos[limb, 1]) != np.sign(data.geom_xpos[foot, 1])]
            assert len(legs) == len(limbs) // 2
            reach = model.geom_size[foot, 0] + model.geom_size[legs, 0]
            assert (abs(data.geom_xpos[foot, 1] - data.geom_xpos[legs, 1]) > reach).all()
        for limb in limbs:
            axis, half = data.geom_xmat[limb].reshape(3, 3)[:, 2], model.geom_size[limb, 1]
            lowest = data.geom_xpos[limb, 2] - half * abs(axis[2]) - model.geom_size[limb, 0]
            sole = min(data.geom_xpos[foot, 2] - model.geom_size[foot, 0] for foot in feet)
            assert lowest > sole


@pytest.mark.parametrize("arguments", [["2"], ["level.xml", "2"]])
def test_script_of_a_driven_walker_finds_the_model_in_its_folder(tmp_path, arguments):
    for name, text in files_of("mjcf", "contact", "level").files.items():
        (tmp_path / name).write_text(text)
    done = subprocess.run([sys.executable, "level.py", *arguments], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [line.partition(":")[0] for line in done.stdout.splitlines()] == ["step 1", "step 2", "step 2"]


@pytest.mark.skipif(
    shutil.which("xvfb-run") is None or shutil.which("xauth") is None, reason="no display: apt-get install xvfb xauth"
)
def test_script_shows_the_walk_in_a_window_and_exits(tmp_path):
    for name, text in files_of("mjcf", "contact", *ROUND_KNEED).files.items():
        (tmp_path / name).write_text(text)
    command = ["xvfb-run", "-a", sys.executable, "kneed_round_feet.py", "1", "--view"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    assert [line.partition(":")[0] for line in done.stdout.splitlines()] == ["step 1", "step 1"]


@pytest.mark.parametrize(
    ("walker", "why", "instead"),
    [
        (("paper", "contact.stance=pinned"), "first touch", "contact.stance=free"),
        (("paper", "contact.friction=none"), "without friction", "coulomb"),
        (("paper", "contact.damping=0"), "needs damping", "contact.damping above 0"),
        (("round-feet",), "only after mid-swing", "checkerboard"),
    ],
)
def test_unsupported_features_are_rejected(walker, why, instead):
    with pytest.raises(ConfigError) as caught:
        export_model(*with_gait(*walker), "mjcf")
    assert why in caught.value.message
    assert instead in caught.value.advice
