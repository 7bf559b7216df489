"""Build the contact model of a config, with only the parts that the config needs, and starts with scaled velocities."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from walkerlab.config import reads, walkers
from walkerlab.config.contact import Contact
from walkerlab.errors import NoAnswer
from walkerlab.physics.ground import friction, normal_force, terrain
from walkerlab.physics.ground.compliant import ContactDrives, KneeRules, contact_walker
from walkerlab.physics.ground.walker import floating_state
from walkerlab.physics.hybrid import contact_state, recorded_walk
from walkerlab.physics.hybrid.contact_result import ContactWalkResult, walk_contact
from walkerlab.physics.mechanics.parts import Assembly
from walkerlab.physics.mechanics.rigid import group_bodies
from walkerlab.physics.mechanics.rigid_model import RigidModel
from walkerlab.physics.orbits import contact_map, scaled_starts, step_map
from walkerlab.physics.orbits.contact_gait import GaitAnswer, find_gait_from
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import Floats, State
from walkerlab.scene.parts import AnyWalker, assembly_of, drive_parameters, ground_law, hinge_law_of
from walkerlab.scene.rigid import have_different_legs

if TYPE_CHECKING:
    from walkerlab.config.schema import Config


BUDGET_PER_STEP = 1_000_000  # maximum number of right-hand sides that are evaluated in a step
SAMPLES_PER_PENDULUM_TIME = 200  # sampling rate of stored walks
# The method is radau5, because the derivatives of its steps are exact.
GAIT_TOLERANCES = Tolerances("radau5", 1e-10, 1e-12, 10_000_000)
FULL_STOP_DAMPING = 1e-5  # rad, penetration at which a compliant knee stop reaches full damping


@dataclass(frozen=True)
class ContactScene(contact_map.WalkerOnGround):
    pinned: bool  # whether a revolute joint holds the stance foot during the first step
    pitch_m: float
    assembly: Assembly

    def walk(
        self,
        start: State,
        steps: int,
        tolerances: Tolerances,
        sampling: float | Floats | None = None,
        heights: Floats | None = None,
    ) -> ContactWalkResult:
        """Simulate up to `steps` steps from a state (4 + 2 n) of the free walker, see `walk_contact`.

        heights  (footholds,) m above the slope, beginning with the start's foothold; even ground by default
        """
        even = self.ground.terrain
        ground = self.ground if heights is None else self.ground._replace(terrain=even._replace(heights=heights))
        return walk_contact(self.walker, ground, self.pinned, terrain.STANCE_FOOT, start, tolerances, steps, sampling)


def contact_scene(
    config: reads.ContactConfig, rigid_step_length_m: float, own_pitch_m: float | None = None, asymmetry: float = 0.0
) -> ContactScene:
    """Build the scene of a config with a contact block.

    rigid_step_length_m  step length of the rigid gait, the reference length for pads and terrain
    own_pitch_m          step length of the contact gait, needed only for `pad_pitch: own`
    asymmetry            second minus first step length, divided by their mean; the lanes of pads are shifted by it
    """
    contact = require_contact(config)
    pitch = pads_pitch(contact, rigid_step_length_m, own_pitch_m)
    laws = ground_laws(contact)
    rules = knee_rules(config.walker)
    assembly = assembly_of(config.walker)
    gravity = config.gravity_m_s2
    drives = contact_drives(config)
    walker = contact_walker(assembly, *laws, gravity, config.slope_rad, rules, drives=drives)
    leg = config.walker.leg_length_m
    frame = contact_state.Frame(leg, math.sqrt(leg / gravity), locate_switching=True)
    ground = contact_state.JudgedGround(TERRAINS[contact.terrain](pitch, asymmetry), frame)
    return ContactScene(walker, ground, contact.stance == "pinned", pitch, assembly)


def tolerances_of(config: reads.GroundConfig, steps: int) -> Tolerances:
    settings = config.solver.contact
    return Tolerances(settings.method, settings.rtol, settings.atol, steps * BUDGET_PER_STEP)


def scene_on_pads(
    config: reads.ContactConfig,
    rigid_step: float,
    rigid_state: State,
    search: GaitAnswer | None = None,
    asymmetry: float = 0.0,
) -> ContactScene:
    """Build the scene of a config and, if necessary, find the contact gait that gives the pitch of its pads.

    search  result of an earlier search for the contact gait; None to search if necessary

    Raises NoAnswer if the pitch of the pads needs a contact gait and none is found.
    """
    pitch = None
    contact = require_contact(config)
    if contact.terrain == "checkerboard" and contact.pad_pitch == "own":
        search = search or contact_gait(config, rigid_step, rigid_state)
        if search.gait is None:
            raise NoAnswer(f"no contact gait to lay the pads for: {search.reason}", search.advice)
        pitch = float(search.gait.lengths_m.mean())
        if len(search.gait.steps) > 1:
            # Pads lie where the feet touch. The distances between touches differ from those between sections.
            first, second = contact_map.lengths_between_touches(search.gait)
            asymmetry = float((second - first) / pitch)
    return contact_scene(config, rigid_step, pitch, asymmetry)


def contact_drives(config: reads.ContactConfig) -> ContactDrives:
    law = hinge_law_of(config.walker)
    drives = drive_parameters(config)
    pulse = {"push_offs": drives.push_offs, "push_off_duration": config.push_off.duration_s}
    knees = {"knees": drives.knees} if drives.knees else {}
    fields = drives.shared | (pulse if any(drives.push_offs) else {}) | knees
    return ContactDrives(law, fields)


def knee_rules(walker: AnyWalker) -> KneeRules:
    if not isinstance(walker, walkers.Kneed | walkers.AssembledWalker):
        return KneeRules()
    knee = walker.knee
    # If the knee is free during the rigid model's strike, it must not stay locked here while the leading foot sinks in.
    at_touch = knee.release == "touch" or knee.at_heel_strike == "free"
    if knee.lock == "ideal":
        return KneeRules(release_at_touch=at_touch)
    return KneeRules(normal_force.Impact(knee.stop_stiffness, 1.0, knee.stop_damping, FULL_STOP_DAMPING), at_touch)


# Functions that build a terrain from the pads' pitch and the asymmetry of the steps. At the start, leg 1 is a step
# behind leg 2.
TERRAINS: dict[str, Callable[[float, float], terrain.Terrain]] = {
    "checkerboard": lambda pitch, asymmetry: terrain.checkerboard(pitch, (-pitch * (1.0 + 0.5 * asymmetry), 0.0)),
    "after-mid-swing": lambda pitch, _: terrain.after_mid_swing(pitch),
    "plane": lambda pitch, _: terrain.plane(pitch),
}


def require_contact(config: reads.ContactConfig) -> Contact:
    if config.contact is None:
        raise ValueError("this config has no contact block")
    return config.contact


def contact_gait(config: reads.ContactConfig, rigid_step_length_m: float, rigid_state: State) -> GaitAnswer:
    """Find the contact model's gait on pads whose pitch is the step length of that gait, starting from a rigid state.

    rigid_step_length_m  initial pad pitch
    """
    # This pitch is only the first guess. The search replaces it by the step length of the gait.
    scene = replace(contact_scene(config, rigid_step_length_m, rigid_step_length_m), pinned=False)
    start = start_state(scene, rigid_state)
    return find_gait_from(scene.walker, scene.ground, GAIT_TOLERANCES, start, have_different_legs(config))


def gait_off_pads(config: "Config", rigid_step_length_m: float, rigid_state: State) -> GaitAnswer:
    """Find the gait of the contact model on a plane that has no pads and lets scuffing feet through."""
    contact = require_contact(config)
    if contact.terrain == "checkerboard":
        config = config.model_copy(update={"contact": contact.model_copy(update={"terrain": "after-mid-swing"})})
    return contact_gait(config, rigid_step_length_m, rigid_state)


def pads_pitch(contact: Contact, rigid_step_length_m: float, own_pitch_m: float | None) -> float:
    """Return the pad pitch (m). Terrain without pads uses the rigid step length as reference length."""
    if contact.terrain != "checkerboard" or contact.pad_pitch == "rigid":
        return rigid_step_length_m
    if contact.pad_pitch == "own":
        if own_pitch_m is None:
            raise ValueError("pad_pitch=own requires the step length of the contact gait")
        return own_pitch_m
    return float(contact.pad_pitch)


def ground_laws(contact: Contact) -> tuple[Any, Any]:
    """Return the laws of the normal force and of friction in SI. Frictionless contact has a law of its own.

    Raises ConfigError if a law that an extension added is incomplete.
    """
    si = contact.to_si()
    return ground_law(normal_force.NORMAL_LAWS, si), ground_law(friction.FRICTION_LAWS, si)


def start_state(scene: ContactScene, rigid_state: State) -> State:
    """Convert a rigid start to a state of the contact model. The stance foot just touches the ground at along = 0.

    rigid_state  state of the rigid model with both feet on the slope. For a compass it is (theta_1, theta_2, dtheta_1,
                 dtheta_2) with index 1 for the swing leg, 2 for the stance leg

    Position and velocity are first computed with a hinge at the centre of the ball foot. Unless the foot is pinned, the
    velocity of the foot is then changed so that it rolls without slip.
    """
    walker = scene.walker
    # In the rigid model, the bodies of a straight leg have one angle in common. Here each of them has its own.
    members = group_bodies(scene.assembly).members
    parts = np.array(rigid_state).reshape(2, members.shape[1])
    turned = parts @ members.T
    y = floating_state(walker.forms[1, 0], turned.ravel(), walker.size)
    if scene.pinned:
        return y
    n = turned.shape[1]
    rolled = float(walker.whole.rolling[terrain.STANCE_FOOT, :n] @ turned[1])
    return (*y[: 2 + n], y[2 + n] - rolled, *y[3 + n :])


def scene_measures(scene: ContactScene) -> dict[str, Any]:
    walker = scene.walker
    # The static penetration is that under the whole weight, not under the component normal to the slope.
    foot = walker.normal.resting_foot(walker.mass * walker.gravity, walker.mass)
    return {
        "static_penetration_m": foot.depth,
        "damping_ratio": foot.damping_ratio,
        "pitch_m": scene.pitch_m,
        "friction": walker.friction.describe(),
    }


# Tolerances for maps. They give the same map as the config's tolerances, except at boundaries between outcomes.
MAP_RTOL = 1e-4
MAP_ATOL = 1e-6
# evaluations per cell: a multiple of what the unchanged start takes, but at least the minimum
MIN_BUDGET, BUDGET_FACTOR = 60_000, 4


def build_scaled_starts(
    scene: ContactScene, rigid: RigidModel, state: State, steps: int, answer: GaitAnswer, tolerances: Tolerances
) -> scaled_starts.ScaledStarts:
    """Build starts with scaled velocities from a rigid start. If `answer` has a contact gait, walks must settle on
    it."""
    gait = None if answer.gait is None else steps_to_settle_on(answer.gait)

    def start(swing: float, stance: float) -> State:
        return start_state(scene, recorded_walk.scale_rates(rigid, state, swing, stance))

    starts = scaled_starts.scaled_starts(scene.walker, scene.ground, start, steps, gait)
    return replace(starts, tolerances=replace(tolerances, method=scaled_starts.START_TOLERANCES.method))


def steps_to_settle_on(gait: step_map.Cycle) -> tuple[tuple[float, float], ...]:
    """Return period (s) and length (m) of each step of a gait: one step for equal legs, otherwise two."""
    if len(gait.steps) == 1:
        return ((gait.period_s, gait.step.length_m),)
    return tuple(zip(gait.periods_s.tolist(), contact_map.lengths_between_touches(gait).tolist(), strict=True))


def scale_for_map(starts: scaled_starts.ScaledStarts, evaluations: int) -> scaled_starts.ScaledStarts:
    """Return the starts with the solver settings of a map.

    evaluations  number of right-hand-side evaluations that the unchanged start takes. The budget of a cell is a
                 multiple of it
    """
    return starts.coarser(MAP_RTOL, MAP_ATOL, max(MIN_BUDGET, BUDGET_FACTOR * evaluations))
