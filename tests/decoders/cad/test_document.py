"""The content of CAD files as documents of breps and groups, with their reports."""

from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import pytest

from service.decoders.cad.content import (
    Definition,
    Face,
    FileLimits,
    Part,
    Placement,
    Reading,
    SkippedFace,
)
from service.decoders.cad.document import write_document
from service.errors import InvalidRequest, SurfaceError, TooLarge
from service.schemas.document import DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.storage.canonical import canonical_content, restore_surface
from service.surface.lowered import GroupModel
from tests.decoders.cad.content import READING, build_content, build_disc, build_plate, move

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.5)


Color: TypeAlias = tuple[float, ...] | None


def color_faces(part: Part, *colors: Color) -> tuple[Face, ...]:
    """Copies of the first face of a part in these colours."""
    return tuple(replace(part.faces[0], color=color) for color in colors)


def test_one_part_that_is_not_placed_is_a_brep() -> None:
    """Identity matrices place nothing; the unit, the axis and the name of the product stay."""
    placement = Placement(0, matrix=np.eye(4))
    tree = write_document(build_content((Definition("bracket", (build_plate(),)),), placement))
    surface = tree.surface
    assert (surface["type"], surface["name"], surface["up"]) == ("brep", "bracket", "z")
    assert surface["metres_per_unit"] == 0.001
    assert surface["invalid_faces"] == "skip"
    assert "shells" not in surface


def test_rational_splines_are_projected() -> None:
    """Points are divided by their weights; equal weights are left out."""
    tree = write_document(build_content((Definition("", (build_disc(),)),))).surface
    assert tree["name"] == "disc"
    assert tree["uncertainty"] == 1e-6
    line, circle = tree["edges"][0], tree["edges"][4]
    assert line == {"vertices": [0, 1]}
    assert circle["uncertainty"] == 1e-5
    curve = circle["curve"]
    assert np.allclose(curve["control_points"][1], [1.5, 1.5, 0])
    assert np.allclose(curve["weights"], [1, 0.5**0.5, 1, 0.5**0.5, 1])
    (face,) = tree["faces"]
    assert "weights" not in face["surface"]
    assert face["name"] == "top"
    outer, hole = face["loops"]
    assert outer == {"edges": [0, 1, 2, 3]}
    assert hole["reversed"] == [True, True]
    assert hole["pcurves"][0] is None
    assert np.allclose(hole["pcurves"][1]["control_points"][0], [0.75, 0.5])


def test_closed_shells_and_poles() -> None:
    """A closed shell is listed; a degenerate edge has one vertex."""
    plate = build_plate()
    pole = replace(plate.edges[1], vertices=(1, 1), is_degenerate=True)
    shell = replace(plate.shells[0], is_closed=True)
    part = replace(plate, edges=(plate.edges[0], pole, *plate.edges[2:]), shells=(shell,))
    tree = write_document(build_content((Definition("", (part,)),))).surface
    assert tree["edges"][1] == {"vertices": [1], "degenerate": True}
    assert tree["shells"][0]["closed"] is True
    assert tree["shells"][0]["faces"].tolist() == [0]


@pytest.mark.parametrize(
    ("instance", "own", "expected"),
    [(None, None, None), (None, RED, [1, 0, 0]), (BLUE, RED, [0, 0, 1, 0.5])],
)
def test_color_of_the_only_part(instance: Color, own: Color, expected: object) -> None:
    """The colour of the instance replaces that of the part; that of a face stays."""
    plate = build_plate()
    green = (0.0, 1.0, 0.0)
    part = replace(plate, color=own, faces=color_faces(plate, None, green))
    part = replace(part, shells=(replace(part.shells[0], faces=(0, 1)),))
    placement = Placement(0, color=instance)
    first, second = write_document(build_content((Definition("", (part,)),), placement)).surface[
        "faces"
    ]
    assert first.get("color") == expected
    assert second["color"] == [0, 1, 0]


