"""MuJoCo: soft convex contact in constraint space, tuned by `exchange/mjcf.py`, at fixed steps."""

from typing import Any

from walkerlab.evidence.benchmarks.engines import adapter
from walkerlab.exchange.engine_scene import EngineContact
from walkerlab.exchange.mjcf import FEET, body_text, contact_settings, option_text, pair_text
from walkerlab.exchange.planar import PlanarModel
from walkerlab.physics.solvers.system import Floats

INTEGRATORS = {"Euler": adapter.Integrator(1, 120_000), "RK4": adapter.Integrator(4, 120_000)}
CONTACTS = {"soft": "Euler", "soft-rk4": "RK4"}
CANNOT_EXPRESS = (
    "a force or damping that grows with a power of the penetration: contact is linear",
    "static above dynamic friction: there is one coefficient",
    "point feet: a ball of half a millimetre replaces each",
    "a knee that locks rigidly at an instant: equality constraints are soft, so the walk continues in another model",
)
NEVER_M = -1e9  # margin so negative that the contact never acts
INTEGRATOR_CODES = {"Euler": "mjINT_EULER", "RK4": "mjINT_RK4"}


def tune(model: str, target: EngineContact) -> adapter.OwnContact:
    """Compute the settings that meet the target, from the closed forms of `exchange.mjcf`."""
    return adapter.OwnContact(model, contact_settings(target))


class MujocoRun(adapter.Simulation):
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        import mujoco

        # The callback is global, so without this the previous run's callback would still be active.
        mujoco.set_mjcb_passive(None)
        self._advance = mujoco.mj_step
        self._model = mujoco.MjModel.from_xml_string(model_xml(model, self.own))
        self._model.opt.timestep = self.stepping.step_s
        self._model.opt.integrator = getattr(mujoco.mjtIntegrator, INTEGRATOR_CODES[self.stepping.integrator])
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:], self._data.qvel[:] = q, v
        mujoco.set_mjcb_passive(None if self.forces is None else force_callback(self.forces, self._data))

    def run(self, steps: int, until_s: float, on_step: adapter.OnStep) -> None:
        model = self._model
        data = self._data
        advance = self._advance
        # The arrays are views of MuJoCo's memory, so they need not be read again after a step.
        q, v, h = data.qpos, data.qvel, float(model.opt.timestep)
        for count in range(1, min(steps, round(until_s / h)) + 1):
            advance(model, data)
            if not on_step(count * h, q, v):
                return

    def carry(self, ball: int, has_ground: bool) -> None:
        if self._model.npair:
            # No distance is below such a margin, so the pair is never in contact.
            self._model.pair_margin[self._model.pair(f"foot {ball} on floor").id] = 0.0 if has_ground else NEVER_M


def force_callback(forces: adapter.Forces, data: Any) -> Any:
    """Build the callback for passive forces, which MuJoCo calls in every stage of every integrator."""
    q = data.qpos
    v = data.qvel
    passive_forces = data.qfrc_passive

    def passive(_model: Any, _data: Any) -> None:
        passive_forces[:] = forces(data.time, q, v)

    return passive


def model_xml(model: PlanarModel, own: adapter.OwnContact | None) -> str:
    """Write the model as MJCF, with a floor for the feet if native contact is used."""
    contact = None if own is None else own.settings
    floor = ""
    pairs = ""
    if contact is not None:
        place = f'pos="0 0 {model.balls[0].ground_m!r}" contype="0" conaffinity="0"'
        floor = f'<geom name="floor" type="plane" size="0 0 1" {place}/>'
        feet = zip(model.balls, FEET, strict=False)
        pairs = "".join(pair_text(model, ball, foot, "floor", contact) for ball, foot in feet)
    return f"""<mujoco>
  <compiler autolimits="false" balanceinertia="true"/>
  {option_text(model, contact)}
  <worldbody>{floor}{body_text(model, 0, contact)}</worldbody>
  <contact>{pairs}</contact>
</mujoco>"""
