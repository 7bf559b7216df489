"""Scene for other programs: parts and start of a walker, and a linear approximation of its contact."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.reads import ContactConfig
from walkerlab.exchange.planar import FLOATING, PlanarModel, planar_model
from walkerlab.physics.ground.friction import FrictionLaw, friction_coefficient
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import LOCKED, MAX_BODIES, ContactWalker, changed_forms
from walkerlab.physics.hybrid.contact_state import JudgedGround
from walkerlab.physics.mechanics.parts import Anchor, Assembly, Knee, hinge_point, levers, masses, total_mass
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.contact import ContactScene, contact_scene, start_state

# Ratio of tangential to normal force of a standing foot. It is close to the mean over a walk.
CREEP_LOAD = 0.1


@dataclass(frozen=True)
class EngineScene:
    """Walker on its ground, described for an engine and for walkerlab's walking rules."""

    assembly: Assembly  # parts of the walker
    base: Anchor  # root of the engine's tree: the hip point of the first stance leg
    ours: ContactWalker  # the walker in walkerlab's contact model
    walker: ContactWalker  # the same walker, with the levers of feet and hip measured from the base
    ground: JudgedGround  # terrain, and the dimensions of the walker by which the walking rules judge a walk
    start: State  # start of the walk, a state of the free walker (not pinned to the ground)
    locked: tuple[Knee, ...] = ()  # locked knees, which have no hinge in the engine

    @cached_property
    def model(self) -> PlanarModel:
        return planar_model(self.assembly, self.base, FLOATING, self.gravity, self.locked)

    @property
    def name(self) -> str:
        return "kneed" if self.assembly.knees else "compass"

    @property
    def gravity(self) -> tuple[float, float]:
        """Gravity (m/s^2) along the slope and normal to it, into the ground."""
        return self.ours.gravity_along, self.ours.gravity_down

    @cached_property
    def knee_indices(self) -> tuple[int, ...]:
        """Index of each knee's angle among the engine's coordinates, or -1 for a locked knee."""
        ends = [(self.assembly.index(knee.shank), self.assembly.index(knee.thigh)) for knee in self.assembly.knees]
        bends = [self.model.chain[shank] - self.model.chain[thigh] for shank, thigh in ends]
        return tuple(2 + int(np.argmax(bend)) if bend.any() else -1 for bend in bends)

    def lock_knees(self, doing: NDArray[np.int8]) -> "EngineScene":
        """Return the scene without hinges at the knees that `doing` marks as LOCKED."""
        locked = (knee for knee, state in zip(self.assembly.knees, doing, strict=False) if state == LOCKED)
        return replace(self, locked=tuple(locked))

    @cached_property
    def centre_levers(self) -> Floats:
        """Vectors (bodies, 2) in the frames of the bodies (m). If each is rotated by the angle of its body, their sum
        leads from the base to the centre of mass.
        """
        weighted = [mass * levers(self.assembly, self.base, anchor) for mass, anchor in masses(self.assembly)]
        return np.asarray(sum(weighted) / total_mass(self.assembly))

    def from_base(self, y: State) -> tuple[Floats, Floats]:
        """Convert a state of the free walker to the engine's coordinates and velocities."""
        n = len(self.model.chain)
        angles = np.array(y[2 : 2 + n]) + self.ours.slope
        rates = np.array(y[4 + n :])
        shift, drift = self._centre(angles, rates)
        position = np.array(y[:2]) - shift
        velocity = np.array(y[2 + n : 4 + n]) - drift
        # Bodies of a locked leg have equal rows, so there may be more equations than angles. They are consistent.
        relative, relative_rates = np.linalg.lstsq(self.model.chain, np.column_stack((angles, rates)), rcond=None)[0].T
        return np.concatenate((position, relative)), np.concatenate((velocity, relative_rates))

    def about_centre(self, q: Floats, v: Floats) -> Floats:
        """Convert an engine's coordinates and velocities to a state of the free walker."""
        angles = self.model.chain @ q[2:]
        rates = self.model.chain @ v[2:]
        shift, drift = self._centre(angles, rates)
        return np.concatenate((q[:2] + shift, angles - self.ours.slope, v[:2] + drift, rates))

    def _centre(self, angles: Floats, rates: Floats) -> tuple[Floats, Floats]:
        """Position (m) and velocity (m/s) of the centre of mass relative to the base."""
        s, c = np.sin(angles), np.cos(angles)
        d = self.centre_levers
        forward = c * d[:, 0] - s * d[:, 1]
        upward = s * d[:, 0] + c * d[:, 1]
        return np.array((forward.sum(), upward.sum())), np.array((-rates @ upward, rates @ forward))

    def scale_start(self, factor: float) -> "EngineScene":
        """Return the scene with the initial velocities multiplied by `factor`, and adjusted so that the stance foot
        does not slip.
        """
        n = len(self.model.chain)
        return replace(self, start=(*self.start[: 2 + n], *(factor * x for x in self.start[2 + n :])))


