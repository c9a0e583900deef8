"""Curves and sections as glTF 2.0: polylines of mode LINE_STRIP with an unlit material.

A curve is one node. Its attributes are POSITION, `_TANGENT`, `_PARAMETER` and `_ARC_LENGTH`.
`_TANGENT` is a VEC3; the attribute TANGENT of glTF is for textures. A closed curve repeats its
first point at the end with another parameter and arc length; so its mode is not LINE_LOOP.

Sections have a node and a mesh for each plane, and the mesh has a primitive for each polyline. If a
plane does not meet the surface, its node has no mesh. Each plane is in `extras` of its node.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives. KHR_materials_unlit.
"""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.encoders.content import SKIPPED_FACE_CHARS
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.columns import Column, to_single
from service.encoders.gltf.document import (
    LINE_STRIP,
    File,
    build_whole_document,
    root_placement,
)
from service.encoders.gltf.primitives import LINE_MATERIAL
from service.encoders.polylines.format import (
    PolylineSize,
    in_space,
    join_points,
    report_curve,
    report_sections,
)
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE
from service.engine.curves.polyline import SampledCurve
from service.engine.extent import choose_origin
from service.engine.sections.values import Sections
from service.engine.stored_positions import FLOAT32

POSITION_BYTES = 12
"""Bytes of a point in float32."""

CURVE_POINT_BYTES = POSITION_BYTES + 12 + 4 + 4
"""Bytes of a point of a curve: position, tangent, parameter and arc length in float32."""

POLYLINE_CHARS = 500 + 6 * FLOAT64_CHARS
"""The most characters of a primitive, its accessor and its buffer view."""


def bound_curve_text(size: PolylineSize) -> int:
    """The most bytes of headers, JSON and padding of a curve, without the buffer."""
    # float64: 8 in the report, 6 in the bounds of POSITION, 3 in the translation.
    # The name of the curve occurs 3 times: in the scene, the node and the mesh.
    return 4096 + 17 * FLOAT64_CHARS + 3 * LONGEST_ESCAPE * size.name_bytes


def bound_sections_text(size: PolylineSize) -> int:
    """The most bytes of headers, JSON and padding of sections, without the buffer."""
    planes = (300 + 4 * FLOAT64_CHARS) * size.planes
    lines = POLYLINE_CHARS * size.polylines + SKIPPED_FACE_CHARS * size.skipped
    return 4096 + 2 * LONGEST_ESCAPE * size.name_bytes + planes + lines


def build_curve(curve: SampledCurve) -> File:
    """The glTF document of a curve, and its buffer."""
    columns = {"POSITION": in_space(curve.points)}
    if curve.tangents is not None:
        columns["_TANGENT"] = in_space(curve.tangents)
    columns["_PARAMETER"] = curve.parameters[:, np.newaxis]
    if curve.arc_lengths is not None:
        columns["_ARC_LENGTH"] = curve.arc_lengths[:, np.newaxis]
    buffer = BufferBuilder()
    placement = root_placement(in_space(curve.origin[np.newaxis])[0], curve.up)
    arrays: JsonObject = {
        "nodes": [{"name": curve.name, "mesh": 0, **placement}],
        "meshes": [{"name": curve.name, "primitives": [_build_strip(columns, buffer)]}],
        "materials": [LINE_MATERIAL],
    }
    return build_whole_document(
        curve.name, report_curve(curve.report), arrays, buffer, EncodeOptions()
    )


def build_sections(sections: Sections) -> File:
    """The glTF document of some sections, and its buffer."""
    origin, rounding = _find_origin(sections)
    buffer = BufferBuilder()
    placement = root_placement(origin, sections.up, sections.metres_per_unit)
    children = list(range(1, len(sections.sections) + 1))
    root: JsonObject = {"name": sections.name, **placement, "children": children}
    nodes: list[JsonObject] = [root]
    meshes: list[JsonObject] = []
    for k, section in enumerate(sections.sections):
        normal, offset = sections.planes.normals[k].tolist(), float(sections.planes.offsets[k])
        node: JsonObject = {"name": f"section {k}", "extras": {"normal": normal, "offset": offset}}
        if section.polylines:
            node["mesh"] = len(meshes)
            strips = [
                _build_strip({"POSITION": line.points - origin}, buffer)
                for line in section.polylines
            ]
            meshes.append({"name": f"section {k}", "primitives": strips})
        nodes.append(node)
    arrays = {"nodes": nodes, "meshes": meshes, "materials": [LINE_MATERIAL] if meshes else []}
    return build_whole_document(
        sections.name, report_sections(sections, rounding), arrays, buffer, EncodeOptions()
    )


def _build_strip(columns: dict[str, RealArray], buffer: BufferBuilder) -> JsonObject:
    """The primitive of one polyline; the columns of its points are added to the buffer."""
    attributes = {
        name: (buffer.add_positions if name == "POSITION" else buffer.add)(
            Column(to_single(values))
        )
        for name, values in columns.items()
    }
    return {"attributes": attributes, "mode": LINE_STRIP, "material": 0}


def _find_origin(sections: Sections) -> tuple[FloatArray, float]:
    """The origin of points stored in float32, and the largest distance that rounding moves one."""
    points = join_points(sections.polylines)
    if not len(points):
        return np.zeros(3), 0.0
    low, high = points.min(axis=0), points.max(axis=0)
    origin = choose_origin(low, high)
    # Rounding moves each coordinate x by at most ε |x| / 2, so a point by less than ε max |x|.
    return origin, float(FLOAT32.eps) * float(np.abs(np.stack([low, high]) - origin).max())
