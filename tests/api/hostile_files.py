"""Hostile files of control points and queries beside them, with the errors that they must get."""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.api.hostile import ECHO, MIB

NPY, OOGL, TEAPOT = "application/x-npy", "model/x-oogl", "text/x-teapot"


@dataclass(frozen=True)
class HostileFile:
    """One body, its media type, and the query beside it; `place` and `where` of the first error."""

    name: str
    media_type: str
    build: Callable[[], bytes]
    query: str
    status: int
    code: str
    place: str
    where: str


def saved(array: NDArray[Any]) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def net(rows: int = 4, columns: int = 4, width: int = 3) -> NDArray[np.float64]:
    points = np.ones((rows, columns, width))
    points[..., 0], points[..., 1] = np.indices((rows, columns))
    return points


def changed(value: float, *place: int, width: int = 3, patches: int = 0) -> bytes:
    """A net, or several, with one number changed."""
    points = net(width=width)
    if patches:
        points = np.stack([points] * patches)
    points[place] = value
    return saved(points)


def case(
    name: str,
    body: bytes,
    status: int,
    code: str,
    where: str = "",
    *,
    media_type: str = NPY,
    query: str = "",
    place: str = "pointer",
) -> HostileFile:
    return HostileFile(name, media_type, lambda: body, query, status, code, place, where)


def arrays() -> Iterator[HostileFile]:
    at = "/surface/control_net"
    good = saved(net())
    yield case("no array", ECHO.encode(), 400, "malformed_body")
    yield case("an empty body", b"", 400, "malformed_body")
    yield case("JSON", b'{"surface": {}}', 400, "malformed_body")
    yield case("half an array", good[:-99], 400, "malformed_body")
    yield case("two arrays", good * 2, 400, "malformed_body")
    huge = good.replace(b"(4, 4, 3), }         ", b"(99999999, 99999, 3)}")
    assert huge != good
    yield case("a huge shape", huge, 400, "malformed_body")
    yield case("whole numbers", saved(net().astype(int)), 422, "wrong_type")
    yield case("a plain list", saved(np.zeros(3)), 422, "wrong_dimension")
    yield case("five numbers", saved(net(width=5)), 422, "wrong_dimension")
    yield case("one row", saved(net(1, 4)), 422, "too_few_points", at)
    yield case("no row", saved(net(0, 4)), 422, "empty_list")
    yield case("degree 65", saved(net(66, 2)), 422, "degree_too_high", at)
    yield case("a patch of degree 65", saved(net(66, 2)[None]), 422, "degree_too_high",
               "/surface/patches")  # fmt: skip
    for value in (np.nan, np.inf, -np.inf):
        yield case(f"{value}", changed(value, 1, 2, 0), 422, "not_finite", f"{at}/1/2/0")
        yield case(f"{value} as a weight", changed(value, 1, 2, 3, width=4), 422,
                   "not_finite", "/surface/weights/1/2")  # fmt: skip
        yield case(f"{value} in a patch", changed(value, 1, 3, 2, 0, patches=2), 422,
                   "not_finite", "/surface/vertices/30/0")  # fmt: skip
    yield case("1e39", changed(1e39, 1, 2, 0), 422, "coordinate_too_large", f"{at}/1/2/0")
    for value in (0, -1):
        yield case(f"weight {value}", changed(value, 1, 2, 3, width=4), 422,
                   "weight_not_positive", "/surface/weights/1/2")  # fmt: skip
    yield HostileFile(
        "too many control points", NPY, lambda: saved(np.zeros((1001, 1000, 3), np.float32)),
        "", 422, "too_many_control_points", "pointer", at,
    )  # fmt: skip


