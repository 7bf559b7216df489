"""Measurements on the paper's own walker and slope, whatever the config: what its errata are shown with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from walkerlab.hybrid.recorded_walk import RigidWalkResult, as_state, take_walk
from walkerlab.paper import measured, printed
from walkerlab.paper.adams_start import AdamsStart, adams_start
from walkerlab.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled
from walkerlab.paper.misprints import (
    MISPRINTED,
    fixed_point,
    foothold_speed_after_impact,
    height_over_slope,
    inertia_at_impact,
)
from walkerlab.paper.prose import prose
from walkerlab.solvers.system import State

SETTLING_STEPS = 150  # from x_p to its fixed point: disturbances shrink by 0.6 a step
FOOT_VELOCITY = (0.3, -0.2)  # m/s, of the foot in the check of (A.9) to (A.24)


@dataclass(frozen=True)
class Impact:
    """What (A.55) as printed does, at the heel strike of the fixed point of the equations as printed.

    height         m, that it puts the swing foot of x_p over the slope
    foothold_speed m/s, of the new stance foot after the impact
    fixed_point    with both misprints; None if there is none nearby
    """

    height: float
    foothold_speed: float
    fixed_point: State | None


@dataclass(frozen=True)
class Ordering:
    """Kinetic energy (J) of one state: from the masses' velocities, and from D_e with either order of coordinates."""

    of_masses: float
    angles_first: float
    foot_first: float


@dataclass(frozen=True)
class PaperStudy:
    """All of it.

    as_printed, corrected  the gaits that x_p settles to
    from_x_p               Table 3 of five gait cycles from x_p with its printed digits, equations as printed
    five_steps_energy      J, time mean over the first five steps of these ten
    fastest                rad/s, largest angular velocity of the gait as printed
    largest_jump           rad/s, largest change of an angular velocity at its heel strike
    """

    slope: float
    slope_rounding: float
    as_printed: measured.RigidModel
    corrected: measured.RigidModel
    from_x_p: measured.Characteristics
    five_steps_energy: float
    fastest: float
    largest_jump: float
    impact: Impact
    ordering: Ordering
    adams: AdamsStart

    @property
    def angles_in_words(self) -> str:
        """On which slopes the feet of the ADAMS start and of x_p stand."""
        return prose(
            "adams_start.angles", self, printed.slope_of(printed.TABLE_2[0].adams, printed.TABLE_2[1].adams)[1]
        )


def study_the_paper() -> PaperStudy:
    """Walk the paper's walker from its printed states; takes milliseconds once compiled."""
    wrong, right = printed.walker_of_the_paper(AS_PRINTED), printed.walker_of_the_paper(CORRECTED)
    gaits = {name: settled(printed.walker_of_the_paper(sign)) for name, sign in printed.SIGNS.items()}
    one_step = take_walk(assembled(wrong), measured.TIGHT, gaits["as-printed"], 1, sampled=True)
    cycles = measured.five_cycles(wrong, printed.fixed_point_as_printed())
    five_steps = take_walk(assembled(wrong), measured.TIGHT, printed.fixed_point_as_printed(), measured.ENERGY_STEPS)
    slope, rounding = printed.slope_of(*printed.X_P[:2])
    return PaperStudy(
        slope=slope,
        slope_rounding=rounding,
        as_printed=measured.rigid_model(wrong, gaits["as-printed"]),
        corrected=measured.rigid_model(right, gaits["corrected"]),
        from_x_p=measured.characteristics(cycles.periods_s, cycles.lengths_m, cycles.mean_energy),
        five_steps_energy=five_steps.mean_energy,
        fastest=fastest_leg(one_step),
        largest_jump=float(np.abs(one_step.after[0, [3, 2]] - one_step.before[0, 2:]).max()),
        impact=misprinted_impact(wrong, one_step),
        ordering=order_of_coordinates(right),
        adams=adams_start(
            assembled(right._replace(slope=printed.slope_of(printed.TABLE_2[0].adams, printed.TABLE_2[1].adams)[0])),
            printed.adams_start_as_printed(),
        ),
    )


def settled(walker: RigidWalker) -> State:
    """The stable gait that walking from x_p leads to."""
    walk = take_walk(assembled(walker), measured.TIGHT, printed.fixed_point_as_printed(), SETTLING_STEPS)
    if walk.steps < SETTLING_STEPS:
        raise ArithmeticError(f"x_p does not walk: {walk.outcome.label} after {walk.steps} steps")
    return walk.final_state


def fastest_leg(walk: RigidWalkResult) -> float:
    """Largest angular velocity (rad/s) of a sampled walk."""
    assert walk.samples is not None
    return float(np.abs(walk.samples.state[:, 2:]).max())


def misprinted_impact(walker: RigidWalker, one_step: RigidWalkResult) -> Impact:
    """What (A.55) as printed does to the gait whose step is given."""
    theta_1, theta_2 = printed.fixed_point_as_printed()[:2]
    return Impact(
        height=height_over_slope(walker, theta_1, theta_2, MISPRINTED),
        foothold_speed=foothold_speed_after_impact(walker, as_state(one_step.before[0]), MISPRINTED),
        fixed_point=fixed_point(walker, one_step.start, MISPRINTED),
    )


def order_of_coordinates(walker: RigidWalker) -> Ordering:
    """Kinetic energies at x_p with a moving foot."""
    theta_1, theta_2, omega_1, omega_2 = printed.fixed_point_as_printed()
    D = inertia_at_impact(walker, theta_1, theta_2)
    angles_first = np.array([omega_1, omega_2, *FOOT_VELOCITY])
    foot_first = np.array([*FOOT_VELOCITY, omega_1, omega_2])
    L, a = walker.leg_length, walker.foot_to_mass
    foot = np.array(FOOT_VELOCITY)
    along_stance = -omega_2 * np.array([math.cos(theta_2), math.sin(theta_2)])
    along_swing = omega_1 * np.array([math.cos(theta_1), math.sin(theta_1)])
    hip = foot + L * along_stance
    moving = [
        (walker.leg_mass, foot + a * along_stance),
        (walker.hip_mass, hip),
        (walker.leg_mass, hip + (L - a) * along_swing),
    ]
    return Ordering(
        of_masses=float(sum(0.5 * mass * velocity @ velocity for mass, velocity in moving)),
        angles_first=float(0.5 * angles_first @ D @ angles_first),
        foot_first=float(0.5 * foot_first @ D @ foot_first),
    )
