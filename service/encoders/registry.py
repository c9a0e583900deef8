"""The registry of all formats of meshes that the service writes.

To add a format, write its module and add an entry here. Content negotiation, suffixes, the list of
formats and the OpenAPI document are made from this table. `Format` explains the fields.
"""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders import json_mesh, npz, obj, off, oogl, ply, stl, threemf
from service.encoders.format import COMPACT_OPTIONS, Format
from service.encoders.gltf import scene as gltf_scene
from service.encoders.gltf.document import encode_gltf, glb_byte_bound, gltf_byte_bound
from service.encoders.gltf.glb import encode_glb
from service.encoders.oogl_patches import encode_patches
from service.surface.batches import ChannelKind

EVERYTHING: frozenset[ChannelKind] = frozenset({"colors", "uvs", "attribute"})
"""All kinds of channels."""

FORMATS: tuple[Format, ...] = (
    Format(
        name="glb",
        title="glTF 2.0, binary",
        media_type="model/gltf-binary",
        suffix="glb",
        is_float32=True,
        has_quads=False,
        has_overlays=True,
        encode=encode_glb,
        byte_bound=glb_byte_bound,
        encode_scene=gltf_scene.encode_glb_scene,
        carries=EVERYTHING,
        reads=COMPACT_OPTIONS,
    ),
    Format(
        name="gltf",
        title="glTF 2.0, one JSON document",
        media_type="model/gltf+json",
        suffix="gltf",
        is_float32=True,
        has_quads=False,
        has_overlays=True,
        encode=encode_gltf,
        byte_bound=gltf_byte_bound,
        encode_scene=gltf_scene.encode_gltf_scene,
        carries=EVERYTHING,
        reads=COMPACT_OPTIONS,
    ),
    Format(
        name="json",
        title="Vertices and faces as JSON",
        media_type="application/json",
        suffix="json",
        is_float32=False,
        has_quads=True,
        has_overlays=True,
        encode=json_mesh.encode,
        byte_bound=json_mesh.byte_bound,
        carries=EVERYTHING,
    ),
    Format(
        name="oogl",
        title="OOGL, read by Geomview",
        media_type="model/x-oogl",
        suffix="oogl",
        is_float32=False,
        has_quads=True,
        has_overlays=True,
        encode=oogl.encode,
        byte_bound=oogl.byte_bound,
        encode_exact=encode_patches,
        carries=frozenset({"colors", "uvs"}),
        coarseness=oogl.coarseness,
        reads=frozenset({"oogl"}),
    ),
    Format(
        name="stl",
        title="STL, binary",
        media_type="model/stl",
        suffix="stl",
        is_float32=True,
        has_quads=False,
        has_overlays=False,
        encode=stl.encode,
        byte_bound=stl.byte_bound,
        has_local_origin=False,
        has_exact_bound=True,
        reads=frozenset({"stl"}),
    ),
    Format(
        name="obj",
        title="Wavefront OBJ",
        media_type="model/obj",
        suffix="obj",
        is_float32=False,
        has_quads=True,
        has_overlays=True,
        encode=obj.encode,
        byte_bound=obj.byte_bound,
        carries=frozenset({"colors", "uvs"}),
    ),
    Format(
        name="ply",
        title="PLY, binary",
        media_type="model/x-ply",
        suffix="ply",
        is_float32=False,
        has_quads=True,
        has_overlays=False,
        encode=ply.encode,
        byte_bound=ply.byte_bound,
        carries=EVERYTHING,
    ),
    Format(
        name="off",
        title="OFF",
        media_type="model/x-off",
        suffix="off",
        is_float32=False,
        has_quads=True,
        has_overlays=False,
        encode=off.encode,
        byte_bound=off.byte_bound,
        carries=frozenset({"colors"}),
    ),
    Format(
        name="3mf",
        title="3MF, binary",
        media_type="model/3mf",
        suffix="3mf",
        is_float32=True,
        has_quads=False,
        has_overlays=False,
        encode=threemf.encode,
        byte_bound=threemf.byte_bound,
        encode_scene=threemf.encode_scene,
        carries=frozenset({"colors"}),
        repeats_meshes=True,
    ),
    Format(
        name="npz",
        title="Arrays of NumPy, binary",
        media_type="application/x-npz",
        suffix="npz",
        is_float32=False,
        has_quads=True,
        has_overlays=True,
        encode=npz.encode,
        byte_bound=npz.byte_bound,
        carries=EVERYTHING,
    ),
)
"""All formats of meshes, in the order in which lists name them."""

BY_NAME: Mapping[str, Format] = MappingProxyType({f.name: f for f in FORMATS})
"""All formats of meshes by name."""

BY_SUFFIX: Mapping[str, Format] = MappingProxyType({f.suffix: f for f in FORMATS})
"""All formats of meshes by suffix."""
