"""The vertices on the sides of faces; the goal for distances and angles determines their places."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, unique_values
from service.engine.adaptive.borders.chains import find_chains
from service.engine.adaptive.borders.curves import SideNormals
from service.engine.adaptive.borders.division import divide_chains
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.connectivity.seams import Seams
from service.surface.sides import BEGINS


@dataclass(frozen=True, eq=False, slots=True)
class Border:
    """The divisions of all sides of faces; sides as in `service.surface.sides`.

    The entries of side s of face f are `start[4f+s] : start[4f+s+1]`: its vertices from end to end,
    with their places along the side in ascending order; a span is SPAN units long. A side that is
    one point has two entries, its ends, with one vertex.

    Attributes
    ----------
    faces : Faces
    start : ndarray of int, shape (4F+1,)
    at, vertex : ndarray of int, shape (M,)
        Place along the side, and vertex, of each entry.
    points : ndarray of float64, shape (B, 3)
        The vertices, in model coordinates.
    collapsed : ndarray of bool, shape (F, 4)
        Sides that are one point.
    side, u, v : ndarray of int, shape (M,)
        Side (4 f + s) and place of each entry in its face.
    base : ndarray of int, shape (4F,)
        Offset added to places along each side, so that places of all sides differ.
    key : ndarray of int, shape (M,)
        Places of the entries along their sides, plus the offset; in ascending order.
    low : ndarray of int, shape (2, F)
        Offsets added to u and to v, so that no two faces share a value of u or of v.
    is_pole : ndarray of bool, shape (B,)
        Whether a vertex is a whole side.
    """

    faces: Faces
    start: Ints
    at: Ints
    vertex: Ints
    points: FloatArray
    collapsed: Bools
    side: Ints
    u: Ints
    v: Ints
    base: Ints
    key: Ints
    low: Ints
    is_pole: Bools

    @classmethod
    def of(
        cls,
        faces: Faces,
        start: Ints,
        entries: tuple[Ints, Ints],
        points: FloatArray,
        collapsed: Bools,
    ) -> "Border":
        """The border with these `entries` (at, vertex)."""
        (at, vertex), size = entries, faces.spans * SPAN
        side = np.arange(len(start) - 1).repeat(start[1:] - start[:-1])
        # Sides 0 and 1 (u = 0 and the greatest u) run along v, sides 2 and 3 along u.
        far, s = size[:, side // 4], side % 4
        u = np.where(s < 2, np.where(s == 1, far[0], 0), at)
        v = np.where(s < 2, at, np.where(s == 3, far[1], 0))
        length = size[[1, 1, 0, 0]].T.ravel() + 1
        base = length.cumsum() - length
        is_pole = np.zeros(len(points), dtype=bool)
        is_pole[vertex[start[:-1][collapsed.ravel()]]] = True
        low = (size + 1).cumsum(axis=1) - size - 1
        key = base[side] + at
        return cls(faces, start, at, vertex, points, collapsed, side, u, v, base, key, low, is_pole)


def divide_border(
    faces: Faces, seams: Seams, goal: Goal, most: int, normals: SideNormals | None = None
) -> Border:
    """Divide the sides of all faces; edges that sides share are divided once.

    Parameters
    ----------
    seams : Seams
        The seams of the model of the faces, in model coordinates.
    most : int
        Largest number of triangles.
    normals : SideNormals, optional
        Normals that may turn by at most the angle of the goal between two vertices.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if the tolerance is below the rounding errors.
    TooLarge
        `too_many_triangles`, as soon as the sides alone need more triangles than `most`.
    """
    chains = find_chains(faces, seams)
    division = divide_chains(chains, seams, goal, len(faces.first), most, normals=normals)
    # The patch at which each side begins, and the number of spans along each side.
    first_patch, _, spans = faces.list_sides()
    collapsed = seams.collapsed[first_patch, np.arange(4)]
    poles = seams.corner[first_patch, BEGINS][collapsed]
    # Corners that are vertices come first, then the vertices between them.
    is_corner = division.corner >= 0
    corners = np.concatenate([division.corner[is_corner], poles])
    first, number = unique_values(corners)
    used = corners[first]
    vertex = np.empty(len(division.at), dtype=np.intp)
    vertex[is_corner] = number[: len(corners) - len(poles)]
    vertex[~is_corner] = len(used) + np.arange(np.count_nonzero(~is_corner))
    points = np.concatenate([seams.corner_points[used], division.points[~is_corner]])

    # A run is one use of a chain on one side; `chains.side`, `.first` and `.reversed` have one
    # entry for each run. A run has the vertices of its chain. Two neighbouring runs of a side have
    # one vertex in common.
    count = (division.start[1:] - division.start[:-1])[chains.chain]
    pieces = np.bincount(chains.side, count - 1, minlength=collapsed.size).astype(np.intp)
    start = np.concatenate([[0], np.cumsum(np.where(collapsed.ravel(), 1, pieces) + 1)])
    # The number of divisions before each run on its own side.
    divisions_before = np.cumsum(count - 1) - (count - 1)
    divisions_before -= divisions_before[np.searchsorted(chains.side, chains.side)]
    run, k = expand_runs(count)
    chain = chains.chain[run]
    source = division.start[chain] + np.where(chains.reversed[run], count[run] - 1 - k, k)
    along = division.at[source]
    along = np.where(chains.reversed[run], chains.length[chain] * SPAN - along, along)
    target = start[chains.side[run]] + divisions_before[run] + k
    at, entry_vertex = np.zeros(start[-1], dtype=np.intp), np.empty(start[-1], dtype=np.intp)
    at[target], entry_vertex[target] = chains.first[run] * SPAN + along, vertex[source]
    # The first of the two entries of each side that is one point.
    pole = start[:-1][collapsed.ravel()]
    at[pole + 1] = spans[collapsed] * SPAN
    entry_vertex[pole] = entry_vertex[pole + 1] = number[len(corners) - len(poles) :]
    return Border.of(faces, start.astype(np.intp), (at, entry_vertex), points, collapsed)