def test_assembly_is_a_group_in_the_order_of_its_tree() -> None:
    """Equal parts are one definition; products with several bodies are members without any.

    Names of instances and of products both stay.
    """
    bolt = build_plate("bolt body")
    frame = (build_plate("left", 3), build_plate("right", 4, color=RED))
    content = build_content(
        (
            Definition("machine", (), (Placement(1), Placement(2, "pair", move(5)))),
            Definition("frame", frame),
            Definition("bolts", (), (Placement(3, "a", move(1)), Placement(3, "", move(2)))),
            Definition("bolt", (bolt,)),
        )
    )
    tree = write_document(content).surface
    assert (tree["type"], tree["up"], tree["name"]) == ("group", "z", "machine")
    assert [each["name"] for each in tree["definitions"]] == ["left", "right", "bolt"]
    assert all(each["up"] == "z" for each in tree["definitions"])
    assert not any("metres_per_unit" in each for each in tree["definitions"])
    rows = [
        (each["name"], each.get("definition"), each.get("parent"), each.get("color"))
        for each in tree["members"]
    ]
    assert rows == [
        ("machine", None, None, None),
        ("frame", None, 0, None),
        ("left", 0, 1, None),
        ("right", 1, 1, [1, 0, 0]),
        ("pair", None, 0, None),
        ("bolts", None, 4, None),
        ("a", 2, 5, None),
        ("bolt", 2, 5, None),
    ]
    matrices = [each["matrix"][0, 3] if "matrix" in each else 0 for each in tree["members"]]
    assert matrices == [0, 0, 0, 0, 5, 0, 1, 2]


def test_color_of_an_instance_replaces_those_of_its_parts() -> None:
    """The members of its parts then have none of their own."""
    parts = build_plate("a", color=RED), build_plate("b", 3, color=RED)
    content = build_content((Definition("", parts),), Placement(0, "x", color=BLUE), Placement(0))
    members = write_document(content).surface["members"]
    assert [each.get("color") for each in members] == [
        [0, 0, 1, 0.5], None, None, None, [1, 0, 0], [1, 0, 0]
    ]  # fmt: skip


def test_a_placed_part_is_a_group_of_one_member() -> None:
    """Its points stay as in the file."""
    content = build_content((Definition("p", (build_plate(),)),), Placement(0, matrix=move(7)))
    tree = write_document(content).surface
    (member,) = tree["members"]
    assert (member["definition"], member["matrix"][0, 3]) == (0, 7)


def test_products_without_faces_are_left_out() -> None:
    """So are their instances, and parts whose faces were all skipped."""
    empty = replace(build_plate(), faces=(), shells=())
    content = build_content(
        (
            Definition("all", (empty,), (Placement(1), Placement(2))),
            Definition("nothing", (), (Placement(3),)),
            Definition("plate", (build_plate(),)),
            Definition("empty", (empty,)),
        )
    )
    tree = write_document(content).surface
    assert [each["name"] for each in tree["members"]] == ["all", "plate"]


def nest(levels: int) -> tuple[Definition, ...]:
    """Products, each with two instances of the next; the last is a plate."""
    twice = [Definition("", (), (Placement(k + 1), Placement(k + 1))) for k in range(levels)]
    return *twice, Definition("", (build_plate(),))


def refuse(definitions: tuple[Definition, ...], **limits: int) -> SurfaceError:
    """The error of a document, for limits that differ from the defaults."""
    with pytest.raises(SurfaceError) as caught:
        write_document(build_content(definitions), FileLimits(**limits))
    return caught.value


def test_members_and_placed_faces_are_counted_first() -> None:
    """40 levels of two are 2^40 parts; a limit that is just reached refuses nothing."""
    error = refuse(nest(40))
    assert isinstance(error, TooLarge)
    assert error.issues[0].code == "too_many_members"
    assert error.issues[0].got == f"{2**41 - 1} members"
    assert "SURFACE_MAX_MEMBERS" in error.issues[0].needed
    error = refuse(nest(5), max_placed_faces=31)
    assert error.issues[0].code == "too_many_placed_faces"
    assert error.issues[0].got == "32 placed faces"
    assert "SURFACE_MAX_PLACED_FACES" in error.issues[0].needed
    limits = FileLimits(max_members=63, max_placed_faces=32, max_faces=1)
    assert len(write_document(build_content(nest(5)), limits).surface["members"]) == 63
    assert refuse(nest(5), max_members=62).issues[0].code == "too_many_members"


