"""Hermite interpolation of an event function over a step, to find crossings that a repeated step then refines.

It needs values and two derivatives at both ends, which explicit methods compute anyway; dense output costs more stages.
"""

from walkerlab.physics.kernels import kernel_part
from walkerlab.physics.solvers.events import (
    FALLING,
    NO_CROSSING,
    CrossingFinder,
    crossing_of_piece,
    divide_out_zero,
)

Jet = tuple[float, float, float]
"""A value with its first two derivatives in time."""
Quintic = tuple[float, float, float, float, float, float]
"""Bernstein coefficients of a quintic polynomial over a step."""
# Newton stops below this fraction of the step. Its error is about the square of its last move.
LAST_MOVE = 1e-4
MAX_ITERATIONS = 50


@kernel_part
def hermite(h: float, start: Jet, end: Jet) -> Quintic:
    """Return the quintic over a step of h (s) with the given values and derivatives at both ends."""
    # In Bernstein form of degree 5, the first difference is h f' / 5 and the second h^2 f'' / 20.
    slope = 0.2 * h * start[1]
    bend = 0.05 * h * h * start[2]
    last_slope = 0.2 * h * end[1]
    last_bend = 0.05 * h * h * end[2]
    return (
        start[0],
        start[0] + slope,
        start[0] + 2.0 * slope + bend,
        end[0] - 2.0 * last_slope + last_bend,
        end[0] - last_slope,
        end[0],
    )


@kernel_part
def evaluate_quintic(quintic: Quintic, x: float) -> float:
    return value_and_slope(power_coefficients(quintic), x)[0]


@kernel_part
def power_coefficients(quintic: Quintic) -> Quintic:
    b0, b1, b2, b3, b4, b5 = quintic
    return (
        b0,
        5.0 * (b1 - b0),
        10.0 * (b2 - 2.0 * b1 + b0),
        10.0 * (b3 - b0 + 3.0 * (b1 - b2)),
        5.0 * (b4 + b0 - 4.0 * (b3 + b1) + 6.0 * b2),
        b5 - b0 + 5.0 * (b1 - b4) + 10.0 * (b3 - b2),
    )


@kernel_part
def value_and_slope(powers: Quintic, x: float) -> tuple[float, float]:
    c0, c1, c2, c3, c4, c5 = powers
    value = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
    slope = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * (5.0 * c5))))
    return value, slope


@kernel_part
def first_fall(finder: CrossingFinder, quintic: Quintic, zero_at_start: bool, after: float) -> float:
    """Find the fraction of the step, above `after`, at which a quintic first falls through zero, or NO_CROSSING."""
    # Coefficients of one sign prove that there is no crossing. A single change from positive to negative proves that
    # there is exactly one. `crossing_of_piece` handles all other cases.
    changes = 0
    for i in range(1 if zero_at_start else 0, 5):
        changes += (quintic[i] < 0.0) != (quintic[i + 1] < 0.0)
    if changes == 0:
        return NO_CROSSING
    # `only_crossing` starts from the end of the step and knows neither `after` nor a zero at the start.
    if changes == 1 and not zero_at_start and after == 0.0:
        return only_crossing(quintic) if quintic[0] >= 0.0 else NO_CROSSING
    for i in range(6):
        finder.stack[0, i] = quintic[i]
    size = divide_out_zero(finder.stack, 6) if zero_at_start else 6
    return crossing_of_piece(finder, size, FALLING, after)


@kernel_part
def only_crossing(quintic: Quintic) -> float:
    """Find the zero of a quintic with a single, falling crossing: Newton from the end, safeguarded by bisection."""
    powers = power_coefficients(quintic)
    low = 0.0
    high = 1.0
    x = 1.0
    for _ in range(MAX_ITERATIONS):
        value, slope = value_and_slope(powers, x)
        if value < 0.0:
            high = x
        else:
            low = x
        # Where the quintic does not fall, Newton would leave the bracket. `low` is not inside it either, so bisection
        # follows.
        new = x - value / slope if slope < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        x, change = new, abs(new - x)
        if change < LAST_MOVE:
            break
    return x
