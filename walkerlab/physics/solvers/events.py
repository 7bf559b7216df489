"""Zero crossings of event functions within a step, including several crossings in one step.

Within a step, an event function is replaced by the polynomial through its values on the dense output. In Bernstein
form, a polynomial lies in the hull of its coefficients, so coefficients of one sign prove that there is no crossing.
Otherwise bisection isolates the crossings. A sign check at the ends of a step would miss double crossings.

A crossing is a change of sign. An event function that touches zero and turns back does not cross. The last event leaves
its event function at zero. This zero at the start is divided out, so that it is not found again and does not hide a
crossing right after it. If several event functions cross in one step, the caller takes the earliest.

Walks in lanes have no dense output, which would cost more stages. There, the polynomial is the quintic through an event
function's values and two derivatives at both ends of a step, which explicit methods compute anyway.

Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, CAGD 29 (2012), sections 3.4 and 5.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from walkerlab.physics.kernels import kernel_part, pass_by_reference

# beyond the end of the step, so that it loses every comparison with a real crossing
NO_CROSSING = 2.0
FALLING = -1
RISING = 1
# Two crossings this close, as a fraction of the step, are not told apart: bisection would never separate a double zero.
MIN_PIECE = 2.0**-48
ROOT_RESOLUTION = 2.0**-52  # resolution of a crossing, as a fraction of its piece
DEPTH = 64  # maximum number of pieces on the stack
# Newton stops below this fraction of the step. Its error is about the square of its last move.
LAST_MOVE = 1e-4
MAX_ITERATIONS = 50

Jet = tuple[float, float, float]
"""A value with its first two derivatives in time."""
Quintic = tuple[float, float, float, float, float, float]
"""Bernstein coefficients of a quintic polynomial over a step."""


@pass_by_reference
class CrossingFinder(NamedTuple):
    """Work arrays and matrices for event functions sampled at `nodes` (fractions of a step)."""

    nodes: Any  # (degree + 1,)
    to_bernstein: Any  # (degree + 1, degree + 1) maps values at the nodes to Bernstein coefficients
    states: Any  # (degree + 1, state_size) states at the nodes, filled by the caller
    values: Any  # (event functions, degree + 1) values at the nodes, filled by the caller
    stack: Any  # (DEPTH, degree + 1) coefficients of the pieces still to search
    ends: Any  # (DEPTH, 2) fractions at which those pieces begin and end


def new_crossing_finder(degree: int, event_functions: int = 1, state_size: int = 0) -> CrossingFinder:
    """Create a finder for steps whose dense output has degree `degree`."""
    nodes, to_bernstein = sampling(degree)
    size = degree + 1
    shapes = ((size, state_size), (event_functions, size), (DEPTH, size), (DEPTH, 2))
    return CrossingFinder(nodes, to_bernstein, *map(np.zeros, shapes))


@lru_cache
def sampling(degree: int) -> tuple[Any, Any]:
    """Compute the nodes (degree + 1,) and the matrix that maps values at the nodes to Bernstein coefficients."""
    size = degree + 1
    # These are Chebyshev points, because equidistant ones would amplify rounding errors at this degree.
    nodes = 0.5 * (1.0 - np.cos(np.pi * np.arange(size) / degree))
    basis = np.zeros((size, size))
    constant = np.array([1.0])
    for i in range(size):
        binomial = np.prod([(degree - j) / (j + 1.0) for j in range(i)])
        term = polynomial.polymul(constant, polynomial.polypow([0.0, 1.0], i))
        term = polynomial.polymul(term, polynomial.polypow([1.0, -1.0], degree - i))
        basis[:, i] = binomial * polynomial.polyval(nodes, term)
    nodes[-1] = 1.0
    return nodes, np.linalg.inv(basis)


@kernel_part
def first_crossing(finder: CrossingFinder, event: int, direction: int, after: float, zero_at_start: bool) -> float:
    """Find the fraction of the step, above `after`, at which an event function first changes sign, or NO_CROSSING.

    direction      FALLING, RISING, or 0 for either
    zero_at_start  whether the event function is zero at the start of the step; that zero is not counted as a crossing
    """
    if not spans_zero(finder, event):
        return NO_CROSSING
    return crossing_of_piece(finder, set_root_piece(finder, event, zero_at_start), direction, after)


@kernel_part
def crossing_of_piece(finder: CrossingFinder, size: int, direction: int, after: float) -> float:
    """Find the first crossing of the polynomial at the bottom of the stack, with `size` Bernstein coefficients."""
    stack = finder.stack
    ends = finder.ends
    ends[0, 0], ends[0, 1] = 0.0, 1.0
    top = 0
    while top >= 0:
        low, high = ends[top, 0], ends[top, 1]
        signs = sign_changes(stack, top, size)
        # If all coefficients have the same sign, the polynomial has no zero here, because it lies in their convex hull.
        if high <= after or signs == 0:
            top -= 1
            continue
        # By Descartes' rule of signs, one change of sign means exactly one crossing. More changes only bound the number
        # of crossings.
        if (signs == 1 and low >= after) or high - low < MIN_PIECE:
            top -= 1
            # The removed piece stays in memory above the top of the stack.
            rising = stack[top + 1, 0] < 0.0
            turned = (stack[top + 1, 0] < 0.0) != (stack[top + 1, size - 1] < 0.0)
            if turned and direction != (FALLING if rising else RISING):
                return regula_falsi(stack, top + 1, size, low, high)
            continue
        split(stack, top, size)
        middle = 0.5 * (low + high)
        # The left half goes on top, so that the first crossing found is the earliest.
        ends[top, 0], ends[top, 1] = middle, high
        ends[top + 1, 0], ends[top + 1, 1] = low, middle
        top += 1
    return NO_CROSSING


@kernel_part
def value_at(finder: CrossingFinder, event: int, fraction: float) -> float:
    """Evaluate a sampled event function at a fraction of the step."""
    return evaluate(finder.stack, 0, set_root_piece(finder, event, False), fraction)


@kernel_part
def spans_zero(finder: CrossingFinder, event: int) -> bool:
    """Whether an event function may cross zero: false if its values are much further from zero than they vary."""
    smallest = finder.values[event, 0]
    largest = finder.values[event, 0]
    for i in range(1, finder.nodes.size):
        smallest = min(smallest, finder.values[event, i])
        largest = max(largest, finder.values[event, i])
    # Between the nodes, a polynomial leaves the range of its values at the nodes by less than the width of that range,
    # because the Lebesgue constant of these points is below 3 up to degree 12. The factor 8 leaves a wide margin.
    room = 8.0 * (largest - smallest)
    return smallest <= room and largest >= -room


@kernel_part
def set_root_piece(finder: CrossingFinder, event: int, zero_at_start: bool) -> int:
    """Write the coefficients for the whole step to the bottom of the stack, and return their number."""
    stack = finder.stack
    size = finder.nodes.size
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += finder.to_bernstein[i, j] * finder.values[event, j]
        stack[0, i] = total
    return divide_out_zero(stack, size) if zero_at_start else size


@kernel_part
def divide_out_zero(stack: Any, size: int) -> int:
    """Divide a zero at the start out of the polynomial at the bottom of the stack, and return its new size."""
    degree = size - 1
    # For i > 0, b_i B_i of degree n is x times b_i (n / i) B_(i-1) of degree n - 1. b_0 is 0, because it is the value
    # at the start.
    for i in range(1, size):
        stack[0, i - 1] = stack[0, i] * degree / i
    return degree


@kernel_part
def way_from_zero(finder: CrossingFinder, event: int, clearly: float) -> float:
    """Return the slope (per step) with which an event function that is zero at the start leaves zero.

    Returns 0 if no slope is larger than `clearly`.
    """
    # The last event's time is inexact, so the event function is not exactly zero at the start. Subtract that offset.
    size = set_root_piece(finder, event, False)
    for i in range(1, size):
        slope = (finder.stack[0, i] - finder.stack[0, 0]) * (size - 1) / i
        if abs(slope) > clearly:
            return float(slope)
    return 0.0


@kernel_part
def sign_changes(stack: Any, piece: int, size: int) -> int:
    """Count sign changes of a piece's coefficients. Zero counts as positive."""
    changes = 0
    for i in range(1, size):
        if (stack[piece, i] < 0.0) != (stack[piece, i - 1] < 0.0):
            changes += 1
    return changes


