"""The registry of formats of sections."""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders.lines import LineFormat, line_format
from service.encoders.sections import files, gltf, svg
from service.encoders.sections.format import SectionFormat

SECTION_FORMATS: tuple[SectionFormat, ...] = (
    line_format("glb", gltf.encode_glb, gltf.glb_bound),
    line_format("gltf", gltf.encode_gltf, gltf.gltf_bound),
    # The hits of rays are in the same list of formats; they are written as JSON only.
    line_format("json", files.encode_json, files.json_bound, "Hits, or polylines, as JSON"),
    line_format("oogl", files.encode_oogl, files.oogl_bound),
    line_format("obj", files.encode_obj, files.obj_bound),
    LineFormat(
        name="svg",
        title="SVG in the planes",
        media_type="image/svg+xml",
        suffix="svg",
        is_float32=False,
        encode=svg.encode_svg,
        byte_bound=svg.svg_bound,
    ),
)
"""All formats of sections, in the order in which lists name them."""

SECTIONS_BY_NAME: Mapping[str, SectionFormat] = MappingProxyType(
    {fmt.name: fmt for fmt in SECTION_FORMATS}
)
"""All formats of sections by name."""
