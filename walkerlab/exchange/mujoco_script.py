"""Use MuJoCo to simulate a walker exported by walkerlab, with its drives and knees, and print its touchdowns.

Usage: python NAME.py [MODEL.xml] [steps] [--view]. The default is ten steps of NAME.xml in the same folder.
The script needs the package mujoco.
"""

import sys
import threading
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

FRAME_S = 1.0 / 60.0
WINDOW_CLOSES_S = 5.0


class Walk:
    """Walk from the keyframe `gait`, with a control callback for push-offs, hip torque, touchdowns and knees.

    It reacts to the state at each time step. A knee locks when it has been bent and straightens, by a plastic impact
    or, if it has a stop, when the stop turns it back. The trailing knee is released after the next touchdown.

    stance  index of the stance foot, 0 or 1
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        *self.impulses, self.duration = model.numeric("push_off").data
        self.pushed = any(self.impulses)
        (self.torque,) = model.numeric("hip_torque").data
        self.hip = model.joint("hip")
        self.impratio = model.opt.impratio
        base = model.joint("height")
        self.weight = model.body_subtreemass[base.bodyid[0]] * np.linalg.norm(model.opt.gravity)
        self.height = base.dofadr[0]
        self.feet = [model.geom(f"foot_{foot}").id for foot in (1, 2)]
        joints = {model.joint(joint).name: joint for joint in range(model.njnt)}
        # knee joints, by leg
        self.knees = {leg: joints[name] for leg, name in enumerate(("knee_1", "knee_2")) if name in joints}
        self.locks = {leg: model.equality(f"lock_{leg + 1}").id for leg in self.knees}
        self.stops = {leg: bool(model.jnt_limited[knee]) for leg, knee in self.knees.items()}
        if self.knees:
            self.flexed, self.at_touch = model.numeric("knees").data
        mujoco.mj_resetDataKeyframe(model, self.data, model.key("gait").id)
        mujoco.mj_forward(model, self.data)
        # directions along the slope and normal to it
        self.along, self.up = self.data.geom("pad_1").xmat.reshape(3, 3)[:, [0, 2]].T
        self.begin()
        mujoco.set_mjcb_control(self.control)

    def begin(self) -> None:
        """Begin a walk: the second leg stands with its knee locked, the knee of the first leg is free."""
        self.time_s = -1.0
        self.stance = 1
        self.touches_s: list[float] = []
        self.touches_m: list[float] = []
        # The trailing knee stays locked until the leading foot has stopped sinking in and the push-off has ended.
        self.sinks = self.pushes = False
        self.bent = [False, False]
        for knee in self.knees.values():
            # A stop acts only after its knee has bent. Otherwise it would act on the straight knee at the start.
            self.model.jnt_limited[knee] = 0

    def control(self, _model: Any, data: Any) -> None:
        """Apply push-off and hip torque. Once per time step, also look for touchdowns and update the knees."""
        # MuJoCo's control callback is global, so it also runs for other data.
        if data is not self.data:
            return
        # The time decreases when the walk is reset, for example in the viewer.
        if data.time < self.time_s:
            self.begin()
        # `mj_forward` calls this again with the same `data.time`, which is not a new time step.
        if data.time > self.time_s:
            self.time_s = data.time
            if data.ncon > 0:
                self.look_for_touch()
                self.scale_friction()
            if self.knees:
                self.turn_knees()
        if self.pushed or self.torque:
            self.drive(1 - self.stance)

    def look_for_touch(self) -> None:
        """Swap feet if the swing foot is on the ground ahead of the stance foot and its knee is locked."""
        data = self.data
        swing = 1 - self.stance
        if (swing in self.knees and not data.eq_active[self.locks[swing]]) or self.feet[swing] not in data.contact.geom:
            return
        along = data.geom_xpos[self.feet] @ self.along
        if along[swing] > along[self.stance]:
            self.stance = swing
            self.touches_s.append(data.time)
            self.touches_m.append(float(along[swing]))
            self.sinks = self.pushes = True

    def scale_friction(self) -> None:
        """Scale the friction damper with the load on the feet, as in ADAMS.

        At a strike the load is many times the weight.
        """
        load = self.data.qfrc_constraint[self.height]
        self.model.opt.impratio = self.impratio * max(1.0, load / self.weight)

    def drive(self, swing: int) -> None:
        """Apply the hip torque, and push the trailing foot during a pulse."""
        self.data.qfrc_applied[:] = 0.0
        # The hip turns leg 1 against leg 2, so the torque on it changes its sign when the legs change roles.
        self.data.qfrc_applied[self.hip.dofadr[0]] = self.torque if swing == 0 else -self.torque
        share = (self.data.time - self.touches_s[-1]) / self.duration if self.touches_s else 0.0
        if self.pushed and 0.0 < share < 1.0:
            self.push(self.feet[swing], self.impulses[swing], share)

    def push(self, foot: int, impulse: float, share: float) -> None:
        """Push a foot towards the hip. `share` is the elapsed fraction of the pulse."""
        point = self.data.geom_xpos[foot] - self.model.geom_size[foot, 0] * self.up
        line = self.data.xanchor[self.hip.id] - point
        # Each foot walks in a lane to one side of the hip, but the push acts in the plane of the walk.
        line[1] = 0.0
        # The integral of (share (1 - share))^2 from 0 to 1 is 1/30.
        force = 30.0 * (share * (1.0 - share)) ** 2 * impulse / self.duration * line / np.linalg.norm(line)
        body = self.model.geom_bodyid[foot]
        mujoco.mj_applyFT(self.model, self.data, force, np.zeros(3), point, body, self.data.qfrc_applied)

    def turn_knees(self) -> None:
        """Release the trailing knee when it no longer has to wait, and lock a bent knee once it has straightened."""
        model = self.model
        data = self.data
        trailing = 1 - self.stance
        if self.pushes:
            motion = np.zeros(6)
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, self.feet[self.stance], motion, 0)
            self.sinks = self.sinks and not self.at_touch and motion[3:] @ self.up < 0.0
            if not self.sinks and (not self.pushed or data.time >= self.touches_s[-1] + self.duration):
                self.pushes = self.bent[trailing] = False
                if trailing in self.knees:
                    data.eq_active[self.locks[trailing]] = 0
        for leg, knee in self.knees.items():
            if data.eq_active[self.locks[leg]]:
                continue
            bend = data.qpos[model.jnt_qposadr[knee]]
            rate = data.qvel[model.jnt_dofadr[knee]]
            if bend < -self.flexed:
                self.bent[leg] = True
                model.jnt_limited[knee] = self.stops[leg]
            elif self.bent[leg] and bend >= 0.0 and not (self.stops[leg] and rate > 0.0):
                self.lock(leg)

    def lock(self, leg: int) -> None:
        """Stop a knee by a plastic impact, during which other constraints stay in force, and hold it from now on."""
        model = self.model
        data = self.data
        knee = self.knees[leg]
        model.jnt_limited[knee] = 0
        # A knee that was caught by a stop is held where it is, with the stop still compressed.
        model.eq_data[self.locks[leg], 0] = data.qpos[model.jnt_qposadr[knee]] if self.stops[leg] else 0.0
        data.eq_active[self.locks[leg]] = 1
        # With so few degrees of freedom MuJoCo's Jacobian is dense. The lock, active only from now on, is not in it
        # yet.
        held = data.efc_J.reshape(-1, model.nv)[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
        rows = np.vstack((held, np.eye(model.nv)[model.jnt_dofadr[knee]]))
        columns = np.zeros_like(rows)
        mujoco.mj_solveM(model, data, columns, rows)
        data.qvel -= columns.T @ np.linalg.solve(rows @ columns.T, rows @ data.qvel)


def main(path: str, steps: int, view: bool) -> None:
    """Walk for `steps` touchdowns, or until the hip is on the ground, and compare with walkerlab's walk."""
    walk = Walk(mujoco.MjModel.from_xml_path(path))
    viewer = None
    if view:
        from mujoco.viewer import launch_passive

        viewer = launch_passive(walk.model, walk.data)
    begun = time.monotonic()
    shown_s = 0.0
    seen = 0
    while len(walk.touches_s) < steps and walk.data.time < 2.0 * steps and walk.data.qpos[1] > 0.0:
        mujoco.mj_step(walk.model, walk.data)
        if len(walk.touches_s) > seen:
            seen = len(walk.touches_s)
            print(f"step {seen}: touch at {walk.touches_s[-1]:.4f} s, {walk.touches_m[-1]:.4f} m")
        if viewer is not None and walk.data.time >= shown_s:
            viewer.sync()
            shown_s += FRAME_S
            time.sleep(max(0.0, shown_s - (time.monotonic() - begun)))
    if viewer is not None:
        viewer.close()
        # Python crashes or hangs if it exits before the window's thread ends (MuJoCo 4.0.0).
        for thread in threading.enumerate():
            if thread is not threading.current_thread():
                thread.join(WINDOW_CLOSES_S)
    if seen < steps:
        print(f"it walked {seen} of {steps} steps")
        return
    period = np.diff(walk.touches_s, prepend=0.0)[-1]
    length = np.diff(walk.touches_m, prepend=0.0)[-1]
    its_periods, its_lengths = walk.model.numeric("steps_in_walkerlab").data.reshape(2, -1)
    compared = min(steps, len(its_periods))
    theirs = f"step {compared} in walkerlab: {its_periods[compared - 1]:.4f} s, {its_lengths[compared - 1]:.4f} m"
    print(f"step {steps}: {period:.4f} s, {length:.4f} m; {theirs}")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--view"]
    steps = next((int(word) for word in words if word.isdecimal()), 10)
    model = next((word for word in words if not word.isdecimal()), str(Path(__file__).with_suffix(".xml")))
    main(model, steps, "--view" in sys.argv)