def engine_scene(
    config: ContactConfig, rigid_step_length_m: float, rigid_state: State, asymmetry: float = 0.0
) -> EngineScene:
    """Build the scene of a config without a pinned foot or locked knees. `pad_pitch: own` means the rigid step length.

    asymmetry  difference between the rigid gait's step lengths divided by their mean, which shifts the lanes of pads
    """
    scene = contact_scene(config, rigid_step_length_m, rigid_step_length_m, asymmetry)
    return scene_for_engines(replace(scene, pinned=False), rigid_state)


def scene_for_engines(scene: ContactScene, rigid_state: State) -> EngineScene:
    assembly = scene.assembly
    start = start_state(scene, rigid_state)
    upper = assembly.legs[STANCE_FOOT][0]
    base = Anchor(upper, hinge_point(assembly, upper, assembly.legs[1 - STANCE_FOOT][0]))
    d = np.zeros((2, MAX_BODIES, 2))
    for foot, part in enumerate(assembly.feet):
        d[foot, : len(assembly.bodies)] = levers(assembly, base, Anchor(part.body, part.centre_m))
    # The base is the hip, so the levers to the hip are zero.
    walker = changed_forms(scene.walker, foot_x=d[..., 0], foot_y=d[..., 1], hip_x=0.0, hip_y=0.0)
    return EngineScene(assembly, base, scene.walker, walker, scene.ground, start)


@dataclass(frozen=True)
class EngineContact:
    """Properties, in SI units, that the native contact model of an engine is tuned to reproduce."""

    mass: float  # mass that rests on one foot (kg)
    gravity: float  # gravity towards the ground (m/s^2)
    penetration: float  # penetration at rest under the weight of that mass (m)
    exponent: float  # exponent of the penetration in the normal force
    damping_ratio: float  # c / (2 sqrt(k m)) at rest
    friction: float  # ratio of tangential to normal force of a sliding foot
    creep_load: float  # ratio of tangential to normal force of a standing foot
    creep_velocity: float  # creep velocity under that load (m/s)


def creep_velocity(friction: FrictionLaw, load: float) -> float:
    """Return the slip velocity (m/s) at which the friction force is `load` times the normal force."""
    # Bisect down to neighbouring floats, because importing the root finder of a library would slow down an export.
    low, high = 0.0, friction.rising_until
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if -friction_coefficient(friction, middle)[0] < load else (low, middle)
    return high


def contact_target(scene: EngineScene) -> EngineContact | None:
    """Linearise the contact of a walker that stands on one foot. Return None for frictionless ground."""
    walker = scene.ours
    friction = walker.friction
    if friction.largest == 0.0:
        return None
    mass = walker.mass
    g = walker.gravity_down
    foot = walker.normal.resting_foot(mass * g, mass)
    creep = creep_velocity(friction, CREEP_LOAD)
    sliding = -friction_coefficient(friction, friction.sliding_from)[0]
    return EngineContact(mass, g, foot.depth, walker.normal.exponent, foot.damping_ratio, sliding, CREEP_LOAD, creep)
