"""Products and assemblies of STEP files: names, placements, mapped items, and circles."""

import itertools

import numpy as np
import pytest

from service.decoders.cad.content import CadContent, Placement
from service.decoders.format import FileLimits
from service.decoders.step.read import read
from service.errors import TooLarge
from tests.decoders.step.written import Writer, wrap


def tree(content: CadContent) -> list[tuple[int, str, list[float] | None]]:
    """Level, name of the definition, and translation of each placement, from the roots on."""
    found: list[tuple[int, str, list[float] | None]] = []

    def add(level: int, placements: tuple[Placement, ...]) -> None:
        for each in placements:
            definition, matrix = content.definitions[each.definition], each.matrix
            where = None if matrix is None else matrix[:3, 3].tolist()
            found.append((level, definition.name, where))
            add(level + 1, definition.placements)

    add(0, content.roots)
    return found


def solid(writer: Writer, name: str, units: str = "", size: float = 1.0) -> tuple[str, str]:
    """A product with a tetrahedron, and its representation with a placement at the origin."""
    context = units or writer.context(writer.unit())
    representation = writer.representation([writer.tetrahedron(size), writer.frame()], context)
    return writer.product(name, representation), representation


def assembly(writer: Writer, name: str, units: str = "") -> tuple[str, str]:
    context = units or writer.context(writer.unit())
    representation = writer.representation([writer.frame()], context)
    return writer.product(name, representation), representation


def test_an_assembly_of_two_levels() -> None:
    writer = Writer()
    top, middle = assembly(writer, "top"), assembly(writer, "middle")
    bolt = solid(writer, "bolt")
    origin = writer.frame()
    for x in (1, 2):
        writer.occurrence(middle, bolt, (origin, writer.frame((x, 0, 0))), f"bolt {x}")
    writer.occurrence(top, middle, (writer.frame((0, 5, 0)), origin), "lower")
    content = writer.read()
    assert tree(content) == [
        (0, "top", None),
        (1, "middle", [0, -5, 0]),
        (2, "bolt", [1, 0, 0]),
        (2, "bolt", [2, 0, 0]),
    ]
    assert len(content.definitions) == content.reading.products == 3
    assert content.reading.solids == 1
    names = [each.name for each in content.definitions[1].placements]
    assert names == ["bolt 1", "bolt 2"]


def test_placements_turn() -> None:
    writer = Writer()
    top, part = assembly(writer, "top"), solid(writer, "part")
    target = writer.frame((1, 0, 0), (1, 0, 0), (0, 1, 0))
    writer.occurrence(top, part, (writer.frame(), target))
    matrix = writer.read().definitions[0].placements[0].matrix
    assert matrix is not None
    np.testing.assert_array_equal(matrix, [[0, 0, 1, 1], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def test_units_of_each_representation() -> None:
    writer = Writer()
    metres = writer.context(writer.unit("$"))
    top, part = assembly(writer, "top"), solid(writer, "part", metres, 2.0)
    writer.occurrence(top, part, (writer.frame((0.5, 0, 0)), writer.frame((0, 7, 0))))
    content = writer.read()
    assert content.metres_per_unit == content.reading.metres_per_unit == 1e-3
    assert content.reading.units == ("millimetre", "metre")
    # A point of the child in metres, another of the assembly in millimetres.
    assert tree(content) == [(0, "top", None), (1, "part", [-500, 7, 0])]
    (found,) = content.definitions[1].parts
    assert found.vertices.max() == 2000


def test_the_unit_of_the_first_root_counts() -> None:
    writer = Writer()
    solid(writer, "one", writer.context(writer.unit("$")))
    solid(writer, "two")
    content = writer.read()
    assert content.metres_per_unit == 1
    assert [each.parts[0].vertices.max() for each in content.definitions] == [1, 1e-3]
    assert [content.definitions[each.definition].name for each in content.roots] == ["one", "two"]


def test_a_part_without_units_is_taken_as_it_is() -> None:
    writer = Writer()
    solid(writer, "one", writer.context(), 3.0)
    content = writer.read()
    assert content.metres_per_unit is None
    assert content.reading.units == ()
    assert content.definitions[0].parts[0].vertices.max() == 3


def test_a_relationship_against_the_rule() -> None:
    """The representation of the assembly is the first one, not the second."""
    writer = Writer()
    top, part = assembly(writer, "top"), solid(writer, "part")
    placement = writer.frame((3, 0, 0))
    origin = writer.frame()
    occurrence = writer.occurrence(top, part)
    moved = writer(f"ITEM_DEFINED_TRANSFORMATION('','',{placement},{origin})")
    relationship = writer(
        f"(REPRESENTATION_RELATIONSHIP('','',{top[1]},{part[1]})"
        f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})"
        "SHAPE_REPRESENTATION_RELATIONSHIP())"
    )
    shape = writer(f"PRODUCT_DEFINITION_SHAPE('','',{occurrence})")
    writer(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relationship},{shape})")
    assert tree(writer.read()) == [(0, "top", None), (1, "part", [3, 0, 0])]


