"""Products: groups, subfigures and their instances, names, colours, and hidden entities."""

import numpy as np
import pytest

from service.decoders.cad.document import write_document
from service.errors import SurfaceError
from tests.decoders.iges.reading import find_names, list_parts, list_reasons, read_all
from tests.decoders.iges.writing import Writer, add_box, add_line, add_quad, string

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def add_named(writer: Writer, name: str) -> int:
    return writer.add(406, 1, string(name), form=15)


def test_names_are_properties_or_labels() -> None:
    writer = Writer()
    name = add_named(writer, "Größe; 5, a")
    surface = add_quad(writer, SQUARE, label="quad", subscript=7)
    file = writer.file()
    boundary = file.read(surface).parameters.pointer(3)
    base = file.read(surface).parameters.pointer(0)
    writer.add(144, base, 1, 0, boundary, 0, 1, name, label="other")
    content = read_all(writer)
    assert [face.name for part in list_parts(content) for face in part.faces] == [
        "quad(7)",
        "Größe; 5, a",
    ]


def test_colours_are_numbers_or_entities() -> None:
    writer = Writer()
    mixed = writer.add(314, 20.0, 40.0, 80.0, "4Hblue")
    wrong = writer.add(314, 300.0, -5.0, 50.0)
    damaged = writer.add(314, "x")
    colors = [0, 2, 8, 9, -mixed, -wrong, -damaged, -99]
    for shift, color in enumerate(colors):
        add_quad(writer, [(x + 3 * shift, y, z) for x, y, z in SQUARE], color=color)
    faces = [face for part in list_parts(read_all(writer)) for face in part.faces]
    assert [face.color for face in faces] == [
        None, (1, 0, 0), (1, 1, 1), None, (0.2, 0.4, 0.8), (1, 0, 0.5), None, None,
    ]  # fmt: skip


def test_blanked_entities_are_listed() -> None:
    writer = Writer()
    add_quad(writer, SQUARE)
    hidden = add_quad(writer, [(x + 3, y, z) for x, y, z in SQUARE], status="01000000")
    inside = add_quad(writer, [(x + 6, y, z) for x, y, z in SQUARE])
    writer.add(402, 1, inside, form=7, status="01000000")
    content = read_all(writer)
    assert len(list_parts(content)) == 1
    assert list(list_reasons(content)) == [f"D{hidden}", f"D{inside}"]
    assert content.reading.skipped_entities == {
        "type 144 (blanked)": 2,
        "type 402 (blanked)": 1,
    }


def test_subfigures_are_placed() -> None:
    writer = Writer()
    box = add_box(writer, (1, 1, 1))
    bolt = writer.add(308, 0, "4Hbolt", 6, *box)
    turn = writer.add(124, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 9.0)
    writer.add(408, bolt, 5.0, 0.0, 0.0, 2.0, matrix=turn, label="left", color=3)
    writer.add(408, bolt, 1.0, 2.0, 3.0)
    content = read_all(writer)
    assert content.reading.products == 2
    root = content.definitions[content.roots[0].definition]
    assert not root.parts
    first, second = root.placements
    assert [each.color for each in root.placements] == [(0, 1, 0), None]
    assert [content.definitions[each.definition].name for each in root.placements] == ["bolt"] * 2
    assert (first.name, second.name) == ("left", "")
    # Scaled by 2, moved by 5 along x, turned to y, and moved along z by 9.
    assert first.matrix is not None
    np.testing.assert_allclose(first.matrix @ [1, 0, 0, 1], [0, 7, 9, 1])
    assert second.matrix is not None
    np.testing.assert_allclose(second.matrix[:3, 3], [1, 2, 3])
    tree = write_document(content).surface
    assert [member.get("name") for member in tree["members"]] == ["test", "left", "bolt"]


def test_subfigures_in_subfigures() -> None:
    writer = Writer()
    inner = writer.add(308, 0, "5Hinner", 1, add_quad(writer, SQUARE))
    instances = [writer.add(408, inner, float(x), 0.0, 0.0, status="00010000") for x in (0, 3)]
    outer = writer.add(308, 1, "5Houter", 2, *instances)
    for y in (0, 5):
        writer.add(408, outer, 0.0, float(y), 0.0)
    content = read_all(writer)
    tree = write_document(content).surface
    assert len(tree["definitions"]) == 1
    assert sum("definition" in member for member in tree["members"]) == 4


def test_subfigures_inside_themselves_are_reported() -> None:
    writer = Writer()
    first = add_quad(writer, SQUARE)
    add_quad(writer, [(x + 3, y, z) for x, y, z in SQUARE])
    # The instance has the number of the entry behind its subfigure.
    number = writer.add(308, 0, "4Hloop", 2, first, len(writer.file().directory) * 2 + 3)
    writer.add(408, number, 0.0, 0.0, 0.0, status="00010000")
    writer.add(408, number, 1.0, 0.0, 0.0)
    content = read_all(writer)
    assert content.reading.skipped_entities == {"type 408": 1}
    assert len(list_parts(content)) == 2


