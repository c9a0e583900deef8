"""Loops as polygons of parameters, for what only depends on how they lie: areas and insides."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.preparation.topology import Topology
from service.surface.spline_tables import find_starts

DIVISIONS = 12
"""Sides of a polygon for each span of a parameter curve that is not straight."""


@dataclass(frozen=True, eq=False, slots=True)
class LoopPolygons:
    """Corners (m, 2) of the polygons of loops; loop k has the rows from `starts[k]` on.

    Attributes
    ----------
    loops : ndarray of int, shape (k,)
    starts : ndarray of int, shape (k+1,)
    corners : ndarray of float64, shape (m, 2)
    coedges : ndarray of int, shape (m,)
        The coedge on which each corner is; it is not the end of it.
    parameters : ndarray of float64, shape (m,)
        The parameter of the coedge's edge.
    """

    loops: Ints
    starts: Ints
    corners: FloatArray
    coedges: Ints
    parameters: FloatArray

    def find_areas(self) -> FloatArray:
        """Areas (k,), positive for counter-clockwise polygons."""
        if not len(self.loops):
            return np.zeros(0)
        first = self.starts[:-1]
        middle = self.corners[first]  # products of small numbers lose fewer digits
        x, y = (self.corners - np.repeat(middle, np.diff(self.starts), axis=0)).T
        following = np.arange(1, len(x) + 1)
        following[self.starts[1:] - 1] = first
        areas: FloatArray = np.add.reduceat(x * y[following] - y * x[following], first) / 2
        return areas

    def contains(self, k: int, points: FloatArray) -> Bools:
        """Whether points (n, 2) are inside polygon k."""
        a = self.corners[self.starts[k] : self.starts[k + 1]]
        b = np.roll(a, -1, axis=0)
        x, y = points[:, :1], points[:, 1:]
        straddles = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(straddles, b[:, 1] - a[:, 1], 1.0)
        cross = a[:, 0] + (b[:, 0] - a[:, 0]) * (y - a[:, 1]) / rise
        inside: Bools = (straddles & (x < cross)).sum(axis=1) % 2 == 1
        return inside


def sample_loops(topology: Topology, loops: Ints) -> LoopPolygons:
    """The polygons of some loops."""
    run, coedge = expand_runs(topology.loop_counts[loops], topology.loop_starts[loops])
    pcurves = topology.pcurves
    divisions = np.where(pcurves.degree == 1, 1, DIVISIONS)[coedge] * pcurves.span_count[coedge]
    of, number = expand_runs(divisions)
    share = number / divisions[of]
    share = np.where(topology.coedge_reversed[coedge[of]], 1.0 - share, share)
    start, end = pcurves.start[coedge[of]], pcurves.end[coedge[of]]
    t = np.where(share == 1.0, end, start + (end - start) * share)
    corners = pcurves.evaluate(coedge[of], t)
    counts = np.bincount(run[of], minlength=len(loops))
    return LoopPolygons(loops, find_starts(counts), corners, coedge[of], t)
