"""A walker on its ground, in the state that a case starts from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from walkerlab.config.reads import ContactConfig, WalksConfig
from walkerlab.config.stability import Case
from walkerlab.mechanics.standing import Standing, swing_foot
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.orbits.gait import Gait
from walkerlab.scene.contact import ContactScene, contact_gait, contact_scene, start_state, wants_own_pitch
from walkerlab.scene.rigid import rigid_walker
from walkerlab.solvers.system import State

HEIGHT = 1  # index into the state of the free walker


@cache
def gait_of(walker: Standing, seed: int) -> Gait | None:
    """The gait that a search finds, once: most cases of a catalogue are one walker on other ground."""
    return find_gaits(walker, seed).gait


@dataclass(frozen=True)
class ContactStart:
    """A walker on its ground, in the state that it starts from."""

    scene: ContactScene
    start: State
    energy: float  # J, m g L and the energy of the start: what residuals are measured by


def prepared(config: WalksConfig, case: Case) -> ContactStart | None:
    """The scene and start of a case; None if it starts from a gait that there is not."""
    walker = rigid_walker(config, config.equations)
    if isinstance(config.start, str):
        gait = gait_of(walker, config.seed)
        if gait is None:
            return None
        rigid_state, length = tuple(float(x) for x in gait.state), float(gait.step_length)
    else:
        rigid_state = config.start
        length = abs(float(swing_foot(walker, rigid_state)[1]))
    own = own_pitch(config, length, rigid_state)
    if own is None:
        return None
    scene = contact_scene(config, length, own)
    y = start_state(scene, rigid_state)
    lowered = case.lowered_m
    y = (*y[:HEIGHT], y[HEIGHT] - lowered, *y[HEIGHT + 1 :])
    mass, gravity, leg = scene.walker.tree.mass, config.gravity_m_s2, config.walker.leg_length_m
    rates = len(y) // 2  # where the velocities begin
    speed = float(np.max(np.abs([*y[rates : rates + 2], *(leg * rate for rate in y[rates + 2 :])])))
    law = scene.walker.normal
    stored = 2.0 * law.stiffness * max(0.0, lowered) ** (law.exponent + 1.0) / (law.exponent + 1.0)
    return ContactStart(scene, y, mass * (gravity * leg + 0.5 * speed**2) + stored)


def own_pitch(config: ContactConfig, rigid_step_m: float, rigid_state: State) -> float | None:
    """What pads of the contact gait's own pitch are laid for (m), if the case wants them; None if there is no gait."""
    contact = config.contact
    if contact is None or not wants_own_pitch(contact):
        return rigid_step_m
    found = contact_gait(config, rigid_step_m, rigid_state).gait
    return None if found is None else found.step.length_m
