"""Every format that curves are written in, as `registry` has those of meshes."""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders.curves import gltf as curve_gltf
from service.encoders.curves import json as curve_json
from service.encoders.curves import obj as curve_obj
from service.encoders.curves import oogl as curve_oogl
from service.encoders.curves.format import CurveFormat

CURVE_FORMATS: tuple[CurveFormat, ...] = (
    CurveFormat(
        name="glb",
        title="glTF 2.0, binary",
        media_type="model/gltf-binary",
        suffix="glb",
        single=True,
        encode=curve_gltf.encode_glb,
        byte_bound=curve_gltf.glb_byte_bound,
    ),
    CurveFormat(
        name="gltf",
        title="glTF 2.0, one JSON document",
        media_type="model/gltf+json",
        suffix="gltf",
        single=True,
        encode=curve_gltf.encode_gltf,
        byte_bound=curve_gltf.gltf_byte_bound,
    ),
    CurveFormat(
        name="json",
        title="Points, tangents and lengths as JSON",
        media_type="application/json",
        suffix="json",
        single=False,
        encode=curve_json.encode,
        byte_bound=curve_json.byte_bound,
    ),
    CurveFormat(
        name="oogl",
        title="OOGL, read by Geomview",
        media_type="model/x-oogl",
        suffix="oogl",
        single=False,
        encode=curve_oogl.encode,
        byte_bound=curve_oogl.byte_bound,
    ),
    CurveFormat(
        name="obj",
        title="Wavefront OBJ",
        media_type="model/obj",
        suffix="obj",
        single=False,
        encode=curve_obj.encode,
        byte_bound=curve_obj.byte_bound,
    ),
)
"""In the order in which they are listed; texts are UTF-8."""

CURVES_BY_NAME: Mapping[str, CurveFormat] = MappingProxyType({f.name: f for f in CURVE_FORMATS})
