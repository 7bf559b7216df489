"""Bifurcations of gaits: folds, flips and tori as zeros of test functions, and the branch beyond a flip.

The test functions of the derivative DP of n steps are det(DP - 1) for a fold, det(DP + 1) for a flip, and for a torus
det(DP ^ DP - 1), where the bialternate product DP ^ DP acts on pairs of directions and has products of pairs of
multipliers as eigenvalues. They are smooth along a branch, so that fast root finders converge.

Source: Kuznetsov, Elements of applied bifurcation theory, sections 5.4 (normal form of the flip), 10.2 and 10.3.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from walkerlab.outcome import Outcome
from walkerlab.physics.orbits.continuation import CurvePoint, Segment, root_along
from walkerlab.physics.orbits.newton import Evaluated
from walkerlab.physics.orbits.step_map import Cycle, StepMap, add_parameter_derivative, walk_steps
from walkerlab.physics.solvers.system import Floats

Kind = Literal["fold", "flip", "torus"]
BIFURCATION_KINDS: tuple[Kind, ...] = ("fold", "flip", "torus")
# difference step for the normal form, for coordinates of magnitude one
NORMAL_FORM_STEP = 1e-3
FORM_REFINEMENTS = 4
FIRST_MULTIPLIER_DROP = 0.2  # 1 minus the multiplier at the first point of a new branch
PAIR_TOLERANCE = 1e-4  # distance from the unit circle within which multipliers form a critical pair


class GaitEquations:
    """Gait equations P^n(z) - z = 0 in the unknowns x = (z, p / scale)."""

    def __init__(self, step_map: StepMap, period: int, scale: float) -> None:
        self.step_map = step_map
        self.period = period
        self.scale = scale

    def __call__(self, x: Floats) -> Evaluated[Cycle]:
        cycle = walk_steps(self.step_map, x[:-1], self.value(x), self.period)
        evaluated = add_parameter_derivative(self.step_map, cycle).mismatch()
        return evaluated._replace(jacobian=np.column_stack((evaluated.jacobian, self.scale * evaluated.data.Dp)))

    def value(self, x: Floats) -> float:
        return self.scale * float(x[-1])


def bialternate_product(DP: Floats) -> Floats:
    """Return the bialternate product of DP (d, d) with itself, a square matrix of size d (d - 1) / 2."""
    first, second = np.triu_indices(DP.shape[0], 1)
    straight = DP[np.ix_(first, first)] * DP[np.ix_(second, second)]
    crossed = DP[np.ix_(first, second)] * DP[np.ix_(second, first)]
    return np.asarray(straight - crossed)


def critical_value(kind: Kind, DP: Floats) -> float:
    acting = bialternate_product(DP) if kind == "torus" else DP
    return float(np.linalg.det(acting + (1.0 if kind == "flip" else -1.0) * np.eye(len(acting))))


@dataclass(frozen=True)
class Bifurcation:
    kind: Kind
    value: float  # value of the parameter
    multiplier: complex
    point: CurvePoint[Cycle]
    segment: Segment[Cycle] = field(repr=False)  # segment of the branch that contains it

    @property
    def gait(self) -> Cycle:
        return self.point.evaluated.data

    def lies_between(self, first: Cycle, second: Cycle) -> bool:
        # The points of a branch are copies that share their array z, so the arrays identify them.
        ends = (self.segment.first, self.segment.second)
        return {id(end.evaluated.data.z) for end in ends} == {id(first.z), id(second.z)}


def locate_bifurcation(segment: Segment[Cycle], kind: Kind, scale: float) -> Bifurcation | None:
    tests = [critical_value(kind, end.evaluated.data.DP) for end in (segment.first, segment.second)]
    if tests[0] * tests[1] >= 0.0:
        return None
    point = root_along(segment, lambda solved: critical_value(kind, solved.evaluated.data.DP))
    if point is None:
        return None
    multipliers = point.evaluated.data.multipliers
    if kind == "torus":
        on_circle = [m for m in multipliers if m.imag > 0.0 and abs(abs(m) - 1.0) < PAIR_TOLERANCE]
        # Two real multipliers with product one also satisfy the test. They belong to a saddle, not to a bifurcation.
        if not on_circle:
            return None
        multiplier = complex(on_circle[0])
    else:
        target = 1.0 if kind == "fold" else -1.0
        multiplier = complex(min(multipliers, key=lambda m: abs(m - target)))
    return Bifurcation(kind, scale * float(point.x[-1]), multiplier, point, segment)


@dataclass(frozen=True)
class FlipForm:
    """Normal form of a flip, xi -> -(1 + rate s) xi + cubic xi^3, at arclength s along the branch from the flip."""

    direction: Floats  # (d,) unit eigenvector of the multiplier -1
    adjoint: Floats  # (d,) left eigenvector, adjoint . direction = 1
    bend: Floats  # (d,) second-order part of the centre manifold: z = z* + xi direction + xi^2 bend
    cubic: float
    rate: float

    @property
    def amplitude(self) -> float:
        """Amplitude xi at which the new gait's multiplier, 1 - 4 cubic xi^2, is FIRST_MULTIPLIER_DROP below 1."""
        return math.sqrt(0.25 * FIRST_MULTIPLIER_DROP / abs(self.cubic))


