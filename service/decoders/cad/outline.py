"""The outline of a face: where unbounded surfaces are cut.

A surface is cut to the outline of its own face alone, so that it is the same whatever else the file
holds. Curves lie in the convex hull of their control points, so an interval that has all
control points has the curves, too; a wedge of less than half a turn is convex, too.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import pi, tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Frame
from service.decoders.cad.splines import project_points

MARGIN = 1e-3
"""How far surfaces go on beyond the outline, as a share of its size along the same axis."""

HALF_TURN = 1e-6
"""A wedge may be wider than half a turn by this angle, because of rounding."""


@dataclass(frozen=True, eq=False)
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
    """

    hull: FloatArray
    ends: FloatArray
    loop_sizes: tuple[int, ...] = ()

    @classmethod
    def of(cls, curves: Iterable[Curve]) -> "Outline":
        """The outline of curves of space in any order."""
        nets = [project_points(curve.points) for curve in curves]
        if not nets:
            return NO_OUTLINE
        return cls(np.concatenate(nets), np.concatenate([net[[0, -1]] for net in nets]))

    def __bool__(self) -> bool:
        return len(self.hull) > 0

    @cached_property
    def size(self) -> float:
        """The longest side of the box around the outline.

        Raises
        ------
        InvalidGeometry
            The outline is empty or a point: it bounds no surface.
        """
        if not self:
            raise InvalidGeometry("an unbounded surface has no edges")
        size = float((self.hull.max(axis=0) - self.hull.min(axis=0)).max())
        if not size > 0.0:
            raise InvalidGeometry("the edges of a face are one point")
        return size

    def count_turns(self, frame: Frame) -> int:
        """How often all loops together run around the z axis of a frame, counter-clockwise.

        A face on a cone that its loops run around, in sum, has the apex inside.
        """
        x, y, _ = frame.locate_all(self.hull)
        angles = np.arctan2(y, x)
        total, first = 0.0, 0
        for size in self.loop_sizes:
            own = angles[first : first + size]
            steps = np.diff(own, append=own[:1])
            total += float((steps - tau * np.round(steps / tau)).sum())
            first += size
        return round(total / tau)


NO_OUTLINE = Outline(np.empty((0, 3)), np.empty((0, 3)))
"""The outline of a face without edges: its surface is bounded."""


def find_range(values: FloatArray, least: float = 0.0) -> tuple[float, float]:
    """The range of values (k,) with a margin; `least` is the least length that the margin is of."""
    low, high = float(values.min()), float(values.max())
    margin = MARGIN * max(high - low, least)
    return low - margin, high + margin


def find_wedge(angles: FloatArray) -> tuple[float, float] | None:
    """The range of angles (k,) with a margin, or None if they span more than half a turn."""
    ordered = np.sort(angles)
    steps = np.diff(ordered, append=ordered[0] + tau)
    widest = int(steps.argmax())
    if steps[widest] < pi - HALF_TURN:
        return None
    first = ordered.item((widest + 1) % len(ordered))
    sweep = tau - steps.item(widest)
    if not sweep > 0.0:
        return None
    margin = MARGIN * sweep
    return first - margin, first + sweep + margin
