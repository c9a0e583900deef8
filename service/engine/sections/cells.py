"""Cells: rectangles of parameters of a patch, with the coefficients of f over each rectangle.

A cell belongs to a pair of a plane and a net. For a patch S(u, v) with control points P_ij, weights
w_ij and a plane n · p = d

    f(u, v) = Σ_ij B_i^p(u) B_j^q(v) w_ij h_ij,   h_ij = n · P_ij − d

is a scalar Bézier polynomial: the height of S over the plane, times Σ B_i B_j w_ij > 0. So the zero
set of f is the section, and the sign of f is the side of the plane. The search halves cells.

Heights of at most `THICKNESS` in absolute value count as zero, so a patch that lies exactly in the
plane also lies in the plane after rounding. On a side, f is computed from the control points of
this side alone, by the same operations in both directions, so it has the same bits in two patches
with the same control points on an edge.

Proof in docs/proofs.md: "Heights over a plane".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.cells.cells import Cells, NetCells
from service.engine.nets.nets import Nets
from service.engine.nets.query_nets import QueryNets
from service.engine.sections.borders import ONE
from service.engine.sections.values import Planes
from service.engine.vectors import dot, project
from service.surface.sides import along_sides

THICKNESS = 2.0**-40
"""The largest height that counts as zero, in the coordinates of the nets."""

EDGE_ERROR = 2.0**-44
"""On a common edge, the polynomials f of two patches differ by at most this, by rounding alone. If
|f| is larger, both have the same sign."""

OVER_U, OVER_V, BELOW, ABOVE, SINGULAR, COPLANAR = range(6)
"""Kinds of cells: the section is a graph over u; a graph over v; f ≤ 0; f ≥ 0; the section is not
known to be a graph; the patch lies in the plane."""


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
        offsets = self.offsets[plane].reshape(len(plane), *(1,) * (points.ndim - 2))
        return np.asarray(dot(points, normals, -1) - offsets)


@dataclass(frozen=True, eq=False, slots=True)
class EndedCells(Cells):
    """The n cells in which a search ends, of nets of all degrees.

    Attributes
    ----------
    rectangle : ndarray of int, shape (4, n)
        In units of 1 / `borders.ONE`.
    plane, net, kind : ndarray of int, shape (n,)
    sense : ndarray of float64, shape (n,)
        The direction in which a graph has f > 0 on its left: 1 toward larger parameters, −1 toward
        smaller parameters; 0 for other kinds.
    is_monotone : ndarray of bool, shape (n,)
        Whether the section is a graph over u and also over v.
    threshold : ndarray of float64, shape (n,)
        The largest absolute value of coefficients whose signs are not reliable.
    corner_values : ndarray of float64, shape (4, n)
        f at the corners (`service.surface.sides`).
    counts : ndarray of int, shape (4, n)
        The number of coefficients on each side.
    sides : ndarray of float64, shape (w, 4, n)
        The coefficients of f on the four sides, and zeros after them.
    """

    rectangle: Ints
    plane: Ints
    net: Ints
    kind: Ints
    sense: FloatArray
    is_monotone: Bools
    threshold: FloatArray
    corner_values: FloatArray
    counts: Ints
    sides: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class OpenCells(NetCells):
    """The n cells of nets of one group that a search examines.

    Attributes
    ----------
    rectangle : ndarray of int, shape (4, n)
        In units of 1 / `borders.ONE`.
    nets : ndarray of float64, shape (p+1, q+1, n)
        Coefficients of f.
    pair : ndarray of int, shape (n,)
        Number of the pair of a plane and a net.
    plane, net : ndarray of int, shape (n,)
    threshold : ndarray of float64, shape (n,)
        If |f| is at most this, a point is at most `THICKNESS` from the plane, whatever its weight:
        the signs of so small coefficients are not reliable.
    is_coplanar : ndarray of bool, shape (n,)
        Whether the patch lies in the plane.
    """

    rectangle: Ints
    pair: Ints
    plane: Ints
    net: Ints
    threshold: FloatArray
    is_coplanar: Bools

    @property
    def lengths(self) -> Ints:
        """The lengths of the sides along u and v, shape (2, n)."""
        return self.rectangle[1::2] - self.rectangle[::2]

    def take_sides(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The coefficients on the four sides, as views: shapes (q+1, n) twice, (p+1, n) twice."""
        return self.nets[0], self.nets[-1], self.nets[:, 0], self.nets[:, -1]

    def end(self, kind: Ints, sense: FloatArray, is_monotone: Bools, width: int) -> EndedCells:
        """End the search in these cells, with what `EndedCells` says of them.

        `width` is at least the number of coefficients of any side.
        """
        sides = np.zeros((width, 4, len(self)))
        for side, row in enumerate(self.take_sides()):
            sides[: len(row), side] = row
        counts = along_sides(*self.nets.shape[:2])
        return EndedCells(
            self.rectangle,
            self.plane,
            self.net,
            kind,
            sense,
            is_monotone,
            self.threshold,
            self.nets[[0, 0, -1, -1], [0, -1, 0, -1]],
            np.repeat(counts, len(self)).reshape(4, -1),
            sides,
        )

    def halve_some(self, along_u: Bools, along_v: Bools) -> "OpenCells":
        """Halve cells along u, along v or along both; cells with neither are omitted."""
        parts: list[OpenCells] = []
        for is_along_u, is_along_v in ((True, False), (False, True), (True, True)):
            rows = ((along_u == is_along_u) & (along_v == is_along_v)).nonzero()[0]
            pieces = [self.take(rows)] if len(rows) else []
            for axis, is_halved in enumerate((is_along_u, is_along_v)):
                if is_halved:
                    checkpoint()
                    pieces = [half for piece in pieces for half in piece.halve(axis)]
            parts += pieces
        checkpoint()
        return OpenCells.join(parts)


