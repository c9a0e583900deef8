"""Free-form surfaces of OBJ files are read; polygons and damaged files are refused by line."""

import json
import time
import tracemalloc
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from geomdl import NURBS
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.format import DEFAULT_FILE_LIMITS, FileLimits
from service.decoders.registry import BY_NAME
from service.encoders.registry import BY_NAME as FORMATS
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.pipeline.calls import CALLS, JSON, CallLimits
from service.pipeline.mesh import render
from service.schemas.queries import MeasureRequest, PointsRequest
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.examples.catalogue import find

OBJ = BY_NAME["obj"]

POINTS = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 10 10 0\n"
SQUARE = "surf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\n"
BILINEAR = f"{POINTS}cstype bezier\ndeg 1 1\n{SQUARE}"
HALF = 0.7071067811865476
CURVES = f"""
vp 0 0
vp 1 0
vp 1 1
vp 0 1
vp 0.7 0.5
vp 0.7 0.3 {HALF}
vp 0.5 0.3
vp 0.3 0.3 {HALF}
vp 0.3 0.5
vp 0.3 0.7 {HALF}
vp 0.5 0.7
vp 0.7 0.7 {HALF}
cstype bezier
deg 1
curv2 1 2 3 4 1
parm u 0 1 2 3 4
end
cstype rat bspline
deg 2
curv2 5 6 7 8 9 10 11 12 5
parm u 0 0 0 1 1 2 2 3 3 4 4 4
end
cstype bezier
deg 1 1
"""


def read(content: str | bytes) -> dict[str, Any]:
    """The document of a file's surface, which is checked like that of a request."""
    content = content if isinstance(content, bytes) else content.encode()
    tree = OBJ.decode(content, None, DEFAULT_FILE_LIMITS).tree
    validate_document(SurfaceRequest, {"surface": tree}).to_surface()
    return tree


def call(path: str, model: Any, **document: Any) -> dict[str, Any]:
    """The answer of the service to a request."""
    request = validate_document(model, document)
    return dict(json.loads(bytes(CALLS[path].plan(request, JSON, CallLimits()).run().content)))


def issue_of(content: str | bytes) -> Any:
    with pytest.raises(SurfaceError) as caught:
        read(content)
    return caught.value.issues[0]


def write_spline(net: Any, weights: Any, degrees: tuple[int, int], knots: Any) -> str:
    """An OBJ file of a NURBS surface (r, c); in the file u varies fastest."""
    rows, columns, _ = net.shape
    lines = [
        "v " + " ".join(map(repr, (*net[i, j].tolist(), float(weights[i, j]))))
        for j in range(columns)
        for i in range(rows)
    ]
    numbers = " ".join(map(str, range(1, rows * columns + 1)))
    ends = [(k[p], k[-p - 1]) for k, p in zip(knots, degrees, strict=True)]
    lines += ["cstype rat bspline", f"deg {degrees[0]} {degrees[1]}"]
    lines.append(f"surf {ends[0][0]} {ends[0][1]} {ends[1][0]} {ends[1][1]} {numbers}")
    lines += [f"parm {d} {' '.join(map(str, k))}" for d, k in zip("uv", knots, strict=True)]
    return "\n".join([*lines, "end", ""])


def test_points_are_those_that_geomdl_evaluates() -> None:
    rng = np.random.default_rng(5)
    net, weights = rng.normal(size=(5, 4, 3)), rng.uniform(0.5, 2, (5, 4))
    knots = [[0, 0, 0, 0.25, 0.5, 1, 1, 1], [0, 0, 0, 0, 2, 2, 2, 2]]
    tree = read(write_spline(net, weights, (2, 3), knots))
    peer = NURBS.Surface(normalize_kv=False)
    peer.degree_u, peer.degree_v = 2, 3
    homogeneous = np.concatenate((net * weights[..., None], weights[..., None]), axis=2)
    peer.set_ctrlpts(homogeneous.reshape(-1, 4).tolist(), 5, 4)
    peer.knotvector_u, peer.knotvector_v = knots
    uv = (rng.uniform(size=(30, 2)) * (1, 2)).tolist()
    answer = call("/v1/points", PointsRequest, surface=tree, uv=uv)
    np.testing.assert_allclose(answer["positions"], peer.evaluate_list(uv), rtol=0, atol=1e-13)


