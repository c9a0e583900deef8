"""The registry of decoders: all formats of files that the service reads.

To add a format, write its module and add an entry here. Media types, suffixes, error messages and
the OpenAPI document are made from these tables. JSON is not in them, because a JSON body is a whole
request, not a file.
"""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from service.decoders import cad_files, geomdl, npy, obj, oogl, teapot
from service.decoders.format import Decoded, Decoder, FileLimits, Tree
from service.errors import Issue

CHILD_BYTES = 1 << 16
"""Bytes of a CAD file that take some 30 ms to read: longer files are read in a child process."""


def _net(read: Callable[[bytes, str | None, int], Tree]) -> Callable[..., Decoded]:
    """The function `Decoder.decode` of a format whose only limit is that of control points."""

    def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
        return Decoded(read(content, kind, limits.max_control_points))

    return decode


_WHOLE = ("up", "name")
"""The fields beside a file that says itself what its surfaces are."""

NET_DECODERS: tuple[Decoder, ...] = (
    Decoder(
        name="npy",
        title="NumPy array",
        media_type="application/x-npy",
        suffixes=("npy",),
        is_binary=True,
        kinds=npy.KINDS,
        decode=_net(npy.decode),
        about="A file that `numpy.save` writes, of float32 or float64, in either byte order and"
        " either order of axes. An array (p+1, q+1, 3) is one control net: of a Bézier patch or, "
        "with `type=bspline`, of a B-spline. An array (P, p+1, q+1, 3) is P Bézier patches, which "
        "meet where their control points are equal. If a point has 4 numbers, the last is its "
        "weight; the other three are not multiplied by the weight, unless `homogeneous=true` says "
        "so. Errors have pointers into the "
        "equivalent JSON document: `/surface/control_net/i/j/k` for one net, and "
        "`/surface/vertices/n/k` for the n-th point of several patches.",
        memory_factor=8,  # patches of float32 take 7.7: as float64, with their indices
        fields=("type", "degree", "knots", "homogeneous", "up", "name"),
    ),
    Decoder(
        name="oogl",
        title="Bézier patches as OOGL, BEZ and BBP, text",
        media_type="model/x-oogl",
        suffixes=("bez", "bbp", "oogl"),
        is_binary=False,
        kinds=oogl.KINDS,
        decode=_net(oogl.decode),
        about="A BEZ or BBP object of OOGL, or a LIST of these, in ASCII: any number of Bézier "
        "patches. Among control points, u varies fastest; a point with 4 numbers is (wx, wy, wz, "
        "w), a direction if w is 0. Texture coordinates and colours of the corners are read; lines "
        "and appearances are skipped. Patches of several degrees become a `group`. Errors name "
        "the line. The service reads the files that it writes with `oogl=bez`.",
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
        decode=_net(teapot.decode),
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
    Decoder(
        name="obj",
        title="Free-form surfaces of Wavefront OBJ",
        media_type="model/obj",
        suffixes=("obj",),
        is_binary=False,
        kinds=obj.KINDS,
        decode=obj.decode,
        about="Surfaces (`surf`) of a Wavefront OBJ file, Bézier or B-spline, with the weights of "
        "`rat`. Surfaces with trimming curves (`trim`, `hole`), or over a part of their domain, "
        "are the faces of a `brep`; several surfaces are a `group`. Names are those of `g` or `o`. "
        "Polygons are refused, also beside surfaces; curves of space, lines, materials and "
        "connectivity are skipped. Errors name the line.",
        memory_factor=112,  # many small surfaces take 101, one large takes 30
        fields=_WHOLE,
        example=(
            "A quarter of a cylinder, exactly: degrees (2, 1), weights",
            "v 1 0 0 1\nv 1 1 0 0.7071067811865476\nv 0 1 0 1\n"
            "v 1 0 1 1\nv 1 1 1 0.7071067811865476\nv 0 1 1 1\n"
            "cstype rat bezier\ndeg 2 1\nsurf 0 1 0 1 1 2 3 4 5 6\n"
            "parm u 0 1\nparm v 0 1\nend\n",
        ),
    ),
    Decoder(
        name="geomdl",
        title="Surfaces of geomdl (NURBS-Python), as JSON",
        media_type="application/vnd.geomdl+json",
        suffixes=("geomdl",),
        is_binary=False,
        kinds=geomdl.KINDS,
        decode=geomdl.decode,
        about="The JSON that geomdl.exchange.export_json writes: a surface is a `bspline`, several "
        "are a `group`. Curves, volumes and trimming curves are refused; fields for sampling are "
        "ignored. Errors of form name the place in the file, others point into the equivalent "
        "JSON document. The command line knows these files by their beginning, whatever their "
        "suffix.",
        memory_factor=48,  # lists of empty lists or objects take 36
        fields=_WHOLE,
        example=(
            "A quarter of a cylinder, exactly: degrees (2, 1), weights",
            '{"shape": {"type": "surface", "count": 1, "data": [{"degree_u": 2, "degree_v": 1, '
            '"knotvector_u": [0, 0, 0, 1, 1, 1], "knotvector_v": [0, 0, 1, 1], "size_u": 3, '
            '"size_v": 2, "control_points": {"points": [[1, 0, 0], [1, 0, 1], [1, 1, 0], '
            '[1, 1, 1], [0, 1, 0], [0, 1, 1]], "weights": [1, 1, 0.7071067811865476, '
            "0.7071067811865476, 1, 1]}}]}}\n",
        ),
    ),
)
"""Formats of control nets, and of surfaces with their degrees and knots."""


def _cad(
    name: str,
    title: str,
    suffixes: tuple[str, ...],
    about: str,
    *,
    media_type: str = "",
    memory_factor: float = 12,  # parts of machines take 8
    **others: Any,
) -> Decoder:
    """The entry of a format of CAD systems, whose longer files are read in a child."""
    return Decoder(
        name=name,
        title=title,
        media_type=media_type or f"model/{name}",
        suffixes=suffixes,
        is_binary=True,  # texts have whatever encoding the writing system chose
        kinds=(),
        decode=cad_files.cad_decoder(name),
        about=about,
        memory_factor=memory_factor,
        base_memory=96 << 20,  # 20,000 faces take 100 MB, however short the file is
        fields=cad_files.FIELDS,
        is_cad=True,
        **{"child_bytes": CHILD_BYTES} | others,
    )


CAD_DECODERS: tuple[Decoder, ...] = (
    _cad(
        "step",
        "STEP: ISO 10303-21 of AP203, AP214 and AP242",
        ("step", "stp", "p21"),
        "A STEP file (ISO 10303-21, clear text) with boundary representations of AP203, AP214"
        " or AP242: solids, shells and loose faces, assemblies with all placements, names, colours "
        "and units. One part becomes a `brep`, an assembly a `group`. Every face that is not in the"
        " surface is in the report of reading. Other files that it names are never opened.",
    ),
    _cad(
        "iges",
        "IGES 5.3",
        ("igs", "iges"),
        "An IGES file (version 5.3, of fixed form): trimmed surfaces (144, 143), solids (186)"
        ", untrimmed surfaces, subfigures with all placements, names, colours and the unit. "
        "Neighbours are joined where whole edges agree within the file's uncertainty. Every face "
        "that is not in the surface is in the report of reading.",
    ),
    _cad(
        "3dm",
        "Rhino 3DM",
        ("3dm",),
        "A file of Rhino (openNURBS): breps, extrusions and surfaces, with names, instances, "
        "units and colours of objects. Meshes and SubD objects are skipped, and are in the report "
        "of reading. Needs the extra `rhino`.",
        media_type="model/vnd.3dm",
        memory_factor=16,
        byte_seconds=2e-5,
        child_bytes=0,  # a library in C++ reads it
        library="rhino3dm",
        extra="rhino",
    ),
)
"""Formats of CAD systems."""

DECODERS: tuple[Decoder, ...] = (*NET_DECODERS, *CAD_DECODERS)
"""All decoders, in the order in which lists name them."""

BY_NAME: Mapping[str, Decoder] = MappingProxyType({d.name: d for d in DECODERS})
"""All decoders by name."""

BY_SUFFIX: Mapping[str, Decoder] = MappingProxyType(
    {suffix: decoder for decoder in DECODERS for suffix in decoder.suffixes}
)
"""All decoders by suffix, without a dot."""

BEGINNINGS: Mapping[str, re.Pattern[bytes]] = MappingProxyType(
    {
        "npy": re.compile(rb"\x93NUMPY"),
        "step": re.compile(
            rb"(?:\xef\xbb\xbf)?\s*(?:/\*(?:[^*]|\*(?!/))*\*/\s*)*ISO-10303-21", re.DOTALL
        ),
        # The first line has 72 columns of text, the letter S and its number, 1.
        "iges": re.compile(rb"[^\r\n]{72}S {0,6}0{0,6}1\s"),
        "3dm": re.compile(rb"3D Geometry File Format "),
        "geomdl": re.compile(rb"(?:\xef\xbb\xbf)?\s*\{\s*\"shape\"\s*:"),
    }
)
"""How files begin, of the formats that can be known by this.

The editor compares them, too: the patterns mean the same in JavaScript, with the flag `s`, in texts
of Latin-1."""


def find_by_content(content: bytes) -> Decoder | None:
    """The decoder of a file that begins with these bytes, if its format can be known by them."""
    start = content[:4096]
    return next((BY_NAME[name] for name, each in BEGINNINGS.items() if each.match(start)), None)


def unavailable_issue(decoder: Decoder) -> Issue:
    """The issue for a client whose file needs a library that is not installed."""
    return Issue(
        "format_unavailable",
        "This service was installed without the library that reads these files.",
        got=f"a file of {decoder.title}",
        needed=f"a service with the extra: surface-service[{decoder.extra}]",
    )