def test_instances_are_counted_before_they_are_placed() -> None:
    writer = Writer()
    number = writer.add(308, 0, "1Ha", 1, add_quad(writer, SQUARE))
    for _ in range(28):
        pair = [writer.add(408, number, float(x), 0.0, 0.0, status="00010000") for x in (0, 1)]
        number = writer.add(308, 0, "1Ha", 2, *pair)
    writer.add(408, number, 0.0, 0.0, 0.0)
    content = read_all(writer)
    assert content.reading.faces == 1
    with pytest.raises(SurfaceError) as info:
        write_document(content)
    assert info.value.issues[0].code.startswith("too_many")


def test_deeper_subfigures_are_reported() -> None:
    writer = Writer()
    add_quad(writer, [(x + 3, y, z) for x, y, z in SQUARE])
    number = writer.add(308, 0, "1Ha", 1, add_quad(writer, SQUARE))
    for _ in range(40):
        instance = writer.add(408, number, 0.0, 0.0, 0.0, status="00010000")
        number = writer.add(308, 0, "1Ha", 1, instance)
    writer.add(408, number, 0.0, 0.0, 0.0)
    content = read_all(writer)
    assert content.reading.skipped_entities["type 408"] >= 1
    assert [len(part.faces) for part in list_parts(content)] == [1]


def test_groups_give_names_and_make_products() -> None:
    writer = Writer()
    box = add_box(writer, (1, 1, 1))
    quads = [add_quad(writer, [(x + n, y, z) for x, y, z in SQUARE]) for n in (5, 8)]
    names = [add_named(writer, name) for name in ("cube", "quads", "all")]
    cube = writer.add(402, 6, *box, 0, 1, names[0], form=7)
    pair = writer.add(402, 2, *quads, 0, 1, names[1], form=15)
    writer.add(402, 2, cube, pair, 0, 1, names[2], form=1)
    content = read_all(writer)
    tree = write_document(content).surface
    paths = [(member.get("name"), member.get("parent")) for member in tree["members"]]
    assert ("quads", paths.index(next(p for p in paths if p[0] == "all"))) in paths
    assert ("cube", paths.index(next(p for p in paths if p[0] == "all"))) in paths
    assert len(tree["definitions"]) == 3


def test_faces_are_joined_across_groups() -> None:
    writer = Writer()
    box = add_box(writer, (1, 1, 1))
    for half in (box[:3], box[3:]):
        writer.add(402, 3, *half, form=7, label="half")
    (part,) = list_parts(read_all(writer))
    assert part.shells[0].is_closed
    assert part.name == ""


def test_groups_in_circles_do_not_matter() -> None:
    writer = Writer()
    quad = add_quad(writer, SQUARE)
    number = len(writer.file().directory) * 2 + 1
    writer.add(402, 2, quad, number, form=7)
    writer.add(402, 1, number + 4, form=7)
    writer.add(402, 1, number + 2, form=7)
    assert len(list_parts(read_all(writer))) == 1


def test_surfaces_are_faces_if_nothing_else_has_them() -> None:
    writer = Writer()
    line = add_line(writer, (0, 0), (1, 0))
    writer.add(122, line, 0.0, 0.0, 1.0)
    writer.add(122, add_line(writer, (5, 0), (6, 0)), 5.0, 0.0, 1.0, status="00010000")
    add_quad(writer, [(x + 9, y, z) for x, y, z in SQUARE])
    parts = list_parts(read_all(writer))
    assert [len(part.faces) for part in parts] == [1, 1]
    assert [len(part.faces[0].loops[0]) for part in parts] == [4, 4]


def test_other_entities_are_counted() -> None:
    writer = Writer()
    add_quad(writer, SQUARE)
    add_line(writer, (0, 0), (1, 0))  # it says that it belongs to another entity
    writer.add(110, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    writer.add(116, 0.0, 0.0, 0.0)
    writer.add(116, 0.0, 0.0, 0.0)
    writer.add(212, 1, 4, 1.0, 1.0, 1, 1.57, 0.0, 0, 0, 0.0, 0.0, 0.0, "4Hnote")
    writer.add(416, "9Hother.igs", form=1)
    reading = read_all(writer).reading
    assert reading.skipped_entities == {"type 110": 1, "type 116": 2, "type 212": 1}
    assert reading.unfollowed_references == 1


def test_assemblies_of_solids_place_their_items() -> None:
    writer = Writer()
    shell = writer.add(514, 0, form=1)
    solid = writer.add(186, shell, 1, 0, status="00010000")
    move = writer.add(124, 1.0, 0.0, 0.0, 7.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    writer.add(184, 3, solid, solid, 999, 0, move, 0)
    content = read_all(writer)
    root = content.definitions[content.roots[0].definition]
    assert [each.matrix is None for each in root.placements] == [True, False]
    assert root.placements[0].definition == root.placements[1].definition
    assert content.reading.skipped_entities == {"type 184, an item": 1}


def test_parts_have_the_names_of_their_groups() -> None:
    writer = Writer()
    box = add_box(writer, (1, 1, 1))
    name = add_named(writer, "cube")
    writer.add(402, 6, *box, 0, 1, name, form=7)
    assert find_names(list_parts(read_all(writer))) == ["cube"]
