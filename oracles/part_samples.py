"""Samples of faces and borders of parts, and cells of faces, from which searches start."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from oracles.brep_documents import Array, Index
from oracles.breps import sample_face
from oracles.parts import INSIDE, Border, Face

OF_BORDER = 200
"""Samples of a border, and at least eight in each span."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of one face or border: parameters (m, k), and a tree of the points.

    `gap` is the largest distance of a sample to its nearest neighbour.
    """

    places: Array
    points: Array
    gap: float

    @cached_property
    def tree(self) -> cKDTree:
        """A search tree of the points."""
        return cKDTree(self.points)

    def find_nearest(self, points: Array, count: int) -> tuple[Array, Index]:
        """Distances (m, s) of points (m, 3), and numbers of the nearest samples; s ≤ `count`."""
        if not len(self.points):
            return np.full((len(points), 1), np.inf), np.zeros((len(points), 1), np.intp)
        distances, rows = self.tree.query(points, min(count, len(self.points)))
        return distances.reshape(len(points), -1), rows.reshape(len(points), -1)


def measure_size(face: Face) -> float:
    """About the largest length of the box of a face, in space."""
    low, high = face.box
    share = np.stack(np.meshgrid(*[np.linspace(0, 1, 7)] * 2, indexing="ij"), axis=-1)
    points = face.at(low + share.reshape(-1, 2) * (high - low)).astype(np.float64)
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _divide(face: Face, count: int) -> tuple[Array, Array]:
    """Lines (n,) of u and (m,) of v in the box of a region, with about `count` crossings."""
    low, high = face.box
    share = np.linspace(0, 1, 9)
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    points = face.at(low + grid * (high - low)).astype(np.float64).reshape(9, 9, 3)
    lengths = [
        float(np.linalg.norm(np.diff(points, axis=axis), axis=2).sum(axis=axis).max())
        for axis in range(2)
    ]
    ratio = np.clip((lengths[0] + 1e-300) / (lengths[1] + 1e-300), 1 / 30, 30)
    numbers = [max(6, int(np.sqrt(count * r))) for r in (ratio, 1 / ratio)]
    lines = []
    for axis, number in enumerate(numbers):
        net = face.net
        knots = net.knots[axis][net.degree[axis] : len(net.knots[axis]) - net.degree[axis]]
        inner = np.unique(knots[(knots > low[axis]) & (knots < high[axis])])
        ends = np.concatenate([[low[axis]], inner, [high[axis]]])
        per_span = max(2, -(-number // (len(ends) - 1)))
        steps = np.arange(per_span) / per_span
        line = (ends[:-1, np.newaxis] + np.diff(ends)[:, np.newaxis] * steps).ravel()
        lines.append(np.append(line, high[axis]))
    return lines[0], lines[1]


def divide_box(face: Face, count: int) -> Array:
    """Corners (n, 4, 2) of cells of the box of a region."""
    u, v = _divide(face, count)
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack([corner.reshape(-1, 2) for corner in corners], axis=1)


def sample_places(face: Face, count: int, rng: np.random.Generator) -> Samples:
    """Samples of a face that are inside: a grid, and places near the loops."""
    u, v = _divide(face, count)
    places = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    if face.document is not None and face.region is not None:
        near = sample_face(face.document, face.number, count, rng, face.region).places
        places = np.concatenate([places, near])
    places = places[face.find_inside(places, is_fine=False) == INSIDE]
    return _build_samples(places, face.at(places).astype(np.float64))


def sample_border(border: Border) -> Samples:
    breaks = border.breaks
    per_span = max(8, -(-OF_BORDER // (len(breaks) - 1)))
    steps = np.arange(per_span) / per_span
    t = np.append((breaks[:-1, np.newaxis] + np.diff(breaks)[:, np.newaxis] * steps), breaks[-1])
    return _build_samples(t[:, np.newaxis], border.at(t).astype(np.float64))


def _build_samples(places: Array, points: Array) -> Samples:
    distinct = np.unique(points, axis=0)
    gap = 0.0
    if len(distinct) > 1:
        gap = float(cKDTree(distinct).query(distinct, 2)[0][:, 1].max())
    return Samples(places, points, gap)
