"""Exported MJCF: it compiles silently, carries the walker at the law's depth, and walks as our contact model does."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from exported_walkers import PADS, PARTS, export_of, files_of, with_gait

from walkerlab.errors import ConfigError
from walkerlab.exchange.engine_scene import contact_target
from walkerlab.exchange.export import export_model
from walkerlab.exchange.mjcf import inverse_weights

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'walkerlab[engines]'")

STEPS = 10
TORSO = ("torso", PADS, "contact.pad_pitch=own")
WALKERS = [("paper",), ("round-feet", PADS), TORSO]
HEAVY_LEGS = ("paper", "walker.foot_to_mass_m=0.2", "walker.leg_inertia_kg_m2=0.2", "walker.leg_mass_kg=8")
BY_PARTS = ("compass-by-parts",)
SPRUNG = ("paper", "walker.hip.spring_N_m_per_rad=1", "walker.hip.damping_N_m_s_per_rad=0.02")
WEIGHED = [*WALKERS, ("level",), HEAVY_LEGS, SPRUNG, BY_PARTS]


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
    """Touches (s) and places (m) of a swing foot that meets its pads ahead of the stance foot."""
    data, stance, touches = at_start(model), 1, []
    feet = [model.geom(f"foot_{foot}").id for foot in (1, 2)]
    while len(touches) < steps and data.time < 1.2 * steps:
        mujoco.mj_step(model, data)
        along, swing = data.geom_xpos[feet, 0], 1 - stance
        if along[swing] > along[stance] and feet[swing] in data.contact.geom[: data.ncon]:
            stance = swing
            touches.append((data.time, along[swing]))
    assert not any(warning.number for warning in data.warning)
    return np.array(touches)


@pytest.fixture(params=WEIGHED, ids=" ".join)
def weighed(request, tmp_path_factory):
    """A walker to export: each exported type, and walkers with other masses and drives."""
    if request.param is not BY_PARTS:
        return request.param
    path = tmp_path_factory.getbasetemp() / "compass-by-parts.yaml"
    path.write_text(PARTS)
    return (str(path),)


def normal_force(model, foot, depth, weight):
    """MuJoCo's force (N) on a foot at `depth` (m) in the gait's pose, if joints hold what the ground does not."""
    data = at_start(model)
    geom = model.geom(f"foot_{foot}").id
    pad = next(pad for pad in range(model.ngeom) if model.geom_conaffinity[pad] == model.geom_contype[geom])
    model.geom_contype[np.arange(model.ngeom) != geom] = 0
    ground = model.geom_pos[pad, 2] + model.geom_size[pad, 2]
    data.qvel[:] = 0.0
    data.qpos[0] += model.geom_pos[pad, 0] - data.geom_xpos[geom, 0]
    data.qpos[1] += ground + model.geom_size[geom, 0] - depth - data.geom_xpos[geom, 2]
    mujoco.mj_forward(model, data)
    lever = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, lever, None, data.geom_xpos[geom], model.geom_bodyid[geom])
    # under this force of the ground nothing would accelerate
    data.qfrc_applied[:] = data.qfrc_bias - data.qfrc_passive - weight * lever[2]
    mujoco.mj_forward(model, data)
    assert data.contact.geom.tolist() == [[pad, geom]] or data.contact.geom.tolist() == [[geom, pad]]
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, force)
    return force[0]


@pytest.mark.parametrize("foot", [1, 2])
def test_each_foot_carries_the_walker_at_the_depth_of_our_law(weighed, foot):
    scene = export_of(*weighed).scene
    weight = scene.ours.mass * scene.ours.gravity_down
    depth = contact_target(scene).penetration
    assert normal_force(model_of(*weighed), foot, depth, weight) == pytest.approx(weight, rel=1e-6)


def test_inverse_weights_are_those_that_mujoco_computes(weighed):
    compiled = model_of(*weighed).body_invweight0[1:, 0]
    assert inverse_weights(export_of(*weighed).model) == pytest.approx(compiled, rel=1e-9)


def test_inverse_weights_of_the_papers_legs_follow_from_their_masses():
    assert inverse_weights(export_of("paper").model) == pytest.approx([7.0 / 180.0, 1.0 / 12.0], rel=1e-12)


@pytest.mark.parametrize("walker", [*WALKERS, ("level",)], ids=lambda walker: walker[0])
def test_a_model_compiles_without_a_word_and_is_the_same_when_saved(walker, tmp_path, capfd):
    model = model_of(*walker)
    first, second = tmp_path / "first.xml", tmp_path / "second.xml"
    mujoco.mj_saveLastXML(str(first), model)
    again = mujoco.MjModel.from_xml_path(str(first))
    mujoco.mj_saveLastXML(str(second), again)
    assert first.read_text() == second.read_text()
    for field in ("body_mass", "body_ipos", "body_inertia", "geom_pos", "geom_size", "geom_solref", "key_qpos"):
        # MuJoCo saves six digits or more
        assert getattr(again, field) == pytest.approx(getattr(model, field), rel=1e-5, abs=1e-6), field
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("walker", WALKERS, ids=lambda walker: walker[0])
def test_plain_steps_walk_ten_steps_on_the_pads(walker):
    export = export_of(*walker)
    assert export.walk.steps == STEPS
    touches = walked(model_of(*walker), STEPS)
    assert len(touches) == STEPS
    # its contact is another law, tuned; what is left of that is less than half a per cent
    periods, lengths = np.diff(touches, axis=0)[-4:].T
    assert periods == pytest.approx(export.walk.periods_s[-1], rel=0.002)
    assert lengths == pytest.approx(export.walk.lengths_m[-1], rel=0.005)


def test_the_papers_walker_takes_our_steps():
    """The last step of our contact model takes .7110 s and .3608 m."""
    touches = walked(model_of("paper"), STEPS)
    assert np.diff(touches, axis=0)[-1] == pytest.approx([0.7111, 0.3601], abs=1e-4)


def test_the_start_is_that_of_our_walk():
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


def test_the_torso_stays_on_the_bisector():
    model = model_of(*TORSO)
    data = at_start(model)
    for _ in range(5000):
        mujoco.mj_step(model, data)
    assert data.joint("hinge of torso").qpos[0] == pytest.approx(0.5 * data.joint("hip").qpos[0], abs=2e-4)


def test_a_hip_spring_and_damper_are_joint_properties():
    model = model_of("paper", "walker.hip.spring_N_m_per_rad=1", "walker.hip.damping_N_m_s_per_rad=0.02")
    hip = model.joint("hip")
    assert (float(hip.stiffness[0]), float(model.dof_damping[hip.dofadr[0]])) == (1.0, 0.02)


def test_a_driven_walker_walks_with_the_script_beside_it(tmp_path, capsys):
    files = files_of("mjcf", "contact", "level").files
    assert list(files) == ["level.xml", "level.py"]
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    spec = importlib.util.spec_from_file_location("level_script", tmp_path / "level.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.main(str(tmp_path / "level.xml"), STEPS, False)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == STEPS
    touches = np.array([[float(word) for word in line.replace(",", "").split() if "." in word] for line in lines])
    export = export_of("level")
    assert np.diff(touches[:, 0])[-4:] == pytest.approx(export.walk.periods_s[-1], rel=0.03)
    assert "mujoco" in sys.modules


@pytest.mark.parametrize("arguments", [["2"], ["level.xml", "2"]])
def test_the_script_of_a_driven_walker_finds_the_model_next_to_it(tmp_path, arguments):
    for name, text in files_of("mjcf", "contact", "level").files.items():
        (tmp_path / name).write_text(text)
    done = subprocess.run([sys.executable, "level.py", *arguments], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [line.partition(":")[0] for line in done.stdout.splitlines()] == ["step 1", "step 2"]


@pytest.mark.parametrize(
    ("walker", "why", "instead"),
    [
        (("paper", "contact.stance=pinned"), "first touch", "contact.stance=free"),
        (("paper", "contact.friction=none"), "without friction", "coulomb"),
        (("paper", "contact.damping=0"), "needs damping", "contact.damping above 0"),
        (("round-feet",), "only after mid-swing", "checkerboard"),
        (("kneed", "strides=1"), "Knees that lock", "straight legs"),
    ],
)
def test_what_would_change_the_walk_is_refused(walker, why, instead):
    with pytest.raises(ConfigError) as caught:
        export_model(*with_gait(*walker), "mjcf")
    assert why in caught.value.message
    assert instead in caught.value.advice