def test_related_representations_are_of_one_product() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    outer = writer.representation([writer.frame()], context)
    middle = writer.representation([writer.frame()], context)
    inner = writer.representation([writer.tetrahedron()], context)
    for first, second in ((outer, middle), (inner, middle), (outer, inner)):
        writer(f"SHAPE_REPRESENTATION_RELATIONSHIP('','',{first},{second})")
    writer.product("part", outer)
    content = writer.read()
    assert tree(content) == [(0, "part", None)]
    assert len(content.definitions[0].parts) == 1


def test_instances_without_a_name_of_open_cascade_have_none() -> None:
    writer = Writer()
    top, bolt = assembly(writer, "top"), solid(writer, "bolt")
    writer.occurrence(top, bolt, (writer.frame(), writer.frame((1, 0, 0))), "=>[0:1:1:4]")
    (placement,) = writer.read().definitions[0].placements
    assert not placement.name


def test_occurrences_without_a_placement() -> None:
    writer = Writer()
    top, part = assembly(writer, "top"), solid(writer, "part")
    writer.occurrence(top, part, name="only")
    assert tree(writer.read()) == [(0, "top", None), (1, "part", None)]


def mapped_item(
    writer: Writer, representation: str, origin: str, target: str, name: str = ""
) -> str:
    source = writer(f"REPRESENTATION_MAP({origin},{representation})")
    return writer(f"MAPPED_ITEM('{name}',{source},{target})")


def test_mapped_items_place_representations() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    inner = writer.representation([writer.tetrahedron()], context, "inner")
    items = [
        mapped_item(writer, inner, writer.frame((1, 0, 0)), writer.frame((x, 0, 0)), f"at {x}")
        for x in (1, 5)
    ]
    writer.product("part", writer.representation(items, context))
    content = writer.read()
    assert tree(content) == [(0, "part", None), (1, "inner", None), (1, "inner", [4, 0, 0])]
    assert [each.name for each in content.definitions[0].placements] == ["at 1", "at 5"]
    assert content.reading.solids == 1


def test_mapped_items_mirror_and_scale() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    inner = writer.representation([writer.tetrahedron()], context)
    axes = ",".join(writer.direction(*each) for each in ((-1, 0, 0), (0, 1, 0)))
    operator = writer(
        f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',{axes},{writer.point(9, 0, 0)},2.,$)"
    )
    item = mapped_item(writer, inner, writer.frame(), operator)
    writer.product("part", writer.representation([item], context))
    matrix = writer.read().definitions[0].placements[0].matrix
    assert matrix is not None
    np.testing.assert_array_equal(matrix, [[-2, 0, 0, 9], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]])


def test_mapped_items_of_another_product_replace_occurrences_without_placements() -> None:
    writer = Writer()
    part = solid(writer, "part")
    item = mapped_item(writer, part[1], writer.frame(), writer.frame((4, 0, 0)))
    representation = writer.representation([item])
    top = writer.product("top", representation), representation
    writer.occurrence(top, part)
    assert tree(writer.read()) == [(0, "top", None), (1, "part", [4, 0, 0])]


def test_representations_placed_in_others_without_occurrences() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    inner = writer.representation([writer.tetrahedron()], context, "inner")
    outer = writer.representation([writer.tetrahedron()], context, "outer")
    moved = writer(f"ITEM_DEFINED_TRANSFORMATION('','',{writer.frame()},{writer.frame((0, 0, 2))})")
    writer(
        f"(REPRESENTATION_RELATIONSHIP('','',{inner},{outer})"
        f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})"
        "SHAPE_REPRESENTATION_RELATIONSHIP())"
    )
    writer.product("part", outer)
    content = writer.read()
    assert tree(content) == [(0, "part", None), (1, "inner", [0, 0, 2])]


def test_files_without_products() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    inner = writer.representation([writer.tetrahedron()], context, "inner")
    item = mapped_item(writer, inner, writer.frame(), writer.frame((4, 0, 0)))
    writer.representation([item], context, "outer")
    content = writer.read()
    assert [entry for entry in tree(content) if entry[0] == 0] == [(0, "outer", None)]
    assert content.metres_per_unit == 1e-3
    assert content.reading.products == 0


