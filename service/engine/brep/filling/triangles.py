"""Triangles of faces during refinement: their corners, and which triangles meet at an edge."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.vectors import NEXT, Items


@dataclass(frozen=True, eq=False, slots=True)
class Triangles(Items):
    """T triangles of corners.

    Attributes
    ----------
    corners : ndarray of int, shape (3, T)
        Rows of `FaceCorners`, counter-clockwise in places. Edge k runs from corner k to k + 1.
    bounds : ndarray of float64, shape (T,)
        No point of the surface over the triangle is further than this from the mesh.
    mesh_bounds : ndarray of float64, shape (T,)
        No point of the triangle of the mesh is further than this from the surface; 0 if the goal
        is not two-sided.
    allowed : ndarray of float64, shape (T,)
        The largest bound at which the triangle may stay.
    mesh_allowed : ndarray of float64, shape (T,)
        The same for `mesh_bounds`.
    is_changed : ndarray of bool, shape (T,)
        Whether `bounds` must be computed.
    is_wide : ndarray of bool, shape (T,)
        Whether the bound also rests on the triangles beyond the neighbours.
    """

    corners: Ints
    bounds: FloatArray
    mesh_bounds: FloatArray
    allowed: FloatArray
    mesh_allowed: FloatArray
    is_changed: Bools
    is_wide: Bools

    def __len__(self) -> int:
        return len(self.bounds)

    @property
    def fails(self) -> Bools:
        """Which bounds are not within what is allowed, (T,); a bound that is NaN never is."""
        fails: Bools = ~(self.bounds <= self.allowed) | ~(self.mesh_bounds <= self.mesh_allowed)
        return fails


def build_triangles(
    corners: Ints, allowed: FloatArray, mesh_allowed: FloatArray | None = None
) -> Triangles:
    """Triangles (3, T) that have not been measured, so their bounds are infinite.

    By default twice `allowed` (T,) is allowed for `mesh_bounds`.
    """
    count = corners.shape[1]
    return Triangles(
        *(corners, np.full(count, np.inf), np.zeros(count), allowed),
        2 * allowed if mesh_allowed is None else mesh_allowed,
        *(np.ones(count, bool), np.zeros(count, bool)),
    )


def join_ends(begins: Ints, ends: Ints) -> Ints:
    """One number for each pair of corners, the same in both directions."""
    keys: Ints = np.minimum(begins, ends) << 32 | np.maximum(begins, ends)
    return keys


@dataclass(frozen=True, eq=False, slots=True)
class Mates:
    """The edges of T triangles, and the same edges in the triangles beyond.

    Edge k of triangle t has the number k T + t.

    Attributes
    ----------
    edges : ndarray of int, shape (3 T,)
        The number of the same edge in the other triangle; −1 if there is none.
    keys : ndarray of int, shape (3 T,)
        `join_ends` of all edges, ascending.
    """

    edges: Ints
    keys: Ints

    @property
    def beyond(self) -> Ints:
        """The triangles beyond edges, (3, T); −1 if there is none."""
        count = len(self.edges) // 3
        beyond: Ints = np.where(self.edges < 0, -1, self.edges % max(count, 1)).reshape(3, -1)
        return beyond

    def has_edges(self, keys: Ints) -> Bools:
        """Whether there are edges with these keys."""
        at = np.searchsorted(self.keys, keys)
        at[at == len(self.keys)] = 0
        has: Bools = self.keys[at] == keys
        return has


def find_mates(corners: Ints) -> Mates:
    """The edges of triangles (3, T) that meet; at most two triangles of a face have an edge."""
    keys = join_ends(corners, corners[NEXT]).ravel()
    order = keys.argsort()
    keys = keys[order]
    first = np.flatnonzero(keys[1:] == keys[:-1])
    edges = np.full(len(keys), -1)
    one, other = order[first], order[first + 1]
    edges[one], edges[other] = other, one
    return Mates(edges, keys)
