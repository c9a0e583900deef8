"""The registry of decoders: all formats of files with control nets that the service reads.

To add a format, write its module and add an entry here. Media types, suffixes, error messages and
the OpenAPI document are made from this table. JSON is not in the table, because a JSON body is a
whole request, not a file.
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
        is_binary=True,
        kinds=npy.KINDS,
        decode=npy.decode,
        about="A file that `numpy.save` writes, of float32 or float64, in either byte order and"
        " either order of axes. An array (p+1, q+1, 3) is one control net: of a Bézier patch or, "
        "with `type=bspline`, of a B-spline. An array (P, p+1, q+1, 3) is P Bézier patches, which "
        "meet where their control points are equal. If a point has 4 numbers, the last is its "
        "weight; the other three are not multiplied by the weight. Errors have pointers into the "
        "equivalent JSON document: `/surface/control_net/i/j/k` for one net, and "
        "`/surface/vertices/n/k` for the n-th point of several patches.",
        memory_factor=8,  # patches of float32 take 7.7: as float64, with their indices
    ),
    Decoder(
        name="oogl",
        title="Bézier patches as OOGL, BEZ and BBP, text",
        media_type="model/x-oogl",
        suffixes=("bez", "bbp", "oogl"),
        is_binary=False,
        kinds=oogl.KINDS,
        decode=oogl.decode,
        about="A BEZ or BBP object of OOGL, or a LIST of these, in ASCII: any number of Bézier "
        "patches. Among control points, u varies fastest; a point with 4 numbers is (wx, wy, wz, "
        "w). Texture coordinates and colours of the corners are read; lines and appearances are "
        "skipped. Patches of several degrees become a `group`. Errors name the line. The service "
        "reads the files that it writes with `oogl=bez`.",
        memory_factor=24,  # a LIST of objects with one patch each takes 21
        example=(
            "A quarter of a cylinder, exactly: degrees (2, 1), weights",
            "BEZ214\n1 0 0 1  1 1 0 1  0 2 0 2\n1 0 1 1  1 1 1 1  0 2 2 2\n",
        ),
    ),
    Decoder(
        name="teapot",
        title="The text of the Utah teapot: indices of patches, then vertices",
        media_type="text/x-teapot",
        suffixes=("teapot",),
        is_binary=False,
        kinds=teapot.KINDS,
        decode=teapot.decode,
        about="The text form of the Utah teapot: the number of patches; for each patch its vertex"
        " numbers, counted from 1, (p+1)² for degree p, in one line or in p + 1 lines; the number"
        " of vertices; x, y and z of each vertex. Commas or blanks separate the numbers. Errors"
        " name the line.",
        memory_factor=24,  # numbers of one digit take 14
        example=(
            "Two patches of degree (1, 1) that share an edge",
            "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n",
        ),
    ),
)
"""All decoders, in the order in which lists name them."""

BY_NAME: Mapping[str, Decoder] = MappingProxyType({d.name: d for d in DECODERS})
"""All decoders by name."""

BY_SUFFIX: Mapping[str, Decoder] = MappingProxyType(
    {suffix: decoder for decoder in DECODERS for suffix in decoder.suffixes}
)
"""All decoders by suffix, without a dot."""
