"""Scales of the Delaunay test: triangles are long where the surface is straight.

The test compares distances of places. Places are scaled to distances in space first, then so that
the cells of the face (`inner_points`) become squares. Factors are powers of two, so that scaled
places stay exact.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.places import SIZE, Places
from service.engine.vectors import length

SAMPLES = 3
"""A face has this many samples of its speed, squared."""

MOST = 1e4
"""The largest ratio of the sides of cells that is followed."""

STEP = 1000
"""The speed is taken over the STEP-th part of the box."""


def find_scales(surface: Places, low: Ints, high: Ints, cells: FloatArray) -> FloatArray:
    """Powers of two (F,) by which v is multiplied for the Delaunay test.

    Parameters
    ----------
    surface : Places
    low, high : ndarray of int, shape (F, 2)
        The boxes of the polygons of faces.
    cells : ndarray of float64, shape (F, 2)
        Typical sides of the cells of faces, in places.
    """
    count = len(low)
    grid = np.linspace(0.1, 0.9, SAMPLES)
    shares = np.array([grid.repeat(SAMPLES), np.concatenate([grid] * SAMPLES)]).T
    places = np.rint(low[:, np.newaxis] + shares * (high - low)[:, np.newaxis]).astype(np.intp)
    step = np.maximum(1, (high - low).max(axis=1) // STEP)
    moved = np.repeat(places[np.newaxis], 3, axis=0)
    for axis in (0, 1):
        moved[axis + 1, ..., axis] += step[:, np.newaxis]
    faces = np.tile(np.arange(count).repeat(len(shares)), 3)
    points = surface.evaluate(faces, np.minimum(moved, SIZE).reshape(-1, 2)).reshape(
        3, count, -1, 3
    )
    squares = np.square(length(points[1:] - points[0], -1)).mean(axis=2)
    speeds = np.maximum(np.sqrt(squares) / step, 1e-300)
    ratio = speeds[0] / speeds[1]
    shape = np.clip(cells[:, 1] / cells[:, 0] / ratio, 1 / MOST, MOST)
    scales: FloatArray = np.exp2(np.rint(-np.log2(ratio * shape)))
    return scales
