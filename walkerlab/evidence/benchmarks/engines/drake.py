"""Drake: point contact with Hunt-Crossley damping, continuous or discrete (SAP, Similar, Lagged, TAMSI).

The walk takes place in Drake's x-y plane. With stiffness k and dissipation d the normal force is k x (1 + d x'), so at
rest under the weight m g the penetration x is m g / k and the damping m g d. SAP is linear: its damping is k times the
relaxation time. Let s be the slip velocity divided by the stiction tolerance. Then friction rises as
10 s^3 - 15 s^4 + 6 s^5 in the continuous model and as s / sqrt(1 + s^2) in Lagged. SAP regularises it internally.

Source: Drake documentation, Multibody: contact modeling; Castro, Permenter, Han (2022).
"""

import logging
import math
from typing import Any

import numpy as np

from walkerlab.evidence.benchmarks.engines import adapter
from walkerlab.exchange.engine_scene import EngineContact
from walkerlab.exchange.planar import Link, PlanarModel
from walkerlab.physics.solvers.system import Floats

INTEGRATORS = {
    "semi_explicit_euler": adapter.Integrator(1, 25_000),
    "runge_kutta3": adapter.Integrator(3, 25_000),
    "runge_kutta3 adaptive": adapter.Integrator(3, 60_000, adapts=True),
    "discrete": adapter.Integrator(1, 45_000, for_contact_only=True),
}
EMBEDDED_METHODS = ("runge_kutta3",)  # methods that adapt their steps by default
CONTACTS = {"sap": "discrete", "lagged": "discrete", "hunt-crossley": "runge_kutta3 adaptive"}
APPROXIMATIONS = {"sap": "kSap", "lagged": "kLagged"}
CANNOT_EXPRESS = (
    "a force that grows with a power of the penetration: point contact is linear",
    "damping that rises over the first 0.1 mm: damping grows with the force, or (SAP) is linear",
    "friction that rises linearly from rest in continuous time: Drake's law is flat at zero slip",
    "static above dynamic friction in discrete time: only one coefficient is used",
    "a knee that locks by an impact: locking stops only the joint itself, so the walk continues in another model",
)


def tune(model: str, target: EngineContact) -> adapter.OwnContact:
    """Compute the settings that meet the target, from the closed forms at the top of this module."""
    from scipy.optimize import brentq

    stiffness = target.mass * target.gravity / target.penetration
    omega = math.sqrt(target.gravity / target.penetration)
    load = target.creep_load / target.friction
    # ratio of slip velocity to stiction tolerance at which friction is the fraction `load` of full friction
    share = load / math.sqrt(1.0 - load * load)
    if model not in APPROXIMATIONS:
        share = brentq(lambda s: s**3 * (10.0 - 15.0 * s + 6.0 * s * s) - load, 0.0, 1.0, xtol=1e-15)
    settings = {"point_contact_stiffness": stiffness, "friction": target.friction}
    if model == "sap":
        settings["relaxation_time"] = 2.0 * target.damping_ratio / omega
    else:
        settings["hunt_crossley_dissipation"] = 2.0 * target.damping_ratio * omega / target.gravity
        settings["stiction_tolerance"] = target.creep_velocity / share
    return adapter.OwnContact(model, settings)


