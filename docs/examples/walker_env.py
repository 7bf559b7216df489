"""An exported walker as a Gymnasium environment: a torque at its hip, and a reward for walking on."""

import gymnasium
import mujoco
import numpy as np


class Walker(gymnasium.Env):
    """An exported walker with a torque at its hip (N m)."""

    def __init__(self, path: str, decision_s: float = 0.02) -> None:
        self.model = mujoco.MjModel.from_xml_path(path)
        self.data = mujoco.MjData(self.model)
        self.steps = round(decision_s / self.model.opt.timestep)
        size = self.model.nq + self.model.nv
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,))
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
        self.hip = self.model.joint("hip").dofadr[0]

    def observe(self) -> np.ndarray:
        return np.concatenate((self.data.qpos, self.data.qvel)).astype(np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        self.data.qvel += 0.01 * self.np_random.standard_normal(self.model.nv)
        return self.observe(), {}

    def step(self, action):
        before = self.data.qpos[0]
        self.data.qfrc_applied[self.hip] = action[0]
        mujoco.mj_step(self.model, self.data, self.steps)
        fallen = bool(self.data.qpos[1] < 0.7)
        reward = float(self.data.qpos[0] - before) - 0.01 * float(action[0]) ** 2
        return self.observe(), reward, fallen, False, {}
