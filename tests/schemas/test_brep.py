"""Breps as documents: read in batches as single models read them, refused alike, written back."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from service.errors import InvalidRequest, Issue
from service.schemas.batches import Unreadable
from service.schemas.brep_batches import read_edges, read_faces
from service.schemas.brep_parts import EdgeDefinition, FaceDefinition
from service.schemas.budget import DocumentBudget
from service.schemas.curves import CurveDefinition
from service.schemas.document import DEFAULT_LIMITS, MAX_BYTES, DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import definition
from service.schemas.validation import parse_request, validate_document
from service.storage.canonical import canonical_content, restore_surface
from service.surface.bezier import BezierSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from tests.breps import PLATE
from tools.breps import build_sheet, load_solid, repeat_solid


def read(document: dict[str, Any], limits: DocumentLimits = DEFAULT_LIMITS) -> BrepSurface:
    surface = validate_document(SurfaceRequest, {"surface": document}, limits).to_surface()
    assert isinstance(surface, BrepSurface)
    return surface


def refuse(document: dict[str, Any], limits: DocumentLimits = DEFAULT_LIMITS) -> tuple[Issue, ...]:
    with pytest.raises(InvalidRequest) as caught:
        read(document, limits)
    return caught.value.issues


def write(brep: BrepSurface) -> bytes:
    return orjson.dumps(definition(brep), option=orjson.OPT_SERIALIZE_NUMPY)


def test_the_fields_of_the_example_are_read() -> None:
    brep = read(PLATE)
    assert (brep.name, brep.up, brep.uncertainty, brep.invalid_faces) == (
        "plate",
        "z",
        1e-6,
        "refuse",
    )
    assert brep.vertices.tolist() == PLATE["vertices"]
    assert brep.vertex_uncertainties is not None
    assert brep.vertex_uncertainties.tolist() == [1e-6] * 5
    assert brep.edge_vertices.tolist() == [[0, 1], [1, 2], [2, 3], [3, 0], [4, 4]]
    assert brep.edge_curves.tolist() == [-1, -1, -1, -1, 0]
    assert brep.edge_uncertainties is not None
    assert brep.edge_uncertainties.tolist() == [1e-6] * 4 + [1e-5]
    assert brep.curves.points.tolist() == PLATE["edges"][4]["curve"]["control_points"]
    assert brep.face_names == ("top",)
    assert brep.palette.tolist() == [[0.8, 0.2, 0.1, 1]]
    assert brep.face_colors.tolist() == [0]
    assert brep.loop_counts.tolist() == [4, 1]
    assert brep.coedge_edges.tolist() == [0, 1, 2, 3, 4]
    assert brep.coedge_reversed.tolist() == [False] * 4 + [True]
    assert brep.coedge_pcurves.tolist() == [-1] * 5
    assert (brep.shell_faces.tolist(), brep.is_closed.tolist()) == ([0], [False])


def test_fields_with_defaults_may_be_left_out() -> None:
    document = deepcopy(PLATE)
    for field in ("name", "up", "uncertainty", "invalid_faces", "vertex_uncertainties", "shells"):
        del document[field]
    for field in ("name", "color", "reversed"):
        del document["faces"][0][field]
    brep = read(document)
    assert (brep.name, brep.up, brep.invalid_faces) == ("brep", "y", "refuse")
    assert brep.uncertainty == pytest.approx(1e-6 * 200**0.5)
    assert brep.vertex_uncertainties is not None
    assert (brep.vertex_uncertainties == brep.uncertainty).all()
    assert (brep.face_names, brep.face_colors.tolist()) == (("",), [-1])
    assert (brep.shell_counts.tolist(), brep.is_closed.tolist()) == ([1], [False])


def test_a_face_without_loops_needs_neither_vertices_nor_edges() -> None:
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
    face: dict[str, Any] = {"surface": {"control_net": net}}
    short = read({"type": "brep", "faces": [face]})
    face = face | {"loops": []}
    empty: dict[str, Any] = {"vertices": [], "vertex_uncertainties": [], "edges": []}
    long = read({"type": "brep", "faces": [face]} | empty)
    assert long.vertex_uncertainties is not None
    assert long.vertex_uncertainties.shape == (0,)
    assert canonical_content(short) == canonical_content(long)
    assert short.uncertainty == pytest.approx(1e-6 * 3**0.5)


@pytest.mark.parametrize("name", ["sphere", "plate", "wavy"])
def test_curves_and_surfaces_are_those_that_single_models_read(name: str) -> None:
    document = load_solid(name)
    brep = read(document)
    curves: TypeAdapter[Any] = TypeAdapter(CurveDefinition)
    tables = [
        (brep.curves, [edge["curve"] for edge in document["edges"] if "curve" in edge]),
        (brep.pcurves, [curve for curve in list_pcurves(document) if curve]),
    ]
    for table, definitions in tables:
        assert len(table) == len(definitions)
        for number, content in enumerate(definitions):
            single, one = (
                curves.validate_python(content).to_curve(),
                table.select(np.array([number])),
            )
            assert np.array_equal(one.points, single.control_points)
            pieces = single.lower()
            assert one.is_rational[0] == (pieces.weights is not None)
            assert one.degrees.tolist() == [pieces.degree]
            assert one.domains[0].tolist() == [pieces.breaks[0], pieces.breaks[-1]]
    for number, face in enumerate(document["faces"]):
        one_surface = brep.surfaces.select(np.array([number]))
        surface = validate_document(SurfaceRequest, {"surface": face["surface"]}).to_surface()
        assert isinstance(surface, BezierSurface | BsplineSurface)
        model = surface.lower()
        assert tuple(one_surface.degrees[0].tolist()) == surface.degree
        assert one_surface.points.tobytes() == surface.control_net.tobytes()
        domain = model.domains[0]
        assert one_surface.domains[0].tolist() == [[d[0], d[-1]] for d in (domain.u, domain.v)]
        assert one_surface.is_rational[0] == (model.batches[0].weights is not None)


def list_pcurves(document: dict[str, Any]) -> Iterator[Any]:
    for face in document["faces"]:
        for loop in face.get("loops", []):
            yield from loop.get("pcurves", [])


FACES: list[dict[str, Any]] = [
    {
        "surface": {
            "type": "bspline",
            "control_net": [[[i, j, i * j] for j in range(3)] for i in range(4)],
            "degree": [2, 1],
            "knots": ["uniform", [0, 0, 1, 2, 2]],
            "weights": [[1, 2, 1]] * 4,
        },
        "loops": [
            {
                "pcurves": [
                    {"control_points": [[0, 0], [1, 0], [1, 1]], "weights": [1, 2, 1], "name": "a"},
                    {
                        "type": "bspline",
                        "control_points": [[1, 1], [0, 1], [0, 0]],
                        "degree": 1,
                        "knots": [0, 0.5, 1],
                        "up": "z",
                    },
                ],
                "reversed": [False, True],
            }
        ],
    },
    PLATE["faces"][0],
    {
        "surface": {
            "type": "bspline",
            "control_net": [[[i, j, i * j % 3] for j in range(3)] for i in range(3)],
            "degree": 2,
            "knots": ["periodic", "clamped"],
        },
        "color": [0, 1, 0.5, 0.25],
        "reversed": True,
        "loops": [{"edges": [0], "pcurves": [{"control_points": [[0, 0], [1, 1]]}]}],
    },
]
EDGES: list[dict[str, Any]] = [
    {"vertices": [0, 1], "curve": {"control_points": [[0, 0, 0], [1, 1, 1]]}},
    {"vertices": [3], "degenerate": True, "uncertainty": 1e-3},
    PLATE["edges"][4],
    {
        "vertices": [2, 2],
        "curve": {
            "type": "bspline",
            "control_points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
            "degree": 2,
            "knots": "periodic",
            "weights": [1, 2, 3],
        },
    },
    {"vertices": [0, 1]},
]
TEXTS = ["", "x", "periodic", "clamped", "bezier", "bspline", "y"]
LISTS: list[Any] = [[], [0], [0, 1], [[0, 0]], [[0, 0, 0]], [0.5] * 3, [None], [True, False]]
NESTED: list[Any] = [{}, [[0, 0], [1, 1]], [[0, 0, 0], [1, 1, 1]], FACES[2]["loops"][0]]
SCALARS: list[Any] = [None, True, False, 0, 1, -1, 2, 65, 1.5, -0.5, 1e39, 2**60]
WRONG = st.sampled_from([*SCALARS, *TEXTS, *LISTS, *NESTED, {"control_points": [[0, 0], [1, 1]]}])
FIELD_NAMES = {*EDGES[2], *FACES[1], *FACES[0]["loops"][0], *FACES[0]["surface"], "degenerate", "x"}
NAMES = st.sampled_from(sorted(FIELD_NAMES))


@st.composite
def mutate(draw: st.DrawFn, items: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Some of the items, in any order, in which one value has changed, is gone, or is new."""
    chosen = draw(st.lists(st.sampled_from(items), min_size=1, max_size=3))
    copies = deepcopy(chosen)
    value: Any = copies
    while True:
        keys = list(value) if isinstance(value, dict) else list(range(len(value)))
        key = draw(st.sampled_from(keys))
        if isinstance(value[key], dict | list) and value[key] and draw(st.integers(0, 5)):
            value = value[key]
            continue
        change = draw(st.integers(0, 3))
        if change == 0 and value is not copies:
            del value[key]
        elif change == 1 and isinstance(value, dict):
            value[draw(NAMES)] = draw(WRONG)
        else:
            value[key] = draw(WRONG)
        return copies


