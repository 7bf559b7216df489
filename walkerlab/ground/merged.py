"""A walker while a knee is locked: thigh and shank are one body, and the walker is one of fewer bodies.

With absolute angles theta = E z, where a column of E says which bodies turn together. The constants of the tree become
E'AE, E'BE and E'c, every lever and radius E'd: what walks is an ordinary walker again, without a knee there.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walkerlab.ground.held import Held, IdealLock, Knees, NoneHeld
from walkerlab.ground.walker import ContactWalker, Foot
from walkerlab.kernels import by_type_or_default, inlined
from walkerlab.mechanics.tree import Tree, merged_tree
from walkerlab.mechanics.tuples import Vector, numbers, put
from walkerlab.solvers.system import State


class Unmerged(NamedTuple):
    """The walker keeps its bodies, whatever its knees do."""


class Fewer(NamedTuple):
    """A walker some of whose bodies are one."""

    onto: tuple[int, ...]  # (n) which of these each body of the whole walker is
    tree: Tree
    feet: tuple[Foot, Foot]
    held: Any  # Independent or Held: by couplings
    thighs: tuple[int, int]
    shanks: tuple[int, int]
    blank: State


class ByKnees(NamedTuple):
    """While knees are locked the walker moves as one of fewer bodies.

    At least one knee always is: that of the stance leg, since a foot that comes down on a bent knee ends the walk.
    """

    one: tuple[Fewer, Fewer]  # knee 0, or knee 1, is locked
    both: Fewer
    locking: tuple[Held, Held]  # of `one`: what holds the shank of the other knee as well, when it locks


class Merged(NamedTuple):
    """This walker already has fewer bodies."""

    onto: tuple[int, ...]  # (n) which of its bodies each body of the whole walker is


def with_merged_bodies(walker: ContactWalker) -> ContactWalker:
    """The walker, told what to walk as while its knees are locked.

    One with compliant stops keeps its bodies, since a latched stop keeps its angle.
    """
    if not isinstance(walker.knees, Knees) or not isinstance(walker.knees.stop, IdealLock):
        return walker
    one = (with_locked(walker, (0,)), with_locked(walker, (1,)))
    both = with_locked(walker, (0, 1))
    locking = (held_by_knee(one[0], 1), held_by_knee(one[1], 0))
    return walker._replace(merging=ByKnees(one, both, locking))


def with_locked(walker: ContactWalker, locked: Sequence[int]) -> Fewer:
    """The bodies of a walker with knees, thigh and shank of these knees as one."""
    knees, n = walker.knees, len(walker.tree.arm_x)
    follows = {knees.shanks[knee]: knees.thighs[knee] for knee in locked}
    kept = [body for body in range(n) if body not in follows]
    onto = tuple(kept.index(follows.get(body, body)) for body in range(n))
    E = np.eye(len(kept))[list(onto)]

    def summed(row: Vector) -> Vector:
        return numbers(np.array(row) @ E)

    feet = tuple(Foot(summed(f.lever_x), summed(f.lever_y), summed(f.rolling), f.radius) for f in walker.feet)
    return Fewer(
        onto=onto,
        tree=merged_tree(walker.tree, E),
        feet=(feet[0], feet[1]),
        held=held_among(walker.held, kept, E),
        thighs=(onto[knees.thighs[0]], onto[knees.thighs[1]]),
        shanks=(onto[knees.shanks[0]], onto[knees.shanks[1]]),
        blank=(0.0,) * (4 + 2 * len(kept)),
    )


def held_among(held: Held, kept: list[int], E: NDArray[np.float64]) -> Held | NoneHeld:
    """Which of the bodies that are left follow others at all times."""
    n = E.shape[0]
    always = np.array(held.always)[kept]
    if not always.any():
        return NoneHeld()
    weights = (np.array(held.weights).reshape(n, n)[kept] @ E) * always[:, None]
    return Held(numbers(weights.ravel()), tuple(bool(x) for x in always))


def held_by_knee(fewer: Fewer, knee: int) -> Held:
    """What follows others as a knee locks: its shank, and what always does."""
    n = len(fewer.tree.arm_x)
    weights, always = np.zeros((n, n)), (False,) * n
    if isinstance(fewer.held, Held):
        weights, always = np.array(fewer.held.weights).reshape(n, n), fewer.held.always
    weights[fewer.shanks[knee], fewer.thighs[knee]] = 1.0
    return Held(numbers(weights.ravel()), always)


@inlined
def as_fewer(walker: ContactWalker, fewer: Fewer, held: Any, knees: Any) -> ContactWalker:
    """The walker with so many bodies, what is held of them and the knees that are left, on the same ground."""
    return ContactWalker(
        fewer.tree,
        fewer.feet,
        walker.normal,
        walker.friction,
        walker.gravity_along,
        walker.gravity_down,
        walker.slope,
        held,
        knees,
        walker.legs,
        fewer.blank,
        Merged(fewer.onto),
    )


@by_type_or_default
def store_whole(merging: Any, y: State, whole: Any) -> None:
    """Write the state y of a walker into `whole`, as that of the whole walker."""
    for i in range(len(y)):
        whole[i] = y[i]


@store_whole.case(Merged)
def store_all_bodies(merging: Merged, y: State, whole: Any) -> None:
    """Bodies that are one turn alike."""
    for i in range(whole.size):
        whole[i] = y[place_of(merging.onto, i, len(y))]


@inlined
def place_of(onto: tuple[int, ...], i: int, size: int) -> int:
    """Where number i of the whole walker's state stands in that of the merged one, of `size` numbers."""
    n = len(onto)
    if i < 2:
        return i
    if i < 2 + n:
        return 2 + onto[i - 2]
    first = size // 2
    return first + i - 2 - n if i < 4 + n else first + 2 + onto[i - 4 - n]


@inlined
def merged_state(onto: tuple[int, ...], whole: Any, y: State) -> State:
    """The merged walker's state of the whole one's numbers; of y only the length matters.

    Bodies that are one turn alike up to rounding; of each group the first tells.
    """
    for i in range(whole.size - 1, -1, -1):
        y = put(y, place_of(onto, i, len(y)), whole[i])
    return y


@inlined
def merged_levers(onto: tuple[int, ...], levers: Vector, summed: Vector) -> Vector:
    """E'd of one row of levers; of `summed` only the length matters."""
    for k in range(len(summed)):
        summed = put(summed, k, 0.0)
    for k in range(len(onto)):
        summed = put(summed, onto[k], summed[onto[k]] + levers[k])
    return summed
