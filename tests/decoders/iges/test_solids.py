"""Solids and shells, whose faces share edges."""

from collections.abc import Sequence

import numpy as np
import pytest

from service.decoders.cad.content import Part
from service.decoders.format import FileLimits
from service.decoders.iges.read import read
from service.errors import SurfaceError
from tests.decoders.iges.reading import assert_closed, list_parts, list_reasons, read_all
from tests.decoders.iges.writing import Writer, add_line

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
TRIANGLES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
"""The faces of a tetrahedron, counter-clockwise as seen from outside."""


def add_tetrahedron(
    writer: Writer,
    *,
    normals: Sequence[int] = (1, 1, 1, 1),
    scale: float = 1.0,
    form: int = 1,
    matrix: int = 0,
    status: str = "00010000",
) -> int:
    """A shell; for each face, whether the normal of its plane points outwards (1), or not (−1)."""
    points = scale * np.array(CORNERS)
    vertices = writer.add(502, 4, *map(float, points.ravel()), form=1)
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    lines = [add_line(writer, points[a], points[b]) for a, b in pairs]
    words: list[int] = []
    for line, (a, b) in zip(lines, pairs, strict=True):
        words += [line, vertices, a + 1, vertices, b + 1]
    edges = writer.add(504, 6, *words, form=1)
    faces: list[int] = []
    for ring, sign in zip(TRIANGLES, normals, strict=True):
        a, b, c = points[list(ring)]
        normal = sign * np.cross(b - a, c - a)
        plane = writer.add(108, *map(float, normal), float(normal @ a))
        # Loops run relative to the normal of the plane.
        order = ring if sign > 0 else ring[::-1]
        uses: list[int] = []
        for first, last in zip(order, (*order[1:], order[0]), strict=True):
            pair = min(first, last), max(first, last)
            uses += [0, edges, pairs.index(pair) + 1, int(first < last), 0]
        faces += [writer.add(510, plane, 1, 1, writer.add(508, 3, *uses, form=1)), int(sign > 0)]
    return writer.add(514, 4, *faces, form=form, matrix=matrix, status=status)


def read_part(writer: Writer) -> Part:
    (part,) = list_parts(read_all(writer))
    return part


@pytest.mark.parametrize("normals", [(1, 1, 1, 1), (1, -1, 1, -1), (-1, -1, -1, -1)])
def test_solids_are_closed(normals: Sequence[int]) -> None:
    writer = Writer()
    writer.add(186, add_tetrahedron(writer, normals=normals), 1, 0)
    content = read_all(writer)
    (part,) = list_parts(content)
    assert (len(part.vertices), len(part.edges), len(part.faces)) == (4, 6, 4)
    assert [face.is_reversed for face in part.faces] == [sign < 0 for sign in normals]
    assert [shell.is_closed for shell in part.shells] == [True]
    assert_closed(part, 1 / 6)
    assert (content.reading.solids, content.reading.closed_shells) == (1, 1)


def test_the_flag_of_a_shell_turns_its_faces() -> None:
    writer = Writer()
    writer.add(186, add_tetrahedron(writer), 0, 0)
    part = read_part(writer)
    assert all(face.is_reversed for face in part.faces)
    assert_closed(part, -1 / 6)


def test_voids_are_shells_of_the_solid() -> None:
    writer = Writer()
    move = writer.add(124, 1.0, 0.0, 0.0, 0.05, 0.0, 1.0, 0.0, 0.05, 0.0, 0.0, 1.0, 0.05)
    void = add_tetrahedron(writer, scale=0.5, matrix=move)
    writer.add(186, add_tetrahedron(writer), 1, 1, void, 0)
    part = read_part(writer)
    assert [shell.faces for shell in part.shells] == [(0, 1, 2, 3), (4, 5, 6, 7)]
    assert_closed(part, 7 / 48)
    np.testing.assert_allclose(part.vertices.min(axis=0), 0, atol=1e-12)


def test_shells_are_open_or_closed_by_their_form() -> None:
    for form, is_closed in ((1, True), (2, False)):
        writer = Writer()
        add_tetrahedron(writer, form=form, status="00000000")
        assert [shell.is_closed for shell in read_part(writer).shells] == [is_closed]


def test_a_face_alone_is_a_part() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    first = writer.file().read(shell).parameters.pointer(1)
    face = writer.file().read(first).parameters
    alone = writer.add(510, face.pointer(0), 1, 1, face.pointer(3), color=2, label="alone")
    content = read_all(writer)
    part = list_parts(content)[-1]
    assert alone > shell
    assert [(each.name, each.color) for each in part.faces] == [("alone", (1, 0, 0))]
    assert len(part.edges) == 3
    assert not part.shells[0].is_closed


def test_edges_may_be_turned_or_longer_than_between_their_vertices() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    writer.add(186, shell, 1, 0)
    lines = writer.content().decode()
    # The first edge becomes a longer line, in the other direction.
    longer = "110,3.0,0.0,0.0,-2.0,0.0,0.0;"
    old = "110,0.0,0.0,0.0,1.0,0.0,0.0;"
    assert old in lines
    content = read(lines.replace(f"{old:<64}", f"{longer:<64}", 1).encode(), FileLimits())
    (part,) = list_parts(content)
    assert_closed(part, 1 / 6)


def test_faces_that_are_damaged_are_listed() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    bad = writer.add(510, 999, 1, 1, 999)
    parameters = writer.file().read(shell).parameters
    faces = [parameters.word(position) for position in range(1, 9)]
    wider = writer.add(514, 5, *faces, bad, 1, form=1)
    writer.add(186, wider, 1, 0)
    content = read_all(writer)
    solid = list_parts(content)[-1]
    assert len(solid.faces) == 4
    assert not solid.shells[0].is_closed
    assert list_reasons(content) == {f"D{bad}": "a pointer leads to no entity"}


def test_a_face_that_is_listed_again_and_again_is_read_once() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    parameters = writer.file().read(shell).parameters
    faces = [parameters.word(position) for position in range(1, 9)] * 50
    writer.add(514, 200, *faces, form=1)
    assert [len(part.faces) for part in list_parts(read_all(writer))] == [4, 4]


def test_solids_with_the_same_shell_again_and_again_are_refused() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    for _ in range(30):
        writer.add(186, shell, 1, 0)
    assert len(list_parts(read_all(writer))) == 30
    with pytest.raises(SurfaceError) as info:
        read_all(writer, max_faces=100)
    assert info.value.issues[0].code == "too_many_faces"


def test_hidden_groups_of_the_same_faces_cost_no_square_of_their_number() -> None:
    writer = Writer()
    shell = add_tetrahedron(writer)
    deep = writer.add(186, shell, 1, 0)
    for _ in range(300):
        deep = writer.add(402, 1, deep, form=7, status="01000000")
    content = read_all(writer)
    assert not list_parts(content)
    assert len(list_reasons(content)) >= 4


def test_solids_without_a_shell_are_listed() -> None:
    writer = Writer()
    number = writer.add(186, 999, 1, 0)
    content = read_all(writer)
    assert not list_parts(content)
    assert list_reasons(content) == {f"D{number}": "a pointer leads to no entity"}
