"""Edges that patches share although their weights differ by a common factor.

Such weights give the same curve, but not the same last digits of what is computed from them; and
it is by equal digits that edges are found to be one.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.rows import distinct_rows
from service.surface.sides import side_of

SAME_WEIGHT = 2.0**-44
"""How far weights of one edge, their largest made 1, may differ on two sides of it."""


def agree(points: FloatArray, weights: FloatArray, raised: FloatArray) -> None:
    """Gives every edge that patches share the same points in each of them.

    Parameters
    ----------
    points, weights : ndarray of float64, shapes (P, p+1, q+1, 3) and (P, p+1, q+1)
        The patches as they were.
    raised : ndarray of float64, shape (P, p'+1, q'+1, 3)
        Their points in a higher degree; the sides of some are overwritten.
    """
    one_degree = all(net.shape[1] == net.shape[2] for net in (points, raised))
    for sides in ((0, 1, 2, 3),) if one_degree else ((0, 1), (2, 3)):
        before = np.concatenate([side_of(points, side) for side in sides])
        loads = np.concatenate([side_of(weights, side) for side in sides])
        after = np.concatenate([side_of(raised, side) for side in sides])
        turned = _turned(before)
        for values in (before, loads, after):
            _turn(values, turned)
        first = _first(before)
        loads /= loads.max(axis=1, keepdims=True)
        same = np.abs(loads - loads[first]).max(axis=1) <= SAME_WEIGHT
        after[same] = after[first[same]]
        _turn(after, turned)
        for side, values in zip(sides, np.split(after, len(sides)), strict=True):
            side_of(raised, side)[...] = values


def _first(rows: FloatArray) -> Ints:
    """For each side the first one with the same points."""
    first, number = distinct_rows(rows.reshape(len(rows), -1))
    found: Ints = first[number]
    return found


def _turned(sides: FloatArray) -> Bools:
    """Which sides run against the direction in which their numbers come first."""
    forth = sides.reshape(len(sides), -1)
    back = sides[:, ::-1].reshape(forth.shape)
    at = np.arange(len(sides)), (forth != back).argmax(axis=1)
    turned: Bools = forth[at] > back[at]
    return turned


def _turn(sides: FloatArray, which: Bools) -> None:
    sides[which] = sides[which, ::-1]
