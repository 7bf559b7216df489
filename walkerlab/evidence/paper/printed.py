"""Numbers printed in the paper, with their sources, and the walker that they describe."""

from dataclasses import dataclass
from typing import Any, Final

from walkerlab.config.check import agreement
from walkerlab.config.contact import MM_PER_M, Contact
from walkerlab.evidence.check.printed import PrintedNumber
from walkerlab.evidence.paper.appendix_a import RigidWalker
from walkerlab.physics.ground.resting import RestingFoot, resting_foot

STATE_NAMES: Final = ("theta_1", "theta_2", "dtheta_1", "dtheta_2")
COORDINATE_UNITS: Final = ("rad", "rad", "rad/s", "rad/s")


@dataclass(frozen=True)
class Printed(PrintedNumber):
    """Number printed in the paper."""

    where: str  # equation, table, figure or section
    quantity: str
    unit: str
    text: str

    @property
    def about(self) -> dict[str, Any]:
        return {"where": self.where, "quantity": self.quantity, "unit": self.unit}

    @property
    def rounding(self) -> tuple[float, float]:
        """Smallest and largest value that round to the printed one."""
        half = 0.5 * self.digits.unit
        return self.value - half, self.value + half

    def agreement(self, value: float | None) -> str:
        """Agreement of a value with the printed digits: 'rounded', 'cut off', or '' if it disagrees."""
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
"""The MATLAB column is x_p; section 4 repeats the percentages of the velocities."""


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
"""Single value for both angles and velocities."""
STEP_LENGTH: Final = Printed("section 5", "length of one complete step", "m", "0.0342")
VELOCITY_DIFFERENCE: Final = Printed("section 5", "difference of the average velocities", "%", "less than 1%")

EQUATION_NUMBERS: Final = (*range(1, 42), *range(55, 59))
"""Numbers of the equations of Appendix A."""


def fixed_point_as_printed() -> tuple[float, float, float, float]:
    """Fixed point x_p of eq. 11 (rad, rad/s)."""
    theta_1, theta_2, omega_1, omega_2 = (entry.value for entry in X_P)
    return theta_1, theta_2, omega_1, omega_2


def adams_start_as_printed() -> tuple[float, float, float, float]:
    """Start of the ADAMS model in Table 2 (rad, rad/s)."""
    theta_1, theta_2, omega_1, omega_2 = (row.adams.value for row in TABLE_2)
    return theta_1, theta_2, omega_1, omega_2


def slope_of(theta_1: Printed, theta_2: Printed) -> tuple[float, float]:
    """Slope (rad) on which both feet of a printed state stand, and its uncertainty due to rounding."""
    return -0.5 * (theta_1.value + theta_2.value), 0.25 * (theta_1.digits.unit + theta_2.digits.unit)


def walker_of_the_paper(c21_sign: float) -> RigidWalker:
    """Walker of Table 1 on the slope of x_p, with the masses at mid-leg. `c21_sign` is CORRECTED or AS_PRINTED."""
    length, mass, hip, gravity = (entry.value for entry in TABLE_1)
    return RigidWalker(length, 0.5 * length, mass, hip, LEG_INERTIA.value, gravity, slope_of(*X_P[:2])[0], c21_sign)


def speed_as_printed(cycle: float) -> float:
    """Speed (m/s) as section 5 computes it: the printed step length divided by the time (s) of a cycle."""
    return STEP_LENGTH.value / cycle


def speed_difference(matlab_cycle: float, adams_cycle: float) -> float:
    """Relative difference (%) of the speeds implied by two cycle times (s)."""
    matlab = speed_as_printed(matlab_cycle)
    adams = speed_as_printed(adams_cycle)
    return 100.0 * abs(adams - matlab) / matlab


def softening_in_metres() -> float:
    """Return the factor by which a default stiffness of ADAMS is lower in a model in metres than in millimetres."""
    return float(MM_PER_M ** (Contact().exponent - 1.0))


def readings_of_fig_4b() -> tuple[RestingFoot, RestingFoot, RestingFoot]:
    """Return the paper's resting foot for three readings of Fig. 4b: in N, mm and s, in SI, and as ADAMS defaults in
    metres.

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
