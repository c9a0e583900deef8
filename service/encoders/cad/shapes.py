"""Splines that files can store in a simpler form: lines and planes."""

import numpy as np

from service.bases.arrays import Bools
from service.surface.spline_tables import CurveTable, SurfaceTable

FLAT = 1e-14
"""A bilinear surface is a plane if its fourth corner is that of a parallelogram, up to this share
of its size."""


def find_lines(table: CurveTable) -> Bools:
    """Which curves are segments of lines: degree 1, two control points, no weights."""
    is_line: Bools = (table.degrees == 1) & (table.counts == 2) & ~table.is_rational
    return is_line


def find_planes(table: SurfaceTable) -> Bools:
    """Which surfaces are planes: bilinear over a parallelogram that has an area."""
    is_plane: Bools = (
        (table.degrees == 1).all(axis=1) & (table.counts == 2).all(axis=1) & ~table.is_rational
    )
    rows = np.flatnonzero(is_plane)
    if len(rows):
        first = table.point_starts[:-1][rows]
        a, b, c, d = (table.points[first + k] for k in range(4))
        size = np.abs(np.stack([b - a, c - a])).max(axis=(0, 2))
        error = np.abs(a - b - c + d).max(axis=1)
        area = np.sqrt(np.square(np.cross(c - a, b - a)).sum(axis=1))
        is_plane[rows] = (error <= FLAT * size) & (area > FLAT * size**2)
    return is_plane
