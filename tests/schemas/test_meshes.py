"""Meshes in JSON: all that this service writes is read, and errors name the place."""

from typing import Any

import numpy as np
import pytest

from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.mesh import render
from service.schemas.document import DocumentLimits
from service.schemas.meshes import MeshDefinition
from service.schemas.validation import parse_request, validate_document
from service.surface.examples.catalogue import find
from service.surface.given_mesh import NO_CORNER, GivenMesh, QuadDiagonal

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]]
UP = [[0, 0, 1]] * 4


def read(faces: Any, diagonal: QuadDiagonal = "02", **others: Any) -> GivenMesh:
    document = {"vertices": SQUARE, "faces": faces} | others
    return validate_document(MeshDefinition, document).to_mesh(diagonal)


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("name", ["torus", "cone", "sphere"])
def test_an_answer_of_the_service_can_be_sent_back(name: str, quads: bool) -> None:
    options = MeshOptions(resolution=(4, 4), faces="quads" if quads else "triangles")
    answer = render(find(name).surface(), options, BY_NAME["json"])
    model = parse_request(MeshDefinition, answer, DocumentLimits())
    mesh = model.to_mesh("02")
    vertices, faces = np.array(model.vertices), model.faces
    firsts = np.concatenate([[0], np.cumsum(1 + (faces[:, -1] >= 0))[:-1]]) if quads else range(999)
    for face, first in list(zip(faces, firsts, strict=False))[::7]:
        corners = mesh.corners[first]
        np.testing.assert_array_equal(corners, vertices[face[:3]])
    assert mesh.normals is not None
    # The vertices of a triangle have normals on its side: those of its own corners.
    cross = np.cross(*(np.diff(mesh.corners, axis=1).transpose(1, 0, 2)))
    along = (cross[:, np.newaxis] * mesh.normals[mesh.triangles]).sum(axis=2)
    assert (along >= -1e-9).all()


def test_faces_of_four_corners_are_divided_along_the_diagonal() -> None:
    quads = [[0, 1, 2, 3], [3, 2, 1, 0]]
    assert read(quads).triangles.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]]
    assert read(quads, "13").triangles.tolist() == [[0, 1, 3], [1, 2, 3], [3, 2, 0], [2, 1, 0]]
    mixed = [[1, 2, 3], [0, 1, 2, 3], [0, 1, 3]]
    assert read(mixed, "13").triangles.tolist() == [[1, 2, 3], [0, 1, 3], [1, 2, 3], [0, 1, 3]]


def test_arrays_in_place_of_lists_are_the_same_mesh() -> None:
    faces = np.array([[1, 2, 3, NO_CORNER], [0, 1, 2, 3]])
    document = {"vertices": np.array(SQUARE, float), "faces": faces, "normals": np.array(UP, float)}
    mesh = validate_document(MeshDefinition, document).to_mesh("13")
    expected = read([[1, 2, 3], [0, 1, 2, 3]], "13", normals=UP)
    np.testing.assert_array_equal(mesh.triangles, expected.triangles)
    np.testing.assert_array_equal(mesh.corners, expected.corners)
    for wrong in (faces[:, :2], faces[0], faces.astype(float), faces.astype(object)):
        with pytest.raises(InvalidRequest):
            validate_document(MeshDefinition, document | {"faces": wrong})


def test_each_corner_has_the_normal_that_it_names() -> None:
    normals = [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
    rows = [[0, 1, 2], [2, 1, 0]]
    mesh = read([[0, 1, 2], [0, 2, 3]], normals=normals, attribute_faces=rows)
    assert mesh.normals is not None
    assert mesh.normals[mesh.triangles].tolist() == [[normals[k] for k in row] for row in rows]
    assert mesh.corners.tolist() == [[SQUARE[k] for k in face] for face in ([0, 1, 2], [0, 2, 3])]
    # Without normals there is nothing that the rows would name.
    assert read([[0, 1, 2]], attribute_faces=[[7, 8, 9]]).normals is None


@pytest.mark.parametrize(
    ("faces", "others", "expected"),
    [
        ([[0, 1, 2], [0, 1, 99]], {}, ("index_out_of_range", "/faces/1/2", "99", "0 to 3")),
        ([[0, 1, 2, 3], [0, 1, -1]], {}, ("index_out_of_range", "/faces/1/2", "-1", "0 to 3")),
        ([[0, 1, 2], [0, 1, 2, -1]], {}, ("index_out_of_range", "/faces/1/3", "-1", "0 to 3")),
        ([[0, 1, 2**70]], {}, ("index_out_of_range", "/faces/0/2", "a number beyond 2^53", None)),
        ([[0, 1, True]], {}, ("wrong_type", "/faces/0/2", "true or false", "a whole number")),
        ([[0, 1, 2], [0, 1]], {}, ("wrong_dimension", "/faces/1", "2 corners", "3 or 4 corners")),
        ([[0, 1, 2, 3, 0]], {}, ("wrong_dimension", "/faces/0", "5 corners", "3 or 4 corners")),
        ([[0, 1, 2], 3], {}, ("wrong_type", "/faces/1", "a whole number", "a list of corners")),
        ([], {}, ("empty_list", "/faces", "an empty list", "a list of faces")),
        (None, {}, ("null_value", "/faces", "null", "a list of faces")),
        ([[0, 1, 2]], {"normals": UP[:1]}, ("wrong_length", "/normals", None, "a list of 4")),
        ([[0, 1, 2]], {"normal": UP}, ("unknown_field", "/normal", None, None)),
        ([[0, 1, 2]], {"vertices": [[0, 0]]}, ("wrong_dimension", "/vertices/0", None, None)),
        ([[0, 0, 0]], {"vertices": [[0, 0, 1e39]]}, ("coordinate_too_large", None, "1e+39", None)),
        (
            [[0, 1, 2], [0, 1, 2, 3]],
            {"normals": UP, "attribute_faces": [[0, 1, 2, 3], [0, 1, 2]]},
            ("wrong_dimension", "/attribute_faces", None, None),
        ),
        (
            [[0, 1, 2]],
            {"normals": UP, "attribute_faces": [[0, 1, 4]]},
            ("index_out_of_range", "/attribute_faces/0/2", "4", "0 to 3"),
        ),
    ],
)  # fmt: skip
def test_an_error_names_the_place(faces: Any, others: Any, expected: tuple[str | None]) -> None:
    with pytest.raises(InvalidRequest) as caught:
        read(faces, **others)
    issue = caught.value.issues[0]
    found = (issue.code, issue.pointer, issue.got, issue.needed)
    assert [e or f for e, f in zip(expected, found, strict=True)] == list(found)


def test_a_mesh_has_at_most_as_many_triangles_as_a_surface_control_points() -> None:
    document = {"vertices": SQUARE, "faces": [[0, 1, 2, 3]] * 5}
    for most, code in ((9, "too_many_triangles"), (1, "too_many_triangles"), (10, "")):
        limits = DocumentLimits(max_control_points=most)
        if not code:
            validate_document(MeshDefinition, document, limits)
            continue
        with pytest.raises(InvalidRequest) as caught:
            validate_document(MeshDefinition, document, limits)
        assert caught.value.issues[0].code == code
    many = {"vertices": SQUARE, "faces": [[0, 1, 2]]}
    with pytest.raises(InvalidRequest) as caught:
        validate_document(MeshDefinition, many, DocumentLimits(max_control_points=1))
    assert caught.value.issues[0].code == "too_many_vertices"