@kernel_part
def split(stack: Any, piece: int, size: int) -> None:
    """Bisect a piece by de Casteljau: its left half goes on top of the stack, its right half replaces it."""
    for i in range(size):
        stack[piece + 1, i] = stack[piece, i]
    for level in range(1, size):
        stack[piece, size - level] = stack[piece + 1, size - 1]
        for i in range(size - 1, level - 1, -1):
            stack[piece + 1, i] = 0.5 * (stack[piece + 1, i - 1] + stack[piece + 1, i])
    stack[piece, 0] = stack[piece + 1, size - 1]


@kernel_part
def regula_falsi(stack: Any, piece: int, size: int, low: float, high: float) -> float:
    """Find the only crossing of a piece, as a fraction of the step, by the Illinois variant of regula falsi."""
    a, b = 0.0, 1.0
    value_a = stack[piece, 0]
    value_b = stack[piece, size - 1]
    side = 0
    for _ in range(100):
        if b - a <= 2.0 * ROOT_RESOLUTION or value_a == value_b:
            break
        # Rounding may put the zero of the secant on an end. Keep it inside, so that the bracket shrinks.
        c = min(max((a * value_b - b * value_a) / (value_b - value_a), a + ROOT_RESOLUTION), b - ROOT_RESOLUTION)
        value_c = evaluate(stack, piece, size, c)
        if value_c == 0.0:
            a, b = c, c
        elif (value_c < 0.0) == (value_b < 0.0):
            b = c
            value_b = value_c
            # Illinois: if the same end is kept twice in a row, halve its value, because plain regula falsi would
            # converge ever more slowly.
            value_a = 0.5 * value_a if side == -1 else value_a
            side = -1
        else:
            a = c
            value_a = value_c
            value_b = 0.5 * value_b if side == 1 else value_b
            side = 1
    return low + 0.5 * (a + b) * (high - low)


@kernel_part
def evaluate(stack: Any, piece: int, size: int, x: float) -> float:
    """Evaluate a piece, stored in Bernstein form, at x (0 to 1) by nested multiplication."""
    degree = size - 1
    u = 1.0 - x
    power = 1.0
    binomial = 1.0
    total = stack[piece, 0] * u
    for i in range(1, degree):
        power *= x
        binomial = binomial * (degree - i + 1) / i
        total = (total + power * binomial * stack[piece, i]) * u
    return total + power * x * stack[piece, degree]


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
    # `only_crossing` starts from the end of the step and handles neither `after` nor a zero at the start.
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
        # Where the quintic does not fall, Newton's method would leave the bracket. Setting `new` to `low` fails the
        # test below, which then bisects.
        new = x - value / slope if slope < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        x, change = new, abs(new - x)
        if change < LAST_MOVE:
            break
    return x


@kernel_part
def shift_column(columns: Any, at: int, rate: Any, wait: float) -> None:
    """Shift the variational column at index `at` from fixed time to the event's time: Phi + f wait (saltation)."""
    # After a jump, a negative wait shifts the column back to fixed time.
    for i in range(len(rate)):
        columns[at + i] += rate[i] * wait
