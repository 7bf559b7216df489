"""Contradictions between the paper's printed values, allowing for their rounding."""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import product
from math import sin
from types import MappingProxyType

from walkerlab.evidence.paper import printed

Interval = tuple[float, float]


@cache
def contradictions() -> MappingProxyType[printed.Printed, str]:
    """Return the printed values that other values of the paper contradict, each with the computation."""
    return MappingProxyType(dict([*percentages(), *steps_of_a_cycle(), *lengths_and_speeds(), start_error()]))


def interval(function: Callable[..., float], *entries: printed.Printed) -> Interval:
    """Return the range of a function, monotonic in each argument, over all values that round to the printed ones."""
    values = [function(*corner) for corner in product(*(entry.rounding for entry in entries))]
    return min(values), max(values)


def are_disjoint(first: Interval, second: Interval) -> bool:
    return first[1] < second[0] or second[1] < first[0]


def percentages() -> Iterator[tuple[printed.Printed, str]]:
    """Yield the percentages of Table 2 that are not relative to the MATLAB column, each with the computation."""
    for row in printed.TABLE_2:
        low, high = percent_left_open(row)
        # the signs of the column follow no rule, so magnitudes are compared
        smallest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
        if are_disjoint((smallest, max(abs(low), abs(high))), row.percent.rounding):
            change = (
                f"{row.matlab.text} to {row.adams.text} {row.matlab.unit} is a change of {row.percent_of_matlab:+.3g}%"
            )
            yield row.percent, f"{change} of the MATLAB value ({low:+.2f} to {high:+.2f}%, given the rounding)"


def percent_left_open(row: printed.StartRow) -> Interval:
    """Return the change in magnitude from MATLAB's to ADAMS's value (%), as the interval that their rounding allows."""
    return interval(lambda adams, matlab: 100.0 * (abs(adams) / abs(matlab) - 1.0), row.adams, row.matlab)


def steps_of_a_cycle() -> Iterator[tuple[printed.Printed, str]]:
    """Yield the unequal steps of a period-one gait, and the cycles that differ from the sum of their steps."""
    left, right = printed.T_LEFT.matlab, printed.T_RIGHT.matlab
    if are_disjoint(left.rounding, right.rounding):
        equal = "x_p is a fixed point of one step (eq. 10 and 11), so its steps are equal"
        for step in (left, right):
            yield step, f"{equal}: not {left.text} and {right.text} s"
    for column in ("matlab", "adams"):
        cycle, *steps = (getattr(row, column) for row in (printed.T_CYCLE, printed.T_LEFT, printed.T_RIGHT))
        low, high = interval(float.__add__, *steps)
        if are_disjoint(cycle.rounding, (low, high)):
            total = f"{steps[0].text} + {steps[1].text} s is {sum(step.value for step in steps):.2f} s"
            open_to = f"({low:.2f} to {high:.2f} s, given the rounding)"
            yield cycle, f"{total} {open_to}, and not {cycle.text} s: one of the three is wrong"


def lengths_and_speeds() -> Iterator[tuple[printed.Printed, str]]:
    """Yield a step length and speeds that do not follow from the length and angles of the legs."""
    leg = printed.TABLE_1[0]
    for column, source in (("matlab", "x_p and Table 1"), ("adams", "Tables 1 and 2")):
        angles = [getattr(row, column) for row in printed.TABLE_2[:2]]
        length = 2.0 * leg.value * sin(0.5 * (angles[1].value - angles[0].value))
        steps = interval(lambda swing, stance: 2.0 * leg.value * sin(0.5 * (stance - swing)), *angles)
        feet = f"the feet are 2 L sin((theta_2 - theta_1)/2) = {length:.4f} m apart ({source})"
        if column == "matlab" and are_disjoint(steps, printed.STEP_LENGTH.rounding):
            yield (
                printed.STEP_LENGTH,
                f"{feet}, {length / printed.STEP_LENGTH.value:.1f} times {printed.STEP_LENGTH.text} m",
            )
        speed = getattr(printed.V_COM, column)
        cycle = getattr(printed.T_CYCLE, column)
        # one step per cycle, as in section 5, or both steps of the cycle
        low, high = steps[0] / cycle.rounding[1], 2.0 * steps[1] / cycle.rounding[0]
        if are_disjoint((low, high), speed.rounding):
            one_step = length / cycle.value
            two_steps = 2.0 * length / cycle.value
            speeds = f"one step is {one_step:.3f} m/s and two are {two_steps:.3f} m/s"
            yield speed, f"{feet}: in {cycle.text} s {speeds}, not {speed.text} m/s"


def start_error() -> tuple[printed.Printed, str]:
    """Return the largest error, which cannot be smaller than the difference between the two starts."""
    angle, rate = (
        max(abs(row.adams.value - row.matlab.value) for row in rows)
        for rows in (printed.TABLE_2[:2], printed.TABLE_2[2:])
    )
    return printed.LARGEST_ERROR, (
        f"the two starts of Table 2 alone differ by {angle:.4f} rad and {rate:.2f} rad/s, "
        f"{angle / printed.LARGEST_ERROR.value:.0f} and {rate / printed.LARGEST_ERROR.value:,.0f} times as much"
    )
