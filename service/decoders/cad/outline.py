"""The outline of a face: where unbounded surfaces are cut.

A surface is cut to the outline of its own face alone, so that it is the same whatever else the file
holds. Curves lie in the convex hull of their control points, so an interval that has all
control points has the curves, too; a wedge of less than half a turn is convex, too.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import pi, tau
from operator import sub

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Frame
from service.decoders.cad.splines import project_points

MARGIN = 1e-3
"""How far surfaces go on beyond the outline, as a share of its size."""

LONG, RUNS = 2048, 128
"""Edges with more control points than `LONG` are enclosed in `RUNS` boxes."""

HALF_TURN = 1e-6
"""A wedge may be wider than half a turn by this angle, because of rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class Outline:
    """Points around the edges of a face.

    Attributes
    ----------
    hull : ndarray of float64, shape (k, 3)
        Control points of all edges, edge after edge along the loops.
    ends : ndarray of float64, shape (m, 3)
        The ends of all edges, and single vertices of the face: points on the surface.
    loop_sizes : tuple of int
        The number of rows of `hull` that belong to each loop; rows after these belong to none.
    middles : ndarray of float64, shape (n, 3), or None
        A point inside each edge, if they are known.
    """

    hull: FloatArray
    ends: FloatArray
    loop_sizes: tuple[int, ...] = ()
    middles: FloatArray | None = None

    @classmethod
    def of(cls, curves: Iterable[Curve]) -> "Outline":
        """The outline of curves of space in any order."""
        nets = [project_points(curve.points) for curve in curves]
        if not nets:
            return NO_OUTLINE
        return cls(np.concatenate(nets), np.concatenate([net[[0, -1]] for net in nets]))

    def __bool__(self) -> bool:
        return len(self.hull) > 0

    @property
    def on_surface(self) -> FloatArray:
        """All known points of edges, (n, 3)."""
        if self.middles is None:
            return self.ends
        return np.concatenate([self.ends, self.middles])

    def locate(self, frame: Frame) -> "LocalOutline":
        """The outline in the coordinates of a frame.

        Raises
        ------
        InvalidGeometry
            The outline is empty or a point: it bounds no surface.
        """
        if not self:
            raise InvalidGeometry("an unbounded surface has no edges")
        hull = frame.locate_all(self.hull)
        low, high = hull.min(axis=1).tolist(), hull.max(axis=1).tolist()
        size = max(map(sub, high, low))
        if not size > 0.0:
            raise InvalidGeometry("the edges of a face are one point")
        return LocalOutline(hull, low, high, size, self.loop_sizes)


@dataclass(frozen=True, eq=False, slots=True)
class LocalOutline:
    """An outline in the coordinates of a frame.

    Attributes
    ----------
    hull : ndarray of float64, shape (3, k)
        Coordinates of control points, as rows.
    low, high : list of three floats
        The box around them.
    size : float
        The longest side of the box.
    loop_sizes : tuple of int
        As in `Outline`.
    """

    hull: FloatArray
    low: list[float]
    high: list[float]
    size: float
    loop_sizes: tuple[int, ...]

    def find_range(self, axis: int) -> tuple[float, float]:
        """The range of a coordinate with a margin."""
        margin = MARGIN * self.size
        return self.low[axis] - margin, self.high[axis] + margin

    def find_angles(self) -> list[float]:
        """The angle of each control point about z, from x, −π to π."""
        angles: list[float] = np.arctan2(self.hull[1], self.hull[0]).tolist()
        return angles

    def count_turns(self, angles: Sequence[float]) -> int:
        """How often all loops together run around z, counter-clockwise; from all angles.

        A face on a cone that its loops run around, in sum, has the apex inside.
        """
        total, first = 0.0, 0
        for size in self.loop_sizes:
            last = angles[first + size - 1] if size else 0.0
            for angle in angles[first : first + size]:
                step = angle - last
                total += step - tau * round(step / tau)
                last = angle
            first += size
        return round(total / tau)


NO_OUTLINE = Outline(np.empty((0, 3)), np.empty((0, 3)))
"""The outline of a face without edges: its surface is bounded."""


def find_range(values: FloatArray, least: float = 0.0) -> tuple[float, float]:
    """The range of values (k,) with a margin, which is a share of the range or of `least`."""
    low, high = float(values.min()), float(values.max())
    margin = MARGIN * max(high - low, least)
    return low - margin, high + margin


def find_wedge(angles: Sequence[float]) -> tuple[float, float] | None:
    """The range of angles with a margin, or None if they span more than half a turn."""
    if not angles:
        return None
    ordered = sorted(angles)
    widest, first = ordered[0] + tau - ordered[-1], ordered[0]
    for before, after in pairwise(ordered):
        if after - before > widest:
            widest, first = after - before, after
    sweep = tau - widest
    if not 0.0 < sweep <= pi + HALF_TURN:
        return None
    margin = MARGIN * sweep
    return first - margin, first + sweep + margin


def enclose_points(net: FloatArray) -> FloatArray:
    """Points whose hull contains those of a net (k, 3): the net itself, unless it is long.

    The first and the last point stay. Between them are the corners of boxes around runs of points,
    so that an edge of a million points costs each face that it bounds no more than any other.
    """
    if len(net) <= LONG:
        return net
    first = np.arange(0, len(net), -(-len(net) // RUNS))
    low, high = (extreme.reduceat(net, first, axis=0) for extreme in (np.minimum, np.maximum))
    corners = np.stack([low, high], axis=1)
    choice = np.array(list(product((0, 1), repeat=3)))
    boxes = corners[:, choice, np.arange(3)].reshape(-1, 3)
    return np.concatenate([net[:1], boxes, net[-1:]])