def test_solids_in_no_representation() -> None:
    writer = Writer()
    writer.tetrahedron()
    content = writer.read()
    assert content.reading.solids == 1
    assert content.reading.skipped_entities == {}


def test_solids_beside_the_products_are_counted() -> None:
    writer = Writer()
    writer.tetrahedron()
    content = writer.read(writer.tetrahedron())
    assert content.reading.solids == 1
    assert content.reading.skipped_entities == {"FACETED_BREP": 1}


MADE = "Open CASCADE STEP translator 8.0 3.1"


@pytest.mark.parametrize(
    ("name", "expected"),
    [("", "id of "), ("Gr\\X\\F6\\X\\DFe", "Größe"), (MADE, f"id of {MADE}")],
)
def test_names_of_products(name: str, expected: str) -> None:
    """The id stands in for a missing name, and for one that Open CASCADE has made."""
    writer = Writer()
    solid(writer, name)
    assert writer.read().definitions[0].name == expected


def test_a_circle_of_products_is_cut() -> None:
    writer = Writer()
    one, two = solid(writer, "one"), solid(writer, "two")
    origin = writer.frame()
    writer.occurrence(one, two, (origin, origin))
    writer.occurrence(two, one, (origin, origin))
    writer.occurrence(two, two, (origin, origin))
    content = writer.read()
    assert tree(content) == [(0, "one", None), (1, "two", None)]
    assert content.reading.skipped_entities == {"NEXT_ASSEMBLY_USAGE_OCCURRENCE": 2}


def test_a_representation_that_maps_itself() -> None:
    writer = Writer()
    origin, context = writer.frame(), writer.context(writer.unit())
    number = len(writer.lines) + 3
    item = mapped_item(writer, f"#{number}", origin, origin)
    representation = writer.representation([item, origin], context)
    assert representation == f"#{number}"
    writer.product("part", representation)
    solid(writer, "other")
    content = writer.read()
    assert content.reading.skipped_entities == {"MAPPED_ITEM": 1}
    assert content.reading.solids == 1


def test_many_links_that_close_circles_take_linear_time() -> None:
    writer = Writer()
    one = solid(writer, "one")
    for _ in range(20_000):
        writer.occurrence(one, one)
    content = writer.read()
    assert content.reading.skipped_entities == {"NEXT_ASSEMBLY_USAGE_OCCURRENCE": 20_000}


def test_forty_levels_of_two_are_kept_once() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    levels = [solid(writer, "0", context)]
    levels += [assembly(writer, str(level), context) for level in range(1, 41)]
    origin = writer.frame()
    for child, parent in itertools.pairwise(levels):
        for x in (0, 1):
            writer.occurrence(parent, child, (origin, writer.frame((x, 0, 0))))
    content = read(wrap(writer.data), FileLimits())
    assert len(content.definitions) == 41
    assert sum(len(each.placements) for each in content.definitions) == 80
    assert content.reading.faces == 4


@pytest.mark.parametrize(
    "damage",
    [
        ("NEXT_ASSEMBLY_USAGE_OCCURRENCE", "'1','',''", "'1'"),
        ("ITEM_DEFINED_TRANSFORMATION", "'','',#", "'','',#9"),
        ("PRODUCT_DEFINITION_FORMATION", "(", "(("),
        ("PRODUCT(", "PRODUCT(", "PRODUKT("),
        (
            "NEXT_ASSEMBLY_USAGE_OCCURRENCE",
            "NEXT_ASSEMBLY_USAGE_OCCURRENCE",
            "((A() NEXT_ASSEMBLY_USAGE_OCCURRENCE",
        ),
        ("REPRESENTATION_RELATIONSHIP_WITH", "SHAPE_REPRESENTATION_RELATIONSHIP())", "'"),
    ],
)
def test_damaged_structure_loses_no_part(damage: tuple[str, str, str]) -> None:
    writer = Writer()
    top, part = assembly(writer, "top"), solid(writer, "part")
    writer.occurrence(top, part, (writer.frame(), writer.frame((1, 0, 0))))
    marker, old, new = damage
    assert any(marker in line and old in line for line in writer.lines)
    writer.lines = [line.replace(old, new) if marker in line else line for line in writer.lines]
    content = writer.read()
    assert content.reading.solids == 1


def test_more_products_than_members() -> None:
    writer = Writer()
    solid(writer, "one")
    solid(writer, "two")
    read(wrap(writer.data), FileLimits(max_members=2))
    with pytest.raises(TooLarge) as error:
        read(wrap(writer.data), FileLimits(max_members=1))
    assert error.value.issues[0].needed == "at most 1 (SURFACE_MAX_MEMBERS)"
