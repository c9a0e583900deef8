"""Which choices of the written form a request makes."""

from service.encoders.compression import made_by
from service.encoders.format import EncodeOptions
from service.pipeline.arithmetic import arithmetic
from service.schemas.options import MeshOptionFields


def encode_options(wanted: MeshOptionFields) -> EncodeOptions:
    """The part of the options that the encoders read."""
    return EncodeOptions(wanted.oogl, wanted.quantize, wanted.compression)


def written_by(wanted: MeshOptionFields) -> str:
    """What else the bytes depend on, beside surface, options and engine: libraries, processor."""
    return f"{arithmetic()} {made_by(wanted.compression)}"
