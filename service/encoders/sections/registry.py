"""The registry of formats of sections."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from service.encoders.registry import BY_NAME
from service.encoders.sections import files, gltf, svg
from service.encoders.sections.format import SectionFormat, SectionSize
from service.engine.sections.section import Sections


def _as_of_meshes(
    name: str,
    encode: Callable[[Sections], bytes],
    byte_bound: Callable[[SectionSize], int],
    title: str = "",
) -> SectionFormat:
    """A format that meshes have too, with the same name, media type and suffix."""
    fmt = BY_NAME[name]
    return SectionFormat(
        fmt.name, title or fmt.title, fmt.media_type, fmt.suffix, fmt.single, encode, byte_bound
    )


SECTION_FORMATS: tuple[SectionFormat, ...] = (
    _as_of_meshes("glb", gltf.encode_glb, gltf.glb_bound),
    _as_of_meshes("gltf", gltf.encode_gltf, gltf.gltf_bound),
    _as_of_meshes("json", files.encode_json, files.json_bound, "Hits, or polylines, as JSON"),
    _as_of_meshes("oogl", files.encode_oogl, files.oogl_bound),
    _as_of_meshes("obj", files.encode_obj, files.obj_bound),
    SectionFormat(
        "svg", "SVG in the planes", "image/svg+xml", "svg", False, svg.encode_svg, svg.svg_bound
    ),
)
"""In the order of lists; texts are UTF-8."""

SECTIONS_BY_NAME: Mapping[str, SectionFormat] = MappingProxyType(
    {fmt.name: fmt for fmt in SECTION_FORMATS}
)
