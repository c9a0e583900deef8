"""The registry of formats of curves."""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders.curves import gltf as curve_gltf
from service.encoders.curves import json as curve_json
from service.encoders.curves import obj as curve_obj
from service.encoders.curves import oogl as curve_oogl
from service.encoders.curves.format import CurveFormat
from service.encoders.lines import line_format

CURVE_FORMATS: tuple[CurveFormat, ...] = (
    line_format("glb", curve_gltf.encode_glb, curve_gltf.glb_byte_bound),
    line_format("gltf", curve_gltf.encode_gltf, curve_gltf.gltf_byte_bound),
    line_format(
        "json", curve_json.encode, curve_json.byte_bound, "Points, tangents and lengths as JSON"
    ),
    line_format("oogl", curve_oogl.encode, curve_oogl.byte_bound),
    line_format("obj", curve_obj.encode, curve_obj.byte_bound),
)
"""All formats of curves, in the order in which lists name them."""

CURVES_BY_NAME: Mapping[str, CurveFormat] = MappingProxyType({f.name: f for f in CURVE_FORMATS})
"""All formats of curves by name."""
