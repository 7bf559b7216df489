"""Measurements on the walker and the slope of the paper, and the errata that they support. No config affects them.

Some measurements keep the misprints of Appendix A. In these, the heel strike solves the six equations of (A.57) as
printed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np
from scipy.optimize import root

from walkerlab.evidence.paper import measured, printed
from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled, swing_constants
from walkerlab.evidence.paper.measured import AdamsStart, adams_start
from walkerlab.evidence.paper.prose import prose
from walkerlab.labels import Label
from walkerlab.physics.hybrid.comparison import Array
from walkerlab.physics.hybrid.recorded_walk import as_state, take_walk
from walkerlab.physics.solvers.system import State

RIGHT, MISPRINTED = 1.0, -1.0  # sign of the second row of P (A.55) and of its derivative E (A.56)
ROOT_TOLERANCE = 1e-9


def inertia_at_impact(walker: RigidWalker, theta_1: float, theta_2: float) -> Array:
    """Return the mass matrix D_e of (A.9) to (A.24), for velocities of (theta_1, theta_2, x, y)."""
    c = swing_constants(walker)
    coupling = -c.mLb * math.cos(theta_2 - theta_1)
    s1, c1 = math.sin(theta_1), math.cos(theta_1)
    s2, c2 = math.sin(theta_2), math.cos(theta_2)
    rows = [
        [c.d11, coupling, c.mb * c1, c.mb * s1],
        [coupling, c.d22, -c2 * c.K, -s2 * c.K],
        [c.mb * c1, -c2 * c.K, c.mass, 0.0],
        [c.mb * s1, -s2 * c.K, 0.0, c.mass],
    ]
    return np.array(rows)


def swing_foot(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> Array:
    """Return the position P (m) of the swing foot by (A.55), with the stance foot at the origin.

    row_2  sign of the second row: RIGHT or MISPRINTED
    """
    L = walker.leg_length
    rise = L * (math.cos(theta_2) - math.cos(theta_1))
    return np.array([L * (math.sin(theta_1) - math.sin(theta_2)), row_2 * rise])


def height_over_slope(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> float:
    """Return the height (m) above the slope at which P places the swing foot."""
    along, up = swing_foot(walker, theta_1, theta_2, row_2)
    return float(along * math.sin(walker.slope) + up * math.cos(walker.slope))


def swing_foot_gradient(walker: RigidWalker, theta_1: float, theta_2: float, row_2: float) -> Array:
    """Return the matrix E of (A.56), the derivative of `swing_foot` with respect to (theta_1, theta_2, x, y)."""
    L = walker.leg_length
    along = [L * math.cos(theta_1), -L * math.cos(theta_2), 1.0, 0.0]
    up = [row_2 * L * math.sin(theta_1), -row_2 * L * math.sin(theta_2), 0.0, 1.0]
    return np.array([along, up])


def velocities_after_impact(walker: RigidWalker, before: State, row_2: float) -> Array:
    """Solve (A.57) for the velocities of (theta_1, theta_2, x, y) after the impact. The legs keep their numbers."""
    D = inertia_at_impact(walker, before[0], before[1])
    E = swing_foot_gradient(walker, before[0], before[1], row_2)
    system = np.block([[D, -E.T], [E, np.zeros((2, 2))]])
    velocities = np.array([before[2], before[3], 0.0, 0.0])
    return np.asarray(np.linalg.solve(system, np.concatenate((D @ velocities, np.zeros(2))))[:4])


def foothold_speed_after_impact(walker: RigidWalker, before: State, row_2: float) -> float:
    """Return the speed (m/s) of the new stance foot after the impact, which should be zero by (7)."""
    after = velocities_after_impact(walker, before, row_2)
    return float(np.linalg.norm(swing_foot_gradient(walker, before[0], before[1], RIGHT) @ after))


def step(walker: RigidWalker, start: State, row_2: float) -> State | None:
    """Return the state after one step with the impact of (A.57), or None if no heel strike occurs."""
    walk = take_walk(assembled(walker), measured.TIGHT, start, 1)
    if walk.steps == 0:
        return None
    before = as_state(walk.before[0])
    after = velocities_after_impact(walker, before, row_2)
    return before[1], before[0], float(after[1]), float(after[0])


def fixed_point(walker: RigidWalker, guess: State, row_2: float) -> State | None:
    """Find the fixed point near `guess` of the step map with the impact of (A.57).

    Return None if the search fails.
    """

    def state(z: Array) -> State:
        return -2.0 * walker.slope - float(z[0]), float(z[0]), float(z[1]), float(z[2])

    def mismatch(z: Array) -> Array:
        after = step(walker, state(z), row_2)
        return np.full(3, 1.0) if after is None else np.array(after[1:]) - z

    solution = root(mismatch, np.array(guess[1:]), tol=ROOT_TOLERANCE)
    return state(solution.x) if np.abs(mismatch(solution.x)).max() < 1e3 * ROOT_TOLERANCE else None


X_P_SETTLING_STEPS = 150  # steps from x_p to the fixed point: each step multiplies a disturbance by 0.6
FOOT_VELOCITY = (0.3, -0.2)  # m/s, velocity of the foot in the check of (A.9) to (A.24)


@dataclass(frozen=True)
class PaperStudy:
    """Measurements on the scene of the paper, in SI units."""

    slope: float
    slope_rounding: float
    # measurements on the gaits to which walks from x_p converge, with the equations as printed and corrected
    as_printed: measured.RigidMeasurements
    corrected: measured.RigidMeasurements
    # Table 3 for five gait cycles from the printed x_p, with the equations as printed
    from_x_p: measured.Characteristics
    five_steps_energy: float  # J, mean energy over the first five of the ten steps of `from_x_p`
    fastest: float  # rad/s, largest angular velocity of the gait as printed
    largest_jump: float  # rad/s, largest change of an angular velocity at the heel strike of this gait
    swing_foot_height: float  # m, height above the slope at which (A.55) as printed places the swing foot of x_p
    foothold_speed: float  # m/s, speed of the new stance foot if the printed gait's impact uses (A.55) as printed
    both_misprints: State | None  # fixed point near x_p with the misprints of (A.5) and (A.55), or None
    # J, kinetic energy of one state, computed from the masses and from D_e with either order of coordinates
    kinetic_energy: Mapping[str, float]
    adams: AdamsStart


def study_the_paper() -> PaperStudy:
    """Make all measurements on the walker and slope of the paper. This takes milliseconds once compiled."""
    wrong = printed.walker_of_the_paper(AS_PRINTED)
    right = printed.walker_of_the_paper(CORRECTED)
    x_p = printed.fixed_point_as_printed()
    as_printed = settle(wrong)
    one_step = take_walk(assembled(wrong), measured.TIGHT, as_printed, 1, sampled=True)
    cycles = take_walk(assembled(wrong), measured.TIGHT, x_p, 2 * measured.PAPER_CYCLES, sampled=True)
    assert one_step.samples is not None
    slope, rounding = printed.slope_of(*printed.X_P[:2])
    adams_slope, _ = printed.slope_of(printed.TABLE_2[0].adams, printed.TABLE_2[1].adams)
    return PaperStudy(
        slope=slope,
        slope_rounding=rounding,
        as_printed=measured.measure_rigid_model(wrong, as_printed),
        corrected=measured.measure_rigid_model(right, settle(right)),
        from_x_p=measured.characteristics(cycles.periods_s, cycles.lengths_m, cycles.mean_energy),
        five_steps_energy=take_walk(assembled(wrong), measured.TIGHT, x_p, measured.ENERGY_STEPS).mean_energy,
        fastest=float(np.abs(one_step.samples.state[:, 2:]).max()),
        largest_jump=float(np.abs(one_step.after[0, [3, 2]] - one_step.before[0, 2:]).max()),
        swing_foot_height=height_over_slope(wrong, *x_p[:2], MISPRINTED),
        foothold_speed=foothold_speed_after_impact(wrong, as_state(one_step.before[0]), MISPRINTED),
        both_misprints=fixed_point(wrong, as_printed, MISPRINTED),
        kinetic_energy=kinetic_energy_by_order(right),
        adams=adams_start(assembled(right._replace(slope=adams_slope)), printed.adams_start_as_printed()),
    )


def settle(walker: RigidWalker) -> State:
    """Return the stable gait on which walks from x_p settle.

    Raises ArithmeticError if the walk ends early.
    """
    walk = take_walk(assembled(walker), measured.TIGHT, printed.fixed_point_as_printed(), X_P_SETTLING_STEPS)
    if walk.steps < X_P_SETTLING_STEPS:
        raise ArithmeticError(f"x_p does not walk: {walk.outcome.label} after {walk.steps} steps")
    return walk.final_state


def kinetic_energy_by_order(walker: RigidWalker) -> dict[str, float]:
    """Return the kinetic energy (J) at x_p with a moving foot, computed in three ways.

    `masses` adds up the point masses. The others use D_e, with the angles or the foot as first coordinates.
    """
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
    return {
        "masses": float(sum(0.5 * mass * velocity @ velocity for mass, velocity in moving)),
        "angles_first": float(0.5 * angles_first @ D @ angles_first),
        "foot_first": float(0.5 * foot_first @ D @ foot_first),
    }


@dataclass(frozen=True)
class Erratum:
    """An error in the paper."""

    where: Annotated[str, Label("", "location in the paper")]
    printed: Annotated[str, Label("", "printed")]
    right: Annotated[str, Label("", "correct")]
    evidence: Annotated[str, Label("", "argument")]
    measured: Annotated[str, Label("", "values from this run")]


def errata(study: PaperStudy) -> tuple[Erratum, ...]:
    """Return all errata: by theme, and within a theme in the order of the paper."""
    texts = [text.partition(": ")[2] for text in prose.parts("errata.errata", study)]
    length = len(fields(Erratum))
    return tuple(Erratum(*texts[first : first + length]) for first in range(0, len(texts), length))