def test_a_piece_over_the_unit_square_is_a_bezier_patch() -> None:
    tree = read(BILINEAR + "end\n")
    assert tree["type"] == "bezier"
    np.testing.assert_array_equal(tree["control_net"][1, 0], [10, 0, 0])
    assert "weights" not in tree
    tree = read(BILINEAR.replace("bezier", "rat bezier") + "end\n")
    np.testing.assert_array_equal(tree["weights"], np.ones((2, 2)))


def test_bezier_pieces_share_their_borders() -> None:
    text = (
        "v 0 0 0\nv 1 0 1\nv 2 0 0\nv 3 0 1\nv 4 0 0\nv 0 1 0\nv 1 1 1\nv 2 1 0\nv 3 1 1\nv 4 1 0\n"
        "cstype bezier\ndeg 2 1\nsurf 0 3 0 1 1 2 3 4 5 \\\n 6 7 8 9 10\n"
        "parm u 0 1 3\nparm v 0 1\nend\n"
    )
    tree = read(text)
    assert tree["type"] == "bspline"
    np.testing.assert_array_equal(tree["knots"][0], [0, 0, 0, 1, 1, 3, 3, 3])
    answer = call("/v1/points", PointsRequest, surface=tree, uv=[[0.5, 0], [1, 0], [2, 1]])
    expected = np.array([[1, 0, 0.5], [2, 0, 0], [3, 1, 0.5]])
    np.testing.assert_allclose(answer["positions"], expected, atol=1e-15)


def test_numbers_of_points_may_count_backwards_and_name_textures() -> None:
    text = BILINEAR.replace(" 1 2 3 4", " -4/1/1 -3/2 -2//3 -1")
    np.testing.assert_array_equal(
        read(text + "end\n")["control_net"], read(BILINEAR + "end\n")["control_net"]
    )


def test_trimming_curves_are_loops_of_a_brep() -> None:
    tree = read(POINTS + CURVES + SQUARE + "trim 0 4 1\nhole 0 4 2\nend\n")
    area = call("/v1/measure", MeasureRequest, surface=tree)["area"]
    assert area["low"] <= 100 - 4 * np.pi <= area["high"]
    without = read(POINTS + CURVES + SQUARE + "hole 0 4 2\nend\n")
    assert call("/v1/measure", MeasureRequest, surface=without)["area"]["low"] <= area["high"]
    # The hole as the outer loop runs the other way around, and is refused.
    inside_out = read(POINTS + CURVES + SQUARE + "trim 0 4 2\nend\n")
    with pytest.raises(SurfaceError):
        call("/v1/measure", MeasureRequest, surface=inside_out)


def test_a_part_of_a_domain_is_a_brep() -> None:
    tree = read(BILINEAR.replace("surf 0 1 0 1", "surf 0.2 1 0 0.5") + "end\n")
    area = call("/v1/measure", MeasureRequest, surface=tree)["area"]
    assert area["low"] <= 40 <= area["high"]
    assert read(BILINEAR.replace("surf 0 1", "surf 0 0.9999999") + "end\n")["type"] == "bezier"


def test_several_surfaces_are_a_group_with_names() -> None:
    tree = read(f"{BILINEAR}end\ng left wing\n{SQUARE}end\no \u00e9\x01\n{SQUARE}end\n")
    assert [member.get("name") for member in tree["members"]] == [None, "left wing", None]


def test_other_statements_are_skipped() -> None:
    others = (
        "# by hand\nmtllib /etc/passwd\nusemtl red\nvn 0 0 1\nvt 0 0\ns 1\ncon 1 0 1 1 2 0 1 2\n"
        "l 1 2\np 1\nlod 3\nctech curv 1\nstech cparma 1 1\ncurv 0 1 1 2\nparm u 0 1\nend\n"
    )
    text = POINTS + others + BILINEAR.removeprefix(POINTS) + "sp 1\nscrv 0 1 1\nend\n"
    np.testing.assert_array_equal(
        read(text)["control_net"], read(BILINEAR + "end\n")["control_net"]
    )


