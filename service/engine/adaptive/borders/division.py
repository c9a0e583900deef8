"""The division of chains, which depends on the chain itself and on the goal alone.

Only where a goal bounds angles, the normals of all patches along the chain count, too: then the
places depend on the models that are meshed together.

A chain of several edges is tried as one straight segment, then cut at the knot in the middle, and
so on; single edges are halved. All arithmetic is elementwise, in coordinates about the chain's
first point and in its own direction. Hence a chain has the same places and points, bit for bit, in
every model.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.curves import Curves, group_curves
from service.engine.adaptive.borders.edge_halving import halve_edges
from service.engine.adaptive.borders.knot_cuts import cut_at_knots
from service.engine.adaptive.borders.side_normals import SideNormals
from service.engine.adaptive.limits import SidePieces
from service.engine.bounds.chords import project
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.mesh.seams import Seams


@dataclass(frozen=True, eq=False, slots=True)
class Division:
    """The vertices of chains: of chain c `start[c]` to `start[c+1]`, both ends among them.

    Attributes
    ----------
    start : ndarray of int, shape (C+1,)
    at : ndarray of int, shape (D,)
        Places along the chain, rising; an edge is SPAN units long.
    corner : ndarray of int, shape (D,)
        The corner that the vertex is, or -1 inside an edge.
    points : ndarray of float64, shape (D, 3)
        Model coordinates; without meaning at corners.
    """

    start: Ints
    at: Ints
    corner: Ints
    points: FloatArray


def divide_chains(
    chains: Chains,
    seams: Seams,
    goal: Goal,
    faces: int,
    most: int,
    *,
    normals: SideNormals | None,
) -> Division:
    """Divides every chain into pieces that may be straight.

    Parameters
    ----------
    faces : int
        Number of faces that have the chains as sides.
    most : int
        Number of triangles that are allowed.
    normals : SideNormals or None
        Normals that may turn at most by the angle of the goal between two vertices.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`.
    TooLarge
        `too_many_triangles`, as soon as the sides alone need more.
    """
    pieces = SidePieces(faces, most)
    pieces.add(chains.uses)
    length = chains.length
    every = np.arange(len(length))
    parts = [(every, length * SPAN, np.zeros((len(every), 3)))]
    parts += [
        _divide_curves(curves, goal, pieces) for curves in group_curves(chains, seams, normals)
    ]
    chain, at, points = (np.concatenate(found) for found in zip(*parts, strict=True))
    order = np.lexsort((at, chain))
    chain, at = chain[order], at[order]
    knot = chains.start[chain] + chain + at // SPAN
    start = np.concatenate([[0], np.cumsum(np.bincount(chain, minlength=len(every)))])
    corner = np.where(at % SPAN == 0, chains.corner[knot], -1)
    return Division(start.astype(np.intp), at, corner, points[order])


def _divide_curves(curves: Curves, goal: Goal, pieces: SidePieces) -> tuple[Ints, Ints, FloatArray]:
    """Chains, places and points of all pieces, in any order."""
    several = curves.start[1:] - curves.start[:-1] > 1
    row = curves.start[:-1][~several]
    cuts, again = np.zeros_like(row), np.zeros(len(row), dtype=bool)
    found: list[tuple[Ints, Ints, FloatArray]] = []
    if several.any():
        straight, *more = cut_at_knots(curves, several.nonzero()[0], goal, pieces)
        row, cuts, again = map(np.concatenate, zip((row, cuts, again), more, strict=True))
        found.append((straight, np.zeros_like(straight), curves.nets[straight, 0]))
    found += halve_edges(curves, (row, cuts, again), goal, pieces)
    row, at, nets = (np.concatenate(columns) for columns in zip(*found, strict=True))
    owner = curves.owner[row]
    points = project(nets[:, None], 3)[:, 0] + curves.origin[owner]
    return curves.chain[owner], at + (row - curves.start[owner]) * SPAN, points
