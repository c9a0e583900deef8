"""Cells are rectangles of places of a face; leaves are cells that need no cut. Nets of cells.

Nets are arrays (p+1, q+1, D, m): the last axis counts cells, and all arithmetic is elementwise, so
that the bits of the net of a cell do not depend on other cells. D is 3, or 4 if the net is
homogeneous.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import comb

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.limits import MeshLimits, build_depth_error
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.cells.cells import Cells
from service.engine.nets.blossoms import restrict
from service.engine.nets.nets import Nets
from service.engine.nets.patch_nets import PatchNets
from service.engine.nets.subdivision import elevate
from service.engine.vectors import Vectors, project

SHORTEST = 16
"""Least side of a cell, in units of places. It leaves room for corners that are moved into the face
by a share of this side, where the border has no vertex."""


@dataclass(frozen=True, eq=False, slots=True)
class FaceCells(Cells):
    """m rectangles of places, shape (4, m), each of the face (m,) with this number."""

    rectangle: Ints
    face: Ints

    @property
    def extents(self) -> Ints:
        """Lengths along u and along v, shape (2, m)."""
        return self.rectangle[1::2] - self.rectangle[::2]

    def halve(self, along_v: Bools) -> "FaceCells":
        """All first halves, then all second ones: v is halved where `along_v`, u elsewhere.

        A cell of several spans is cut at the knot nearest its middle, all others at their middles.
        """
        low, high = np.where(along_v, self.rectangle[2:], self.rectangle[:2])
        knot = (low // SPAN + high // SPAN) // 2 * SPAN
        middle = np.where(high - low > SPAN, knot, (low + high) // 2)
        if (np.minimum(middle - low, high - middle) < SHORTEST).any():
            raise build_depth_error()
        cells = FaceCells(self.rectangle, self.face)  # without fields of subclasses
        return FaceCells.join(cells.cut(along_v, middle))


@dataclass(frozen=True, eq=False, slots=True)
class Leaves(FaceCells):
    """m cells that are estimated to be near enough to their triangles, or candidates for leaves.

    A leaf becomes two triangles on either side of a diagonal, or a fan: one triangle for each piece
    of its boundary, with the middle of the leaf as the third corner. A fan has one vertex more than
    two triangles. It is nearer to the surface, and it adds no vertex to the leaves beside it, as a
    cut does.

    Attributes
    ----------
    along_v : ndarray of bool, shape (m,)
        Whether a cut halves v, not u.
    is_rising : ndarray of bool, shape (m,)
        Whether the diagonal (0, 0)–(1, 1) is better than (1, 0)–(0, 1).
    is_fan : ndarray of bool, shape (m,)
        Whether the triangles are a fan.
    form : ndarray of float64, shape (7, m)
        The cell as a quadratic surface over [0, 1]². Rows E, F, G: the squared length of a step
        (du, dv) is E du² + 2 F du dv + G dv². Rows a, b, c: the height of the middle of a chord
        (du, dv) over the surface, along the normal of the cell, is a du² + 2 b du dv + c dv². The
        last row is the allowed deviation.
    """

    along_v: Bools
    is_rising: Bools
    is_fan: Bools
    form: FloatArray


NO_NUMBERS = np.empty(0, dtype=np.intp)
"""An empty array, for example of leaves to be cut."""

NO_LEAVES = Leaves(
    np.empty((4, 0), dtype=np.intp),
    NO_NUMBERS,
    np.zeros(0, dtype=bool),
    np.zeros(0, dtype=bool),
    np.zeros(0, dtype=bool),
    np.empty((7, 0)),
)


@dataclass(frozen=True, eq=False, slots=True)
class Task:
    """Faces to be divided, with their patches, the goal of their triangles, and limits."""

    patch_nets: PatchNets
    faces: Faces
    goal: Goal
    limits: MeshLimits

    def find_patches(self, cells: FaceCells) -> Ints:
        """The patches (m,) in which cells of one span lie."""
        return self.find_patches_at(cells.face, cells.rectangle[0], cells.rectangle[2])

    def find_patches_at(self, face: Ints, u: Ints, v: Ints) -> Ints:
        """The patches (m,) at places; on a knot line the patch after it, if there is one."""
        faces, last = self.faces, self.faces.spans.take(face, axis=1) - 1
        span_u: Ints = np.minimum(u // SPAN, last[0])
        span_v: Ints = np.minimum(v // SPAN, last[1])
        return faces.first[face] + span_u * faces.stride[face] + span_v

    def find_border_sides(self, cells: FaceCells) -> Bools:
        """Which sides ab, bc, cd, da of cells are on the border of their face, shape (4, m).

        The corners a, b, c, d are those at (u0, v0), (u1, v0), (u1, v1), (u0, v1).
        """
        end_u, end_v = self.faces.spans.take(cells.face, axis=1) * SPAN
        u0, u1, v0, v1 = cells.rectangle
        return np.array([v0 == 0, u1 == end_u, v1 == end_v, u0 == 0])

    def evaluate_points(self, face: Ints, u: Ints, v: Ints) -> FloatArray:
        """Points of the surface at places, shape (m, 3), model coordinates."""
        ends = self.faces.spans.take(face, axis=1) * SPAN
        parameters = (  # u and v in the patch
            np.where(place == end, SPAN, place % SPAN) / SPAN
            for place, end in zip((u, v), ends, strict=True)
        )
        return self.patch_nets.evaluate_points(self.find_patches_at(face, u, v), *parameters)

    def estimate_work(self, face: Ints, places: Ints) -> float:
        """Approximate cost of certifying triangles (3, 2, m) of places, in multiplications."""
        costs = np.array(
            [estimate_piece_cost(*nets.degree) for nets in self.patch_nets.groups],
            dtype=np.float64,
        )
        costs = costs[self.patch_nets.group[self.faces.first[face]]]
        # A triangle has pieces in half of the patches of its box, and in those along one of its
        # edges: 1.5 pieces if each face is one patch.
        if int(self.faces.spans.max()) == 1:
            return 1.5 * float(costs.sum())
        first, last = places.min(axis=0) // SPAN, -(-places.max(axis=0) // SPAN)
        long, wide = np.maximum(last - first, 1).astype(np.float64)
        pieces = (long * wide + long + wide) / 2
        return float((pieces * costs).sum())

    def find_eyes(self, patch: Ints) -> Vectors | None:
        """The eye (3, m) in the coordinates of the nets of these patches; None without a view."""
        if self.goal.view is None:
            return None
        return self.goal.view.eye[:, np.newaxis] - self.patch_nets.middles.take(patch, axis=1)


def build_whole_cells(faces: Faces) -> FaceCells:
    """One cell for each face."""
    zero = np.zeros(len(faces.first), dtype=np.intp)
    high = faces.spans * SPAN
    return FaceCells(np.array([zero, high[0], zero, high[1]]), np.arange(len(faces.first)))


def elevate_to_quadratics(nets: FloatArray) -> FloatArray:
    """Nets elevated to degrees of at least 2."""
    for axis in (0, 1):
        while nets.shape[axis] < 3:
            nets = elevate(nets.swapaxes(0, axis)).swapaxes(0, axis)
    return nets


def evaluate_nine_points(nets: FloatArray) -> FloatArray:
    """Points at u, v ∈ {0, ½, 1}, shape (3, 3, 3, m): entry [i, j] is S(i/2, j/2), shape (3, m)."""
    lines = np.empty((3, *nets.shape[1:]))
    lines[0], lines[1], lines[2] = nets[0], _evaluate_middle(nets), nets[-1]
    points = np.empty((3, 3, *nets.shape[2:]))
    points[:, 0], points[:, 2] = lines[:, 0], lines[:, -1]
    points[:, 1] = _evaluate_middle(lines.swapaxes(0, 1))
    return project(points)


def _evaluate_middle(rows: FloatArray) -> FloatArray:
    """Value at ½ along the first axis: Σ binom(n, i) / 2^n P_i."""
    degree = len(rows) - 1
    if degree > 50:  # binomials, or sums of binomials, would be rounded
        while len(rows) > 1:
            rows = (rows[:-1] + rows[1:]) * 0.5
        middle: FloatArray = rows[0]
        return middle
    shares = _build_binomials(degree).reshape(-1, *[1] * (rows.ndim - 1))
    value: FloatArray = np.add.reduce(rows * shares, axis=0)
    return value


@lru_cache(maxsize=64)
def _build_binomials(degree: int) -> FloatArray:
    return np.array([comb(degree, i) / 2**degree for i in range(degree + 1)])


@lru_cache(maxsize=128)
def build_quadratic_matrix(degree: int) -> FloatArray:
    """Matrix (n+1, 3) from values of a quadratic at 0, ½ and 1 to its net of degree n ≥ 2.

    The net of degree 2 is x_0, 2 x_½ − ½ (x_0 + x_1), x_1. In point i of the net elevated to degree
    n, these have the shares (n−i)(n−i−1), 2 i (n−i) and i (i−1), divided by n (n−1).
    """
    i = np.arange(degree + 1)[:, np.newaxis]
    shares = np.concatenate(
        [(degree - i) * (degree - i - 1), 2 * i * (degree - i), i * (i - 1)], axis=1
    )
    values = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])
    net: FloatArray = (shares[:, :, np.newaxis] * values).sum(axis=1) / (degree * (degree - 1))
    net.flags.writeable = False
    return net


def restrict_to_cells(nets: Nets, rows: Ints, cells: FaceCells) -> FloatArray:
    """Nets over cells of one span, with degrees of at least 2, from patches in rows of `nets`."""
    if (cells.extents == SPAN).all():
        return elevate_to_quadratics(nets.values.take(rows, axis=3))
    low, high = cells.rectangle[::2], cells.rectangle[1::2]
    first = low // SPAN * SPAN
    ends = np.array([low - first, high - first]) / SPAN  # parameters of the patch
    boxes = restrict(nets.items.take(rows, axis=0), ends)
    return elevate_to_quadratics(np.ascontiguousarray(boxes.transpose(2, 3, 1, 0)))


def estimate_piece_cost(p: int, q: int) -> int:
    """Approximate cost of certifying a piece over a patch of degree (p, q), in multiplications.

    Blossoming takes about p + q steps, each with 10 multiplications for each of (p+1)(q+1) points.
    Then the (p+q+1)(p+q+2) / 2 points of the triangular net are compared with the reference
    triangle, with about 60 multiplications for each.
    """
    return (p + q + 2) * (10 * (p + 1) * (q + 1) + 30 * (p + q + 1))
