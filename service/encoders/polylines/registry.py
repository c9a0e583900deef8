"""The registry of formats of curves and of sections."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

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
) -> PolylineFormat[Lines]:
    """A format that is a format of meshes, too, with its name, media type and suffix.

    Without `title`, the title is that of the format of meshes.
    """
    fmt = BY_NAME[name]
    return PolylineFormat(
        fmt.name, title or fmt.title, fmt.media_type, fmt.suffix, fmt.is_float32, encode, byte_bound
    )


CURVE_FORMATS: tuple[CurveFormat, ...] = (
    _build("glb", gltf.encode_curve_glb, gltf.curve_glb_bound),
    _build("gltf", gltf.encode_curve_gltf, gltf.curve_gltf_bound),
    _build("json", json.encode_curve, json.curve_bound, "Points, tangents and lengths as JSON"),
    _build("oogl", oogl.encode_curve, oogl.curve_bound),
    _build("obj", obj.encode_curve, obj.curve_bound),
)
"""All formats of curves, in the order in which lists name them."""

CURVES_BY_NAME: Mapping[str, CurveFormat] = MappingProxyType({f.name: f for f in CURVE_FORMATS})
"""All formats of curves by name."""

SECTION_FORMATS: tuple[SectionFormat, ...] = (
    _build("glb", gltf.encode_sections_glb, gltf.sections_glb_bound),
    _build("gltf", gltf.encode_sections_gltf, gltf.sections_gltf_bound),
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
