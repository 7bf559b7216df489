"""Order conditions of a Runge-Kutta tableau, one for each rooted tree (Butcher; Hairer, Norsett, Wanner I, II.2)."""

import math
from functools import cache

import numpy as np


@cache
def trees(order):
    """Return the rooted trees of an order. Each is the sorted tuple of the subtrees of its root."""
    if order == 1:
        return ((),)
    return tuple(sorted({tuple(sorted(forest)) for forest in forests(order - 1)}))


def forests(nodes):
    if nodes == 0:
        yield ()
    for first in range(1, nodes + 1):
        for tree in trees(first):
            for rest in forests(nodes - first):
                yield (tree, *rest)


def nodes(tree):
    return 1 + sum(map(nodes, tree))


def density(tree):
    return nodes(tree) * math.prod(map(density, tree))


def stage_weights(A, tree):
    """Return the elementary weight of each stage: the product, over all subtrees, of A times their weights."""
    weights = np.ones(len(A))
    for subtree in tree:
        weights = weights * (A @ stage_weights(A, subtree))
    return weights


def defects(A, weights, order):
    """Return how far each condition of an order is from being met."""
    return [weights @ stage_weights(A, tree) - 1.0 / density(tree) for tree in trees(order)]
