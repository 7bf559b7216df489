"""Exudyn: a kinematic tree in minimal coordinates, explicit and implicit integrators, contact of balls with a triangle.

The walk takes place in Exudyn's x-y plane. The contact force is k d^e + c d' with the k and e of ADAMS's law. Friction
rises linearly with the slip velocity up to its full value.

Source: Exudyn documentation, ObjectKinematicTree and ObjectContactSphereTriangle.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from walkerlab.evidence.benchmarks.engines import adapter
from walkerlab.exchange.engine_scene import EngineContact
from walkerlab.exchange.planar import PlanarModel
from walkerlab.physics.solvers.system import Floats

INTEGRATORS = {
    "ExplicitEuler": adapter.Integrator(1, 45_000),
    "RK44": adapter.Integrator(4, 45_000),
    "TrapezoidalIndex2": adapter.Integrator(2, 25_000),
    "DOPRI5 adaptive": adapter.Integrator(5, 60_000, adapts=True),
}
CONTACTS = {"sphere-triangle": "RK44", "sphere-triangle implicit": "TrapezoidalIndex2"}
CANNOT_EXPRESS = (
    "damping that rises over the first 0.1 mm: damping acts in full from first touch",
    "a ground that never pulls: damping also acts on a lifting foot, and holds the trailing foot back",
    "friction that rises as a cubic, or static above dynamic friction: friction rises linearly to one coefficient",
    "an endless plane: a triangle of a kilometre replaces it",
    "a knee that locks: the explicit integrators allow no constraints, so the walk continues in another model",
)
PLANE_M = 1000.0
NO_ROTATION = np.eye(3)
SMALLEST_STEP_S = 1e-12
NO_ITERATION = 1e12
EXPLICIT_METHODS = ("ExplicitEuler", "RK44")


def tune(model: str, target: EngineContact) -> adapter.OwnContact:
    """Compute the settings that meet the target, including the slip velocity at which friction is full."""
    stiffness = target.exponent * target.mass * target.gravity / target.penetration
    settings = {
        "contact_stiffness": target.mass * target.gravity / target.penetration**target.exponent,
        "contact_stiffness_exponent": target.exponent,
        "contact_damping": 2.0 * target.damping_ratio * math.sqrt(stiffness * target.mass),
        "dynamic_friction": target.friction,
        "friction_proportional_zone": target.creep_velocity * target.friction / target.creep_load,
    }
    return adapter.OwnContact(model, settings)


class ExudynRun(adapter.Simulation):
    """An Exudyn system with one tree and its contacts."""

    def build(self, model: PlanarModel, q: Floats, v: Floats) -> None:
        import exudyn as exu
        from exudyn.itemInterface import NodeGenericODE2

        self._container = exu.SystemContainer()
        self._system = self._container.AddSystem()
        start = NodeGenericODE2(
            referenceCoordinates=[0.0] * model.size,
            initialCoordinates=q.tolist(),
            initialCoordinates_t=v.tolist(),
            numberOfODE2Coordinates=model.size,
        )
        tree, places = add_tree(self._system, model, self._system.AddNode(start), self.forces)
        self._contacts = [] if self.own is None else list(add_contacts(self._system, model, tree, places, self.own))
        self._system.Assemble()

    def run(self, steps: int, until_s: float, on_step: adapter.OnStep) -> None:
        import exudyn as exu

        data = self._system.systemData
        remaining = [steps]

        def after_step(_system: Any, time_s: float) -> bool:
            if time_s <= 0.0:
                return True
            remaining[0] -= 1
            return on_step(time_s, data.GetODE2Coordinates(), data.GetODE2Coordinates_t()) and remaining[0] > 0

        name, _, adaptive = self.stepping.integrator.partition(" ")
        settings = exu.SimulationSettings()
        stepping = settings.timeIntegration
        h = self.stepping.step_s
        stepping.endTime = min(until_s, steps * h) if not adaptive else until_s
        # Without the small margin, rounding could add a step.
        stepping.numberOfSteps = max(1, math.ceil(stepping.endTime / h - 1e-9))
        stepping.verboseMode = 0
        stepping.adaptiveStep = name not in EXPLICIT_METHODS  # explicit methods have a fixed step size
        # No iterations: contact is detected at the end of a step, as in any explicit method.
        stepping.discontinuous.ignoreMaxIterations = True
        stepping.discontinuous.iterationTolerance = NO_ITERATION
        settings.solution.file.write = False
        if adaptive:
            stepping.relativeTolerance = stepping.absoluteTolerance = self.stepping.tolerance
            stepping.minimumStepSize = SMALLEST_STEP_S
            stepping.initialStepSize = 1e-5
        self._system.SetPostStepUserFunction(after_step)
        self._system.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, name))

    def carry(self, ball: int, has_ground: bool) -> None:
        if self._contacts:
            self._system.SetObjectParameter(self._contacts[ball], "activeConnector", has_ground)


def add_tree(system: Any, model: PlanarModel, node: Any, forces: adapter.Forces | None) -> tuple[Any, list[int]]:
    """Add the tree of the model to the system, and return its object number and the joint index of each link."""
    import exudyn as exu
    from exudyn.itemInterface import ObjectKinematicTree

    kinds = {"along": exu.JointType.PrismaticX, "height": exu.JointType.PrismaticY, "turn": exu.JointType.RevoluteZ}
    pieces: list[tuple[Any, ...]] = []
    places: list[int] = []
    for link in model.links:
        freedoms = model.freedoms if link.parent < 0 else ("turn",)
        for freedom in freedoms:
            # Each degree of freedom of the base needs a separate link. Only the last of these links may have mass.
            last = freedom == freedoms[-1]
            hangs = link.parent >= 0
            offset = link.parent_point_m if hangs or not pieces else (0.0, 0.0)
            from_hinge = np.subtract(offset, model.links[link.parent].point_m if hangs else (0.0, 0.0))
            parent = places[link.parent] if hangs else len(pieces) - 1
            centre = [*np.subtract(link.centre_m, link.point_m), 0.0] if last else [0.0, 0.0, 0.0]
            mass, inertia = (link.mass_kg, link.inertia_kg_m2) if last else (0.0, 0.0)
            pieces.append((kinds[freedom], parent, [*from_hinge, 0.0], centre, mass, inertia * NO_ROTATION))
        places.append(len(pieces) - 1)
    joints, parents, offsets, centres, masses, inertias = map(list, zip(*pieces, strict=True))

    def applied(_system: Any, time_s: float, _item: Any, q: Any, v: Any) -> Any:
        assert forces is not None, "only called with forces"
        return forces(time_s, np.asarray(q), np.asarray(v)).tolist()

    tree = ObjectKinematicTree(
        nodeNumber=node,
        jointTypes=joints,
        linkParents=parents,
        jointTransformations=exu.Matrix3DList([NO_ROTATION] * len(joints)),
        jointOffsets=exu.Vector3DList(offsets),
        linkInertiasCOM=exu.Matrix3DList(inertias),
        linkCOMs=exu.Vector3DList(centres),
        linkMasses=masses,
        gravity=[model.gravity_along, -model.gravity_down, 0.0],
        forceUserFunction=0 if forces is None else applied,
    )
    return system.AddObject(tree), places


def add_contacts(
    system: Any, model: PlanarModel, tree: Any, places: list[int], own: adapter.OwnContact
) -> Iterator[Any]:
    """Add a contact between each foot and a large triangle, and yield the contact's object number.

    places  joint index of each link, as returned by `add_tree`
    """
    import exudyn as exu
    from exudyn import itemInterface

    settings = own.settings
    r = PLANE_M
    plane = exu.Vector3DList([[-r, 0.0, r], [r, 0.0, r], [0.0, 0.0, -r]])  # its normal points upwards
    floor = system.AddObject(itemInterface.ObjectGround())
    for ball in model.balls:
        place = [*np.subtract(ball.centre_m, model.links[ball.link].point_m), 0.0]
        foot = itemInterface.MarkerKinematicTreeRigid(
            objectNumber=tree, linkNumber=places[ball.link], localPosition=place
        )
        ground = itemInterface.MarkerBodyRigid(bodyNumber=floor, localPosition=[0.0, ball.ground_m, 0.0])
        state = itemInterface.NodeGenericData(initialCoordinates=[0.0] * 4, numberOfDataCoordinates=4)
        contact = itemInterface.ObjectContactSphereTriangle(
            markerNumbers=[system.AddMarker(foot), system.AddMarker(ground)],
            nodeNumber=system.AddNode(state),
            sphereRadius=ball.radius_m,
            trianglePoints=plane,
            includeEdges=0,
            dynamicFriction=settings["dynamic_friction"],
            frictionProportionalZone=settings["friction_proportional_zone"],
            contactStiffness=settings["contact_stiffness"],
            contactDamping=settings["contact_damping"],
            contactStiffnessExponent=settings["contact_stiffness_exponent"],
        )
        yield system.AddObject(contact)
