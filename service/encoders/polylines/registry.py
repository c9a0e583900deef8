"""The registry of formats of curves and of sections."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from service.encoders.gltf.document import File, write_gltf
from service.encoders.gltf.glb import write_glb
from service.encoders.polylines import gltf, json, obj, oogl, svg
from service.encoders.polylines.format import (
    CurveFormat,
    Lines,
    PolylineFormat,
    PolylineSize,
    SectionFormat,
)
from service.encoders.registry import BY_NAME


def _build(
    name: str,
    encode: Callable[[Lines], bytes],
    byte_bound: Callable[[PolylineSize], int],
    title: str = "",
    *,
    has_columns: bool = False,
) -> PolylineFormat[Lines]:
    """A format that is a format of meshes, too, with its name, media type and suffix.

    Without `title`, the title is that of the format of meshes.
    """
    fmt = BY_NAME[name]
    return PolylineFormat(
        fmt.name,
        title or fmt.title,
        fmt.media_type,
        fmt.suffix,
        fmt.is_float32,
        encode,
        byte_bound,
        has_columns,
    )


def _build_gltf(
    build: Callable[[Lines], File], text_bound: Callable[[PolylineSize], int], point_bytes: int
) -> tuple[PolylineFormat[Lines], PolylineFormat[Lines]]:
    """The two forms of glTF: a binary file, and one JSON document with the buffer as base64.

    `text_bound` bounds the bytes of all but the buffer, which has `point_bytes` for each point.
    """

    def encode_glb(lines: Lines) -> bytes:
        return bytes(write_glb(*build(lines)))

    def encode_gltf(lines: Lines) -> bytes:
        return write_gltf(*build(lines))

    def glb_bound(size: PolylineSize) -> int:
        return text_bound(size) + size.points * point_bytes

    def gltf_bound(size: PolylineSize) -> int:
        # base64 writes 3 bytes as 4 characters.
        return text_bound(size) + 4 + size.points * point_bytes // 3 * 4

    return _build("glb", encode_glb, glb_bound), _build("gltf", encode_gltf, gltf_bound)


CURVE_FORMATS: tuple[CurveFormat, ...] = (
    *_build_gltf(gltf.build_curve, gltf.bound_curve_text, gltf.CURVE_POINT_BYTES),
    _build(
        "json",
        json.encode_curve,
        json.curve_bound,
        "Points, tangents and lengths as JSON",
        has_columns=True,
    ),
    _build("oogl", oogl.encode_curve, oogl.curve_bound),
    _build("obj", obj.encode_curve, obj.curve_bound),
)
"""All formats of curves, in the order in which lists name them."""

CURVES_BY_NAME: Mapping[str, CurveFormat] = MappingProxyType({f.name: f for f in CURVE_FORMATS})
"""All formats of curves by name."""

SECTION_FORMATS: tuple[SectionFormat, ...] = (
    *_build_gltf(gltf.build_sections, gltf.bound_sections_text, gltf.POSITION_BYTES),
    # The hits of rays are in the same list of formats; they are written as JSON only.
    _build("json", json.encode_sections, json.sections_bound, "Hits, or polylines, as JSON"),
    _build("oogl", oogl.encode_sections, oogl.sections_bound),
    _build("obj", obj.encode_sections, obj.sections_bound),
    PolylineFormat(
        name="svg",
        title="SVG in the planes",
        media_type="image/svg+xml",
        suffix="svg",
        is_float32=False,
        encode=svg.encode_sections,
        byte_bound=svg.sections_bound,
    ),
)
"""All formats of sections, in the order in which lists name them."""

SECTIONS_BY_NAME: Mapping[str, SectionFormat] = MappingProxyType(
    {fmt.name: fmt for fmt in SECTION_FORMATS}
)
"""All formats of sections by name."""