def is_readable(read_items: Callable[..., object], items: list[dict[str, Any]]) -> bool:
    try:
        read_items(items, DEFAULT_LIMITS)
    except Unreadable:
        return False
    return True


def are_valid(adapter: TypeAdapter[Any], items: list[dict[str, Any]]) -> bool:
    try:
        for item in items:
            adapter.validate_python(item, context=DEFAULT_LIMITS)
    except ValidationError:
        return False
    return True


@given(mutate(EDGES))
def test_batches_accept_the_edges_that_their_model_accepts(items: list[dict[str, Any]]) -> None:
    assert is_readable(read_edges, items) == are_valid(TypeAdapter(EdgeDefinition), items)


@given(mutate(FACES))
def test_batches_accept_the_faces_that_their_model_accepts(items: list[dict[str, Any]]) -> None:
    assert is_readable(read_faces, items) == are_valid(TypeAdapter(FaceDefinition), items)


def test_batches_accept_all_items_before_they_are_changed() -> None:
    assert is_readable(read_edges, EDGES)
    assert is_readable(read_faces, FACES)
    assert are_valid(TypeAdapter(EdgeDefinition), EDGES)
    assert are_valid(TypeAdapter(FaceDefinition), FACES)


def change(path: str, value: object) -> dict[str, Any]:
    """The plate with another value at a path; a path that ends in − takes the value away."""
    document: Any = deepcopy(PLATE)
    *parts, last = path.removesuffix("-").split("/")
    inner = document
    for part in parts:
        inner = inner[int(part) if part.isdigit() else part]
    key: Any = int(last) if last.isdigit() else last
    if path.endswith("-"):
        del inner[key]
    else:
        inner[key] = value
    return dict(document)


