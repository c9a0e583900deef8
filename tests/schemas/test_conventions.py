"""Fields of other programs are refused with the field that is meant, and the request to send."""

import json
import re
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from geomdl import NURBS
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest, Issue
from service.pipeline.calls import CALLS, JSON, CallLimits
from service.schemas.conventions import MAX_REQUEST
from service.schemas.curves import CurveRequest
from service.schemas.program_fields import CONVENTIONS, ROLES, fold_name
from service.schemas.queries import PointsRequest
from service.schemas.request import MeshRequest, SurfaceRequest
from service.schemas.validation import validate_document

RNG = np.random.default_rng(3)
NET = np.round(RNG.normal(size=(4, 3, 3)), 3)
WEIGHTS = np.round(RNG.uniform(0.5, 2, (4, 3)), 3)
KNOTS_U, KNOTS_V = [0, 0, 0, 0.5, 1, 1, 1], [0, 0, 1, 2, 2]
U_FASTEST, V_FASTEST = NET.swapaxes(0, 1).reshape(-1, 3), NET.reshape(-1, 3)
HOMOGENEOUS = np.concatenate((NET * WEIGHTS[..., None], WEIGHTS[..., None]), axis=2)
WITH_WEIGHTS = np.concatenate((NET, WEIGHTS[..., None]), axis=2)
GEOMDL = {"degree_u": 2, "degree_v": 1, "knotvector_u": KNOTS_U, "knotvector_v": KNOTS_V}

SURFACES: dict[str, dict[str, Any]] = {
    "geomdl": GEOMDL
    | {
        "size_u": 4,
        "size_v": 3,
        "ctrlpts": V_FASTEST.tolist(),
        "weights": WEIGHTS.ravel().tolist(),
    },
    "geomdl, weighted": GEOMDL
    | {"ctrlpts_size_u": 4, "ctrlpts_size_v": 3, "ctrlptsw": HOMOGENEOUS.reshape(-1, 4).tolist()},
    "geomdl, rows": GEOMDL | {"ctrlpts2d": HOMOGENEOUS.tolist(), "delta": 0.05},
    "splinepy": {
        "degrees": [2, 1],
        "knot_vectors": [KNOTS_U, KNOTS_V],
        "control_points": U_FASTEST.tolist(),
        "weights": WEIGHTS.T.reshape(-1, 1).tolist(),
    },
    "splinepy, in an object": {
        "nurbs": {
            "degrees": [2, 1],
            "knot_vectors": [KNOTS_U, KNOTS_V],
            "control_points": U_FASTEST.tolist(),
            "weights": WEIGHTS.T.ravel().tolist(),
        }
    },
    "G+Smo": {
        "type": "TensorNurbs2",
        "degree": [2, 1],
        "knots": [KNOTS_U, KNOTS_V],
        "coefs": U_FASTEST.tolist(),
        "weights": WEIGHTS.T.ravel().tolist(),
    },
    "Rhino": {
        "OrderU": 3,
        "OrderV": 2,
        "CountU": 4,
        "CountV": 3,
        "KnotsU": KNOTS_U[1:-1],
        "KnotsV": KNOTS_V[1:-1],
        "Points": HOMOGENEOUS.reshape(-1, 4).tolist(),
        "IsRational": True,
    },
    "Rhino, without sizes": {
        "degree": [2, 1],
        "knots_u": KNOTS_U[1:-1],
        "knots_v": KNOTS_V[1:-1],
        "points": V_FASTEST.tolist(),
        "weights": WEIGHTS.ravel().tolist(),
    },
    "USD": {
        "uVertexCount": 4,
        "vVertexCount": 3,
        "uOrder": 3,
        "vOrder": 2,
        "uKnots": KNOTS_U,
        "vKnots": KNOTS_V,
        "points": U_FASTEST.tolist(),
        "pointWeights": WEIGHTS.T.ravel().tolist(),
        "uForm": "open",
    },
    "Open CASCADE": {
        "poles": NET.tolist(),
        "weights": WEIGHTS.tolist(),
        "u_degree": 2,
        "v_degree": 1,
        "u_knots": [0, 0.5, 1],
        "v_knots": [0, 1, 2],
        "u_multiplicities": [3, 1, 3],
        "v_multiplicities": [2, 1, 2],
    },
    "Blender": {
        "order_u": 3,
        "order_v": 2,
        "point_count_u": 4,
        "point_count_v": 3,
        "knots_u": KNOTS_U,
        "knots_v": KNOTS_V,
        "points": WITH_WEIGHTS.swapaxes(0, 1).reshape(-1, 4).tolist(),
    },
    "three.js": {
        "degree1": 2,
        "degree2": 1,
        "knots1": KNOTS_U,
        "knots2": KNOTS_V,
        "controlPoints": WITH_WEIGHTS.tolist(),
    },
    "verb": {
        "degreeU": 2,
        "degreeV": 1,
        "knotsU": KNOTS_U,
        "knotsV": KNOTS_V,
        "controlPoints": HOMOGENEOUS.tolist(),
    },
    "flat numbers": GEOMDL
    | {"size_u": 4, "size_v": 3, "ctrlpts": NET.ravel().tolist(), "weights": WEIGHTS.tolist()},
}
"""One surface, in the fields of each program."""


