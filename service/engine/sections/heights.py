"""Heights of patches over planes: the polynomials f whose zero sets are the sections.

For a patch S(u, v) with control points P_ij, weights w_ij and a plane n · p = d

    f(u, v) = Σ_ij B_i^p(u) B_j^q(v) w_ij h_ij,   h_ij = n · P_ij − d

is a scalar Bézier polynomial: the height of S over the plane, times Σ B_i B_j w_ij. This factor is
positive, so the zero set of f is the section, and the sign of f is the side of the plane.

Rounding. Coordinates are local, as in `QueryNets`: at most 1 in absolute value. Weights are
divided by the largest weight of a net. Heights of at most `THICKNESS` in absolute value count as
zero; so the section belongs to a surface whose control points are moved by at most this distance
along n. `THICKNESS` is far more than the rounding errors of h. So a patch that lies exactly in the
plane also lies in the plane after rounding.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.nets.query_nets import NetGroup, QueryNets
from service.engine.sections.planes import Planes
from service.engine.vectors import project

THICKNESS = 2.0**-40
"""The largest height that counts as zero, in the coordinates of the nets."""

NOISE = 2.0**-44
"""On a common edge, the polynomials f of two patches differ by at most this, by rounding alone
(`cells`). If |f| is larger, both have the same sign."""


@dataclass(frozen=True, eq=False, slots=True)
class LocalPlanes:
    """Planes in the coordinates of the nets: `normals` (m, 3), `offsets` (m,)."""

    normals: FloatArray
    offsets: FloatArray

    @staticmethod
    def of(planes: Planes, nets: QueryNets) -> "LocalPlanes":
        """The planes n · x = (d − n · origin) / scale."""
        offset_of_origin = np.einsum("mk,k->m", planes.normals, nets.origin)
        # Planes that are too far away get infinite offsets, and cut nothing.
        with np.errstate(over="ignore"):
            return LocalPlanes(planes.normals, (planes.offsets - offset_of_origin) / nets.scale)

    def heights(self, plane: Ints, points: FloatArray) -> FloatArray:
        """Heights (m, …) of points (m, …, 3): row k over plane `plane[k]`."""
        normals = self.normals[plane].reshape(len(plane), *(1,) * (points.ndim - 2), 3)
        x, y, z = np.moveaxis(points * normals, -1, 0)
        offsets = self.offsets[plane].reshape(len(plane), *(1,) * (points.ndim - 2))
        return np.asarray((x + y) + z - offsets)


class Boxes:
    """Boxes around the control points of all nets, to find which planes may cut which nets."""

    def __init__(self, nets: QueryNets) -> None:
        low, high = [], []
        for group in nets.groups:
            flat = project(group.nets, -1).reshape(len(group.nets), -1, 3)
            low.append(flat.min(axis=1))
            high.append(flat.max(axis=1))
        lows, highs = np.concatenate(low), np.concatenate(high)
        self.middle, self.half = (lows + highs) / 2, (highs - lows) / 2

    def candidates(self, planes: LocalPlanes, first: int, last: int) -> tuple[Ints, Ints]:
        """Pairs of a plane of first … last − 1 and a net that it may cut, ordered by plane."""
        normals = planes.normals[first:last]
        height = normals @ self.middle.T - planes.offsets[first:last, np.newaxis]
        # Heights of at most `THICKNESS` count as zero; the second `THICKNESS` covers rounding.
        may_meet = np.abs(height) <= np.abs(normals) @ self.half.T + 2 * THICKNESS
        plane, net = np.nonzero(may_meet)
        return plane + first, net


def height_nets(
    group: NetGroup, planes: LocalPlanes, plane: Ints, net: Ints
) -> tuple[FloatArray, FloatArray, Bools]:
    """Compute the polynomials f of pairs of a plane and a net of a group.

    Parameters
    ----------
    plane, net : ndarray of int, shape (m,)
        The plane and the net of each pair; `net` counts the nets of all groups.

    Returns
    -------
    nets : ndarray of float64, shape (m, p+1, q+1)
        Bernstein coefficients of f.
    floor : ndarray of float64, shape (m,)
        If |f| is at most this, a point is at most `THICKNESS` from the plane, whatever its weight.
    is_coplanar : ndarray of bool, shape (m,)
        Whether the patch lies in the plane.
    """
    nets = group.nets[net - group.first]
    heights = planes.heights(plane, project(nets, -1))
    heights[np.abs(heights) <= THICKNESS] = 0.0
    is_coplanar = np.asarray(~heights.any(axis=(1, 2)))
    floor = np.full(len(net), THICKNESS)
    if group.is_rational:
        weights = nets[..., 3] / nets[..., 3].max(axis=(1, 2), keepdims=True)
        heights *= weights
        floor *= weights.min(axis=(1, 2))
    return heights, floor, is_coplanar


def runs_of_planes(counts: Ints, max_pairs: int) -> Iterator[tuple[int, int]]:
    """Split planes into runs [first, last) that have together at most `max_pairs` pairs.

    `counts` has the number of pairs of each plane. A run has at least one plane.
    """
    first, total = 0, 0
    for k, count in enumerate(counts.tolist()):
        if k > first and total + count > max_pairs:
            yield first, k
            first, total = k, 0
        total += count
    if first < len(counts):
        yield first, len(counts)
