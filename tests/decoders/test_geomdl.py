"""Files of geomdl are read as geomdl evaluates them; other files are refused by their place."""

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geomdl import NURBS, BSpline, exchange, multi, utilities
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.format import DEFAULT_FILE_LIMITS, FileLimits
from service.decoders.registry import BY_NAME, find_by_content
from service.errors import SurfaceError
from service.pipeline.calls import CALLS, JSON, CallLimits
from service.schemas.queries import PointsRequest
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface

GEOMDL = BY_NAME["geomdl"]
SQUARE: dict[str, Any] = {
    "degree_u": 1,
    "degree_v": 1,
    "size_u": 2,
    "size_v": 2,
    "knotvector_u": [0, 0, 1, 1],
    "knotvector_v": [0, 0, 1, 1],
    "control_points": {"points": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]},
}


def build_peer(
    degrees: tuple[int, int], counts: tuple[int, int], seed: int, *, rational: bool = True
) -> Any:
    """A surface of geomdl with random points, and weights if it is rational."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(counts[0] * counts[1], 3))
    surface = NURBS.Surface() if rational else BSpline.Surface()
    surface.degree_u, surface.degree_v = degrees
    if rational:
        weights = rng.uniform(0.5, 2, (len(points), 1))
        points = np.hstack((points * weights, weights))
    surface.set_ctrlpts(points.tolist(), *counts)
    surface.knotvector_u, surface.knotvector_v = (
        utilities.generate_knot_vector(degree, count)
        for degree, count in zip(degrees, counts, strict=True)
    )
    return surface


def write(surface: Any, folder: Path) -> bytes:
    """The file that geomdl writes."""
    path = folder / "surface.json"
    exchange.export_json(surface, str(path))
    return path.read_bytes()


def read(content: bytes) -> dict[str, Any]:
    """The document of a file's surface, which is checked like that of a request."""
    tree = GEOMDL.decode(content, None, DEFAULT_FILE_LIMITS).tree
    validate_document(SurfaceRequest, {"surface": tree}).to_surface()
    return tree


def evaluate(tree: dict[str, Any], uv: list[list[float]]) -> Any:
    """The points of a surface, computed by the service."""
    request = validate_document(PointsRequest, {"surface": tree, "uv": uv})
    file = CALLS["/v1/points"].plan(request, JSON, CallLimits()).run()
    return np.array(json.loads(bytes(file.content))["positions"])


def change(**fields: Any) -> bytes:
    """A file with a square that has these fields too."""
    shape = {"type": "surface", "count": 1, "data": [SQUARE | fields]}
    return json.dumps({"shape": shape}).encode()


def issue_of(content: bytes) -> Any:
    with pytest.raises(SurfaceError) as caught:
        read(content)
    return caught.value.issues[0]


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize(
    ("degrees", "counts"), [((2, 1), (3, 2)), ((3, 2), (6, 5)), ((1, 4), (4, 7))]
)
def test_points_are_those_that_geomdl_evaluates(
    tmp_path: Path, degrees: tuple[int, int], counts: tuple[int, int], rational: bool
) -> None:
    peer = build_peer(degrees, counts, 7, rational=rational)
    uv = np.random.default_rng(8).uniform(size=(40, 2)).tolist()
    points = evaluate(read(write(peer, tmp_path)), uv)
    np.testing.assert_allclose(points, peer.evaluate_list(uv), rtol=0, atol=1e-13)


def test_several_surfaces_are_a_group(tmp_path: Path) -> None:
    peers = [build_peer((2, 2), (3, 4), seed) for seed in range(3)]
    tree = read(write(multi.SurfaceContainer(*peers), tmp_path))
    surface = validate_document(SurfaceRequest, {"surface": tree}).to_surface()
    assert isinstance(surface, GroupSurface)
    for member, peer in zip(surface.members, peers, strict=True):
        assert isinstance(member.surface, BsplineSurface)
        np.testing.assert_array_equal(np.reshape(member.surface.control_net, (-1, 3)), peer.ctrlpts)