class DrakeRun(adapter.Simulation):
    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
        from pydrake.systems.framework import DiagramBuilder

        logging.getLogger("drake").setLevel(logging.ERROR)
        own = self.own
        self._h = self.stepping.step_s
        name, _, adaptive = self.stepping.integrator.partition(" ")
        self._discrete = name == "discrete"
        builder = DiagramBuilder()
        self._plant, self._scene_graph = AddMultibodyPlantSceneGraph(builder, self._h if self._discrete else 0.0)
        joints, self._feet, self._floor = add_model(self._plant, model, own)
        if self._discrete:
            self._plant.SetUseSampledOutputPorts(False)  # unused, and each copies the whole state
        if self._discrete and own is not None:
            approximation = getattr(DiscreteContactApproximation, APPROXIMATIONS[own.model])
            self._plant.set_discrete_contact_approximation(approximation)
        self._plant.Finalize()
        if own is not None and "stiction_tolerance" in own.settings:
            self._plant.set_stiction_tolerance(own.settings["stiction_tolerance"])
        self._order = np.array([j.position_start() + i for j in joints for i in range(j.num_positions())])
        self._rates = len(q) + self._order
        if self.forces is not None:
            add_forces(builder, self._plant, self.forces, self._order)
        self._simulator = Simulator(builder.Build())
        self._context = self._simulator.get_mutable_context()
        self._at = self._plant.GetMyMutableContextFromRoot(self._context)
        self._declared: dict[int, Any] = {}
        state = np.zeros(2 * len(q))
        state[self._order], state[self._rates] = q, v
        self._plant.SetPositionsAndVelocities(self._at, state)
        if not self._discrete:
            ResetIntegratorFromFlags(self._simulator, name, self._h)
            integrator = self._simulator.get_mutable_integrator()
            if adaptive:
                integrator.set_target_accuracy(self.stepping.tolerance)
                integrator.set_maximum_step_size(self._h)
                integrator.set_requested_minimum_step_size(1e-12)
                integrator.request_initial_step_size_target(1e-5)
            elif name in EMBEDDED_METHODS:
                integrator.set_fixed_step_mode(True)
        self._simulator.Initialize()

    def run(self, steps: int, until_s: float, on_step: adapter.OnStep) -> None:
        from pydrake.systems.framework import EventStatus

        if self._discrete:
            for count in range(1, min(steps, round(until_s / self._h)) + 1):
                # Updates are due at multiples of the step. Stop between two, so that rounding cannot skip one.
                self._simulator.AdvanceTo((count + 0.25) * self._h)
                if not on_step(count * self._h, *self._state()):
                    return
            return
        remaining = [steps]

        def monitor(root: Any) -> Any:
            # Drake also calls monitors when the simulator is initialised, which is not a step.
            if root.get_time() <= 0.0:
                return EventStatus.DidNothing()
            remaining[0] -= 1
            if not on_step(root.get_time(), *self._state()) or remaining[0] <= 0:
                return EventStatus.ReachedTermination(None, "the walk is over")
            return EventStatus.DidNothing()

        self._simulator.set_monitor(monitor)
        self._simulator.AdvanceTo(until_s)

    def _state(self) -> tuple[Floats, Floats]:
        x = self._plant.GetPositionsAndVelocities(self._at)
        return x[self._order], x[self._rates]

    def carry(self, ball: int, has_ground: bool) -> None:
        """Allow or exclude a foot's collisions with the floor. Each foot has its own filter."""
        from pydrake.geometry import CollisionFilterDeclaration, GeometrySet

        if not self._feet or has_ground == (ball not in self._declared):
            return
        context = self._scene_graph.GetMyMutableContextFromRoot(self._context)
        manager = self._scene_graph.collision_filter_manager(context)
        if has_ground:
            manager.RemoveDeclaration(self._declared.pop(ball))
        else:
            declaration = CollisionFilterDeclaration()
            declaration.ExcludeBetween(GeometrySet(self._floor), GeometrySet(self._feet[ball]))
            self._declared[ball] = manager.ApplyTransient(declaration)


def add_model(plant: Any, model: PlanarModel, own: adapter.OwnContact | None) -> tuple[list[Any], list[Any], Any]:
    """Add bodies, joints and feet.

    Returns the joints in the order of the coordinates, and the geometries of feet and floor.
    """
    from pydrake.geometry import HalfSpace, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import ContactModel
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia

    plant.mutable_gravity_field().set_gravity_vector(np.array((model.gravity_along, -model.gravity_down, 0.0)))
    bodies: list[Any] = []
    joints: list[Any] = []
    for link in model.links:
        inertia = RotationalInertia(*[link.inertia_kg_m2] * 3)
        centre = np.array((*link.centre_m, 0.0))
        body = plant.AddRigidBody(link.name, SpatialInertia.MakeFromCentralInertia(link.mass_kg, centre, inertia))
        parent = plant.world_body() if link.parent < 0 else bodies[link.parent]
        joints += join_to_parent(plant, model, link, parent, body)
        bodies.append(body)
    if own is None:
        return joints, [], None
    plant.set_contact_model(ContactModel.kPoint)
    pose = HalfSpace.MakePose(np.array((0.0, 1.0, 0.0)), np.array((0.0, model.balls[0].ground_m, 0.0)))
    floor = plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), "floor", material(own))
    feet = []
    for number, ball in enumerate(model.balls):
        shape = RigidTransform(np.array((*ball.centre_m, 0.0))), Sphere(ball.radius_m)
        feet.append(plant.RegisterCollisionGeometry(bodies[ball.link], *shape, f"foot {number}", material(own)))
    return joints, feet, floor


