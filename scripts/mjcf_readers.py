#!/usr/bin/env python3
"""Make the table of docs/engines.md on how other programs read an exported model and how it walks in them.

Usage: python scripts/mjcf_readers.py MODEL.xml [STEP_S]

The script tries every reader that is installed, with the lines that the documentation tells users to type. The walk
starts from the keyframe and has ten steps. STEP_S is the time step in Drake and Newton.
"""

import contextlib
import importlib.metadata
import io
import logging
import sys
import warnings

import mujoco
import numpy as np

STEPS, UNTIL_S = 10, 9.0


class Feet:
    """Touches of a walk, found from the coordinates alone. A touch is when one ball comes down on the ground ahead of
    the other.
    """

    def __init__(self, path):
        self.model = mujoco.MjModel.from_xml_path(path)
        self.data = mujoco.MjData(self.model)
        self.key = self.model.key("gait")
        self.feet = [self.model.geom(f"foot_{foot}").id for foot in (1, 2)]
        mujoco.mj_kinematics(self.model, self.data)
        pad = self.model.geom("pad_1").id
        self.place, frame = self.data.geom_xpos[pad].copy(), self.data.geom_xmat[pad].reshape(3, 3)
        self.along, self.up = frame[:, 0], frame[:, 2]
        self.top_m = self.model.geom_size[pad, 2]
        self.stance, self.touches = 1, []

    def follow(self, time_s, q):
        """Record a touch if there is one, and return whether the walk goes on."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        feet = self.data.geom_xpos[self.feet]
        along, swing = feet @ self.along, 1 - self.stance
        height = (feet[swing] - self.place) @ self.up - self.top_m - self.model.geom_size[self.feet[swing], 0]
        if along[swing] > along[self.stance] and height < 0.0:
            self.stance = swing
            self.touches.append((time_s, along[swing]))
        return len(self.touches) < STEPS and time_s < UNTIL_S and self.data.qpos[1] > 0.0

    def walk(self):
        if len(self.touches) < STEPS:
            return f"{len(self.touches)} steps"
        period, length = np.subtract(self.touches[-1], self.touches[-2])
        return f"{STEPS} steps, the last of {period:.4f} s and {length:.4f} m"


def read_in_mujoco(path, _step_s):
    feet = Feet(path)
    model, data = feet.model, mujoco.MjData(feet.model)
    mujoco.mj_resetDataKeyframe(model, data, feet.key.id)
    yield "gravity", model.opt.gravity
    yield "total mass", model.body_subtreemass[model.joint("height").bodyid[0]]
    yield "keyframe", "read"
    yield "pairs of shapes that can touch", model.npair
    while feet.follow(data.time, data.qpos):
        mujoco.mj_step(model, data, 4)
    yield "walk", feet.walk()


def read_in_drake(path, step_s):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    feet, builder = Feet(path), DiagramBuilder()
    plant, scene = AddMultibodyPlantSceneGraph(builder, step_s)
    logging.getLogger("drake").setLevel(logging.ERROR)
    (instance,) = Parser(plant).AddModels(path)
    yield "gravity", plant.gravity_field().gravity_vector()
    plant.set_penetration_allowance(6e-5)
    plant.set_stiction_tolerance(7e-3)
    plant.Finalize()
    diagram = builder.Build()
    links = (plant.get_body(index) for index in plant.GetBodyIndices(instance))
    yield "total mass", sum(link.default_mass() for link in links if link.name() != "slope")
    simulator = Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    yield "keyframe", "dropped" if not plant.GetPositions(context).any() else "read"
    yield "pairs of shapes that can touch", len(scene.model_inspector().GetCollisionCandidates())
    plant.SetPositions(context, feet.key.qpos)
    plant.SetVelocities(context, feet.key.qvel)
    time_s = 0.0
    while feet.follow(time_s, plant.GetPositions(context)):
        time_s += 5e-4
        simulator.AdvanceTo(time_s)
    yield "walk", feet.walk()


def read_in_newton(path, step_s):
    import newton
    import warp

    warp.config.quiet = True
    feet, builder = Feet(path), newton.ModelBuilder()
    builder.add_mjcf(path)
    model = builder.finalize(device="cpu")
    yield "gravity", np.ravel(model.gravity.numpy())
    yield "total mass", model.body_mass.numpy().sum()
    yield "keyframe", "dropped" if not model.joint_qd.numpy().any() else "read"
    yield "pairs of shapes that can touch", model.shape_contact_pair_count
    model.set_gravity(feet.model.opt.gravity)
    state, after, control = model.state(), model.state(), model.control()
    state.joint_q.assign(feet.key.qpos.astype(np.float32))
    state.joint_qd.assign(feet.key.qvel.astype(np.float32))
    newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True, disable_contacts=False)
    time_s = 0.0
    while feet.follow(time_s, state.joint_q.numpy()):
        for _ in range(4):
            state.clear_forces()
            solver.step(state, after, control, None, step_s)
            state, after = after, state
            time_s += step_s
    yield "walk", feet.walk()


def read_in_pybullet(path, _step_s):
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    bodies = pybullet.loadMJCF(path)
    moving = [body for body in bodies if pybullet.getNumJoints(body)]
    links = [pybullet.getDynamicsInfo(body, link) for body in moving for link in range(pybullet.getNumJoints(body))]
    yield "gravity", "not read"
    yield "total mass", sum(link[0] for link in links)
    yield "moments of inertia", [round(link[2][1], 4) for link in links if link[0] > 0.0]
    yield "keyframe", "dropped"


def read_in_pinocchio(path, _step_s):
    import pinocchio

    feet, model = Feet(path), pinocchio.buildModelFromMJCF(path)
    geometry = pinocchio.buildGeomFromMJCF(model, path, pinocchio.GeometryType.COLLISION)
    yield "gravity", model.gravity.linear
    yield "total mass", pinocchio.computeTotalMass(model)
    yield (
        "keyframe",
        "positions read" if np.allclose(model.referenceConfigurations["gait"], feet.key.qpos) else "dropped",
    )
    yield "pairs of shapes that can touch", len(geometry.collisionPairs)
    model.gravity.linear = feet.model.opt.gravity
    free = pinocchio.aba(model, model.createData(), feet.key.qpos, feet.key.qvel, np.zeros(model.nv))
    feet.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    feet.data.qpos[:] = feet.key.qpos
    feet.data.qvel[:] = feet.key.qvel
    mujoco.mj_forward(feet.model, feet.data)
    yield "largest difference from MuJoCo's accelerations without contact", np.abs(free - feet.data.qacc).max()


def read_in_dart(path, _step_s):
    import dartpy

    world = dartpy.utils.MjcfParser.readWorld(path)
    (walker,) = (
        skeleton for skeleton in map(world.getSkeleton, range(world.getNumSkeletons())) if skeleton.getNumDofs()
    )
    links = [link for link in map(walker.getBodyNode, range(walker.getNumBodyNodes())) if link.getMass() > 0.0]
    yield "gravity", world.getGravity()
    yield "total mass", walker.getMass()
    yield "moments of inertia", [round(link.getInertia().getMoment()[1, 1], 4) for link in links]
    yield "keyframe", "read" if walker.getPositions().any() else "dropped"


READERS = {
    "mujoco": read_in_mujoco,
    "drake": read_in_drake,
    "newton": read_in_newton,
    "pybullet": read_in_pybullet,
    "pin": read_in_pinocchio,
    "dartpy": read_in_dart,
}


def main(path, step_s):
    for name, read in READERS.items():
        try:
            print(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
        words = io.StringIO()
        with warnings.catch_warnings(record=True) as caught, contextlib.redirect_stdout(words):
            warnings.simplefilter("always")
            rows = read(path, step_s)
            for what, value in rows:
                print(f"  {what}: {np.round(value, 4) if not isinstance(value, str) else value}", file=sys.stderr)
        for message in {str(each.message).splitlines()[0] for each in caught}:
            print(f"  warning: {message}")


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 1e-4)