BAD_KNOTS = {
    "type": "bspline",
    "control_net": [[[i, j, 0] for j in range(4)] for i in range(4)],
    "degree": 1,
    "knots": [[0, 0, 1, 1, 2, 2], "clamped"],
}
CURVE = "edges/4/curve"
NET = "faces/0/surface/control_net"
POINTS = {"control_points": [[0, 0, 0], [1, 1, 1]]}
SHORT = {"type": "bspline", "control_points": [[0, 0], [1, 1]]}
PCURVE = "faces/0/loops/1/pcurves/0"
REFUSALS: list[tuple[str, object, str, str]] = [
    ("vertices", [[0, 0]], "wrong_dimension", "/vertices/0"),
    ("vertices/1/2", 1e39, "coordinate_too_large", "/vertices/1/2"),
    ("vertex_uncertainties", [1, 2], "wrong_length", "/vertex_uncertainties"),
    ("vertex_uncertainties/2", -1, "out_of_range", "/vertex_uncertainties/2"),
    ("vertex_uncertainties/2", 1e39, "out_of_range", "/vertex_uncertainties/2"),
    ("uncertainty", -1, "out_of_range", "/uncertainty"),
    ("uncertainty", 1e300, "out_of_range", "/uncertainty"),
    ("invalid_faces", "keep", "wrong_value", "/invalid_faces"),
    ("edges", {}, "wrong_type", "/edges"),
    ("edges/0", [], "wrong_type", "/edges/0"),
    ("edges/0/vertices-", None, "missing_field", "/edges/0/vertices"),
    ("edges/0/vertices", [0], "wrong_length", "/edges/0/vertices"),
    ("edges/0/vertices", [0, 1, 2], "wrong_length", "/edges/0/vertices"),
    ("edges/0/vertices/1", 1.5, "wrong_type", "/edges/0/vertices/1"),
    ("edges/0/vertices/1", 5, "unknown_vertex", "/edges/0/vertices"),
    ("edges/0/vertices/0", -1, "unknown_vertex", "/edges/0/vertices"),
    ("edges/0/vertices/0", 1, "degenerate_curve", "/edges/0"),
    ("edges/0/curve", None, "null_value", "/edges/0/curve"),
    ("edges/0/degenerate", True, "wrong_length", "/edges/0/vertices"),
    ("edges/4/degenerate", True, "conflicting_options", "/edges/4/curve"),
    ("edges/0/uncertainty", -1, "out_of_range", "/edges/0/uncertainty"),
    ("edges/3/uncertainty", 1e39, "out_of_range", "/edges/3/uncertainty"),
    ("edges/0/colour", 1, "unknown_field", "/edges/0/colour"),
    (f"{CURVE}/type", "nurbs", "unknown_type", f"/{CURVE}/type"),
    (f"{CURVE}/degree", 0, "out_of_range", f"/{CURVE}/degree"),
    (f"{CURVE}/degree", 3, "wrong_length", f"/{CURVE}/knots"),
    (f"{CURVE}/knots/3", -1, "knots_decrease", f"/{CURVE}/knots/3"),
    (f"{CURVE}/knots/5", 1, "knot_multiplicity", f"/{CURVE}/knots/5"),
    (f"{CURVE}/knots", "cubic", "wrong_value", f"/{CURVE}/knots"),
    (f"{CURVE}/weights/3", -1, "weight_not_positive", f"/{CURVE}/weights/3"),
    (f"{CURVE}/weights/3", 1e-9, "weight_ratio", f"/{CURVE}/weights"),
    (f"{CURVE}/weights", [1, 2], "weights_shape", f"/{CURVE}/weights"),
    (f"{CURVE}/control_points/2", [5, 7], "ragged", f"/{CURVE}/control_points/2"),
    (f"{CURVE}/control_points/2/0", "5", "wrong_type", f"/{CURVE}/control_points/2/0"),
    (CURVE, {"control_points": [[7, 5]] * 2}, "wrong_dimension", f"/{CURVE}/control_points"),
    (CURVE, {"control_points": [[7, 5, 0]] * 2}, "degenerate_curve", f"/{CURVE}/control_points"),
    (CURVE, {"control_points": [[7, 5, 0], [7, 7, 0]]}, "edge_not_at_vertex", "/edges/4/vertices"),
    ("faces", [], "wrong_length", "/faces"),
    ("faces-", None, "missing_field", "/faces"),
    ("faces/0", 1, "wrong_type", "/faces/0"),
    ("faces/0/name", "", "wrong_length", "/faces/0/name"),
    ("faces/0/name", "a\nb", "wrong_value", "/faces/0/name"),
    ("faces/0/color", [1, 0], "wrong_length", "/faces/0/color"),
    ("faces/0/color/1", 1.5, "out_of_range", "/faces/0/color/1"),
    ("faces/0/reversed", 0, "wrong_type", "/faces/0/reversed"),
    ("faces/0/surface-", None, "missing_field", "/faces/0/surface"),
    ("faces/0/surface/type", "triangle", "unknown_type", "/faces/0/surface/type"),
    ("faces/0/surface/up", "z", "unknown_field", "/faces/0/surface/up"),
    ("faces/0/surface/name", "top", "unknown_field", "/faces/0/surface/name"),
    ("faces/0/surface/colors", [[[0, 0, 0]]], "unknown_field", "/faces/0/surface/colors"),
    ("faces/0/surface/uvs", [[[0, 0]]], "unknown_field", "/faces/0/surface/uvs"),
    ("faces/0/surface/attributes", {}, "unknown_field", "/faces/0/surface/attributes"),
    (f"{NET}/1/0/1", 1e39, "coordinate_too_large", f"/{NET}/1/0/1"),
    (f"{NET}/1", [[1, 0, 0]], "ragged", f"/{NET}/1"),
    ("faces/0/surface", BAD_KNOTS, "knot_multiplicity", "/faces/0/surface/knots/0"),
    ("faces/0/loops", None, "null_value", "/faces/0/loops"),
    ("faces/0/loops/0", {}, "missing_field", "/faces/0/loops/0/edges"),
    ("faces/0/loops/0/edges", [], "wrong_length", "/faces/0/loops/0/edges"),
    ("faces/0/loops/0/edges/2", 5, "unknown_edge", "/faces/0/loops/0/edges/2"),
    ("faces/0/loops/0/edges/2", -1, "unknown_edge", "/faces/0/loops/0/edges/2"),
    ("faces/0/loops/0/edges/2", True, "wrong_type", "/faces/0/loops/0/edges/2"),
    ("faces/0/loops/0/edges", [0, 2, 1, 3], "loop_open", "/faces/0/loops/0"),
    ("faces/0/loops/0/edges", [0, 1, 2], "loop_open", "/faces/0/loops/0"),
    ("faces/0/loops/1/reversed", [True, False], "wrong_length", "/faces/0/loops/1/reversed"),
    ("faces/0/loops/1/pcurves", [None] * 2, "wrong_length", "/faces/0/loops/1/pcurves"),
    ("faces/0/loops/1", {"pcurves": [None]}, "null_value", "/faces/0/loops/1/pcurves/0"),
    (PCURVE, POINTS, "wrong_dimension", f"/{PCURVE}/control_points"),
    (PCURVE, {"control_points": [[0, 0]]}, "too_few_points", f"/{PCURVE}/control_points"),
    (PCURVE, SHORT, "too_few_points", f"/{PCURVE}/control_points"),
    ("shells", [], "wrong_length", "/shells"),
    ("shells/0/faces", [], "empty_list", "/shells/0/faces"),
    ("shells/0/faces", [1], "unknown_face", "/shells/0/faces/0"),
    ("shells/0/faces", [0, 0], "repeated_face", "/shells/0/faces/1"),
    ("shells/0/closed", True, "not_closed", "/shells/0"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "code", "pointer"), REFUSALS)