def eigenvector(A: Floats, value: complex) -> Floats:
    """Return the unit eigenvector of a real eigenvalue, or a direction in the plane of a complex pair."""
    _, _, rows = np.linalg.svd(A - (value if value.imag else value.real) * np.eye(A.shape[0]))
    # The right singular vector of the smallest singular value spans the kernel. The real and the imaginary part of a
    # complex one span the pair's plane, but its phase is arbitrary, so one of them may vanish.
    return max(rows[-1].real, rows[-1].imag, key=lambda part: float(np.linalg.norm(part)))


def flip_form(equations: GaitEquations, flip: Bifurcation) -> FlipForm | None:
    """Compute the normal form at a flip from differences of exact steps, or return None if a probe fails."""
    A = flip.point.evaluated.data.DP
    v, w = eigenvector(A, -1.0), eigenvector(A.T, -1.0)
    w = w / (w @ v)
    segment = flip.segment
    s = float(segment.first.tangent @ (flip.point.x - segment.first.x))
    gap = 1e-3 * segment.length
    neighbours = [segment.point_at(s + h) for h in (-gap, gap)]
    passing = [float(w @ point.evaluated.data.DP @ v) for point in neighbours if isinstance(point, CurvePoint)]
    if len(passing) < 2:
        return None
    # minus the derivative, with respect to s, of the multiplier that crosses -1
    rate = (passing[0] - passing[1]) / (2.0 * gap)
    form = None
    probe = NORMAL_FORM_STEP
    for _ in range(FORM_REFINEMENTS):
        terms = _cubic(equations, flip, v, w, probe)
        if terms is None:
            return form
        form = FlipForm(v, w, *terms, rate)
        # The difference step must be small compared with the amplitude at which the form is used.
        if probe <= 0.5 * form.amplitude:
            break
        probe = 0.2 * form.amplitude
    return form


def _cubic(equations: GaitEquations, flip: Bifurcation, v: Floats, w: Floats, h: float) -> tuple[Floats, float] | None:
    z, p = flip.point.x[:-1], equations.value(flip.point.x)
    A = flip.point.evaluated.data.DP

    def probe(direction: Floats) -> tuple[Floats, Floats] | None:
        cycles = [walk_steps(equations.step_map, z + sign * h * direction, p, equations.period) for sign in (1, -1)]
        if any(cycle.outcome is not Outcome.WALKED for cycle in cycles):
            return None
        return cycles[0].DP @ v, cycles[1].DP @ v

    along = probe(v)
    if along is None:
        return None
    B_vv = (along[0] - along[1]) / (2.0 * h)
    C_vvv = (along[0] - 2.0 * (A @ v) + along[1]) / h**2
    inner = np.asarray(np.linalg.solve(np.eye(v.size) - A, B_vv), np.float64)
    size = float(np.linalg.norm(inner))
    across = probe(inner / size)
    if across is None:
        return None
    B_inner = size * (across[0] - across[1]) / (2.0 * h)
    # Kuznetsov's coefficient, <w, C(v, v, v) + 3 B(v, (1 - A)^-1 B(v, v))> / 6.
    cubic = float(w @ (C_vvv + 3.0 * B_inner)) / 6.0
    return (0.5 * inner, cubic) if cubic != 0.0 else None


def predict_doubled(flip: Bifurcation, form: FlipForm, share: float = 1.0) -> tuple[Floats, Floats, float]:
    """Predict a point x (d + 1,) of the doubled branch.

    Returns x, the normal of the plane on which x is to be corrected, and the amplitude.

    share  fraction of the amplitude of the normal form
    """
    xi = share * form.amplitude
    # The gait of twice the period has -(1 + rate s) xi + cubic xi^3 = -xi.
    s = form.cubic * xi * xi / form.rate
    guess = flip.point.x + s * flip.point.tangent
    guess[:-1] += xi * form.direction + xi * xi * form.bend
    normal = np.append(form.adjoint, 0.0)
    return guess, normal / np.linalg.norm(normal), xi