def refuse(document: object, model: Any = MeshRequest) -> tuple[Issue, ...]:
    with pytest.raises(InvalidRequest) as caught:
        validate_document(model, document)
    return caught.value.issues


def read_request(issue: Issue) -> dict[str, Any]:
    """The request to send, which the issue has."""
    return dict(json.loads(issue.needed.split("; send ")[1]))


def evaluate(request: dict[str, Any], uv: Any) -> Any:
    query = validate_document(PointsRequest, request | {"uv": uv})
    file = CALLS["/v1/points"].plan(query, JSON, CallLimits()).run()
    return np.array(json.loads(bytes(file.content))["positions"])


@pytest.mark.parametrize("wrap", [lambda fields: {"surface": fields}, lambda fields: fields])
@pytest.mark.parametrize("program", SURFACES)
def test_the_request_to_send_is_the_same_surface(program: str, wrap: Any) -> None:
    issues = refuse(wrap(SURFACES[program]) | {"resolution": 3})
    assert "; send " in issues[0].needed
    assert sum("; send " in issue.needed for issue in issues) == 1
    peer = NURBS.Surface(normalize_kv=False)
    peer.degree_u, peer.degree_v = 2, 1
    peer.set_ctrlpts(HOMOGENEOUS.reshape(-1, 4).tolist(), 4, 3)
    peer.knotvector_u, peer.knotvector_v = KNOTS_U, KNOTS_V
    uv = (np.random.default_rng(1).uniform(size=(9, 2)) * (1, 2)).tolist()
    points = evaluate(read_request(issues[0]), uv)
    np.testing.assert_allclose(points, peer.evaluate_list(uv), rtol=0, atol=1e-14)


@pytest.mark.parametrize("program", SURFACES)
def test_each_unknown_field_names_the_field_that_is_meant(program: str) -> None:
    fields = SURFACES[program]
    issues = refuse({"surface": fields})
    unknown = {issue.pointer: issue for issue in issues if issue.code == "unknown_field"}
    for pointer, issue in unknown.items():
        name = pointer.removeprefix("/surface/")
        assert name in fields
        assert issue.needed != "a documented name"
        assert "or another documented name" not in issue.needed
    assert "control_net" in str(issues)
    if program in [each.program for each in CONVENTIONS] and unknown:
        assert any(f"; {program} has one" in issue.message for issue in issues)


def test_a_kind_of_another_program_names_ours() -> None:
    for name, kind in (("nurbs", "bspline"), ("BezierSurface", "bezier"), ("Solid", "brep")):
        issue = refuse({"surface": {"type": name, "control_net": []}})[0]
        assert (issue.code, issue.pointer) == ("unknown_type", "/surface/type")
        assert issue.needed.startswith(f"`{kind}`")


@pytest.mark.parametrize(
    "fields",
    [
        SURFACES["splinepy"] | {"control_points": U_FASTEST[:-1].tolist()},
        SURFACES["USD"] | {"uOrder": "3"},
        SURFACES["USD"] | {"uOrder": 2.5},
        SURFACES["USD"] | {"uKnots": [1, 0] * 4},
        SURFACES["USD"] | {"pointWeights": [-1] * 12},
        SURFACES["Rhino"] | {"CountU": 10**30},
        SURFACES["Rhino"] | {"Points": [[0]]},
        SURFACES["Open CASCADE"] | {"u_multiplicities": [10**9, 1, 3]},
        {"points": V_FASTEST.tolist(), "degree": [2, 1], "knots": [KNOTS_U, KNOTS_V]},
        {"order": 4, "control_net": NET.tolist()},
        {"ctrlpts": None},
        GEOMDL | {"ctrlpts": [[0, 0, 0]] * 500, "size_u": 20, "size_v": 25},
    ],
)
def test_in_doubt_the_refusal_shows_the_form_of_a_request(fields: dict[str, Any]) -> None:
    needed = refuse({"surface": fields})[0].needed
    assert '"control_net": [[[x, y, z], …], …]' in needed


def test_requests_that_are_shown_are_short_and_repeat_no_text() -> None:
    net = (np.arange(390).reshape(13, 10, 3) * 1.123456789).reshape(-1, 3).tolist()
    fields = {"ctrlpts": net, "size_u": 13, "size_v": 10, "degree_u": 12, "degree_v": 9}
    assert len(refuse({"surface": fields | {"name": "secret"}})[0].needed) < MAX_REQUEST + 200
    issues = refuse({"surface": SURFACES["geomdl"] | {"name": "secret"}, "up": "secret"})
    assert "secret" not in str(issues)