def test_invalid_breps_are_refused_with_a_pointer_to_the_fault(
    path: str, value: object, code: str, pointer: str
) -> None:
    issues = refuse(change(path, value))
    assert (issues[0].code, issues[0].pointer) == (code, f"/surface{pointer}")
    assert all(issue.got and issue.needed for issue in issues)


def test_a_brep_without_any_point_is_refused() -> None:
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
    face = {"surface": {"control_net": net}, "loops": [{"edges": [0]}]}
    (issue,) = refuse({"type": "brep", "vertices": [], "edges": [], "faces": [face]})
    assert (issue.code, issue.pointer) == ("unknown_edge", "/surface/faces/0/loops/0/edges/0")


def test_errors_of_several_faces_are_reported_together_up_to_twenty() -> None:
    document = deepcopy(PLATE)
    face = document["faces"][0]
    document["faces"] = [face] * 3 + [face | {"name": ""}] * 30
    issues = refuse(document)
    assert [issue.pointer for issue in issues] == [f"/surface/faces/{k}/name" for k in range(3, 23)]


def test_a_wrong_item_among_thousands_is_found_quickly() -> None:
    """Only 20 items are checked by their models, which take milliseconds each."""
    edge = {"vertices": [0, 1]}
    document = PLATE | {"edges": [edge] * 20_000 + [{"vertices": [0, "1"]}] + [edge] * 20_000}
    assert [issue.pointer for issue in refuse(document)] == ["/surface/edges/20000/vertices/1"]


