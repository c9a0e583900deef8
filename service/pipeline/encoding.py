"""Which choices of the written form a request makes."""

from service.encoders.format import EncodeOptions
from service.schemas.options import MeshOptionFields


def encode_options(wanted: MeshOptionFields) -> EncodeOptions:
    """The part of the options that the encoders read."""
    return EncodeOptions(wanted.oogl, wanted.quantize, wanted.compression)
