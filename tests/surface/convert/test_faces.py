"""Faces are taken out of breps: the surface of one, or a brep of some."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.schemas.surfaces import definition
from service.surface.bezier import BezierSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.operations import Elevate, Operation, Select, Split, Untrim
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member
from tests.breps import PLATE, build_box
from tests.surface.test_brep import read


def refuse(surface: Surface, *operations: Operation) -> tuple[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        convert(surface, operations)
    return caught.value.issues[0].code, caught.value.issues[0].pointer


def test_untrim_answers_with_the_surface_of_a_face() -> None:
    surface = convert(read(PLATE), [Untrim(0)])
    assert isinstance(surface, BezierSurface)
    assert surface.control_net.tolist() == PLATE["faces"][0]["surface"]["control_net"]
    assert (surface.name, surface.up) == ("top", "z")


def test_untrim_answers_with_a_spline_if_the_surface_is_one() -> None:
    net = [[[i, j, i * j % 3] for j in range(4)] for i in range(3)]
    weights = [[1, 2, 1, 1]] * 3
    content = {"type": "bspline", "control_net": net, "degree": [2, 2], "weights": weights}
    brep = read({"type": "brep", "faces": [{"surface": content}, {"surface": content}]})
    surface = convert(brep, [Untrim(1)])
    assert isinstance(surface, BsplineSurface)
    expected = BsplineSurface(np.array(net, np.float64), (2, 2))
    assert surface.control_net.tolist() == net
    assert surface.weights is not None
    assert surface.weights.tolist() == weights
    for given_knots, knots in zip(surface.knots, expected.knot_vectors, strict=True):
        assert np.array_equal(given_knots, knots)
    assert surface.name == "brep"


def test_operations_on_nets_follow_untrim() -> None:
    surface = convert(read(PLATE), [Untrim(0), Elevate((2, 3))])
    assert isinstance(surface, BezierSurface)
    assert surface.degree == (2, 3)
    assert refuse(read(PLATE), Elevate((2, 3))) == ("not_parametric", "/operations/0")
    assert refuse(read(PLATE), Select((0,)), Split(0.5)) == ("not_parametric", "/operations/1")


def test_a_selected_face_has_its_own_edges_and_vertices() -> None:
    box = read(build_box())
    brep = convert(box, [Select((3,))])
    assert isinstance(brep, BrepSurface)
    assert (len(brep.surfaces), len(brep.edge_vertices), len(brep.vertices)) == (1, 4, 4)
    assert brep.is_closed.tolist() == [False]
    assert brep.uncertainty == box.uncertainty
    content = definition(brep)
    assert "shells" not in content


@given(st.permutations(range(6)), st.integers(1, 6))
def test_selected_faces_are_those_of_the_brep(order: list[int], count: int) -> None:
    document = build_box()
    for number, face in enumerate(document["faces"]):
        face["name"] = f"face {number}"
        face["color"] = [number % 3 / 2, 0, 0]
    document["edges"][5]["uncertainty"] = 0.125
    faces = tuple(order[:count])
    box = read(document)
    brep = convert(box, [Select(faces)])
    assert isinstance(brep, BrepSurface)
    assert brep.face_names == tuple(f"face {number}" for number in faces)
    assert brep.is_closed.tolist() == [count == 6]
    old, new = box.lower(), brep.lower()
    for number, face in enumerate(faces):
        assert brep.palette[brep.face_colors[number]].tolist() == [face % 3 / 2, 0, 0, 1]
        for model, face_number in ((old, face), (new, number)):
            assert (model.loop_faces == face_number).sum() == 1
        # Each coedge of the face runs between the same points as before, with its uncertainty.
        rows = [
            [
                (
                    model.vertices[model.edge_vertices[model.coedge_edges[k]]].tolist(),
                    bool(model.coedge_reversed[k]),
                    float(model.edge_uncertainties[model.coedge_edges[k]]),
                )
                for k in np.flatnonzero(model.coedge_faces == face_number)
            ]
            for model, face_number in ((old, face), (new, number))
        ]
        assert rows[0] == rows[1]
    # All edges and vertices are used.
    assert set(new.coedge_edges.tolist()) == set(range(len(new.edge_vertices)))
    assert set(new.edge_vertices.ravel().tolist()) == set(range(len(new.vertices)))


def test_selecting_all_faces_changes_nothing() -> None:
    brep = read(PLATE)
    assert definition_text(convert(brep, [Select((0,))])) == definition_text(brep)


def definition_text(surface: Surface) -> str:
    return repr(definition(surface))


def test_faces_that_failed_a_check_can_be_selected() -> None:
    document = build_box() | {"invalid_faces": "skip"}
    document["edges"][0]["vertices"] = [0, 8]
    document["faces"][5]["loops"][0]["edges"][0] = 99
    brep = convert(read(document), [Select((5, 4, 1))])
    assert isinstance(brep, BrepSurface)
    assert {face.face: face.issue.code for face in brep.lower().skipped} == {
        0: "unknown_edge",
        1: "unknown_vertex",
    }


def test_members_of_groups_are_named() -> None:
    net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])
    group = GroupSurface((Member(BezierSurface(net)), Member(read(PLATE))))
    surface = convert(group, [Untrim(0, member=1)])
    assert isinstance(surface, BezierSurface)
    brep = convert(group, [Select((0,), member=1), Untrim(0)])
    assert definition_text(brep) == definition_text(surface)
    inches = replace(group, metres_per_unit=0.0254)
    assert convert(inches, [Select((0,), member=1)]).unit == 0.0254
    assert refuse(group, Untrim(0)) == ("missing_field", "/operations/0/member")
    assert refuse(group, Untrim(0, member=0)) == ("unsupported_operation", "/operations/0/member")
    assert refuse(group, Untrim(0, member=2)) == ("index_out_of_range", "/operations/0/member")
    assert refuse(read(PLATE), Untrim(0, member=0)) == ("unknown_field", "/operations/0/member")


def test_other_faces_are_refused() -> None:
    assert refuse(read(PLATE), Untrim(1)) == ("unknown_face", "/operations/0/face")
    assert refuse(read(PLATE), Select((0, 1))) == ("unknown_face", "/operations/0/faces/1")
    with pytest.raises(InvalidRequest, match="once"):
        Select((0, 0))
    bezier = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]))
    assert refuse(bezier, Untrim(0)) == ("unsupported_operation", "/operations/0")