def test_limits_of_faces_points_and_degrees() -> None:
    issue = refuse(PLATE | {"faces": PLATE["faces"] * 3}, DocumentLimits(max_faces=2))[0]
    assert (issue.code, issue.pointer) == ("too_many_faces", "/surface/faces")
    assert (issue.got, issue.needed) == ("3 faces", "at most 2")
    group = {"type": "group", "members": [{"surface": PLATE}] * 3}
    issue = refuse(group, DocumentLimits(max_faces=2))[0]
    assert (issue.code, issue.pointer) == ("too_many_faces", "/surface/members")
    issue = refuse(PLATE, DocumentLimits(max_control_points=17))[0]
    assert (issue.code, issue.pointer) == ("too_many_control_points", "/surface")
    assert issue.got == "18 control points"  # 5 vertices, 9 of the circle, 4 of the plane
    issue = refuse(PLATE, DocumentLimits(max_degree=1))[0]
    assert (issue.code, issue.pointer) == ("degree_too_high", "/surface/edges/4/curve/degree")


@pytest.mark.parametrize("name", ["plate", "sphere", "gear"])
def test_documents_that_are_written_are_read_as_the_same_brep(name: str) -> None:
    brep = read(load_solid(name))
    content = canonical_content(brep)
    again = parse_request(SurfaceRequest, b'{"surface":' + write(brep) + b"}", DEFAULT_LIMITS)
    assert canonical_content(again.to_surface()) == content
    assert canonical_content(restore_surface(content, DEFAULT_LIMITS)) == content


