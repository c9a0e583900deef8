"""Surfaces that are closed, or whose sides are points: parameters that go around, and poles."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.surfaces import FaceSurfaces
from service.engine.vectors import length, project

AT_POLE = 100.0
"""Points of curves are at a pole if they are nearer to it than this many times the error that foot
points may have."""

THIN = 1e-3
"""Sides that are apart, or long, by at most this share of how wide the surface is may be one."""

NOISE = 2.0**-44
"""Rounding of coordinates, as a share of them."""


@dataclass(frozen=True, eq=False)
class ClosedSurfaces:
    """The surfaces of F faces, continued beyond their domains along closed axes.

    Along a closed axis the parameters x and x + period stand for the same point. Along other axes,
    parameters are clamped to the domain.

    Attributes
    ----------
    surfaces : FaceSurfaces
    is_closed : ndarray of bool, shape (F, 2)
        Whether the two sides across an axis are one curve.
    apart : ndarray of float64, shape (F,)
        A bound of the distances of points that x and x + period stand for: the sides may be one up
        to a tolerance only. 0 if they are equal; infinite if weights differ.
    is_pole : ndarray of bool, shape (F, 2, 2)
        Whether the side where the parameter of axis a (second index) is least or greatest (third
        index) is one point.
    """

    surfaces: FaceSurfaces
    is_closed: Bools
    is_pole: Bools
    apart: FloatArray

    @classmethod
    def open(cls, surfaces: FaceSurfaces) -> "ClosedSurfaces":
        """Surfaces without continuation and without poles."""
        count = len(surfaces)
        none = np.zeros((count, 2), bool)
        return cls(surfaces, none, np.zeros((count, 2, 2), bool), np.zeros(count))

    @cached_property
    def low(self) -> FloatArray:
        """The least parameters (F, 2) of the domains."""
        return self.surfaces.low

    @cached_property
    def period(self) -> FloatArray:
        """The lengths (F, 2) of the domains."""
        period: FloatArray = self.surfaces.high - self.low
        return period

    def find_turns(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """How many periods (m, 2) parameters are away from the domain; 0 along open axes."""
        period = self.period.take(face, axis=0)
        turns = np.floor((parameters - self.low.take(face, axis=0)) / period)
        return np.where(self.is_closed.take(face, axis=0), turns, 0.0)

    def wrap(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Parameters (m, 2) of the same points inside of the domains of faces (m,)."""
        if not self.is_closed.any():
            return parameters
        return parameters - self.find_turns(face, parameters) * self.period.take(face, axis=0)

    def find_spans(self, face: Ints, axis: int, value: FloatArray) -> Ints:
        """The spans (m,) of values along an axis; along closed axes, their numbers go on."""
        turns = np.floor((value - self.low[face, axis]) / self.period[face, axis])
        turns = np.where(self.is_closed[face, axis], turns, 0.0)
        inside = value - turns * self.period[face, axis]
        span = self.surfaces.breaks.find_spans(2 * face + axis, inside)
        number: Ints = span + turns.astype(np.intp) * self.surfaces.faces.spans[axis, face]
        return number

    def list_knots(self, face: Ints, axis: int, span: Ints) -> FloatArray:
        """The knots (2, m) at which spans begin and end, also of spans beyond a closed domain."""
        breaks = self.surfaces.breaks
        turns, inside = np.divmod(span, self.surfaces.faces.spans[axis, face])
        at = breaks.first[2 * face + axis] + inside
        shift = turns * self.period[face, axis]
        knots: FloatArray = np.array([breaks.values[at], breaks.values[at + 1]]) + shift
        return knots

    def evaluate(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Points (m, 3) of faces (m,) at parameters (m, 2)."""
        return self.surfaces.evaluate(face, self.wrap(face, parameters))

    def evaluate_partials(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """S, S_u and S_v at parameters (m, 2): shape (3, m, 3)."""
        return self.surfaces.evaluate_partials(face, self.wrap(face, parameters))

    def find_poles(self, face: Ints, points: FloatArray, tolerance: float) -> tuple[Ints, Ints]:
        """The axis and the end (m,) of the pole that is at each point (m, 3); axis −1 if none."""
        axis, end = np.full(len(face), -1), np.zeros(len(face), np.intp)
        for a, e in ((0, 0), (0, 1), (1, 0), (1, 1)):
            rows = self.is_pole[face, a, e].nonzero()[0]
            if len(rows):
                apart = length(points[rows] - self.pole_points[face[rows], a, e], -1)
                rows = rows[apart <= tolerance]
                axis[rows], end[rows] = a, e
        return axis, end

    @cached_property
    def pole_points(self) -> FloatArray:
        """The points (F, 2, 2, 3) of the first corner of each side; see `is_pole`."""
        low, high = self.low, self.surfaces.high
        corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), low, low], 1)
        corners[:, 3, 1] = high[:, 1]
        face = np.repeat(np.arange(len(low)), 4)
        return self.surfaces.evaluate(face, corners.reshape(-1, 2)).reshape(-1, 2, 2, 3)


def find_closure(surfaces: FaceSurfaces, tolerance: float) -> ClosedSurfaces:
    """Which axes of surfaces are closed, and which sides are points, up to a tolerance.

    Thin surfaces may be much narrower than the tolerance: sides are one, if they are apart by at
    most `THIN` of how far the surface goes between them, and a side is a point, if it is at most
    that share as long as the other side or the middle.
    """
    count = len(surfaces)
    is_closed, all_apart = np.zeros((count, 2), bool), np.zeros(count)
    is_pole = np.zeros((count, 2, 2), bool)
    faces = surfaces.faces
    curved = (~surfaces.is_planar).nonzero()[0]
    for axis in range(2) if len(curved) else ():
        along = faces.spans[1 - axis, curved]
        run, number = expand_runs(along)
        face = curved[run]
        step = faces.stride[face] if axis else 1
        near = faces.first[face] + number * step
        # The patches on the far side, and those in the middle.
        across = 1 if axis else faces.stride[face]
        last = faces.spans[axis, face] - 1
        patches = np.concatenate([near, near + last * across, near + (last + 1) // 2 * across])
        where = np.repeat([0.0, 1.0, 0.0], len(near))
        where[2 * len(near) :][last % 2 == 0] = 0.5
        points, weights = _take_rows(surfaces, patches, axis, where)
        begin, end, middle = points.reshape(3, len(near), *points.shape[1:])
        begin_weights, end_weights, _ = weights.reshape(3, len(near), *weights.shape[1:])
        starts = np.cumsum(along) - along
        apart, wide = _reach(begin, end, starts), _reach(begin, middle, starts)
        noise = NOISE * np.maximum.reduceat(np.abs([begin, end]).max(axis=(0, 2, 3)), starts)
        same_weights = (np.abs(begin_weights - end_weights) <= 1e-9).all(axis=1)
        same = np.logical_and.reduceat(same_weights, starts)
        is_closed[curved, axis] = (apart <= tolerance) & (apart <= THIN * wide) & same
        is_closed[curved, axis] &= wide > noise
        equal = np.logical_and.reduceat((begin_weights == end_weights).all(axis=1), starts)
        bound = np.where(equal, np.where(apart > 0.0, apart + noise, 0.0), np.inf)
        all_apart[curved] += np.where(is_closed[curved, axis], bound, 0.0)
        rows = begin, end, middle
        lengths = np.array([_reach(row, row[starts][:, :1][run], starts) for row in rows])
        limit = np.minimum(np.maximum(THIN * lengths.max(axis=0), noise), tolerance)
        is_pole[curved, axis] = (lengths[:2] <= limit).T
        # Of a torus that touches its axis both sides are one point, but it ends there.
        is_closed[:, axis] &= ~is_pole[:, axis].all(axis=1)
    return ClosedSurfaces(surfaces, is_closed, is_pole, all_apart)


def _reach(a: FloatArray, b: FloatArray, starts: Ints) -> FloatArray:
    """The largest distances between points of a and b, (r, n, 3), in each run of rows."""
    reach: FloatArray = np.maximum.reduceat(length(a - b, -1).max(axis=1), starts)
    return reach


def _take_rows(
    surfaces: FaceSurfaces, patch: Ints, axis: int, where: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points and relative weights of the rows of nets of patches across an axis.

    `where` is 0 for the first row, 1 for the last, and between them for a middle row. Rows are
    (r, n, 3), filled with their last points up to the longest row.
    """
    nets = surfaces.nets
    width = max((max(group.degree) for group in nets.groups), default=0) + 1
    points, weights = np.empty((len(patch), width, 3)), np.ones((len(patch), width))
    for group, rows in nets.split_by_group(patch):
        net = group.nets[nets.row[patch[rows]]]
        if axis:
            net = net.swapaxes(1, 2)
        at = np.rint(where[rows] * (net.shape[1] - 1)).astype(np.intp)
        line = net[np.arange(len(rows)), at]
        points[rows, : line.shape[1]] = project(line, -1)
        points[rows, line.shape[1] :] = project(line, -1)[:, -1:]
        if group.is_rational:
            weights[rows, : line.shape[1]] = line[..., 3] / line[:, :1, 3]
    return points + nets.middles[:, patch].T[:, np.newaxis], weights
