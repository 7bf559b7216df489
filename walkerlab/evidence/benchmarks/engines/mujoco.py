"""MuJoCo: soft convex contact in constraint space, fixed steps.

Contact is normalised by mass. With constant impedance d and a reference of stiffness K and damping B (solref -K, -B),
a loaded contact accelerates by a = (1 - d) a_0 - B v - K r, where a_0 is the acceleration without contact; so any ball
rests at (1 - d) g / K, and a foot creeps at (1 - d) a_0 / (impratio B).

Source: MuJoCo documentation, Computation: constraint model, and Modeling: solver parameters.
"""

import math
from collections.abc import Mapping
from typing import Any

from walkerlab.evidence.benchmarks.engines import adapter
from walkerlab.evidence.benchmarks.engines.planar import Ball, PlanarModel
from walkerlab.physics.solvers.system import Floats

INTEGRATORS = {"Euler": adapter.Integrator(1, 120_000), "RK4": adapter.Integrator(4, 120_000)}
CONTACTS = {"soft": "Euler", "soft-rk4": "RK4"}
CANNOT_EXPRESS = (
    "a force or damping that grows with a power of the penetration: contact is linear",
    "stiffness in N/m: stiffness is scaled by the contact's effective mass",
    "static above dynamic friction: there is one coefficient",
    "point feet: a ball of half a millimetre replaces each",
    "a knee that locks rigidly at an instant: equality constraints are soft, so the walk continues in another model",
)
MIN_INERTIA = 2e-15  # kg m^2, twice MuJoCo's minimum
IMPEDANCE = 0.1  # small, for a contact close to an ordinary spring and damper
JOINT_AXES = {"along": ("slide", "1 0 0"), "height": ("slide", "0 0 1"), "turn": ("hinge", "0 -1 0")}
INTEGRATOR_CODES = {"Euler": "mjINT_EULER", "RK4": "mjINT_RK4"}


def tuned(model: str, target: adapter.EngineContact) -> adapter.OwnContact:
    """Solve the closed forms above for the target."""
    stiffness = (1.0 - IMPEDANCE) * target.gravity / target.penetration
    damping = 2.0 * target.damping_ratio * math.sqrt(stiffness)
    creep = (1.0 - IMPEDANCE) * target.creep_load * target.gravity / damping
    settings = {
        "solref_stiffness": stiffness,
        "solref_damping": damping,
        "solimp_d": IMPEDANCE,
        "impratio": creep / target.creep_velocity,
        "friction": target.friction,
    }
    return adapter.OwnContact(model, settings)


class MujocoRun(adapter.Simulation):
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        import mujoco

        mujoco.set_mjcb_passive(None)  # it is global; remove the last run's
        self._advance = mujoco.mj_step
        self._model = mujoco.MjModel.from_xml_string(model_xml(model, self.own))
        self._model.opt.timestep = self.stepping.step_s
        self._model.opt.integrator = getattr(mujoco.mjtIntegrator, INTEGRATOR_CODES[self.stepping.integrator])
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:], self._data.qvel[:] = q, v
        mujoco.set_mjcb_passive(None if self.forces is None else force_callback(self.forces, self._data))

    def run(self, steps: int, until_s: float, on_step: adapter.OnStep) -> None:
        model, data, advance = self._model, self._data, self._advance
        q, v, h = data.qpos, data.qvel, float(model.opt.timestep)
        for count in range(1, min(steps, round(until_s / h)) + 1):
            advance(model, data)
            if not on_step(count * h, q, v):
                return

    def carry(self, ball: int, has_ground: bool) -> None:
        if self._model.ngeom:
            self._model.geom_contype[self._model.geom(f"foot {ball}").id] = int(has_ground)


def force_callback(forces: adapter.Forces, data: Any) -> Any:
    """Callback for passive forces; MuJoCo calls it in every stage of every integrator."""
    q, v, passive_forces = data.qpos, data.qvel, data.qfrc_passive

    def passive(_model: Any, _data: Any) -> None:
        passive_forces[:] = forces(data.time, q, v)

    return passive


def model_xml(model: PlanarModel, own: adapter.OwnContact | None) -> str:
    ratio, world = "", body(model, 0, own)
    if own is not None:
        ratio = f'cone="elliptic" impratio="{own.settings["impratio"]!r}"'
        place = f'pos="0 0 {model.balls[0].ground_m!r}" contype="0" conaffinity="1"'
        world = f'<geom name="floor" type="plane" size="0 0 1" {place}/>{world}'
    return f"""<mujoco>
  <compiler autolimits="false" balanceinertia="true"/>
  <option gravity="{model.gravity_along!r} 0 {-model.gravity_down!r}" {ratio} iterations="100" tolerance="1e-12"/>
  <worldbody>{world}</worldbody>
</mujoco>"""


def body(model: PlanarModel, place: int, own: adapter.OwnContact | None) -> str:
    """MJCF of a link with its hinge, feet and child links."""
    link = model.links[place]
    (px, pz), (x, z), (cx, cz) = link.parent_point_m, link.point_m, link.centre_m
    inside = ""
    for kind, axis in (JOINT_AXES[freedom] for freedom in (model.freedoms if link.parent < 0 else ("turn",))):
        inside += f'<joint type="{kind}" axis="{axis}" pos="{x!r} 0 {z!r}"/>'
    i = max(link.inertia_kg_m2, MIN_INERTIA)
    inside += f'<inertial pos="{cx!r} 0 {cz!r}" mass="{link.mass_kg!r}" diaginertia="{i!r} {i!r} {i!r}"/>'
    feet = [] if own is None else [(n, ball) for n, ball in enumerate(model.balls) if ball.link == place]
    inside += "".join(foot(number, ball, own.settings) for number, ball in feet if own is not None)
    inside += "".join(
        body(model, child, own) for child, candidate in enumerate(model.links) if candidate.parent == place
    )
    return f'<body name="{link.name}" pos="{px - x!r} 0 {pz - z!r}">{inside}</body>'


def foot(number: int, ball: Ball, contact: Mapping[str, float]) -> str:
    (x, z), d = ball.centre_m, contact["solimp_d"]
    return (
        f'<geom name="foot {number}" type="sphere" size="{ball.radius_m!r}" pos="{x!r} 0 {z!r}" contype="1" '
        f'conaffinity="0" condim="3" friction="{contact["friction"]!r} 0 0" priority="1" '
        f'solref="{-contact["solref_stiffness"]!r} {-contact["solref_damping"]!r}" solimp="{d!r} {d!r} 1 0.5 1"/>'
    )
