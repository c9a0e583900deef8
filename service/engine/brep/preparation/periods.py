"""Loops of closed surfaces, moved by periods to where their face is one region of the plane."""

from dataclasses import replace
from itertools import product

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.brep.preparation.loop_polygons import LoopPolygons, sample_loops
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import ClosedSurfaces

SAME = 1e-6
"""A loop that begins this share of a period before the domain begins in the domain."""


def place_loops(surfaces: ClosedSurfaces, topology: Topology, loops: Ints) -> Topology:
    """Move loops by periods: counter-clockwise loops into the domain, others into one of these.

    Parameters
    ----------
    loops : ndarray of int, shape (k,)
        Whole loops of faces on closed surfaces, none of which runs around.
    """
    polygons = sample_loops(topology, loops)
    areas = polygons.find_areas()
    face = topology.loop_faces[loops]
    period = np.where(surfaces.is_closed[face], surfaces.period[face], np.inf)
    first = polygons.starts[:-1]
    low = np.minimum.reduceat(polygons.corners, first)
    high = np.maximum.reduceat(polygons.corners, first)
    moves = -np.floor((low - surfaces.low[face]) / period + SAME)
    finite = np.where(np.isfinite(period), period, 0.0)
    is_hole = areas < 0
    moves[is_hole] = 0.0
    outer_low, outer_high = low + moves * finite, high + moves * finite
    for k in is_hole.nonzero()[0].tolist():
        checkpoint()
        outers = (~is_hole & (face == face[k])).nonzero()[0]
        moves[k] = _find_move(
            polygons,
            k,
            [(int(j), outer_low[j], outer_high[j], moves[j] * finite[j]) for j in outers],
            (low[k], high[k], period[k]),
        )
    if not moves.any():
        return topology
    by_loop = np.zeros((len(topology.loop_counts), 2))
    by_loop[loops] = moves * finite
    shift = by_loop[topology.coedge_loops]
    pcurves = topology.pcurves.map_points(-shift, np.ones_like(shift))
    return replace(topology, pcurves=pcurves)


def _find_move(
    polygons: LoopPolygons,
    hole: int,
    outers: list[tuple[int, FloatArray, FloatArray, FloatArray]],
    box: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """By how many periods (2,) a hole is moved to be inside of one of the outer loops."""
    low, high, period = box
    points = polygons.corners[polygons.starts[hole] : polygons.starts[hole + 1]]
    for outer, outer_low, outer_high, shift in outers:
        least = np.ceil((outer_low - low) / period - SAME)
        most = np.floor((outer_high - high) / period + SAME)
        u, v = (range(int(a), int(b) + 1) for a, b in zip(least, most, strict=True))
        moves = sorted(product(u, v), key=lambda move: abs(move[0]) + abs(move[1]))
        for move in moves:
            offset = np.array(move) * np.where(np.isfinite(period), period, 0.0) - shift
            if len(moves) + len(outers) == 2 or (
                polygons.contains(outer, points + offset).mean() > 0.5
            ):
                return np.array(move, np.float64)
    return np.zeros(2)
