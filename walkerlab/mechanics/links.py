"""Bodies that follow others: a locked shank its thigh, a torso the bisector of the legs.

Angles theta = E z with a constant E turn M alpha = r into E' M E dz = E' r. The system keeps its size: a follower's
row and column are added to those of the bodies that it follows, and its own equation becomes trivial.
"""

from typing import Any, NamedTuple

from walkerlab.kernels import by_type, inlined
from walkerlab.mechanics.tuples import Vector, put, solve_symmetric


class Independent(NamedTuple):
    """Every body turns by itself."""


class Links(NamedTuple):
    """Which of n bodies follow others, and how."""

    follows: Vector  # (n) 1 for a body that follows others, else 0
    weights: Vector  # (n n) row k: weights of the angles that body k follows


class InLine(NamedTuple):
    """Links of n bodies of which the swing shank turns with its thigh: both may as well be one body of n - 1."""

    links: Links
    others: Any  # links of the n - 1
    one_each: Vector  # (n - 1) zeros
    square: Vector  # (n - 1)^2 zeros


@by_type
def reduced(links: Any, M: Vector, r: Vector) -> tuple[Vector, Vector]:
    """E' M E and E' r, with trivial equations for the followers."""


@by_type
def spread(links: Any, z: Vector) -> Vector:
    """E z: the followers' values from those they follow."""


@by_type
def gathered(links: Any, r: Vector) -> Vector:
    """E' r, zero for the followers."""


@reduced.case(Independent)
def all_of_them(links: Independent, M: Vector, r: Vector) -> tuple[Vector, Vector]:
    """As they are."""
    return M, r


@spread.case(Independent)
@gathered.case(Independent)
def each_by_itself(links: Independent, z: Vector) -> Vector:
    """As it is."""
    return z


@reduced.case(Links)
def without_followers(links: Links, M: Vector, r: Vector) -> tuple[Vector, Vector]:
    """One follower after another."""
    n = len(r)
    for c in range(n):
        if links.follows[c] != 0.0:
            for p in range(n):
                w = links.weights[c * n + p]
                for l in range(n):
                    M = put(M, p * n + l, M[p * n + l] + w * M[c * n + l])
            for p in range(n):
                w = links.weights[c * n + p]
                for l in range(n):
                    M = put(M, l * n + p, M[l * n + p] + w * M[l * n + c])
            for l in range(n):
                M = put(M, c * n + l, 0.0)
                M = put(M, l * n + c, 0.0)
            M = put(M, c * n + c, 1.0)
    return M, gathered(links, r)


@gathered.case(Links)
def to_the_followed(links: Links, r: Vector) -> Vector:
    """What acts on a follower acts on those it follows."""
    n = len(r)
    for c in range(n):
        if links.follows[c] != 0.0:
            for p in range(n):
                r = put(r, p, r[p] + links.weights[c * n + p] * r[c])
            r = put(r, c, 0.0)
    return r


@spread.case(Links)
def to_the_followers(links: Links, z: Vector) -> Vector:
    """A follower moves with those it follows."""
    n = len(z)
    for c in range(n):
        if links.follows[c] != 0.0:
            total = 0.0
            for p in range(n):
                total += links.weights[c * n + p] * z[p]
            z = put(z, c, total)
    return z


@reduced.case(InLine)
def reduced_one_by_one(links: InLine, M: Vector, r: Vector) -> tuple[Vector, Vector]:
    """As any links."""
    return reduced(links.links, M, r)


@spread.case(InLine)
def spread_one_by_one(links: InLine, z: Vector) -> Vector:
    """As any links."""
    return spread(links.links, z)


@gathered.case(InLine)
def gathered_one_by_one(links: InLine, r: Vector) -> Vector:
    """As any links."""
    return gathered(links.links, r)


@inlined
def solve_linked(links: Any, M: Vector, r: Vector) -> Vector:
    """Solve E' M E dz = E' r; returns E dz."""
    M, r = reduced(links, M, r)
    return spread(links, solve_symmetric(M, r))
