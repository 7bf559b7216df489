"""Where an event function crosses zero within a step: every crossing, also two or three between the step's ends.

An event function is known on a step by its values along the dense output, as a polynomial. In Bernstein form a
polynomial lies in the hull of its coefficients: coefficients of one sign prove that there is no crossing, and halving
isolates those there are. A sign check at the ends of a step misses double crossings.

Definitions. A crossing is a change of sign; an event function that touches zero and turns back does not cross. A zero
exactly at the start, where the event before left the event function, is divided out, so that it is neither found again
nor hides a crossing right behind it. Of several event functions that cross in one step, the caller takes the earliest.

Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, CAGD 29 (2012), sections 3.4 and 5.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from walkerlab.kernels import by_reference, inlined

NO_CROSSING = 2.0
FALLING, RISING = -1, 1
NARROWEST = 2.0**-48
CLOSEST = 2.0**-52  # how finely a crossing is located within its piece
DEPTH = 64


@by_reference
class CrossingFinder(NamedTuple):
    """Memory and matrices for event functions sampled at `nodes` (fractions of a step)."""

    nodes: Any  # (degree + 1,)
    to_bernstein: Any  # (degree + 1, degree + 1), from values at the nodes to Bernstein coefficients
    states: Any  # (degree + 1, numbers) at the nodes, and
    values: Any  # (event functions, degree + 1), filled by the caller
    stack: Any  # (DEPTH, degree + 1) coefficients of the pieces still to search
    ends: Any  # (DEPTH, 2) where those pieces begin and end


def new_crossing_finder(degree: int, event_functions: int = 1, numbers: int = 0) -> CrossingFinder:
    """A finder for `event_functions` event functions on steps whose dense output has degree `degree`.

    numbers  of a state that event functions are of
    """
    nodes, to_bernstein = sampling(degree)
    size = degree + 1
    rooms = ((size, numbers), (event_functions, size), (DEPTH, size), (DEPTH, 2))
    return CrossingFinder(nodes, to_bernstein, *map(np.zeros, rooms))


@lru_cache
def sampling(degree: int) -> tuple[Any, Any]:
    """The nodes of a polynomial of this degree, and what takes its values there to Bernstein coefficients."""
    size = degree + 1
    nodes = 0.5 * (1.0 - np.cos(np.pi * np.arange(size) / degree))
    basis = np.zeros((size, size))
    one = np.array([1.0])
    for i in range(size):
        binomial = np.prod([(degree - j) / (j + 1.0) for j in range(i)])
        term = polynomial.polymul(one, polynomial.polypow([0.0, 1.0], i))
        term = polynomial.polymul(term, polynomial.polypow([1.0, -1.0], degree - i))
        basis[:, i] = binomial * polynomial.polyval(nodes, term)
    nodes[-1] = 1.0
    return nodes, np.linalg.inv(basis)


@inlined
def first_crossing(finder: CrossingFinder, event: int, direction: int, after: float, zero_at_start: bool) -> float:
    """Fraction of the step at which an event function first changes sign.

    event         row of `finder.values`
    direction      FALLING, RISING, or 0 for both
    after          fraction of the step before which crossings are passed over
    zero_at_start  the event function is zero at the step's start: divide that zero out

    Returns NO_CROSSING if there is none.
    """
    if not spans_zero(finder, event):
        return NO_CROSSING
    return crossing_of_piece(finder, set_root_piece(finder, event, zero_at_start), direction, after)


@inlined
def crossing_of_piece(finder: CrossingFinder, size: int, direction: int, after: float) -> float:
    """`first_crossing` of the polynomial whose `size` Bernstein coefficients are at the bottom of the stack."""
    stack, ends = finder.stack, finder.ends
    ends[0, 0], ends[0, 1] = 0.0, 1.0
    top = 0
    while top >= 0:
        low, high = ends[top, 0], ends[top, 1]
        signs = sign_changes(stack, top, size)
        if high <= after or signs == 0:
            top -= 1
            continue
        if (signs == 1 and low >= after) or high - low < NARROWEST:
            top -= 1
            rising = stack[top + 1, 0] < 0.0
            turned = (stack[top + 1, 0] < 0.0) != (stack[top + 1, size - 1] < 0.0)
            if turned and direction != (FALLING if rising else RISING):
                return regula_falsi(stack, top + 1, size, low, high)
            continue
        split(stack, top, size)
        middle = 0.5 * (low + high)
        ends[top, 0], ends[top, 1] = middle, high
        ends[top + 1, 0], ends[top + 1, 1] = low, middle
        top += 1
    return NO_CROSSING


@inlined
def value_at(finder: CrossingFinder, event: int, fraction: float) -> float:
    """Value of a sampled event function at a fraction of the step."""
    return evaluate(finder.stack, 0, set_root_piece(finder, event, False), fraction)


@inlined
def spans_zero(finder: CrossingFinder, event: int) -> bool:
    """Whether an event function could cross: false where it stays further from zero than it varies."""
    smallest, largest = finder.values[event, 0], finder.values[event, 0]
    for i in range(1, finder.nodes.size):
        smallest = min(smallest, finder.values[event, i])
        largest = max(largest, finder.values[event, i])
    room = 8.0 * (largest - smallest)
    return smallest <= room and largest >= -room


@inlined
def set_root_piece(finder: CrossingFinder, event: int, zero_at_start: bool) -> int:
    """Coefficients of the whole step into the first place of the stack; returns how many there are."""
    stack, size = finder.stack, finder.nodes.size
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += finder.to_bernstein[i, j] * finder.values[event, j]
        stack[0, i] = total
    return without_zero_at_start(stack, size) if zero_at_start else size


@inlined
def without_zero_at_start(stack: Any, size: int) -> int:
    """Divide a zero at the start out of the coefficients at the bottom of the stack; returns how many are left."""
    degree = size - 1
    for i in range(1, size):
        stack[0, i - 1] = stack[0, i] * degree / i
    return degree


@inlined
def way_from_zero(finder: CrossingFinder, event: int, clearly: float) -> float:
    """Which way an event function goes that is zero at the step's start: a number of that sign; 0 while it stays there.

    What the error of an event's time left of the value there does not count.

    clearly  what a coefficient of its slope (per step) must exceed to count
    """
    size = set_root_piece(finder, event, False)
    for i in range(1, size):
        slope = (finder.stack[0, i] - finder.stack[0, 0]) * (size - 1) / i
        if abs(slope) > clearly:
            return float(slope)
    return 0.0


@inlined
def sign_changes(stack: Any, piece: int, size: int) -> int:
    """How often the coefficients of a piece change sign; zero counts as positive."""
    changes = 0
    for i in range(1, size):
        if (stack[piece, i] < 0.0) != (stack[piece, i - 1] < 0.0):
            changes += 1
    return changes


@inlined
def split(stack: Any, piece: int, size: int) -> None:
    """De Casteljau at the middle: the left half goes on top of the stack, the right half takes the piece's place."""
    for i in range(size):
        stack[piece + 1, i] = stack[piece, i]
    for level in range(1, size):
        stack[piece, size - level] = stack[piece + 1, size - 1]
        for i in range(size - 1, level - 1, -1):
            stack[piece + 1, i] = 0.5 * (stack[piece + 1, i - 1] + stack[piece + 1, i])
    stack[piece, 0] = stack[piece + 1, size - 1]