def test_too_many_faces() -> None:
    """Each face of the file counts once, however often it is placed."""
    two = (Definition("", (build_plate(), build_plate())),)
    assert refuse(two, max_faces=1).issues[0].code == "too_many_faces"
    error = refuse(two, max_definitions=1)
    assert (error.issues[0].code, error.issues[0].got) == ("too_many_parts", "2 parts")
    assert "SURFACE_MAX_MEMBERS" in error.issues[0].needed


def test_no_geometry() -> None:
    """A file without faces that could be placed is refused."""
    assert refuse((Definition("empty"),)).issues[0].code == "no_geometry"


@pytest.mark.parametrize("levels", [99, 100])
def test_depth(levels: int) -> None:
    """A hundred levels of members are read, and no more; circles count as deeper."""
    chain = tuple(Definition("", (), (Placement(k + 1),)) for k in range(levels))
    definitions = (*chain, Definition("", (build_plate(),)))
    if levels < 100:
        assert len(write_document(build_content(definitions)).surface["members"]) == 100
    else:
        assert refuse(definitions).issues[0].code == "too_deep"


@pytest.mark.parametrize("name", ["", "product 0", "root"])
def test_names_of_instances_are_levels(name: str) -> None:
    """Members whose instances and products have two names count twice, those of the root too."""
    chain = tuple(
        Definition(f"product {k}", (build_plate(),), (Placement(k + 1, f"instance {k}"),))
        for k in range(50)
    )
    content = build_content((*chain, Definition("last", (build_plate(),))), Placement(0, name))
    if name == "root":
        with pytest.raises(InvalidRequest) as caught:
            write_document(content)
        assert caught.value.issues[0].code == "too_deep"
        return
    # Each product has a member of its own, one of its plate, and one of its instance.
    members = write_document(content, FileLimits(max_members=150)).surface["members"]
    assert len(members) == 150
    with pytest.raises(TooLarge):
        write_document(content, FileLimits(max_members=149))
    names = [each["name"] for each in members]
    assert names[:5] == ["product 0", "plate", "instance 0", "product 1", "plate"]
    assert names[-1] == "instance 49"


def test_circle_is_refused() -> None:
    """Readers leave circles out; one that does not must not hang."""
    circle = Definition("", (), (Placement(1),)), Definition("", (), (Placement(0),))
    assert refuse(circle).issues[0].code == "too_deep"


def test_names_are_cleaned_and_counted() -> None:
    """Control characters become blanks, long names are cut, and blank ones left out."""
    part = build_plate("a\nb\ud800")
    part = replace(part, faces=(replace(part.faces[0], name="x" * 101),))
    content = build_content(
        (Definition("  ", (part,)),), Placement(0, "ok"), Placement(0, "\x00", move(1))
    )
    content = replace(content, reading=replace(READING, changed_names=3))
    document = write_document(content)
    (definition,) = document.surface["definitions"]
    assert definition["name"] == "a b "
    assert definition["faces"][0]["name"] == "x" * 100
    assert [each.get("name") for each in document.surface["members"]] == ["ok", None]
    # 3 of the reader; then the part, its face, the product and the second instance.
    assert document.reading["changed_names"] == 7


def test_placements_that_flatten_bodies_are_counted() -> None:
    """They would refuse the whole group."""
    flat, skewed, unknown = np.diag([1, 1, 0, 1.0]), np.eye(4), np.eye(4)
    skewed[3, 0], unknown[0, 0] = 0.5, np.nan
    placements = [Placement(1, matrix=each) for each in (flat, skewed, unknown, move(1))]
    content = build_content(
        (Definition("", (), tuple(placements)), Definition("", (build_plate(),)))
    )
    document = write_document(content)
    assert len(document.surface["members"]) == 2
    assert document.reading["skipped_entities"] == {"placement": 3}


