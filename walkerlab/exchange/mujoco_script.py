"""Simulate in MuJoCo a walker that walkerlab exported, with push-offs and hip torque, and print its touchdowns.

Usage: python NAME.py [MODEL.xml] [steps] [--view]. By default it walks ten steps of NAME.xml, which stands next to it.
It needs the package mujoco.
"""

import sys
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np


class Walk:
    """Walk from the keyframe `gait`."""

    def __init__(self, model: Any) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, self.data, model.key("gait").id)
        mujoco.mj_forward(model, self.data)
        self.impulse, self.duration = model.numeric("push_off").data
        (self.torque,) = model.numeric("hip_torque").data
        self.hip = model.joint("hip")
        self.feet = [model.geom(f"foot_{foot}").id for foot in (1, 2)]
        self.stance = 1
        self.touches_s: list[float] = []
        self.touches_m: list[float] = []

    def step(self) -> None:
        """Apply push-off and hip torque, advance one time step, and swap feet if the swing foot touches down ahead."""
        data, swing = self.data, 1 - self.stance
        data.qfrc_applied[:] = 0.0
        data.qfrc_applied[self.hip.dofadr[0]] = self.torque if swing == 0 else -self.torque
        if self.touches_s:
            self.push(self.feet[swing], (data.time - self.touches_s[-1]) / self.duration)
        mujoco.mj_step(self.model, data)
        along = data.geom_xpos[self.feet, 0]
        if along[swing] > along[self.stance] and self.feet[swing] in data.contact.geom[: data.ncon]:
            self.stance = swing
            self.touches_s.append(data.time)
            self.touches_m.append(float(along[swing]))

    def push(self, foot: int, share: float) -> None:
        """Push a foot towards the hip; `share` is the elapsed fraction of the pulse."""
        if not 0.0 < share < 1.0:
            return
        point = self.data.geom_xpos[foot] - [0.0, 0.0, self.model.geom_size[foot, 0]]
        line = self.data.xanchor[self.hip.id] - point
        line[1] = 0.0
        force = 30.0 * (share * (1.0 - share)) ** 2 * self.impulse / self.duration * line / np.linalg.norm(line)
        body = self.model.geom_bodyid[foot]
        mujoco.mj_applyFT(self.model, self.data, force, np.zeros(3), point, body, self.data.qfrc_applied)


def main(path: str, steps: int, view: bool) -> None:
    """Walk for `steps` touchdowns, but at most for ten simulated seconds."""
    walk, viewer = Walk(mujoco.MjModel.from_xml_path(path)), None
    if view:
        from mujoco.viewer import launch_passive

        viewer = launch_passive(walk.model, walk.data)
    begun, seen = time.monotonic(), 0
    while len(walk.touches_s) < steps and walk.data.time < 10.0:
        walk.step()
        if len(walk.touches_s) > seen:
            seen = len(walk.touches_s)
            print(f"step {seen}: touch at {walk.touches_s[-1]:.4f} s, {walk.touches_m[-1]:.4f} m")
        if viewer is not None and walk.data.time > time.monotonic() - begun:
            viewer.sync()


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--view"]
    steps = next((int(word) for word in words if word.isdecimal()), 10)
    model = next((word for word in words if not word.isdecimal()), str(Path(__file__).with_suffix(".xml")))
    main(model, steps, "--view" in sys.argv)
