"""Exported MJCF: it compiles silently, survives being saved, and walks in plain MuJoCo as our contact model does."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from exported_walkers import PADS, export_of, files_of, with_gait

from walkerlab.errors import ConfigError
from walkerlab.exchange.export import export_model

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'walkerlab[engines]'")

STEPS = 10
TORSO = ("torso", PADS, "contact.pad_pitch=own")
WALKERS = [("paper",), ("round-feet", PADS), TORSO]


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
    # its contact is another law, tuned; what is left of that is about one per cent
    periods, lengths = np.diff(touches, axis=0)[-4:].T
    assert periods == pytest.approx(export.walk.periods_s[-1], rel=0.015)
    assert lengths == pytest.approx(export.walk.lengths_m[-1], rel=0.02)


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
        (("round-feet",), "only after mid-swing", "checkerboard"),
        (("kneed", "strides=1"), "Knees that lock", "straight legs"),
    ],
)
def test_what_would_change_the_walk_is_refused(walker, why, instead):
    with pytest.raises(ConfigError) as caught:
        export_model(*with_gait(*walker), "mjcf")
    assert why in caught.value.message
    assert instead in caught.value.advice
