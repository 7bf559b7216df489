"""Measurements on the paper's own walker and slope, for its errata. They do not depend on the config."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from walkerlab.evidence.paper import measured, misprints, printed
from walkerlab.evidence.paper.adams_start import AdamsStart, adams_start
from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled
from walkerlab.physics.hybrid.recorded_walk import as_state, take_walk
from walkerlab.physics.solvers.system import State

X_P_SETTLING_STEPS = 150  # steps from x_p to the fixed point; disturbances shrink by a factor of 0.6 per step
FOOT_VELOCITY = (0.3, -0.2)  # m/s, velocity of the foot in the check of (A.9) to (A.24)


@dataclass(frozen=True)
class PaperStudy:
    """Measurements, in SI units."""

    slope: float
    slope_rounding: float
    # gaits to which walks from x_p converge, with the equations as printed and corrected
    as_printed: measured.RigidMeasurements
    corrected: measured.RigidMeasurements
    # Table 3 for five gait cycles from the printed x_p, with the equations as printed
    from_x_p: measured.Characteristics
    five_steps_energy: float  # J, time mean of the energy over the first five of the ten steps of `from_x_p`
    fastest: float  # rad/s, largest angular velocity of the gait as printed
    largest_jump: float  # rad/s, largest change of an angular velocity at its heel strike
    swing_foot_height: float  # m, height above the slope at which (A.55) as printed places the swing foot of x_p
    foothold_speed: float  # m/s, speed of the new stance foot if the printed gait's impact uses (A.55) as printed
    both_misprints: State | None  # fixed point near x_p with the misprints of (A.5) and (A.55), or None
    # J, kinetic energy of one state: from the velocities of the masses, and from D_e with either order of coordinates
    kinetic_energy: Mapping[str, float]
    adams: AdamsStart


def study_the_paper() -> PaperStudy:
    """Make all measurements on the paper's own walker and slope, which takes milliseconds once compiled."""
    wrong = printed.walker_of_the_paper(AS_PRINTED)
    right = printed.walker_of_the_paper(CORRECTED)
    x_p = printed.fixed_point_as_printed()
    as_printed = settle(wrong)
    corrected = settle(right)
    one_step = take_walk(assembled(wrong), measured.TIGHT, as_printed, 1, sampled=True)
    cycles = take_walk(assembled(wrong), measured.TIGHT, x_p, 2 * measured.PAPER_CYCLES, sampled=True)
    five_steps = take_walk(assembled(wrong), measured.TIGHT, x_p, measured.ENERGY_STEPS)
    assert one_step.samples is not None
    slope, rounding = printed.slope_of(*printed.X_P[:2])
    adams_slope, _ = printed.slope_of(printed.TABLE_2[0].adams, printed.TABLE_2[1].adams)
    return PaperStudy(
        slope=slope,
        slope_rounding=rounding,
        as_printed=measured.measure_rigid_model(wrong, as_printed),
        corrected=measured.measure_rigid_model(right, corrected),
        from_x_p=measured.characteristics(cycles.periods_s, cycles.lengths_m, cycles.mean_energy),
        five_steps_energy=five_steps.mean_energy,
        fastest=float(np.abs(one_step.samples.state[:, 2:]).max()),
        largest_jump=float(np.abs(one_step.after[0, [3, 2]] - one_step.before[0, 2:]).max()),
        swing_foot_height=misprints.height_over_slope(wrong, *x_p[:2], misprints.MISPRINTED),
        foothold_speed=misprints.foothold_speed_after_impact(wrong, as_state(one_step.before[0]), misprints.MISPRINTED),
        both_misprints=misprints.fixed_point(wrong, as_printed, misprints.MISPRINTED),
        kinetic_energy=kinetic_energy_by_order(right),
        adams=adams_start(assembled(right._replace(slope=adams_slope)), printed.adams_start_as_printed()),
    )


def settle(walker: RigidWalker) -> State:
    """Return the stable gait to which walks from x_p converge."""
    walk = take_walk(assembled(walker), measured.TIGHT, printed.fixed_point_as_printed(), X_P_SETTLING_STEPS)
    if walk.steps < X_P_SETTLING_STEPS:
        raise ArithmeticError(f"x_p does not walk: {walk.outcome.label} after {walk.steps} steps")
    return walk.final_state


def kinetic_energy_by_order(walker: RigidWalker) -> dict[str, float]:
    """Return the kinetic energy (J) at x_p with a moving foot: from masses, and from D_e with angles or foot first."""
    theta_1, theta_2, omega_1, omega_2 = printed.fixed_point_as_printed()
    D = misprints.inertia_at_impact(walker, theta_1, theta_2)
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
    return {
        "masses": float(sum(0.5 * mass * velocity @ velocity for mass, velocity in moving)),
        "angles_first": float(0.5 * angles_first @ D @ angles_first),
        "foot_first": float(0.5 * foot_first @ D @ foot_first),
    }
