"""Upper bounds of the bytes of STEP and IGES files, from counts alone.

A number takes at most 24 characters and a comma. The bytes for each count are rounded up from the
longest records that the encoders write.
"""

from collections.abc import Iterator

import numpy as np

from service.encoders.cad.assembly import Assembly, Definition
from service.surface.brep_model import BrepModel
from service.surface.sizes import NUMBER, SurfaceSize
from service.surface.spline_tables import find_starts

NAME_FACTOR = 12
"""The most characters of a byte of UTF-8 in a string: X2 and X0 between backslashes, 4 digits."""

FILE_BYTES, DEFINITION_BYTES, INSTANCE_BYTES, COLOR_BYTES = 4_000, 2_000, 2_000, 700
"""Bytes for a file, a definition, an instance, and a colour, without their names."""

POINT, PARAMETERS, KNOT, WEIGHT = 125, 100, 30, 25
"""Bytes in STEP of a control point with the reference to it, of one in parameters, of a knot with
its multiplicity, and of a weight."""

VERTEX, EDGE, COEDGE, LOOP, FACE, SHELL = 170, 450, 320, 100, 700, 400
"""Bytes in STEP beside control points and knots."""

REAL, ENTITY = 41, 400
"""Bytes in IGES of a number, of which a record of 81 bytes has at least two; and of an entity
beside its numbers."""

NET_BYTES = 8_000
"""Bytes of a face of a surface without trims, with its edges, in both formats."""


def bound_step(assembly: Assembly) -> int:
    """The most bytes of a STEP file."""
    definitions = sum(map(_bound_step_definition, assembly.definitions))
    return FILE_BYTES + definitions + _bound_instances(assembly)


def bound_iges(assembly: Assembly) -> int:
    """The most bytes of an IGES file."""
    definitions = sum(map(_bound_iges_definition, assembly.definitions))
    return FILE_BYTES + definitions + _bound_instances(assembly)


def estimate_bytes(size: SurfaceSize) -> int:
    """About the most bytes of a file in either format, before the surface is lowered."""
    numbers = size.surface_bytes // NUMBER
    return (
        FILE_BYTES
        + 2 * REAL * numbers
        + (POINT + WEIGHT) * size.net_points
        + NET_BYTES * size.nets
        + (EDGE + VERTEX) * size.edges
        + (COEDGE + ENTITY) * size.coedges
        + (DEFINITION_BYTES + INSTANCE_BYTES) * size.members
        + 2 * NAME_FACTOR * (size.name_bytes + size.label_bytes)
    )


def _bound_instances(assembly: Assembly) -> int:
    names = [assembly.name, *(instance.name for instance in assembly.instances)]
    return INSTANCE_BYTES * len(names) + 3 * NAME_FACTOR * sum(map(_count_bytes, names))


def _count_bytes(name: str) -> int:
    return len(name.encode())


def _bound_names(definition: Definition) -> int:
    names = [definition.name, *_list_names(definition)]
    return 3 * NAME_FACTOR * sum(map(_count_bytes, names))


def _list_names(definition: Definition) -> Iterator[str]:
    for body in definition.bodies:
        yield body.name
        yield from body.face_names


def _bound_step_definition(definition: Definition) -> int:
    """The bytes of a definition in STEP."""
    bodies = sum(map(_bound_step_body, definition.bodies))
    return DEFINITION_BYTES + bodies + _bound_names(definition)


def _bound_step_body(body: BrepModel) -> int:
    points = len(body.surfaces.points) + len(body.curves.points)
    knots = len(body.surfaces.knots) + len(body.curves.knots) + len(body.pcurves.knots)
    return (
        (POINT + WEIGHT) * points
        + (PARAMETERS + WEIGHT) * len(body.pcurves.points)
        + KNOT * knots
        + VERTEX * len(body.vertices)
        + EDGE * len(body.edge_vertices)
        + COEDGE * len(body.coedge_edges)
        + LOOP * len(body.loop_counts)
        + FACE * body.face_count
        + SHELL * (len(body.shell_counts) + 1)
        + COLOR_BYTES * (len(body.palette) + 1)
    )


def _bound_iges_definition(definition: Definition) -> int:
    """The bytes of a definition in IGES."""
    bodies = sum(map(_bound_iges_body, definition.bodies))
    return DEFINITION_BYTES + bodies + _bound_names(definition)


def _bound_iges_body(body: BrepModel) -> int:
    """The bytes of a brep in IGES: the curve of an edge is written for each of its uses."""
    curves = body.edge_curves[body.coedge_edges]
    curves = curves[curves >= 0]
    knots = np.diff(find_starts(body.curves.counts + body.curves.degrees + 1))
    numbers = 4 * len(body.surfaces.points) + len(body.surfaces.knots) + 8 * body.face_count
    numbers += int((4 * body.curves.counts + knots + 8)[curves].sum())
    numbers += 6 * len(body.coedge_edges)
    entities = 2 * len(body.coedge_edges) + 3 * len(body.loop_counts) + 3 * body.face_count
    return (
        REAL * numbers
        + ENTITY * entities
        + COLOR_BYTES * (len(body.palette) + 1)
        + SHELL * len(body.shell_counts)
    )