def test_other_ways_to_write_a_brep_have_the_same_content() -> None:
    content = canonical_content(read(PLATE))
    document = deepcopy(PLATE)
    face = document["faces"][0]
    face["color"].append(1)
    face["surface"] |= {"type": "bspline", "degree": 1, "knots": [[0, 0, 1, 1], "clamped"]}
    face["surface"]["weights"] = [[2, 2], [2, 2]]
    face["loops"][0] |= {"pcurves": [None] * 4, "reversed": [False] * 4}
    document["edges"][0] |= {"degenerate": False, "uncertainty": 1e-6}
    circle = document["edges"][4]["curve"]
    circle["knots"] = circle["knots"][1:-1]
    circle |= {"up": "z", "name": "circle"}
    document["edges"][4]["vertices"] = [4, 4]
    del document["shells"], document["vertex_uncertainties"]
    assert canonical_content(read(document)) == content


def test_a_brep_with_some_pcurves_is_stored() -> None:
    document = deepcopy(PLATE)
    line = {"control_points": [[1, 0], [1, 1]]}
    document["faces"][0]["loops"][0]["pcurves"] = [None, line, None, None]
    brep = read(document)
    assert brep.coedge_pcurves.tolist() == [-1, 0, -1, -1, -1]
    content = canonical_content(brep)
    restored = restore_surface(content, DEFAULT_LIMITS)
    assert isinstance(restored, BrepSurface)
    assert restored.coedge_pcurves.tolist() == [-1, 0, -1, -1, -1]
    assert canonical_content(restored) == content
    assert definition(restored)["faces"][0]["loops"][0]["pcurves"][::2] == [None, None]


def test_periodic_splines_are_unrolled() -> None:
    """A closed curve through `periodic` has its first points once more at the end."""
    brep = read({"type": "brep", "faces": [FACES[2] | {"loops": []}]})
    assert brep.surfaces.counts.tolist() == [[5, 3]]
    net = brep.surfaces.points.reshape(5, 3, 3)
    assert np.array_equal(net[:2], net[3:])
    u = brep.surfaces.knots[: brep.surfaces.knot_starts[1]]
    assert u.tolist() == [-2, -1, 0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("has_pcurves", [False, True])
def test_a_brep_of_twenty_thousand_faces_is_within_the_budget_of_documents(
    has_pcurves: bool,
) -> None:
    """The text of a sheet of 200 faces, repeated, has as many values as one of 20,000."""
    sheet = build_sheet(10, 20, has_pcurves=has_pcurves)
    text = orjson.dumps(sheet)
    budget = DocumentBudget()
    for _ in range(DEFAULT_LIMITS.max_faces // len(sheet["faces"])):
        budget.take(text)
    assert budget.received < MAX_BYTES


def test_sheets_and_copies_of_solids_are_breps() -> None:
    assert read(build_sheet(2, 3, has_pcurves=True)).size().edges == 17
    copies = read(repeat_solid(load_solid("plate"), 3)).lower()
    assert (copies.is_closed.tolist(), copies.face_count) == ([True] * 3, 90)