def test_documents_are_valid() -> None:
    """Requests accept them; placements, names and colours arrive."""
    bolt, disc = build_plate("bolt"), build_disc()
    frame = (build_plate("left", 3), build_plate("right", 4, color=RED))
    mirror = move(5)
    mirror[0, 0] = -1
    content = build_content(
        (
            Definition("machine", (disc,), (Placement(1), Placement(2, "pair", mirror))),
            Definition("frame", frame),
            Definition("bolts", (), (Placement(3, "a", move(1)), Placement(3, color=BLUE))),
            Definition("bolt", (bolt,)),
        )
    )
    for each in (content, build_content((Definition("", (disc,)),))):
        tree = write_document(each).surface
        surface = validate_document(SurfaceRequest, {"surface": tree}).to_surface()
        assert surface.unit == 0.001
        assert surface.up == "z"
        restored = restore_surface(canonical_content(surface), DocumentLimits())
        assert canonical_content(restored) == canonical_content(surface)
    tree = write_document(content).surface
    group = validate_document(SurfaceRequest, {"surface": tree}).to_surface()
    model = group.lower()
    assert isinstance(model, GroupModel)
    assert [copy.name for copy in model.members] == [
        "machine/disc", "machine/frame/left", "machine/frame/right",
        "machine/pair/bolts/a", "machine/pair/bolts/bolt",
    ]  # fmt: skip
    assert [copy.color for copy in model.members] == [None, None, (*RED, 1), None, BLUE]
    matrix = model.members[3].matrix
    assert matrix is not None
    assert (matrix[0, 0], matrix[0, 3]) == (-1, 4)
    assert len(model.models) == 4


def test_reading_is_plain() -> None:
    """Values that are not known are left out, and texts of the file are cleaned."""
    reading = Reading(
        "iges",
        system="CAD\x07" + "y" * 300,
        units=("inch",),
        skipped_entities={"230": 2, "106": 1},
        skipped_faces=(SkippedFace("#17", "its loop is open"),),
    )
    content = replace(build_content((Definition("", (build_plate(),)),)), reading=reading)
    tree = write_document(content).reading
    assert "schema" not in tree
    assert "metres_per_unit" not in tree
    assert tree["system"] == "CAD " + "y" * 196
    assert tree["skipped_entities"] == {"106": 1, "230": 2}
    assert tree["skipped_faces"] == [{"entity": "#17", "reason": "its loop is open"}]
    assert tree["faces"] == 0


def test_unit_that_no_document_takes_is_left_out() -> None:
    """Units are above 0, and at most 1e6 metres."""
    content = build_content((Definition("", (build_plate(),)),))
    for metres in (None, 0.0, 2e6, float("nan")):
        tree = write_document(replace(content, metres_per_unit=metres)).surface
        assert "metres_per_unit" not in tree


def test_no_root_is_no_geometry() -> None:
    """A file may have products of which none is placed."""
    content = replace(build_content((Definition("", (build_plate(),)),)), roots=())
    with pytest.raises(InvalidRequest):
        write_document(content)


@pytest.mark.parametrize(
    ("report", "got"),
    [
        ({}, "no faces"),
        (
            {"skipped_faces": (SkippedFace("#7", "a radius is not positive"),)},
            "1 face that cannot be read: a radius is not positive",
        ),
        ({"skipped_entities": {"TESSELLATED_SOLID": 2}}, "2 entities of kinds that are not read"),
    ],
)
def test_no_geometry_says_why(report: dict[str, Any], got: str) -> None:
    content = replace(build_content((Definition("empty"),)), reading=Reading("step", **report))
    with pytest.raises(InvalidRequest) as error:
        write_document(content)
    assert error.value.issues[0].got == got