def queries() -> Iterator[HostileFile]:
    good = saved(net())
    for query, code, where in (
        ("type=tube", "wrong_value", "type"),
        ("type=patches", "wrong_value", "type"),
        (f"type={ECHO}", "wrong_value", "type"),
        ("type=", "wrong_value", "type"),
        ("degree=3", "unknown_field", "degree"),
        ("knots=uniform", "unknown_field", "knots"),
        ("type=bspline&degree=4", "too_few_points", None),
        ("type=bspline&degree=0", "out_of_range", "degree"),
        ("type=bspline&degree=65", "degree_too_high", "degree"),
        ("type=bspline&degree=3.0", "wrong_type", "degree"),
        ("type=bspline&degree=", "wrong_type", "degree"),
        ("type=bspline&degree=3,3,3", "wrong_length", "degree"),
        (f"type=bspline&degree=3,{ECHO}", "wrong_type", "degree"),
        (f"type=bspline&knots={ECHO}", "wrong_value", "knots"),
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
        ("resolution=4&tolerance=0.1", "conflicting_options", None),
        ("format=fbx", "unknown_format", "format"),
        ("format=stl&faces=quads", "unsupported_by_format", "faces"),
        ("resolution=9000", "too_many_vertices", "resolution"),
        ("&".join(f"a{i}=1" for i in range(60)), "too_many_parameters", "a50"),
    ):
        if where is not None:
            yield case(f"?{query[:40]}", good, 422, code, where, query=query, place="parameter")
    text = b"BEZ113 0 0 0 1 0 0 0 1 0 1 1 0"
    for kind in ("bezier", "bspline", "group"):
        yield case(f"OOGL as {kind}", text, 422, "wrong_value", "type", media_type=OOGL,
                   query=f"type={kind}", place="parameter")  # fmt: skip
    yield case("knots of patches", text, 422, "unknown_field", "knots", media_type=OOGL,
               query="knots=uniform", place="parameter")  # fmt: skip


def texts() -> Iterator[HostileFile]:
    for media_type in (OOGL, TEAPOT):
        for name, body in (
            ("nothing", b""),
            ("a word", ECHO.encode()),
            ("JSON", b'{"surface": {}}'),
            ("bytes", bytes(range(256))),
            ("UTF-16", "BBP 1 2 3".encode("utf-16")),
        ):
            yield case(
                f"{name} as {media_type}", body, 400, "malformed_body", media_type=media_type
            )
        yield HostileFile(f"blanks as {media_type}", media_type, lambda: b" " * (8 * MIB), "", 400,
                          "malformed_body", "pointer", "")  # fmt: skip
        yield HostileFile(f"digits as {media_type}", media_type, lambda: b"1" * (8 * MIB), "", 400,
                          "malformed_body", "pointer", "")  # fmt: skip
    yield HostileFile("numbers without end", OOGL, lambda: b"BBP" + b" 1" * (4 * MIB), "", 422,
                      "too_many_control_points", "pointer", "")  # fmt: skip
    yield HostileFile("numbers without a layout", TEAPOT, lambda: b"1 " * (4 * MIB), "", 422,
                      "too_many_control_points", "pointer", "")  # fmt: skip
    one = b"{BEZ113 0 0 0 1 0 0 0 1 0 1 1 0}"
    other = b"{BEZ213 0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0}"
    yield case("lists in lists", b"{LIST" * 5000, 400, "malformed_body", media_type=OOGL)
    yield case("a coordinate beyond float32", one.replace(b"1 1 0", b"1 1 1e39"), 422,
               "coordinate_too_large", "/surface/vertices/3/2", media_type=OOGL)  # fmt: skip
    group = b"LIST" + one + other.replace(b"2 1 0", b"2 1 1e39")
    yield case("the same in a group", group, 422, "coordinate_too_large",
               "/surface/members/1/surface/vertices/5/2", media_type=OOGL)  # fmt: skip
    yield case("a quotient beyond float64", b"BEZ114 1e300 0 0 1e-300" + b" 1 1 1 1" * 3, 422,
               "not_finite", "/surface/vertices/0/0", media_type=OOGL)  # fmt: skip
    yield case("a colour of 2", b"CBEZ113 0 0 0 1 0 0 0 1 0 1 1 0" + b" 1 1 2 1" * 4, 422,
               "out_of_range", "/surface/colors/0/2", media_type=OOGL)  # fmt: skip


FILES: tuple[HostileFile, ...] = (*arrays(), *queries(), *texts())
