"""Curves and surfaces as STEP entities: B-splines, lines and planes.

References
----------
ISO 10303-42, Geometric and topological representation: curves and surfaces.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.encoders.cad.step_records import (
    Records,
    write_net,
    write_reals,
    write_references,
)
from service.surface.spline_tables import CurveTable, SurfaceTable

NO_FORM = ".UNSPECIFIED."


def write_curves(records: Records, table: CurveTable) -> list[int]:
    """B-spline curves of space, or in parameters; returns the number of each."""
    first = records.add_points(table.points) if len(table) else 0
    starts, knot_starts = table.point_starts.tolist(), table.knot_starts.tolist()
    degrees, is_rational = table.degrees.tolist(), table.is_rational.tolist()
    numbers = []
    for k, degree in enumerate(degrees):
        begin, end = starts[k], starts[k + 1]
        points = write_references(range(first + begin, first + end))
        counts, knots = write_knots(table.knots[knot_starts[k] : knot_starts[k + 1]])
        head = f"{degree},{points},{NO_FORM},.F.,.F."
        tail = f"{counts},{knots},{NO_FORM}"
        if not is_rational[k]:
            record = f"B_SPLINE_CURVE_WITH_KNOTS('',{head},{tail})"
        else:
            weights = write_reals(table.weights[begin:end])
            record = (
                f"(BOUNDED_CURVE() B_SPLINE_CURVE({head}) B_SPLINE_CURVE_WITH_KNOTS({tail}) "
                "CURVE() GEOMETRIC_REPRESENTATION_ITEM() "
                f"RATIONAL_B_SPLINE_CURVE({weights}) REPRESENTATION_ITEM(''))"
            )
        numbers.append(records.add(record))
    return numbers


def write_line(records: Records, begin: FloatArray, end: FloatArray) -> tuple[int, float]:
    """The line from one point to another, by its arc length; returns its number and length."""
    vector = end - begin
    length = float(np.sqrt(np.square(vector).sum()))
    point = records.add_points(begin[np.newaxis])
    direction = write_direction(records, vector / length)
    unit = records.add(f"VECTOR('',#{direction},1.)")
    return records.add(f"LINE('',#{point},#{unit})"), length


def write_direction(records: Records, direction: FloatArray) -> int:
    """A direction; returns its number."""
    return records.add(f"DIRECTION('',{write_reals(direction)})")


def write_axes(records: Records, point: FloatArray, axis: FloatArray, along: FloatArray) -> int:
    """A placement by its origin, its z axis and its x axis; returns its number."""
    origin = records.add_points(point[np.newaxis])
    z, x = write_direction(records, axis), write_direction(records, along)
    return records.add(f"AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})")


def write_knots(knots: FloatArray) -> tuple[str, str]:
    """The multiplicities, and the distinct knots."""
    is_new = np.append(True, knots[1:] != knots[:-1])
    begins = np.flatnonzero(is_new)
    counts = np.diff(np.append(begins, len(knots)))
    return f"({','.join(map(str, counts.tolist()))})", write_reals(knots[begins])


def write_surfaces(records: Records, table: SurfaceTable, is_plane: Bools) -> list[int]:
    """B-spline surfaces and planes; returns the number of each."""
    numbers = np.zeros(len(table), np.intp)
    planes, others = np.flatnonzero(is_plane), np.flatnonzero(~is_plane)
    starts = table.point_starts
    for face in planes.tolist():
        a, b, c = table.points[starts[face] : starts[face] + 3]
        normal = np.cross(c - a, b - a)
        along = (c - a) / np.sqrt(np.square(c - a).sum())
        axes = write_axes(records, a, normal / np.sqrt(np.square(normal).sum()), along)
        numbers[face] = records.add(f"PLANE('',#{axes})")
    if len(others):
        numbers[others] = _write_splines(records, table.select(others))
    return numbers.tolist()


def _write_splines(records: Records, table: SurfaceTable) -> Ints:
    """B-spline surfaces; returns the number of each."""
    first = records.add_points(table.points)
    starts, knot_starts = table.point_starts.tolist(), table.knot_starts.tolist()
    degrees, counts = table.degrees.tolist(), table.counts.tolist()
    is_rational = table.is_rational.tolist()
    numbers = []
    for k, ((p, q), (rows, columns)) in enumerate(zip(degrees, counts, strict=True)):
        net = write_net(first + starts[k], rows, columns)
        (counts_u, u), (counts_v, v) = (
            write_knots(table.knots[knot_starts[2 * k + axis] : knot_starts[2 * k + axis + 1]])
            for axis in range(2)
        )
        head = f"{p},{q},{net},{NO_FORM},.F.,.F.,.F."
        tail = f"{counts_u},{counts_v},{u},{v},{NO_FORM}"
        if not is_rational[k]:
            record = f"B_SPLINE_SURFACE_WITH_KNOTS('',{head},{tail})"
        else:
            weights = table.weights[starts[k] : starts[k + 1]].reshape(rows, columns)
            lists = ",\n".join(map(write_reals, weights))
            record = (
                f"(BOUNDED_SURFACE() B_SPLINE_SURFACE({head}) B_SPLINE_SURFACE_WITH_KNOTS({tail}) "
                "GEOMETRIC_REPRESENTATION_ITEM() "
                f"RATIONAL_B_SPLINE_SURFACE(({lists})) REPRESENTATION_ITEM('') SURFACE())"
            )
        numbers.append(records.add(record))
    return np.array(numbers, np.intp)
