"""The registry of formats of curves."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from service.encoders.curves import gltf as curve_gltf
from service.encoders.curves import json as curve_json
from service.encoders.curves import obj as curve_obj
from service.encoders.curves import oogl as curve_oogl
from service.encoders.curves.format import CurveFormat, CurveSize
from service.encoders.registry import BY_NAME
from service.engine.curves.polyline import Polyline


def _as_of_meshes(
    name: str,
    encode: Callable[[Polyline], bytes],
    byte_bound: Callable[[CurveSize], int],
    title: str = "",
) -> CurveFormat:
    """A format that meshes have too, with the same name, media type and suffix."""
    fmt = BY_NAME[name]
    return CurveFormat(
        fmt.name, title or fmt.title, fmt.media_type, fmt.suffix, fmt.single, encode, byte_bound
    )


CURVE_FORMATS: tuple[CurveFormat, ...] = (
    _as_of_meshes("glb", curve_gltf.encode_glb, curve_gltf.glb_byte_bound),
    _as_of_meshes("gltf", curve_gltf.encode_gltf, curve_gltf.gltf_byte_bound),
    _as_of_meshes(
        "json", curve_json.encode, curve_json.byte_bound, "Points, tangents and lengths as JSON"
    ),
    _as_of_meshes("oogl", curve_oogl.encode, curve_oogl.byte_bound),
    _as_of_meshes("obj", curve_obj.encode, curve_obj.byte_bound),
)
"""In the order of lists; texts are UTF-8."""

CURVES_BY_NAME: Mapping[str, CurveFormat] = MappingProxyType({f.name: f for f in CURVE_FORMATS})
