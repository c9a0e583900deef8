"""Hostile files of control points and hostile queries, each with the error that it must get."""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tools.hostile.requests import MIB, NOT_TO_REPEAT

NPY, OOGL, TEAPOT = "application/x-npy", "model/x-oogl", "text/x-teapot"
OBJ, GEOMDL = "model/obj", "application/vnd.geomdl+json"


@dataclass(frozen=True)
class HostileFile:
    """A body, its media type, the query of its URL, and its first error.

    The member `location_key` of the error, "pointer" or "parameter", has the value `location`.
    """

    name: str
    media_type: str
    build: Callable[[], bytes]
    query: str
    status: int
    code: str
    location_key: str
    location: str


def save_array(array: NDArray[Any]) -> bytes:
    """The `.npy` file of an array."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def build_net(rows: int = 4, columns: int = 4, dimension: int = 3) -> NDArray[np.float64]:
    """A valid control net (rows, columns, dimension): row, column, and ones as further numbers."""
    points = np.ones((rows, columns, dimension))
    points[..., 0], points[..., 1] = np.indices((rows, columns))
    return points


def change_number(value: float, *index: int, dimension: int = 3, patches: int = 0) -> bytes:
    """The `.npy` file of a net in which the number at `index` is `value`.

    If `patches` is not 0, the file has this many equal nets, (patches, rows, columns, dimension).
    """
    points = build_net(dimension=dimension)
    if patches:
        points = np.stack([points] * patches)
    points[index] = value
    return save_array(points)


def build_case(
    name: str,
    body: bytes,
    status: int,
    code: str,
    location: str = "",
    *,
    media_type: str = NPY,
    query: str = "",
    location_key: str = "pointer",
) -> HostileFile:
    return HostileFile(name, media_type, lambda: body, query, status, code, location_key, location)


def build_array_cases() -> Iterator[HostileFile]:
    """Invalid `.npy` files."""
    pointer = "/surface/control_net"
    valid_file = save_array(build_net())
    yield build_case("no array", NOT_TO_REPEAT.encode(), 400, "malformed_body")
    yield build_case("an empty body", b"", 400, "malformed_body")
    yield build_case("JSON", b'{"surface": {}}', 400, "malformed_body")
    yield build_case("a truncated array", valid_file[:-99], 400, "malformed_body")
    yield build_case("two arrays", valid_file * 2, 400, "malformed_body")
    # The header has an equal length, because blanks of its padding are replaced.
    file_of_huge_shape = valid_file.replace(b"(4, 4, 3), }         ", b"(99999999, 99999, 3)}")
    assert file_of_huge_shape != valid_file
    yield build_case("a huge shape", file_of_huge_shape, 400, "malformed_body")
    yield build_case("whole numbers", save_array(build_net().astype(int)), 422, "wrong_type")
    yield build_case("a plain list", save_array(np.zeros(3)), 422, "wrong_dimension")
    yield build_case("five numbers", save_array(build_net(dimension=5)), 422, "wrong_dimension")
    yield build_case("one row", save_array(build_net(1, 4)), 422, "too_few_points", pointer)
    yield build_case("no row", save_array(build_net(0, 4)), 422, "empty_list")
    yield build_case("degree 65", save_array(build_net(66, 2)), 422, "degree_too_high", pointer)
    yield build_case(
        "a patch of degree 65",
        save_array(build_net(66, 2)[None]),
        422,
        "degree_too_high",
        "/surface/patches",
    )
    for value in (np.nan, np.inf, -np.inf):
        yield build_case(
            f"{value}", change_number(value, 1, 2, 0), 422, "not_finite", f"{pointer}/1/2/0"
        )
        yield build_case(
            f"{value} as a weight",
            change_number(value, 1, 2, 3, dimension=4),
            422,
            "not_finite",
            "/surface/weights/1/2",
        )
        yield build_case(
            f"{value} in a patch",
            change_number(value, 1, 3, 2, 0, patches=2),
            422,
            "not_finite",
            f"/surface/vertices/{4 * 4 + 3 * 4 + 2}/0",  # of 16 vertices for each patch
        )
    yield build_case(
        "1e39", change_number(1e39, 1, 2, 0), 422, "coordinate_too_large", f"{pointer}/1/2/0"
    )
    for value, row, column in ((0, 0, 3), (-1, 1, 2)):
        yield build_case(
            f"weight {value}",
            change_number(value, row, column, 3, dimension=4),
            422,
            "weight_not_positive",
            f"/surface/weights/{row}/{column}",
        )
    for name, content, code, where in (
        ("a corner of weight 0", change_number(0, 0, 3, 3, dimension=4), "weight_not_positive",
         "/surface/control_net/0/3"),
        ("a weight of NaN", change_number(np.nan, 1, 1, 3, dimension=4), "not_finite",
         "/surface/control_net/1/1/3"),
        ("weights that vanish", change_number(-40, 1, 1, 3, dimension=4), "weight_not_positive",
         "/surface"),
        ("three numbers", save_array(build_net()), "wrong_dimension", "/surface/control_net/0/0"),
    ):  # fmt: skip
        yield HostileFile(
            f"homogeneous: {name}", NPY, partial(bytes, content), "homogeneous=true", 422, code,
            "pointer", where,
        )  # fmt: skip
    for text in ("1", "True", ""):
        yield HostileFile(
            f"homogeneous={text}", NPY, lambda: save_array(build_net(dimension=4)),
            f"homogeneous={text}", 422, "wrong_type", "parameter", "homogeneous",
        )  # fmt: skip
    yield HostileFile(
        "too many control points",
        NPY,
        lambda: save_array(np.zeros((1001, 1000, 3), np.float32)),
        "",
        422,
        "too_many_control_points",
        "pointer",
        pointer,
    )


def build_query_cases() -> Iterator[HostileFile]:
    """Valid files with invalid queries."""
    valid_file = save_array(build_net())
    yield build_case(
        "a degree above the net",
        valid_file,
        422,
        "too_few_points",
        "/surface/control_net",
        query="type=bspline&degree=4",
    )
    for query, code, parameter in (
        ("type=tube", "wrong_value", "type"),
        ("type=patches", "wrong_value", "type"),
        (f"type={NOT_TO_REPEAT}", "wrong_value", "type"),
        ("type=", "wrong_value", "type"),
        ("degree=3", "unknown_field", "degree"),
        ("knots=uniform", "unknown_field", "knots"),
        ("type=bspline&degree=0", "out_of_range", "degree"),
        ("type=bspline&degree=65", "degree_too_high", "degree"),
        ("type=bspline&degree=3.0", "wrong_type", "degree"),
        ("type=bspline&degree=", "wrong_type", "degree"),
        ("type=bspline&degree=3,3,3", "wrong_length", "degree"),
        ("type=bspline&degree=3&degree=3&degree=3", "wrong_length", "degree"),
        (f"type=bspline&degree=3,{NOT_TO_REPEAT}", "wrong_type", "degree"),
        (f"type=bspline&degree=3&degree={NOT_TO_REPEAT}", "wrong_type", "degree"),
        (f"type=bspline&knots={NOT_TO_REPEAT}", "wrong_value", "knots"),
        ("type=bspline&knots=clamped,clamped,clamped", "wrong_length", "knots"),
        ("type=bspline&knots=0,1", "wrong_value", "knots"),
        ("up=x", "wrong_value", "up"),
        ("name=", "wrong_length", "name"),
        ("name=%00", "wrong_value", "name"),
        ("up=y&up=z", "repeated_key", "up"),
        ("control_net=1", "unknown_field", "control_net"),
        ("surface=1", "unknown_field", "surface"),
        ("camera=1", "unknown_field", "camera"),
        ("pixel_tolerance=1", "unknown_field", "pixel_tolerance"),
        ("colour=1", "unknown_field", "colour"),
        ("resolution=0", "out_of_range", "resolution"),
        ("resolution=4&tolerance=0.1", "conflicting_options", "resolution"),
        ("format=fbx", "unknown_format", "format"),
        ("format=stl&faces=quads", "unsupported_by_format", "faces"),
        ("resolution=9000", "too_many_vertices", "resolution"),
        # At most 50 parameters are read; a50 is the 51st.
        ("&".join(f"a{i}=1" for i in range(60)), "too_many_parameters", "a50"),
    ):
        yield build_case(
            f"?{query[:40]}",
            valid_file,
            422,
            code,
            parameter,
            query=query,
            location_key="parameter",
        )
    # A patch in OOGL: BEZ, its two degrees, the number of coordinates, and the points.
    text = b"BEZ113 0 0 0 1 0 0 0 1 0 1 1 0"
    for kind in ("bezier", "bspline", "group"):
        yield build_case(
            f"OOGL as {kind}",
            text,
            422,
            "wrong_value",
            "type",
            media_type=OOGL,
            query=f"type={kind}",
            location_key="parameter",
        )
    yield build_case(
        "knots of patches",
        text,
        422,
        "unknown_field",
        "knots",
        media_type=OOGL,
        query="knots=uniform",
        location_key="parameter",
    )


def build_text_cases() -> Iterator[HostileFile]:
    """Invalid texts of OOGL, of the teapot, of OBJ and of geomdl."""
    for media_type in (OOGL, TEAPOT, OBJ, GEOMDL):
        for name, body in (
            ("nothing", b""),
            ("a word", NOT_TO_REPEAT.encode()),
            ("JSON", b'{"surface": {}}'),
            ("bytes", bytes(range(256))),
            ("brackets", b"[" * 5000),
            ("UTF-16", "BBP 1 2 3".encode("utf-16")),
        ):
            yield build_case(
                f"{name} as {media_type}", body, 400, "malformed_body", media_type=media_type
            )
        yield HostileFile(
            f"blanks as {media_type}",
            media_type,
            lambda: b" " * (8 * MIB),
            "",
            400,
            "malformed_body",
            "pointer",
            "",
        )
        yield HostileFile(
            f"digits as {media_type}",
            media_type,
            lambda: b"1" * (8 * MIB),
            "",
            400,
            "malformed_body",
            "pointer",
            "",
        )
    yield HostileFile(
        "numbers without end",
        OOGL,
        lambda: b"BBP" + b" 1" * (4 * MIB),
        "",
        422,
        "too_many_control_points",
        "pointer",
        "",
    )
    yield HostileFile(
        "numbers without a layout",
        TEAPOT,
        lambda: b"1 " * (4 * MIB),
        "",
        422,
        "too_many_control_points",
        "pointer",
        "",
    )
    bilinear = b"{BEZ113 0 0 0 1 0 0 0 1 0 1 1 0}"
    # OOGL: BEZ, the two degrees, and the number of coordinates.
    quadratic = b"{BEZ213 0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0}"
    yield build_case("lists in lists", b"{LIST" * 5000, 400, "malformed_body", media_type=OOGL)
    yield build_case(
        "a coordinate beyond float32",
        bilinear.replace(b"1 1 0", b"1 1 1e39"),
        422,
        "coordinate_too_large",
        "/surface/vertices/3/2",
        media_type=OOGL,
    )
    group = b"LIST" + bilinear + quadratic.replace(b"2 1 0", b"2 1 1e39")
    yield build_case(
        "a coordinate beyond float32 in a group",
        group,
        422,
        "coordinate_too_large",
        "/surface/members/1/surface/vertices/5/2",
        media_type=OOGL,
    )
    yield build_case(
        "a quotient beyond float64",
        b"BEZ114 1e305 0 0 1e-5" + b" 1 1 1 1" * 3,
        422,
        "not_finite",
        "/surface/vertices/0/0",
        media_type=OOGL,
    )
    yield build_case(
        "a colour of 2",
        b"CBEZ113 0 0 0 1 0 0 0 1 0 1 1 0" + b" 1 1 2 1" * 4,
        422,
        "out_of_range",
        "/surface/colors/0/2",
        media_type=OOGL,
    )


OBJ_SQUARE = (
    b"v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\ncstype rat bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\n"
    b"parm u 0 1\nparm v 0 1\nend\n"
)
GEOMDL_SQUARE = (
    b'{"shape": {"type": "surface", "data": [{"degree_u": 1, "degree_v": 1, "size_u": 2, '
    b'"size_v": 2, "knotvector_u": [0, 0, 1, 1], "knotvector_v": [0, 0, 1, 1], "control_points": '
    b'{"points": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]}}]}}'
)


def build_spline_cases() -> Iterator[HostileFile]:
    """Invalid files of OBJ and of geomdl, which have whole surfaces with degrees and knots."""
    for name, old, new, status, code, pointer in (
        ("polygons", b"end", b"end\nf 1 2 3", 422, "wrong_value", ""),
        ("an index beyond", b"3 4\n", b"3 5\n", 422, "index_out_of_range", ""),
        ("a huge index", b"3 4\n", b"3 " + b"4" * 5000 + b"\n", 400, "malformed_body", ""),
        ("a huge degree", b"deg 1 1", b"deg 999999999 1", 400, "malformed_body", ""),
        ("NaN", b"v 1 1 0", b"v 1 1 nan", 422, "not_finite", ""),
        ("1e39", b"v 1 1 0", b"v 1 1 1e39", 422, "coordinate_too_large",
         "/surface/control_net/1/1/2"),
        ("a weight below 0", b"v 1 1 0", b"v 1 1 0 -1", 422, "weight_not_positive",
         "/surface/weights/1/1"),
        ("a word", b"parm", NOT_TO_REPEAT.encode(), 400, "malformed_body", ""),
        ("another file", b"parm", b"call /etc/passwd\nparm", 400, "malformed_body", ""),
        ("a loop without curves", b"end", b"trim 0 1 1\nend", 422, "index_out_of_range", ""),
    ):  # fmt: skip
        body = OBJ_SQUARE.replace(old, new, 1)
        yield build_case(f"OBJ: {name}", body, status, code, pointer, media_type=OBJ)
    yield build_case(
        "OBJ: too many small surfaces",
        OBJ_SQUARE + OBJ_SQUARE[OBJ_SQUARE.index(b"surf") :] * 5000,
        422,
        "too_many_parts",
        media_type=OBJ,
    )
    yield HostileFile(
        "OBJ: points without end",
        OBJ,
        lambda: OBJ_SQUARE.replace(b"3 4\n", b"3" + b" 4" * (2 * MIB) + b"\n"),
        "",
        422,
        "too_many_control_points",
        "pointer",
        "",
    )
    for name, old, new, status, code, pointer in (
        ("a curve", b'"surface"', b'"curve"', 422, "wrong_value", ""),
        ("another type", b'"surface"', f'"{NOT_TO_REPEAT}"'.encode(), 400, "malformed_body", ""),
        ("a size", b'"size_u": 2', b'"size_u": 9999999999', 400, "malformed_body", ""),
        ("a degree", b'"degree_u": 1', b'"degree_u": 65', 422, "degree_too_high",
         "/surface/degree/0"),
        ("a degree beyond the points", b'"degree_u": 1', b'"degree_u": 2', 422, "too_few_points",
         "/surface/control_net"),
        ("knots", b'"knotvector_u": [0, 0, 1, 1]', b'"knotvector_u": [1, 0, 1, 1]', 422,
         "knots_decrease", "/surface/knots/0/1"),
        ("NaN", b"[1, 1, 0]", b"[1, 1, NaN]", 400, "malformed_body", ""),
        ("a text", b"[1, 1, 0]", f'[1, 1, "{NOT_TO_REPEAT}"]'.encode(), 422, "wrong_type",
         "/surface/control_net/1/1/2"),
        ("no shape", GEOMDL_SQUARE[GEOMDL_SQUARE.index(b"[") + 1 : -3], b"", 400, "malformed_body",
         ""),
        ("trimming curves", b'"size_u"', b'"trims": {"data": [1]}, "size_u"', 422, "wrong_value",
         ""),
    ):  # fmt: skip
        assert old in GEOMDL_SQUARE
        body = GEOMDL_SQUARE.replace(old, new, 1)
        yield build_case(f"geomdl: {name}", body, status, code, pointer, media_type=GEOMDL)
    for media_type, body in ((OBJ, OBJ_SQUARE), (GEOMDL, GEOMDL_SQUARE)):
        for name in ("type", "degree", "knots", "invalid_faces"):
            yield build_case(
                f"{name} beside {media_type}",
                body,
                422,
                "unknown_field",
                name,
                media_type=media_type,
                query=f"{name}=bspline",
                location_key="parameter",
            )


FILES: tuple[HostileFile, ...] = (
    *build_array_cases(),
    *build_query_cases(),
    *build_text_cases(),
    *build_spline_cases(),
)