def build_cells(group: Nets, planes: LocalPlanes, plane: Ints, net: Ints) -> OpenCells:
    """Whole nets of a group as cells, one for each pair of a plane and a net.

    `plane` and `net`, shape (m,), are the numbers of each pair; `net` counts the nets of all
    groups.
    """
    nets = group.nets[net - group.first]
    heights = planes.heights(plane, project(nets, -1))
    heights[np.abs(heights) <= THICKNESS] = 0.0
    is_coplanar = np.asarray(~heights.any(axis=(1, 2)))
    threshold = np.full(len(net), THICKNESS)
    if group.is_rational:
        weights = nets[..., 3] / nets[..., 3].max(axis=(1, 2), keepdims=True)
        heights *= weights
        threshold *= weights.min(axis=(1, 2))
    whole = np.repeat([[0], [ONE], [0], [ONE]], len(net), axis=1)
    coefficients = heights.transpose(1, 2, 0)
    return OpenCells(whole, coefficients, np.arange(len(net)), plane, net, threshold, is_coplanar)


def find_boxes(nets: QueryNets) -> FloatArray:
    """Middles and half sides, shape (2, N, 3), of boxes around the control points of all nets."""
    points = [project(group.nets, -1).reshape(len(group.nets), -1, 3) for group in nets.groups]
    low = np.concatenate([each.min(axis=1) for each in points])
    high = np.concatenate([each.max(axis=1) for each in points])
    return np.stack([(low + high) / 2, (high - low) / 2])


def find_pairs(boxes: FloatArray, planes: LocalPlanes, first: int, last: int) -> tuple[Ints, Ints]:
    """Pairs of a plane of first … last − 1 and a net that it may cut, ordered by plane.

    `boxes` are the middles and half sides of the boxes of all nets.
    """
    middles, halves = boxes
    normals = planes.normals[first:last]
    height = normals @ middles.T - planes.offsets[first:last, np.newaxis]
    # Heights of at most `THICKNESS` count as zero; the second `THICKNESS` covers rounding.
    may_meet = np.abs(height) <= np.abs(normals) @ halves.T + 2 * THICKNESS
    plane, net = np.nonzero(may_meet)
    return plane + first, net
