"""Every kind of file with control nets that is read: the one place that knows them all.

To add a kind, write its module and a line here; media types, suffixes, refusals and the OpenAPI
document follow from this table. JSON is none of them: it carries whole requests.
"""

from collections.abc import Mapping
from types import MappingProxyType

from service.decoders import npy, oogl, teapot
from service.decoders.format import Decoder

DECODERS: tuple[Decoder, ...] = (
    Decoder(
        name="npy",
        title="NumPy array",
        media_type="application/x-npy",
        suffixes=("npy",),
        binary=True,
        kinds=npy.KINDS,
        decode=npy.decode,
        weight=8,
    ),
    Decoder(
        name="oogl",
        title="Bézier patches as OOGL, BEZ and BBP, text",
        media_type="model/x-oogl",
        suffixes=("bez", "bbp", "oogl"),
        binary=False,
        kinds=oogl.KINDS,
        decode=oogl.decode,
        weight=24,
    ),
    Decoder(
        name="teapot",
        title="The text of the Utah teapot: indices of patches, then vertices",
        media_type="text/x-teapot",
        suffixes=("teapot",),
        binary=False,
        kinds=teapot.KINDS,
        decode=teapot.decode,
        weight=24,
    ),
)
"""In the order in which they are listed."""

BY_NAME: Mapping[str, Decoder] = MappingProxyType({d.name: d for d in DECODERS})
BY_SUFFIX: Mapping[str, Decoder] = MappingProxyType(
    {suffix: decoder for decoder in DECODERS for suffix in decoder.suffixes}
)