def test_rows_of_points_times_weights_are_read(tmp_path: Path) -> None:
    """`ctrlpts2d` of a rational surface has (wx, wy, wz, w)."""
    peer = build_peer((2, 1), (3, 2), 3)
    document = json.loads(write(peer, tmp_path))
    (shape,) = document["shape"]["data"]
    expected = read(json.dumps(document).encode())
    del shape["control_points"]
    shape["ctrlpts2d"] = peer.ctrlpts2d
    tree = read(json.dumps(document).encode())
    uv = [[0.1, 0.2], [0.5, 1]]
    np.testing.assert_allclose(evaluate(tree, uv), evaluate(expected, uv), atol=1e-14)
    shape["ctrlpts2d"] = [[point[:3] for point in row] for row in peer.ctrlpts2d]
    assert "homogeneous" not in read(json.dumps(document).encode())


def test_fields_for_sampling_are_ignored_and_names_kept() -> None:
    tree = read(change(delta=[0.1, 0.1], sample_size=7, reversed=1, trims={"count": 0, "data": []}))
    assert tree == read(change())
    assert read(change(name="sail"))["name"] == "sail"
    for name in ("", "x" * 101, "a\nb", 7):
        assert "name" not in read(change(name=name))


@pytest.mark.parametrize(
    ("content", "place"),
    [
        (b"", "line 1, column 1"),
        (b'{"shape": NaN}', "line 1"),
        (b"[]", "the whole"),
        (b"{}", "shape"),
        (b'{"shape": {}}', "shape.type"),
        (b'{"shape": {"type": "surface"}}', "shape.data"),
        (b'{"shape": {"type": "surface", "data": []}}', "shape.data"),
        (b'{"shape": {"type": "solid", "data": [{}]}}', "shape.type"),
        (b'{"shape": {"type": "surface", "data": [1]}}', "shape.data[0]"),
        (change(degree_u=None), "shape.data[0].degree_u"),
        (change(degree_u=True), "shape.data[0].degree_u"),
        (change(size_u=3), "shape.data[0].control_points.points"),
        (change(size_u=-2, size_v=-2), "shape.data[0].control_points.points"),
        (change(control_points={"points": SQUARE["control_points"]["points"], "weights": [1]}),
         "shape.data[0].control_points.weights"),
        (change(knotvector_v="clamped"), "shape.data[0].knotvector_v"),
    ],
)  # fmt: skip
def test_malformed_files_are_refused_with_the_place(content: bytes, place: str) -> None:
    issue = issue_of(content)
    assert issue.code == "malformed_body"
    assert f"({place}" in issue.message


def test_curves_volumes_and_trimmed_surfaces_say_what_to_send(tmp_path: Path) -> None:
    curve = BSpline.Curve()
    curve.degree, curve.ctrlpts, curve.knotvector = 1, [[0, 0], [1, 1]], [0, 0, 1, 1]
    issue = issue_of(write(curve, tmp_path))
    assert (issue.code, issue.got) == ("wrong_value", "a curve")
    assert "/v1/curve" in issue.needed
    assert issue_of(b'{"shape": {"type": "volume", "data": [{}]}}').got == "a volume"
    issue = issue_of(change(trims={"count": 1, "data": [{"type": "spline"}]}))
    assert issue.got == "trimming curves"
    assert "brep" in issue.needed


def test_values_are_checked_as_in_a_request() -> None:
    points = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, "x"]]
    issue = issue_of(change(control_points={"points": points}))
    assert (issue.code, issue.pointer) == ("wrong_type", "/surface/control_net/1/1/2")
    assert issue_of(change(degree_v=65)).pointer.startswith("/surface/degree")
    assert issue_of(change(knotvector_u=[0, 0, 1])).pointer == "/surface/knots/0"


def test_files_are_known_by_their_beginning() -> None:
    assert find_by_content(change()) is GEOMDL
    assert find_by_content(b'\n{ "shape" : {') is GEOMDL
    assert find_by_content(b'{"surface": {"shape": 1}}') is None


def test_too_many_surfaces_are_refused() -> None:
    content = json.dumps({"shape": {"type": "surface", "data": [SQUARE] * 3}}).encode()
    with pytest.raises(SurfaceError) as caught:
        GEOMDL.decode(content, None, FileLimits(max_definitions=2))
    assert caught.value.issues[0].code == "too_many_parts"


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3),
)


@given(_VALUES, st.sampled_from([*SQUARE, "trims", "ctrlpts2d", "name"]))
def test_any_value_of_a_field_is_read_or_refused(value: Any, name: str) -> None:
    with suppress(SurfaceError):
        read(change(**{name: value}))
