"""Measures of placed copies from those of their brep, where lengths are all scaled alike."""

from collections.abc import Sequence
from math import inf, nextafter

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.solids import Solid
from service.engine.measures.values import Interval
from service.engine.parts.measures.brep import BrepMeasures
from service.engine.scenes.placing import scalings

ALIKE = 2.0**-36
"""Scalings of a placement that differ by at most this share are one."""


def find_scaling(matrix: FloatArray | None) -> Interval | None:
    """The scaling of all lengths by a placement; None if it stretches directions differently."""
    if matrix is None:
        return Interval(1.0, 1.0, 1.0)
    low, high = scalings(matrix)
    if high - low > ALIKE * high:
        return None
    return Interval((low + high) / 2, nextafter(low, -inf), nextafter(high, inf))


def place_measures(measures: BrepMeasures, matrix: FloatArray, scaling: Interval) -> BrepMeasures:
    """The measures of a copy that is moved, turned, mirrored, and scaled alike in all directions.

    Volumes stay positive if the copy is mirrored: normals point out of the material still.
    """
    square = scaling.product(scaling)
    cube = square.product(scaling)

    def scale(intervals: Sequence[Interval], factor: Interval) -> list[Interval]:
        return [each.product(factor) for each in intervals]

    def place(solid: Solid) -> Solid:
        volume, centroid = solid
        if volume is None:
            return solid
        placed = None if centroid is None else place_point(centroid, matrix)
        return volume.product(cube), placed

    return BrepMeasures(
        scale(measures.areas, square),
        [place(solid) for solid in measures.solids],
        measures.edge_length.product(scaling),
        scale(measures.edge_lengths, scaling),
        measures.boundary_length.product(scaling),
        scale(measures.boundary_lengths, scaling),
        measures.borders,
        measures.uses,
    )


def place_point(point: Sequence[Interval], matrix: FloatArray) -> tuple[Interval, ...]:
    """Intervals of the coordinates of a placed point."""
    rows = []
    for *linear, shift in np.asarray(matrix[:3]).tolist():
        terms = [each.product(Interval(x, x, x)) for each, x in zip(point, linear, strict=True)]
        rows.append(Interval.total(terms).plus(shift))
    return tuple(rows)