def test_surfaces_inside_surfaces_are_explained_too() -> None:
    square = {"ctrlpts": [[0, 0, 0]] * 4, "degree_u": 1, "degree_v": 1}
    for surface, where in (
        ({"type": "group", "members": [{"surface": square}]}, "/surface/members/0/surface"),
        ({"type": "multipatch", "surfaces": [square]}, "/surface/surfaces/0"),
    ):
        issue = refuse({"surface": surface})[0]
        assert issue.pointer.startswith(where)
        assert "`control_net`" in issue.needed


@pytest.mark.parametrize(
    "fields",
    [
        {"ctrlpts": [[0, 0], [1, 1], [2, 0]], "degree": 2, "knotvector": [0, 0, 0, 1, 1, 1]},
        {"poles": [[0, 0], [1, 1], [2, 0]], "degree": 2, "knots": [0, 1], "multiplicities": [3, 3]},
        {"control_points": [[0, 0], [1, 1], [2, 0]], "degrees": [2],
         "knot_vectors": [[0, 0, 0, 1, 1, 1]]},
        {"points": [[0, 0], [1, 1], [2, 0]], "order": 3, "knots": [0, 0, 0, 1, 1, 1]},
    ],
)  # fmt: skip
def test_curves_are_translated(fields: dict[str, Any]) -> None:
    issues = refuse({"curve": fields}, CurveRequest)
    request = validate_document(CurveRequest, read_request(issues[0]))
    curve = request.to_curve()
    np.testing.assert_array_equal(curve.control_points[1][:2], [1, 1])


@pytest.mark.parametrize("points", [V_FASTEST.tolist(), NET.ravel().tolist()])
def test_a_flat_list_is_one_error_that_says_how_to_split_it(points: list[Any]) -> None:
    surface: dict[str, Any] = {"type": "bspline", "degree": [2, 1], "knots": [KNOTS_U, KNOTS_V]}
    for fields, pointer in (
        ({"control_net": points}, "/surface/control_net/0"),
        ({"control_net": NET.tolist(), "weights": [1] * 12}, "/surface/weights/0"),
    ):
        (issue,) = refuse({"surface": surface | fields})
        assert issue.code == "wrong_type"
        assert issue.pointer.startswith(pointer)
        assert "4 rows of 3, if v varies fastest" in issue.needed
        assert "number i + 4 j" in issue.needed
    surface = {"type": "bspline", "degree": [2, 1], "control_net": points}
    (issue,) = refuse({"surface": surface})
    assert issue.needed == "a list of rows along u, [[[x, y, z], …], …]"
    sizes = refuse({"surface": surface | {"size_u": 4, "size_v": 3}})
    assert "4 rows of 3" in sizes[-1].needed


def test_degree_and_knots_without_a_kind_name_the_kind() -> None:
    surface = {"control_net": NET.tolist(), "degree": [2, 1], "knots": [KNOTS_U, KNOTS_V]}
    degree, knots = refuse({"surface": surface})
    assert degree.needed.startswith("`type`: `bspline`")
    assert knots.needed.startswith("`type`: `bspline`")
    assert read_request(degree) == {"surface": {"type": "bspline"} | surface}


def test_fields_of_a_surface_beside_it_belong_inside() -> None:
    issues = {issue.pointer: issue for issue in refuse({"control_net": NET.tolist()})}
    assert issues["/control_net"].needed == "`surface`, with it inside"


def test_format_in_a_body_belongs_into_the_query() -> None:
    (issue,) = refuse({"surface": {"control_net": NET.tolist()}, "format": "stl"})
    assert issue.pointer == "/format"
    assert issue.needed.startswith("`format` in the query")


def test_a_file_of_geomdl_is_sent_as_a_file() -> None:
    issue = refuse({"shape": {"type": "surface", "data": []}})[0]
    assert issue.pointer == "/shape"
    assert "application/vnd.geomdl+json" in issue.needed


def test_names_are_folded_and_no_field_of_a_surface_is_one_of_them() -> None:
    assert fold_name("Knots_U") == fold_name("knotsU") == "knotsu"
    assert all(re.fullmatch("[a-z0-9]+", name) for name in ROLES)
    own = {"weights", "degree", "knots"}
    assert own <= ROLES.keys()
    assert not {"controlnet", "vertices", "patches", "curve", "radius"} & ROLES.keys()


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([*ROLES]), inner),
)


@given(st.dictionaries(st.sampled_from([*ROLES, "type", "control_net"]), _VALUES, max_size=6),
       st.sampled_from([*SURFACES]))  # fmt: skip
def test_any_fields_are_refused_or_accepted(fields: dict[str, Any], program: str) -> None:
    for document in (fields, {"surface": fields}, {"surface": SURFACES[program] | fields}):
        with suppress(InvalidRequest):
            validate_document(SurfaceRequest, document)
