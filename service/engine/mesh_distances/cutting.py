"""Where pieces are cut, so that one triangle is near all of a part.

A piece over a triangle T is as far from T as its corners say. So pieces are cut by the planes
through the edges of T that are perpendicular to T. Of a piece over T another part may be nearer to
a second triangle; the two heights over the planes of the triangles are equal on a line, along which
it is cut. All other pieces are halved.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.mesh_distances.frames import TriangleFrames
from service.engine.mesh_distances.polygons import Polygons
from service.engine.vectors import Vectors

SNAP = 2.0**-40
"""In relation to the size of the coordinates: a corner at most this far from a cut is on it, so
that no piece is cut by rounding alone."""

LARGE = 4.0
"""Pieces that are longer than the triangles near them by this factor are large."""


class Cutter:
    """Cuts pieces whose corners are at most `reach` from the origin.

    The triangle near a piece is that in its slot of `frames`.
    """

    def __init__(self, frames: TriangleFrames, reach: float) -> None:
        self._frames, self._snap = frames, SNAP * (reach + frames.reach)

    def is_large(self, pieces: Polygons) -> Bools:
        """Whether pieces (m,) are much larger than the triangles near them."""
        low, high = _find_boxes(pieces)
        corners = self._frames.corners.take(pieces.slot, axis=2)
        sizes = (corners.max(axis=0) - corners.min(axis=0)).max(axis=0)
        large: Bools = (high - low).max(axis=0) > LARGE * sizes
        return large

    def is_apart(self, pieces: Polygons) -> Bools:
        """Whether pieces (m,) are outside of an edge of the triangles near them."""
        apart = np.zeros(len(pieces), np.bool_)
        for edge in range(3):
            outside = self._measure_outside(pieces, edge)
            apart |= np.minimum.reduceat(outside, pieces.starts) >= 0
        return apart

    def cut_edge(self, pieces: Polygons, edge: int) -> tuple[Polygons, Polygons]:
        """The parts of pieces inside and outside of an edge of the triangles near them."""
        return pieces.cut(self._measure_outside(pieces, edge))

    def cut_between(self, pieces: Polygons, slots: Ints, corners: Ints) -> list[Polygons]:
        """Cut pieces (m,) where the triangles near them and those in `slots` (m,) are equally near.

        Each piece has one of its corners in `corners` (m,). On the sides of this corner the heights
        over both triangles are counted as positive. A piece without a line of equal heights is
        halved.
        """
        owner, heights = pieces.owner, []
        for slot in (pieces.slot, slots):
            height = self._frames.measure_heights(pieces.corners, slot.take(owner))
            heights.append(height * np.sign(height[corners]).take(owner))
        difference = self._round(heights[0] - heights[1])
        is_cut = np.minimum.reduceat(difference, pieces.starts) < 0
        is_cut &= pieces.find_largest(difference) > 0
        parts: list[Polygons] = []
        if is_cut.any():
            parts += pieces.select(is_cut).cut(difference[is_cut.take(owner)])
        if not is_cut.all():
            parts += halve(pieces.select(~is_cut))
        return parts

    def _measure_outside(self, pieces: Polygons, edge: int) -> FloatArray:
        """How far the corners (N,) are outside of an edge of the triangles near their pieces."""
        slot = pieces.slot.repeat(pieces.sizes)
        return self._round(self._frames.measure_outside(pieces.corners, slot, edge))

    def _round(self, heights: FloatArray) -> FloatArray:
        """Replace the smallest heights by 0."""
        heights[np.abs(heights) <= self._snap] = 0.0
        return heights


def halve(pieces: Polygons) -> tuple[Polygons, Polygons]:
    """Cut pieces across the middle of their longest coordinate."""
    low, high = _find_boxes(pieces)
    axis, rows = (high - low).argmax(axis=0), np.arange(len(pieces))
    middle = (low + (high - low) / 2)[axis, rows]
    owner = pieces.owner
    heights = pieces.corners[axis.take(owner), np.arange(len(owner))] - middle.take(owner)
    # One cut more is counted, so that pieces that are too small to be halved end, too.
    return replace(pieces, cuts=pieces.cuts + 1).cut(heights)


def _find_boxes(pieces: Polygons) -> tuple[Vectors, Vectors]:
    """The least and the largest coordinates (3, m) of pieces."""
    low: Vectors = np.minimum.reduceat(pieces.corners, pieces.starts, axis=1)
    return low, np.maximum.reduceat(pieces.corners, pieces.starts, axis=1)
