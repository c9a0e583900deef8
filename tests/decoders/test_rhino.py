"""Files of Rhino: parts, blocks, units, colours and names; what is not read is in the report."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rhino3dm")

import rhino3dm

from service.decoders import rhino
from service.decoders.cad.content import CadContent, Definition, Placement
from service.decoders.cad_files import cad_decoder
from service.decoders.format import FileLimits
from service.errors import MalformedBody, TooLarge
from tests.decoders.rhino_files import (
    add_block,
    add_layer,
    attributes,
    box,
    file_bytes,
    new_file,
    plate_with_hole,
    reference,
)
from tools.cad_files.judge import mesh_part

LIMITS = FileLimits()


def point(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return rhino3dm.Point3d(x, y, z)


def circle(radius: float) -> Any:
    return rhino3dm.Circle(point(), radius)


def read(file: Any, folder: Path) -> CadContent:
    return rhino.read(file_bytes(file, folder), LIMITS)


def only_part(content: CadContent) -> Any:
    (definition,) = content.definitions
    (part,) = definition.parts
    return part


SOLIDS: dict[str, tuple[Any, int, float]] = {
    "box": (lambda: box(1, 2, 3), 6, 6.0),
    "ball": (lambda: rhino3dm.Sphere(point(1, 2, 3), 2).ToBrep(), 1, 32 / 3 * np.pi),
    "ball of six faces": (
        lambda: rhino3dm.Brep.CreateQuadSphere(rhino3dm.Sphere(point(), 2)),
        6,
        32 / 3 * np.pi,
    ),
    "cylinder": (lambda: rhino3dm.Cylinder(circle(1), 4).ToBrep(True, True), 3, 4 * np.pi),
    "plate": (lambda: plate_with_hole(10, 2, 3), 7, 300 - 12 * np.pi),
    "pipe": (
        lambda: rhino3dm.Extrusion.CreatePipeExtrusion(
            rhino3dm.Cylinder(circle(3), 5), 2, True, True
        ),
        4,
        25 * np.pi,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_has_its_faces_and_its_mesh_is_closed(name: str, tmp_path: Path) -> None:
    make, faces, volume = SOLIDS[name]
    file = new_file()
    file.Objects.Add(make(), attributes(name))
    decoded = cad_decoder("3dm")(file_bytes(file, tmp_path), None, LIMITS)
    tree = decoded.tree
    assert tree["type"] == "brep"
    assert tree["name"] == name
    assert len(tree["faces"]) == faces
    assert [shell["closed"] for shell in tree["shells"]] == [True]
    reading = decoded.reading
    assert reading is not None
    assert (reading["solids"], reading["closed_shells"], reading["open_shells"]) == (1, 1, 0)
    assert (reading["faces"], reading["skipped_faces"]) == (faces, [])
    assert tree.pop("metres_per_unit") == 1e-3
    meshed = mesh_part(tree, 1.0)
    assert meshed["is_closed"]
    assert meshed["skipped"] == 0
    assert meshed["volume"] == pytest.approx(volume, abs=meshed["slack"])
    assert meshed["slack"] < 0.02 * volume


def test_an_open_part_and_a_whole_surface_are_open_shells(tmp_path: Path) -> None:
    file = new_file()
    tube = rhino3dm.Cylinder(circle(1), 4).ToBrep(False, False)
    file.Objects.AddBrep(tube, attributes("tube"))
    sphere = rhino3dm.NurbsSurface.CreateFromSphere(rhino3dm.Sphere(point(), 2))
    file.Objects.AddSurface(sphere, attributes("sphere"))
    content = read(file, tmp_path)
    assert [definition.name for definition in content.definitions] == ["tube", "sphere"]
    for definition in content.definitions:
        (part,) = definition.parts
        assert [shell.is_closed for shell in part.shells] == [False]
    whole = content.definitions[1].parts[0].faces[0]
    assert whole.loops == ()
    # The weights of the control points are apart in the file's own form; 2 is the radius.
    net = whole.surface.points
    assert np.abs(net[..., :3] / net[..., 3:]).max() == pytest.approx(2)
    assert (content.reading.solids, content.reading.open_shells) == (0, 2)


def test_knots_are_full_and_weights_are_multiplied_in(tmp_path: Path) -> None:
    file = new_file()
    file.Objects.AddBrep(rhino3dm.Cylinder(circle(3), 4).ToBrep(True, True))
    part = only_part(read(file, tmp_path))
    side = next(face for face in part.faces if face.surface.degrees != (1, 1))
    for degree, knots, count in zip(
        side.surface.degrees, side.surface.knots, side.surface.points.shape, strict=False
    ):
        assert len(knots) == count + degree + 1
        assert (knots[: degree + 1] == knots[0]).all()
    weights = side.surface.points[..., 3]
    assert sorted(set(np.round(weights.ravel(), 12))) == [0.707106781187, 1.0]
    radii = np.hypot(*(side.surface.points[..., :2] / weights[..., None]).reshape(-1, 2).T)
    assert sorted(set(np.round(radii, 9))) == [3, round(3 * 2**0.5, 9)]
    edges = [edge for edge in part.edges if edge.curve is not None]
    assert all(edge.vertices[0] == edge.vertices[1] for edge in edges)  # the two circles
    assert len(edges) == 2
    assert part.uncertainty == 1e-3


def test_blocks_are_products_and_instances_have_matrices(tmp_path: Path) -> None:
    file = new_file("Inches")
    bolt = add_block(file, "bolt", [(box(1, 1, 5), attributes("shaft", (0, 0, 255)))])
    mirror = rhino3dm.Transform.Mirror(point(), rhino3dm.Vector3d(1, 0, 0))
    move = rhino3dm.Transform.Translation(5, 6, 7)
    pair = add_block(
        file,
        "pair",
        [
            (reference(bolt, move), attributes("left", (9, 9, 9))),
            (reference(bolt, mirror), attributes("right")),
            (box(1, 1, 1), attributes("cube")),
        ],
    )
    file.Objects.AddInstanceObject(reference(pair, rhino3dm.Transform(1.0)), attributes("first"))
    file.Objects.AddInstanceObject(reference(bolt, move), attributes("alone"))
    content = read(file, tmp_path)
    assert content.metres_per_unit == 0.0254
    assert content.reading.units == ("inch",)
    names = [(each.name, [part.name for part in each.parts]) for each in content.definitions]
    assert names == [("bolt", ["shaft"]), ("pair", ["cube"])]
    assert [(root.name, root.definition) for root in content.roots] == [("first", 1), ("alone", 0)]
    left, right = content.definitions[1].placements
    assert (left.name, left.definition) == ("left", 0)
    assert left.color is None  # the shaft has a colour of its own
    moved = np.eye(4)
    moved[:3, 3] = 5, 6, 7
    np.testing.assert_array_equal(left.matrix, moved)
    assert right.matrix is not None
    assert np.linalg.det(right.matrix) == pytest.approx(-1)
    tree = cad_decoder("3dm")(file_bytes(file, tmp_path), None, LIMITS).tree
    assert tree["type"] == "group"
    assert len(tree["definitions"]) == 2
    assert [member.get("name") for member in tree["members"]] == [
        "first", "pair", "cube", "left", "right", "alone",
    ]  # fmt: skip


def test_colours_are_those_of_objects_layers_and_instances(tmp_path: Path) -> None:
    file = new_file()
    orange, black = add_layer(file, (255, 128, 0)), add_layer(file, (0, 0, 0))
    file.Objects.AddBrep(box(1, 1, 1), attributes("own", (51, 102, 204)))
    file.Objects.AddBrep(box(1, 1, 1), attributes("of its layer", layer=orange))
    file.Objects.AddBrep(box(1, 1, 1), attributes("of a new layer", layer=black))
    plain = attributes("of the instance")
    plain.ColorSource = rhino3dm.ObjectColorSource.ColorFromParent
    block = add_block(file, "block", [(box(1, 1, 1), plain)])
    identity = rhino3dm.Transform(1.0)
    file.Objects.AddInstanceObject(reference(block, identity), attributes("red", (255, 0, 0)))
    content = read(file, tmp_path)
    colors = {part.name: part.color for each in content.definitions for part in each.parts}
    assert colors == {
        "own": (0.2, 0.4, 0.8),
        "of its layer": (1.0, 128 / 255, 0.0),
        "of a new layer": None,
        "of the instance": None,
    }
    assert content.roots[-1].color == (1.0, 0.0, 0.0)


def test_objects_of_other_kinds_are_counted(tmp_path: Path) -> None:
    file = new_file()
    file.Objects.AddBrep(box(1, 1, 1))
    file.Objects.AddPoint(1, 2, 3)
    file.Objects.AddMesh(rhino3dm.Mesh())
    file.Objects.AddCircle(circle(1))
    page = attributes("on a page")
    page.ActiveSpace = rhino3dm.ActiveSpace.PageSpace
    file.Objects.AddBrep(box(1, 1, 1), page)
    reading = read(file, tmp_path).reading
    assert reading.skipped_entities == {"Point": 1, "Mesh": 1, "Curve": 1, "PageSpace": 1}
    assert reading.faces == 6


def test_a_file_of_another_format_and_a_damaged_one_are_refused(tmp_path: Path) -> None:
    file = new_file()
    file.Objects.AddBrep(box(1, 1, 1))
    content = file_bytes(file, tmp_path)
    for damaged in (b"", b"ISO-10303-21;", content[:1000]):
        with pytest.raises(MalformedBody):
            rhino.read(damaged, LIMITS)


def test_too_many_faces_or_objects_are_refused(tmp_path: Path) -> None:
    file = new_file()
    for _ in range(3):
        file.Objects.AddBrep(box(1, 1, 1))
    content = file_bytes(file, tmp_path)
    assert rhino.read(content, FileLimits(max_faces=18, max_entities=3)).reading.faces == 18
    for limits, code in (
        (FileLimits(max_faces=17), "too_many_faces"),
        (FileLimits(max_entities=2), "too_many_entities"),
    ):
        with pytest.raises(TooLarge) as caught:
            rhino.read(content, limits)
        assert caught.value.issues[0].code == code


def test_a_custom_unit_has_no_length(tmp_path: Path) -> None:
    file = new_file("CustomUnits", tolerance=0)
    file.Objects.AddBrep(box(1, 1, 1))
    content = read(file, tmp_path)
    assert content.metres_per_unit is None
    assert content.reading.units == ()
    assert content.reading.uncertainty is None


def test_placements_in_a_circle_are_left_out() -> None:
    def define(*below: int) -> Definition:
        return Definition("", placements=tuple(Placement(number) for number in below))

    definitions = [define(1, 1, 2), define(2, 3), define(0, 3, 2), define()]
    assert rhino.drop_circles(definitions) == 2
    kept = [[each.definition for each in definition.placements] for definition in definitions]
    assert kept == [[1, 1, 2], [2, 3], [3], []]
    deep = [define(number + 1) for number in range(50_000)] + [define(0)]
    assert rhino.drop_circles(deep) == 1
    assert deep[-1].placements == ()