def join_to_parent(plant: Any, model: PlanarModel, link: Link, parent: Any, body: Any) -> list[Any]:
    """Join a link to its parent by a hinge, or the base to the world by joints for its degrees of freedom.

    Returns the joints.
    """
    from pydrake.math import RigidTransform
    from pydrake.multibody.tree import FixedOffsetFrame, PlanarJoint, PrismaticJoint, RevoluteJoint, SpatialInertia

    def frame(on: Any, name: str, point: tuple[float, float]) -> Any:
        return plant.AddFrame(FixedOffsetFrame(name, on.body_frame(), RigidTransform(np.array((*point, 0.0)))))

    child_frame = frame(body, f"{link.name} hinge", link.point_m)
    parent_frame = frame(parent, f"{link.name} on its parent", link.parent_point_m)
    if link.parent >= 0 or model.freedoms == ("turn",):
        return [plant.AddJoint(RevoluteJoint(link.name, parent_frame, child_frame, np.array((0.0, 0.0, 1.0))))]
    if model.freedoms == ("along", "height", "turn"):
        return [plant.AddJoint(PlanarJoint(link.name, parent_frame, child_frame))]
    # Each of the two slides is a joint, and a body without mass must connect them.
    carriage = plant.AddRigidBody("carriage", SpatialInertia.Zero())
    x, y = np.array((1.0, 0.0, 0.0)), np.array((0.0, 1.0, 0.0))
    along = plant.AddJoint(PrismaticJoint("along", parent_frame, carriage.body_frame(), x))
    return [along, plant.AddJoint(PrismaticJoint("height", carriage.body_frame(), child_frame, y))]


def material(own: adapter.OwnContact) -> Any:
    """Return the surface properties of feet and floor. Each surface contributes half of the compliance."""
    from pydrake.geometry import AddContactMaterial, ProximityProperties
    from pydrake.multibody.plant import CoulombFriction

    settings = own.settings
    properties = ProximityProperties()
    AddContactMaterial(
        properties=properties,
        dissipation=settings.get("hunt_crossley_dissipation"),
        point_stiffness=2.0 * settings["point_contact_stiffness"],  # two springs in series
        friction=CoulombFriction(settings["friction"], settings["friction"]),
    )
    if "relaxation_time" in settings:
        # The relaxation times of both surfaces add up, so each gets half.
        properties.AddProperty("material", "relaxation_time", 0.5 * settings["relaxation_time"])
    return properties


def add_forces(builder: Any, plant: Any, forces: adapter.Forces, place: Any) -> None:
    """Add a system that computes the external forces from the state of the plant at every evaluation.

    place  index of each of our coordinates in Drake's order
    """
    from pydrake.systems.framework import LeafSystem

    n = len(place)
    rates = n + place
    result = np.zeros(n)

    class Ground(LeafSystem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("state", 2 * n)
            self.DeclareVectorOutputPort("forces", n, self._calculate)

        def _calculate(self, context: Any, output: Any) -> None:
            state = self.get_input_port(0).Eval(context)
            result[place] = forces(context.get_time(), state[place], state[rates])
            output.SetFromVector(result)

    ground = builder.AddSystem(Ground())
    builder.Connect(plant.get_state_output_port(), ground.get_input_port(0))
    builder.Connect(ground.get_output_port(0), plant.get_applied_generalized_force_input_port())
