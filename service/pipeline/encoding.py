"""Which choices of the written form a request makes."""

from service.encoders.format import EncodeOptions
from service.encoders.gltf.meshopt import library_version
from service.schemas.options import MeshOptionFields


def encode_options(wanted: MeshOptionFields) -> EncodeOptions:
    """The part of the options that the encoders read."""
    return EncodeOptions(wanted.oogl, wanted.quantize, wanted.compression)


def written_by(wanted: MeshOptionFields) -> str:
    """What else the bytes depend on, beside surface, options and engine: a library's version."""
    return f"meshopt {library_version()}" if wanted.compression == "meshopt" else ""
