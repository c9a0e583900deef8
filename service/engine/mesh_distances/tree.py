"""A tree of boxes over triangles.

Triangles that are long and thin are first divided (`parts.py`). The parts are halved at medians of
their middles (`halving.py`), down to groups of at most eight. Each group gets a box whose sides are
parallel to the axes, each four groups that follow one another get a larger box, and so on. So box k
of a level contains the boxes 4 k … 4 k + 3 of the next, and nothing else need be stored.
"""

from math import frexp

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.mesh_distances.frames import TriangleFrames
from service.engine.mesh_distances.halving import group_points
from service.engine.mesh_distances.parts import divide_triangles
from service.engine.vectors import Vectors

MAX_GROUP = 8
"""The most parts of a group."""

FANOUT = 4
"""How many boxes a larger box contains, if it is not that of a group."""

SMALLEST = -64
"""Coordinates are enlarged by at most 2^64: then the squares of all points' do not overflow."""


class TriangleTree:
    """A tree of boxes over t triangles, t > 0, to which distances are measured.

    Parameters
    ----------
    corners : ndarray of float64, shape (t, 3, 3)
        Axis 1 counts the vertices. Triangles that are segments or points are measured as such. No
        coordinate is larger than those of float32.

    Attributes
    ----------
    origin : ndarray of float64, shape (3,)
    scale : float
        The tree is in coordinates (x − origin) · scale, which are at most 1 for its triangles;
        `scale` is a power of two.
    order : ndarray of int, shape (t,)
        The numbers of the triangles in the order of the tree. Places in this order are *slots*.
    slots : ndarray of int, shape (t,)
        The slot of each triangle.
    frames : TriangleFrames
        The triangles in the order of the tree.
    levels : list of ndarray of float64, shape (6, N)
        For each level the least and the largest coordinates of its boxes; the level of the largest
        box comes first. The boxes of the last level are those of parts of triangles, and the boxes
        of the level before are those of groups.
    leaves : ndarray of int, shape (n,)
        The slot of the triangle of each part on the last level.
    sizes : list of float
        For each level the mean of the longest sides of its boxes.
    group : int
        The number of parts of a group.
    """

    def __init__(self, corners: FloatArray) -> None:
        if not len(corners):
            raise ValueError("A tree needs a triangle.")
        points = np.asarray(corners, np.float64).reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        self.origin = low + (high - low) / 2
        size = float(np.maximum(high - self.origin, self.origin - low).max())
        self.scale = 2.0 ** -max(frexp(size)[1], SMALLEST)
        vertices = self.to_frame(points).reshape(3, -1, 3).transpose(2, 0, 1)
        owner, boxes = divide_triangles(vertices)
        groups = group_points((boxes[:3] + boxes[3:]) / 2, MAX_GROUP)
        self.levels = [boxes.take(groups.ravel(), axis=1)]
        owner, self.group = owner.take(groups.ravel()), groups.shape[1]
        # The triangles in the order in which the tree has them first.
        first = np.full(len(corners), len(owner))
        np.minimum.at(first, owner, np.arange(len(owner)))
        self.order = first.argsort()
        self.slots = np.empty_like(self.order)
        self.slots[self.order] = np.arange(len(self.order))
        self.leaves = self.slots.take(owner)
        self.frames = TriangleFrames(vertices.take(self.order, axis=2))
        inner = self.group
        while self.levels[0].shape[1] > 1:
            self.levels.insert(0, _enclose(self.levels[0], inner))
            inner = FANOUT
        self.sizes = [float((boxes[3:] - boxes[:3]).max(axis=0).mean()) for boxes in self.levels]

    def count_inner(self, level: int) -> int:
        """How many boxes of the next level a box of a level has."""
        return self.group if level == len(self.levels) - 2 else FANOUT

    def list_inner(self, level: int, box: Ints) -> Ints:
        """The boxes (k, m) of the next level that are in the boxes `box` (m,) of a level."""
        inner = self.count_inner(level)
        boxes = np.arange(inner)[:, np.newaxis] + inner * box
        # On some levels the only box has fewer than `inner`; then the last occurs several times.
        existing: Ints = np.minimum(boxes, self.levels[level + 1].shape[1] - 1)
        return existing

    def to_frame(self, points: FloatArray) -> Vectors:
        """Points (m, 3) in the coordinates of the tree, (3, m)."""
        return np.ascontiguousarray(((points - self.origin) * self.scale).T)

    def from_frame(self, points: Vectors) -> FloatArray:
        """Points (3, m) of the tree in the coordinates of its triangles, (m, 3)."""
        original: FloatArray = points.T / self.scale + self.origin
        return original


def _enclose(boxes: FloatArray, inner: int) -> FloatArray:
    """The boxes of the next level up, of `inner` boxes each."""
    starts = np.arange(0, boxes.shape[1], inner)
    low = np.minimum.reduceat(boxes[:3], starts, axis=1)
    return np.concatenate([low, np.maximum.reduceat(boxes[3:], starts, axis=1)])