@inlined
def regula_falsi(stack: Any, piece: int, size: int, low: float, high: float) -> float:
    """Fraction at which the only crossing of a piece lies: the Illinois variant, kept inside its bracket."""
    a, b = 0.0, 1.0
    value_a, value_b = stack[piece, 0], stack[piece, size - 1]
    side = 0
    for _ in range(100):
        if b - a <= 2.0 * CLOSEST or value_a == value_b:
            break
        # rounding may put the secant's zero on an end: a step inside shrinks the bracket to it
        c = min(max((a * value_b - b * value_a) / (value_b - value_a), a + CLOSEST), b - CLOSEST)
        value_c = evaluate(stack, piece, size, c)
        if value_c == 0.0:
            a, b = c, c
        elif (value_c < 0.0) == (value_b < 0.0):
            b, value_b = c, value_c
            value_a = 0.5 * value_a if side == -1 else value_a
            side = -1
        else:
            a, value_a = c, value_c
            value_b = 0.5 * value_b if side == 1 else value_b
            side = 1
    return low + 0.5 * (a + b) * (high - low)


@inlined
def evaluate(stack: Any, piece: int, size: int, x: float) -> float:
    """Value of a piece at x (0 to 1): Bernstein form by nested products."""
    degree = size - 1
    u, power, binomial = 1.0 - x, 1.0, 1.0
    total = stack[piece, 0] * u
    for i in range(1, degree):
        power *= x
        binomial = binomial * (degree - i + 1) / i
        total = (total + power * binomial * stack[piece, i]) * u
    return total + power * x * stack[piece, degree]


@inlined
def shift_column(columns: Any, at: int, rate: Any, wait: float) -> None:
    """Take a column of a state's derivative from equal times to the event itself: Phi + f wait (saltation).

    Before the event by the wait for it; after a jump, where time goes on as before, back by the same wait.

    columns  numbers of which those from `at` on are the column; written
    rate     (n,) f, the state's own derivative in time
    wait     derivative of the event's time by what the column is for
    """
    for i in range(len(rate)):
        columns[at + i] += rate[i] * wait
