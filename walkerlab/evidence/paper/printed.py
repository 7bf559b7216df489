"""Numbers printed in the paper, the walker that they describe, and where they contradict each other.

Numbers contradict each other only if their rounding does not explain the difference.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import sin
from types import MappingProxyType
from typing import Final

from walkerlab.config.check import agreement
from walkerlab.config.contact import MM_PER_M, Contact
from walkerlab.evidence.check.printed import PrintedNumber
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.physics.ground.resting import RestingFoot, resting_foot

STATE_NAMES: Final = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")
COORDINATE_UNITS: Final = ("rad", "rad", "rad/s", "rad/s")


@dataclass(frozen=True)
class Printed(PrintedNumber):
    """A number printed in the paper."""

    where: str  # location in the paper: equation, table, figure or section
    quantity: str
    unit: str
    text: str

    @property
    def rounding(self) -> tuple[float, float]:
        """Smallest and largest value that round to the printed one."""
        half = 0.5 * self.digits.unit
        return self.value - half, self.value + half

    def agreement(self, value: float | None) -> str:
        """Return how a value agrees with the printed digits: 'rounded', 'cut off', or '' if it does not."""
        return "" if value is None else agreement(self.digits, value)


X_P: Final = tuple(
    Printed("eq. 11, Table 2", f"x_p, {name}", unit, text)
    for name, unit, text in zip(STATE_NAMES, COORDINATE_UNITS, ("-0.2022", "0.1674", "-0.60", "-0.84"), strict=True)
)

TABLE_1: Final = (
    Printed("Table 1", "length of legs, L", "m", "1"),
    Printed("Table 1", "mass of legs, m", "kg", "5"),
    Printed("Table 1", "mass of hip, MH", "kg", "10"),
    Printed("Table 1", "gravity, g", "m/s^2", "9.81"),
)


@dataclass(frozen=True)
class PrintedRow:
    name: str
    matlab: Printed
    adams: Printed


@dataclass(frozen=True)
class StartRow(PrintedRow):
    percent: Printed

    @property
    def raised(self) -> float:
        return self.adams.value / self.matlab.value

    @property
    def percent_of_matlab(self) -> float:
        """Increase in magnitude from MATLAB to ADAMS, relative to the MATLAB value, in percent."""
        return self._percent_of(self.matlab)

    @property
    def percent_of_adams(self) -> float:
        """Increase in magnitude from MATLAB to ADAMS, relative to the ADAMS value, in percent."""
        return self._percent_of(self.adams)

    def _percent_of(self, base: Printed) -> float:
        return 100.0 * (abs(self.adams.value) - abs(self.matlab.value)) / abs(base.value)


TABLE_2: Final = tuple(
    StartRow(
        name,
        matlab,
        Printed("Table 2", f"{name}, MSC ADAMS", matlab.unit, adams),
        Printed(where, f"{name}, difference rate", "%", percent),
    )
    for name, matlab, adams, where, percent in (
        ("theta_1", X_P[0], "-0.2021", "Table 2", "+0.1%"),
        ("theta_2", X_P[1], "0.1670", "Table 2", "+0.15%"),
        ("dtheta_1", X_P[2], "-1.02", "Table 2, section 4", "+41%"),
        ("dtheta_2", X_P[3], "-3.20", "Table 2, section 4", "+74%"),
    )
)
"""The MATLAB column is x_p. Section 4 repeats the percentages of the velocities."""


TABLE_3: Final = tuple(
    PrintedRow(
        name,
        Printed("Table 3", f"{quantity}, {name}, MATLAB", unit, matlab),
        Printed("Table 3", f"{quantity}, {name}, MSC ADAMS", unit, adams),
    )
    for name, quantity, unit, matlab, adams in (
        ("t_left", "left step period", "s", "0.60", "0.59"),
        ("t_right", "right step period", "s", "0.79", "0.77"),
        ("t_cycle", "stride period", "s", "1.39", "1.38"),
        ("v_com", "average velocity", "m/s", "0.0246", "0.0248"),
        ("E_avg", "average mechanical energy (5 steps)", "J", "150.13", "150.14"),
    )
)
T_LEFT, T_RIGHT, T_CYCLE, V_COM, E_AVG = TABLE_3

EIGENVALUES: Final = Printed("section 3.3", "largest eigenvalue of P of a stable gait", "1", "less than one")
LEG_INERTIA: Final = Printed("section 4, Fig. 4a", "inertia of the links", "kg m^2", "zero")
FOOT_RADIUS: Final = Printed("section 4, Fig. 3", "radius of the foot points", "mm", "1")
STIFFNESS: Final = Printed("section 4, Fig. 4b", "stiffness of the contact", "not given", "10^5")
DAMPING: Final = Printed("section 4, Fig. 4b", "damping of the contact", "not given", "90")
STATIC_FRICTION: Final = Printed("section 4, Fig. 4b", "static friction", "1", "0.9")
DYNAMIC_FRICTION: Final = Printed("section 4, Fig. 4b", "dynamic friction", "1", "0.7")
LOST_BALANCE: Final = Printed("section 4", "steps until balance was lost, from MATLAB's initial conditions", "1", "one")
CYCLES_WALKED: Final = Printed("section 5, Fig. 7", "gait cycles walked", "1", "five")
LARGEST_ERROR: Final = Printed("section 5, Fig. 8", "largest error, angles and velocities", "rad, rad/s", "10^-4")
"""The paper gives one value for angles and velocities together."""
STEP_LENGTH: Final = Printed("section 5", "length of one complete step", "m", "0.0342")
VELOCITY_DIFFERENCE: Final = Printed("section 5", "difference of the average velocities", "%", "less than 1%")

EQUATION_NUMBERS: Final = (*range(1, 42), *range(55, 59))
"""Numbers of the equations of Appendix A."""


def fixed_point_as_printed() -> tuple[float, float, float, float]:
    """Return the fixed point x_p of eq. 11 (rad, rad/s)."""
    theta_1, theta_2, omega_1, omega_2 = (entry.value for entry in X_P)
    return theta_1, theta_2, omega_1, omega_2


def adams_start_as_printed() -> tuple[float, float, float, float]:
    """Return the start of the ADAMS model in Table 2 (rad, rad/s)."""
    theta_1, theta_2, omega_1, omega_2 = (row.adams.value for row in TABLE_2)
    return theta_1, theta_2, omega_1, omega_2


def slope_of(theta_1: Printed, theta_2: Printed) -> tuple[float, float]:
    """Return the slope (rad) on which both feet of a printed state stand, and the uncertainty due to rounding."""
    return -0.5 * (theta_1.value + theta_2.value), 0.25 * (theta_1.digits.unit + theta_2.digits.unit)


def walker_of_the_paper(c21_sign: float) -> RigidWalker:
    """Return the walker of Table 1, with masses at mid-leg, on the slope on which both feet of x_p stand.

    c21_sign  CORRECTED or AS_PRINTED
    """
    length, mass, hip, gravity = (entry.value for entry in TABLE_1)
    return RigidWalker(length, 0.5 * length, mass, hip, LEG_INERTIA.value, gravity, slope_of(*X_P[:2])[0], c21_sign)


def speed_as_printed(cycle: float) -> float:
    """Return the speed (m/s) as section 5 computes it: the printed step length divided by the time of a cycle (s)."""
    return STEP_LENGTH.value / cycle


def speed_difference(matlab_cycle: float, adams_cycle: float) -> float:
    """Return the relative difference (%) of the speeds that section 5 would compute from two cycle times (s)."""
    matlab = speed_as_printed(matlab_cycle)
    return 100.0 * abs(speed_as_printed(adams_cycle) - matlab) / matlab


def softening_in_metres() -> float:
    """Return the factor by which a default stiffness of ADAMS is lower in a model in metres than in millimetres."""
    return float(MM_PER_M ** (Contact().exponent - 1.0))


def readings_of_fig_4b() -> tuple[RestingFoot, RestingFoot, RestingFoot]:
    """Return how a foot rests on the ground for three readings of Fig. 4b.

    Its values are read in N, mm and s, in SI, and as the defaults of an ADAMS model in metres.

    Adams View converts a default stiffness as force over length, whatever the exponent. The same dialog in a model in
    metres therefore means a stiffness 1000^(exponent - 1) times lower than 10^5 N/mm^exponent.
    """
    _, leg, hip, gravity = (entry.value for entry in TABLE_1)
    mass = hip + 2.0 * leg
    adams = Contact(stiffness=STIFFNESS.value, damping=DAMPING.value).to_si()
    weight = mass * gravity
    return (
        resting_foot(weight, mass, adams.stiffness, adams.exponent, adams.damping),
        resting_foot(weight, mass, STIFFNESS.value, 1.0, DAMPING.value),
        resting_foot(weight, mass, STIFFNESS.value * MM_PER_M, adams.exponent, adams.damping),
    )


Interval = tuple[float, float]


@cache
def contradictions() -> MappingProxyType[Printed, str]:
    """Return the printed values that other values of the paper contradict, each with the computation that shows it."""
    return MappingProxyType(dict([*percentages(), *steps_of_a_cycle(), *lengths_and_speeds(), start_error()]))


def interval(function: Callable[..., float], *entries: Printed) -> Interval:
    """Return the range of a function over all values that round to the printed ones.

    The function must be monotonic in each argument.
    """
    values = [function(*corner) for corner in product(*(entry.rounding for entry in entries))]
    return min(values), max(values)


def are_disjoint(first: Interval, second: Interval) -> bool:
    return first[1] < second[0] or second[1] < first[0]


def percentages() -> Iterator[tuple[Printed, str]]:
    """Yield the percentages of Table 2 that are not relative to the MATLAB column, each with the right computation."""
    for row in TABLE_2:
        low, high = percent_left_open(row)
        # The signs of the column follow no rule, so only magnitudes are compared.
        smallest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
        if are_disjoint((smallest, max(abs(low), abs(high))), row.percent.rounding):
            change = f"a change of {row.percent_of_matlab:+.3g}% of the MATLAB value"
            open_to = f"({low:+.2f} to {high:+.2f}%, given the rounding)"
            yield row.percent, f"{row.matlab.text} to {row.adams.text} {row.matlab.unit} is {change} {open_to}"


def percent_left_open(row: StartRow) -> Interval:
    """Return the interval (%) of the change in magnitude from MATLAB to ADAMS, given the rounding of both values."""
    return interval(lambda adams, matlab: 100.0 * (abs(adams) / abs(matlab) - 1.0), row.adams, row.matlab)


def steps_of_a_cycle() -> Iterator[tuple[Printed, str]]:
    """Yield the steps of the period-1 gait if they are unequal, and cycles that differ from the sum of their steps."""
    left, right = T_LEFT.matlab, T_RIGHT.matlab
    if are_disjoint(left.rounding, right.rounding):
        equal = "x_p is a fixed point of one step (eq. 10 and 11), so its steps are equal"
        for step in (left, right):
            yield step, f"{equal}: not {left.text} and {right.text} s"
    for column in ("matlab", "adams"):
        cycle, *steps = (getattr(row, column) for row in (T_CYCLE, T_LEFT, T_RIGHT))
        low, high = interval(float.__add__, *steps)
        if are_disjoint(cycle.rounding, (low, high)):
            total = f"{steps[0].text} + {steps[1].text} s is {sum(step.value for step in steps):.2f} s"
            open_to = f"({low:.2f} to {high:.2f} s, given the rounding)"
            yield cycle, f"{total} {open_to}, and not {cycle.text} s: one of the three is wrong"


def lengths_and_speeds() -> Iterator[tuple[Printed, str]]:
    """Yield the step length and the speeds that disagree with the length and the angles of the legs."""
    leg = TABLE_1[0]
    for column, source in (("matlab", "x_p and Table 1"), ("adams", "Tables 1 and 2")):
        angles = [getattr(row, column) for row in TABLE_2[:2]]
        length = 2.0 * leg.value * sin(0.5 * (angles[1].value - angles[0].value))
        steps = interval(lambda swing, stance: 2.0 * leg.value * sin(0.5 * (stance - swing)), *angles)
        feet = f"the feet are 2 L sin((theta_2 - theta_1)/2) = {length:.4f} m apart ({source})"
        if column == "matlab" and are_disjoint(steps, STEP_LENGTH.rounding):
            yield STEP_LENGTH, f"{feet}, {length / STEP_LENGTH.value:.1f} times {STEP_LENGTH.text} m"
        speed = getattr(V_COM, column)
        cycle = getattr(T_CYCLE, column)
        # The speed may count one step per cycle, as in section 5, or both.
        low, high = steps[0] / cycle.rounding[1], 2.0 * steps[1] / cycle.rounding[0]
        if are_disjoint((low, high), speed.rounding):
            speeds = f"one step is {length / cycle.value:.3f} m/s and two are {2.0 * length / cycle.value:.3f} m/s"
            yield speed, f"{feet}: in {cycle.text} s {speeds}, not {speed.text} m/s"


def start_error() -> tuple[Printed, str]:
    """Return the largest error as printed, and the reason why it is wrong: the two starts alone differ by more."""
    angle, rate = (max(abs(row.adams.value - row.matlab.value) for row in rows) for rows in (TABLE_2[:2], TABLE_2[2:]))
    return LARGEST_ERROR, (
        f"the two starts of Table 2 alone differ by {angle:.4f} rad and {rate:.2f} rad/s, "
        f"{angle / LARGEST_ERROR.value:.0f} and {rate / LARGEST_ERROR.value:,.0f} times as much"
    )