@pytest.mark.parametrize("beside", [False, True])
def test_polygons_are_refused_with_their_number(beside: bool) -> None:
    mesh = render(find("saddle").surface(), MeshOptions(resolution=(1, 1)), FORMATS["obj"])
    issue = issue_of(mesh + f"{BILINEAR}end\n".encode() * beside)
    assert issue.code == "wrong_value"
    assert issue.got == "2 polygons" + " beside 1 surface" * beside


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("", "no surface", 1),
        ("v 1 2", "x y z", 1),
        ("v 1 2 x", "A number is needed", 1),
        ("\n\nv 1_0 2 3", "A number is needed", 3),
        ("v 1 2 1e999", "finite", 1),
        ("vp 1 2 3 4", "u v", 1),
        ("bsp 1 2 3", "does not know", 1),
        ("call other.obj", "does not know", 1),
        ("cstype cardinal", "Bézier and B-spline", 1),
        ("cstype rat", "Bézier and B-spline", 1),
        ("deg 0 1", "above zero", 1),
        ("deg 1 2 3", "above zero", 1),
        (POINTS + "surf 0 1 0 1 1 2 3 4", "basis or the degree", 5),
        (BILINEAR, "no end", 10),
        (BILINEAR + SQUARE, "no end", 10),
        (BILINEAR.replace("1 2 3 4", "1 2 3 5"), "numbers from 1", 7),
        (BILINEAR.replace("1 2 3 4", "1 2 3 0"), "numbers from 1", 7),
        (BILINEAR.replace("1 2 3 4", "1 2 3 4.5"), "whole number", 7),
        (BILINEAR.replace("1 2 3 4", "1 2 3") + "end", "number of control points", 10),
        (BILINEAR.replace("parm v 0 1\n", "") + "end", "number of control points", 9),
        (BILINEAR.replace("parm v", "parm w"), "of u or of v", 9),
        ("vp 0 0\ncstype bezier\ndeg 1\ncurv2\nend", "number of control points", 5),
        (BILINEAR + "trim 0 1", "three numbers", 10),
        (BILINEAR + "trim 0 1 1", "numbers from 1", 10),
        (POINTS + CURVES + SQUARE + "trim 0 2 1", "whole curves", 33),
    ],
)
def test_malformed_files_are_refused_with_the_line(text: str, message: str, line: int) -> None:
    issue = issue_of(text)
    assert message in issue.message
    assert f"(line {line})" in issue.message


def test_limits_are_checked_while_the_file_is_read() -> None:
    def refuse(text: str, **limits: int) -> str:
        with pytest.raises(SurfaceError) as caught:
            OBJ.decode(text.encode(), None, FileLimits(**limits))
        return caught.value.issues[0].code

    assert refuse(BILINEAR + "end\n", max_control_points=3) == "too_many_control_points"
    two = f"{BILINEAR}end\n{SQUARE}end\n"
    assert refuse(two, max_control_points=7) == "too_many_control_points"
    assert refuse(two, max_definitions=1) == "too_many_parts"
    trimmed = POINTS + CURVES + SQUARE + "trim 0 4 1\n" * 9
    assert refuse(trimmed, max_members=1) == "too_many_parts"
    assert refuse(trimmed, max_control_points=40) == "too_many_control_points"


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        BILINEAR + "end\n" + (SQUARE.replace("0 1 0 1", "0 .5 0 1") + "end\n") * 500,
        BILINEAR + "end\n" + (SQUARE.replace("0 1", "0 2") + "end\n") * 500,
        POINTS + CURVES + "curv2 1 2\nparm u 0 1\nend\n" * 1000,
        "\\\n" * 50_000,
        "vp 0 0\n" * 4000,
    ],
)
def test_files_take_no_more_memory_than_their_decoder_says(text: str) -> None:
    content = text.encode()
    tracemalloc.start()
    with suppress(SurfaceError):
        read(content)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < OBJ.memory(len(content))


def test_no_text_takes_long() -> None:
    start = time.process_time()
    for text in ("\\\n" * 100_000, "\n" * 200_000, "#" * 200_000, "surf" + " 1" * 100_000):
        issue_of(text)
    assert time.process_time() - start < 2


_WORDS = st.sampled_from(
    (BILINEAR + " trim hole vp curv2 end rat bspline -1 0.5 2 / 1/2 \\ 1e9 nan #").split()
)


@given(st.lists(st.lists(_WORDS, max_size=6).map(" ".join), max_size=12))
def test_any_statements_are_read_or_refused(lines: list[str]) -> None:
    for prefix in ("", BILINEAR, POINTS + CURVES + SQUARE):
        with suppress(SurfaceError):
            read(prefix + "\n".join(lines))
