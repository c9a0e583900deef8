"""Breps are checked when they are made; invalid faces are refused or left out."""

from collections import Counter
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface
from service.surface.brep_model import BrepModel
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.member import Member
from tests.breps import PLATE, build_box

Document = dict[str, Any]


def read(document: Document) -> BrepSurface:
    surface = validate_document(SurfaceRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    return surface


def refuse(document: Document) -> list[tuple[str, str]]:
    """Codes and pointers of a brep that must be refused."""
    with pytest.raises(InvalidRequest) as caught:
        read(document)
    return [(issue.code, issue.pointer.removeprefix("/surface")) for issue in caught.value.issues]


def skip(document: Document) -> BrepModel:
    return read(document | {"invalid_faces": "skip"}).lower()


def list_coedges(document: Document) -> list[tuple[int, int, int, bool]]:
    """Face, loop, edge and direction of each coedge."""
    return [
        (f, j, edge, is_reversed)
        for f, face in enumerate(document["faces"])
        for j, loop in enumerate(face.get("loops", []))
        for edge, is_reversed in zip(
            loop["edges"], loop.get("reversed", [False] * len(loop["edges"])), strict=True
        )
    ]


def find_open_loops(document: Document) -> set[str]:
    """Pointers of the loops whose edges do not follow each other, slowly."""
    chains: dict[str, list[tuple[int, int]]] = {}
    for f, j, edge, is_reversed in list_coedges(document):
        first, last = document["edges"][edge]["vertices"]
        step = (last, first) if is_reversed else (first, last)
        chains.setdefault(f"/faces/{f}/loops/{j}", []).append(step)
    return {
        pointer
        for pointer, chain in chains.items()
        if any(chain[k - 1][1] != chain[k][0] for k in range(len(chain)))
    }


def find_uses(document: Document) -> tuple[set[str], set[str]]:
    """Edges that are used twice in one direction, and closed shells with borders, slowly."""
    twice, open_shells = set(), set()
    for h, shell in enumerate(document["shells"]):
        uses: Counter[tuple[int, bool]] = Counter()
        for f, _, edge, is_reversed in list_coedges(document):
            if f in shell["faces"]:
                flips = document["faces"][f].get("reversed", False)
                uses[edge, is_reversed != flips] += 1
        for edge in {edge for edge, _ in uses}:
            forward, backward = uses[edge, False], uses[edge, True]
            if sorted((forward, backward)) == [0, 2]:
                twice.add(f"/edges/{edge}")
            if forward != backward and shell["closed"]:
                open_shells.add(f"/shells/{h}")
    return twice, open_shells


def test_a_box_is_a_closed_shell() -> None:
    model = read(build_box()).lower()
    assert (model.face_count, len(model.edge_vertices), len(model.coedge_edges)) == (6, 12, 24)
    assert model.is_closed.tolist() == [True]
    assert model.face_shells.tolist() == [0] * 6
    assert model.coedge_faces.tolist() == np.repeat(np.arange(6), 4).tolist()
    assert not model.skipped
    low, high = model.bounds
    assert (low.tolist(), high.tolist()) == ([0, 0, 0], [2, 3, 4])
    assert model.uncertainty == pytest.approx(1e-6 * 29**0.5)


def test_lines_become_curves_of_degree_one_from_vertex_to_vertex() -> None:
    model = read(PLATE).lower()
    assert model.edge_curves.tolist() == [1, 2, 3, 4, 0]
    assert model.curves.degrees.tolist() == [2, 1, 1, 1, 1]
    lines = model.curves.select(np.arange(1, 5))
    assert lines.points.reshape(4, 2, 3).tolist() == [
        [PLATE["vertices"][k] for k in PLATE["edges"][e]["vertices"]] for e in range(4)
    ]
    assert lines.domains.tolist() == [[0, 1]] * 4


def test_weights_that_are_equal_have_no_effect() -> None:
    document = deepcopy(PLATE)
    document["faces"][0]["surface"]["weights"] = [[3, 3], [3, 3]]
    surfaces = read(document).lower().surfaces
    assert not surfaces.is_rational.any()
    assert (surfaces.weights == 1).all()


@st.composite
def draw_boxes(draw: st.DrawFn) -> Document:
    """Boxes with some changed flags and edges, and sometimes two shells."""
    document = build_box()
    for _ in range(draw(st.integers(0, 3))):
        face = draw(st.sampled_from(document["faces"]))
        loop = face["loops"][0]
        position = draw(st.integers(0, 3))
        match draw(st.integers(0, 3)):
            case 0:
                face["reversed"] = True
            case 1:
                loop["reversed"][position] ^= True
            case 2:
                loop["edges"][position] = draw(st.integers(0, 11))
            case 3:
                loop["edges"].reverse()
                loop["reversed"] = [not flag for flag in reversed(loop["reversed"])]
    if draw(st.booleans()):
        is_closed = draw(st.booleans())
        document["shells"] = [
            {"faces": [0, 2, 4], "closed": is_closed},
            {"faces": [5, 3, 1], "closed": False},
        ]
    return document


@given(draw_boxes())
def test_faults_are_those_that_a_slow_search_finds(document: Document) -> None:
    open_loops = find_open_loops(document)
    twice, open_shells = find_uses(document)
    if open_loops:
        assert set(refuse(document)) == {("loop_open", pointer) for pointer in open_loops}
    elif twice:
        expected = {("used_twice_same_direction", pointer) for pointer in twice}
        assert set(refuse(document)) == expected
    elif open_shells:
        assert set(refuse(document)) == {("not_closed", pointer) for pointer in open_shells}
    else:
        read(document)


@given(draw_boxes())
def test_the_faces_left_after_skipping_have_no_faults(document: Document) -> None:
    model = skip(document)
    skipped = {face.face for face in model.skipped}
    assert {face for face in range(6) if (model.loop_faces == face).any()} | skipped == set(
        range(6)
    )
    assert not skipped & set(model.loop_faces.tolist())
    assert not skipped & set(model.shell_faces.tolist())
    rest = deepcopy(document)
    for face in skipped:
        rest["faces"][face]["loops"] = []
    assert not find_open_loops(rest)
    twice, open_shells = find_uses(rest)
    assert not twice
    for shell, is_closed in enumerate(model.is_closed.tolist()):
        assert not is_closed or f"/shells/{shell}" not in open_shells
    for face in skipped:
        pointer = f"/faces/{face}/loops/0"
        is_open = pointer in find_open_loops(document)
        issue = next(each.issue for each in model.skipped if each.face == face)
        assert issue.code == ("loop_open" if is_open else "used_twice_same_direction")
        assert issue.got
        assert issue.needed


def test_a_face_that_is_turned_around_is_skipped_alone() -> None:
    document = build_box()
    document["faces"][3]["reversed"] = True
    codes = refuse(document)
    assert len(codes) == 4
    assert {code for code, _ in codes} == {"used_twice_same_direction"}
    model = skip(document)
    assert [face.face for face in model.skipped] == [3]
    assert model.is_closed.tolist() == [False]
    assert model.shell_counts.tolist() == [5]


def test_edges_with_unknown_vertices_leave_out_their_faces() -> None:
    document = build_box()
    document["edges"][0]["vertices"] = [0, 8]
    users = {f for f, _, edge, _ in list_coedges(document) if edge == 0}
    assert refuse(document) == [("unknown_vertex", "/edges/0/vertices")]
    model = skip(document)
    assert {face.face for face in model.skipped} == users
    assert {face.issue.code for face in model.skipped} == {"unknown_vertex"}
    assert model.is_degenerate.tolist() == [True] + [False] * 11
    assert model.face_count == 6


def test_an_edge_that_no_face_has_must_have_vertices_too() -> None:
    document = build_box()
    document["edges"].append({"vertices": [0, 8]})
    assert refuse(document) == [("unknown_vertex", "/edges/12/vertices")]
    assert not skip(document).skipped


def test_unknown_edges_leave_out_their_face() -> None:
    document = build_box()
    document["faces"][2]["loops"][0]["edges"][1] = 12
    assert refuse(document) == [("unknown_edge", "/faces/2/loops/0/edges/1")]
    assert [face.face for face in skip(document).skipped] == [2]


def test_all_faces_of_a_brep_may_be_left_out() -> None:
    document = deepcopy(PLATE)
    document["faces"][0]["loops"][0]["edges"] = [0, 1, 2]
    model = skip(document)
    assert [face.issue.code for face in model.skipped] == ["loop_open"]
    assert (len(model.loop_counts), len(model.coedge_edges), len(model.shell_faces)) == (0, 0, 0)
    document["vertices"] = []
    del document["vertex_uncertainties"]
    model = skip(document)
    assert [face.issue.code for face in model.skipped] == ["unknown_vertex"]
    assert len(model.edge_vertices) == 0


@pytest.mark.parametrize(("shift", "is_refused"), [(0.05, False), (2.0, True)])
def test_ends_of_curves_may_be_a_tenth_of_the_face_from_their_vertices(
    shift: float, is_refused: bool
) -> None:
    """The diagonal of a face is that of its edges, here 14.1: its surface may be larger."""
    document = deepcopy(PLATE)
    document["faces"][0]["surface"]["control_net"] = [
        [[-1e3, -1e3, 0], [-1e3, 1e3, 0]],
        [[1e3, -1e3, 0], [1e3, 1e3, 0]],
    ]
    document["vertices"][4][2] = shift
    if is_refused:
        assert refuse(document) == [("edge_not_at_vertex", "/edges/4/vertices")]
        assert [face.issue.code for face in skip(document).skipped] == ["edge_not_at_vertex"]
    else:
        read(document)


def test_a_line_from_a_point_to_the_same_point_is_no_edge() -> None:
    document = deepcopy(PLATE)
    document["vertices"][1] = document["vertices"][0]
    assert refuse(document) == [("degenerate_curve", "/edges/0")]


def test_degenerate_edges_are_not_counted_as_borders() -> None:
    """A cone of two faces: each has the apex as a degenerate edge of its own."""
    half = [[1, 0, 0], [1, 2, 0], [-1, 2, 0], [-1, 0, 0]]
    other = [[-x, -y, z] for x, y, z in half]
    document = {
        "type": "brep",
        "vertices": [[1, 0, 0], [-1, 0, 0], [0, 0, 2]],
        "edges": [
            {"vertices": [0, 1], "curve": {"control_points": half}},
            {"vertices": [1, 0], "curve": {"control_points": other}},
            {"vertices": [0, 2]},
            {"vertices": [1, 2]},
            {"vertices": [2], "degenerate": True},
            {"vertices": [2, 2], "degenerate": True},
        ],
        "faces": [
            {
                "surface": {"control_net": [[a, [0, 0, 2]] for a in half]},
                "loops": [{"edges": [0, 3, 4, 2], "reversed": [False, False, False, True]}],
            },
            {
                "surface": {"control_net": [[a, [0, 0, 2]] for a in other]},
                "loops": [{"edges": [1, 2, 5, 3], "reversed": [False, False, False, True]}],
            },
            {
                "surface": {"control_net": [[[-9, -9, 0], [9, -9, 0]], [[-9, 9, 0], [9, 9, 0]]]},
                "loops": [{"edges": [1, 0], "reversed": [True, True]}],
            },
        ],
        "shells": [{"faces": [0, 1, 2], "closed": True}],
    }
    model = read(document).lower()
    assert model.is_closed.tolist() == [True]
    assert model.edge_curves.tolist()[4:] == [-1, -1]
    assert model.edge_vertices.tolist()[4:] == [[2, 2], [2, 2]]


def test_a_closed_shell_has_no_loop_of_pcurves_alone() -> None:
    document = build_box()
    square = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    lines = [{"control_points": square[k : k + 2]} for k in range(4)]
    document["faces"][5]["loops"] = [{"pcurves": lines}]
    assert refuse(document) == [("not_closed", "/shells/0")]
    document["shells"][0]["closed"] = False
    model = read(document).lower()
    assert model.coedge_edges.tolist()[-4:] == [-1] * 4
    assert model.coedge_pcurves.tolist()[-4:] == [0, 1, 2, 3]


def test_every_face_belongs_to_one_shell() -> None:
    document = build_box()
    document["shells"] = [{"faces": [0, 1, 7]}, {"faces": [1, 2]}]
    assert refuse(document) == [
        ("unknown_face", "/shells/0/faces/2"),
        ("repeated_face", "/shells/1/faces/0"),
        ("missing_face", "/shells"),
    ]


def test_uncertainties_are_those_of_the_brep_unless_they_are_given() -> None:
    document = build_box()
    document |= {"uncertainty": 1e-3, "vertex_uncertainties": [*range(8)]}
    document["edges"][3]["uncertainty"] = 0.25
    model = read(document).lower()
    assert model.uncertainty == 1e-3
    assert model.vertex_uncertainties.tolist() == [*range(8)]
    assert model.edge_uncertainties.tolist() == [1e-3] * 3 + [0.25] + [1e-3] * 8


def test_the_size_counts_faces_edges_coedges_patches_and_colours() -> None:
    size = read(PLATE).size()
    assert (size.faces, size.edges, size.coedges, size.members) == (1, 5, 5, 1)
    assert (size.face_colors, size.face_patches, size.edge_pieces) == (1, 1, 8)
    assert (size.degree, size.patches, size.curves) == ((1, 1), 0, 0)
    wave = [[[i, j, i * j % 2] for j in range(5)] for i in range(4)]
    face = {"surface": {"type": "bspline", "control_net": wave, "degree": [2, 3]}}
    brep = read({"type": "brep", "faces": [face, face]})
    spline = BsplineSurface(np.array(wave, np.float64), (2, 3)).size()
    assert brep.size().degree == (2, 3)
    assert brep.size().face_patches == 2 * spline.patches
    assert brep.size().control_points == 2 * spline.control_points
    group = GroupSurface((Member(brep), Member(brep, name="other"), Member(read(PLATE))))
    assert (group.size().faces, group.size().face_patches) == (5, 4 * spline.patches + 1)
    assert group.stored_size().faces == 3


def test_arrays_of_a_brep_cannot_be_changed() -> None:
    brep = read(PLATE)
    for array in (brep.vertices, brep.curves.points, brep.coedge_edges, brep.surfaces.knots):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7


def test_splines_of_a_brep_made_without_a_document_are_checked_too() -> None:
    brep = read(PLATE)
    columns = {name: getattr(brep, name) for name in brep.__dataclass_fields__ if name[0] != "_"}
    knots = brep.curves.knots.copy()
    knots[4] = -1
    points = brep.surfaces.points.copy()
    points[0, 0] = np.nan
    for name, table, where in (
        ("curves", replace(brep.curves, knots=knots), "/edges/4/curve/knots/4"),
        ("surfaces", replace(brep.surfaces, points=points), "/faces/0/surface/control_net/0/0/0"),
    ):
        with pytest.raises(InvalidRequest) as caught:
            BrepSurface(**columns | {name: table})
        assert caught.value.issues[0].pointer == where
