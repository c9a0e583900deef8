"""The registry of formats of sections."""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders.lines import LineFormat, line_format
from service.encoders.sections import files, gltf, svg
from service.encoders.sections.format import SectionFormat

SECTION_FORMATS: tuple[SectionFormat, ...] = (
    line_format("glb", gltf.encode_glb, gltf.glb_bound),
    line_format("gltf", gltf.encode_gltf, gltf.gltf_bound),
    line_format("json", files.encode_json, files.json_bound, "Hits, or polylines, as JSON"),
    line_format("oogl", files.encode_oogl, files.oogl_bound),
    line_format("obj", files.encode_obj, files.obj_bound),
    LineFormat(
        "svg", "SVG in the planes", "image/svg+xml", "svg", False, svg.encode_svg, svg.svg_bound
    ),
)
"""All formats of sections, in the order in which lists name them."""

SECTIONS_BY_NAME: Mapping[str, SectionFormat] = MappingProxyType(
    {fmt.name: fmt for fmt in SECTION_FORMATS}
)
"""All formats of sections by name."""
