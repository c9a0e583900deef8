"""Seams: edges that a face has on both of their sides, one period apart."""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.trims.places import SIZE
from service.engine.trims.splines import Splines

SAME = SIZE / 2**20
"""Two parameter curves are a period apart up to this number of units."""


def find_seams(
    pcurves: Splines,
    coedge_edges: Ints,
    coedge_faces: Ints,
    coedge_reversed: Bools,
    periods: FloatArray,
) -> Bools:
    """Whether each coedge (C,) is one side of a seam of its face.

    A seam is an edge that one face has twice, in opposite directions, and whose two parameter
    curves begin, and end, a whole number of periods apart.

    Parameters
    ----------
    pcurves : Splines
        In places, one for each coedge.
    coedge_edges, coedge_faces : ndarray of int, shape (C,)
    coedge_reversed : ndarray of bool, shape (C,)
    periods : ndarray of float64, shape (C, 2)
        The lengths of closed axes of the coedge's face, in places; 0 for others.
    """
    is_seam = np.zeros(len(coedge_edges), bool)
    key = coedge_faces * (int(coedge_edges.max(initial=0)) + 1) + coedge_edges
    order = key.argsort(kind="stable")
    first = (key[order[1:]] == key[order[:-1]]).nonzero()[0]
    a, b = order[first], order[first + 1]
    is_pair = coedge_reversed[a] != coedge_reversed[b]
    a, b = a[is_pair], b[is_pair]
    if not len(a):
        return is_seam
    period = periods[a]
    step = np.where(period > 0, period, 1.0)
    is_moved = np.ones(len(a), bool)
    for t in (pcurves.start, pcurves.end):
        offset = pcurves.evaluate(b, t[b]) - pcurves.evaluate(a, t[a])
        turns = np.where(period > 0, np.rint(offset / step), 0.0)
        is_moved &= (np.abs(offset - turns * period) <= SAME).all(axis=1)
        is_moved &= (turns != 0).any(axis=1)
    is_seam[a[is_moved]] = is_seam[b[is_moved]] = True
    return is_seam
