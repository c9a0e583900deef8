"""IGES: records of 80 columns, with the faces, loops, names, colours and instances of the model."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.encoders.cad.format import WrittenFile
from service.encoders.cad.iges import encode
from service.errors import InvalidRequest
from service.surface.examples.catalogue import find
from tests.encoders.cad.iges_file import Entity, read
from tests.encoders.cad.test_step import (
    WRITTEN,
    allow_any,
    make_group,
    make_tree,
    place,
    read_surface,
)

SOLIDS = ["box", "cone", "sphere", "torus", "shelled", "gear", "pipe"]


def write(document: dict[str, Any]) -> tuple[list[str], dict[int, Entity], WrittenFile]:
    surface = read_surface(document)
    file = encode(surface.lower(), surface.unit, allow_any)
    return *read(bytes(file.content)), file


def find_kind(entities: dict[int, Entity], kind: int) -> list[Entity]:
    return [entity for entity in entities.values() if entity.kind == kind]


def list_ends(entities: dict[int, Entity], number: int) -> list[tuple[list[float], list[float]]]:
    """First and last point of each curve of a curve."""
    curve = entities[number]
    values = curve.values
    if curve.kind == 102:
        return [
            pair for k in values[1 : 1 + int(values[0])] for pair in list_ends(entities, int(k))
        ]
    numbers = curve.numbers
    if curve.kind == 110:
        return [(numbers[:3], numbers[3:6])]
    assert curve.kind == 126
    last, degree = int(numbers[0]), int(numbers[1])
    first_point = 6 + (last + degree + 2) + last + 1
    assert len(numbers) == first_point + 3 * (last + 1) + 5
    return [
        (
            numbers[first_point : first_point + 3],
            numbers[first_point + 3 * last : first_point + 3 * last + 3],
        )
    ]


def check_loops(entities: dict[int, Entity], gap: float) -> None:
    """All loops of space are closed, and those in parameters too."""
    for bound in find_kind(entities, 142):
        _, surface, in_parameters, in_space, preference = map(int, bound.values)
        assert entities[surface].kind == 128
        assert preference == 2
        for number, limit in ((in_space, gap), (in_parameters, 0.0)):
            if not number:
                assert number == in_parameters
                continue
            ends = list_ends(entities, number)
            for (_, last), (first, _) in zip(ends, ends[1:] + ends[:1], strict=True):
                assert np.allclose(last, first, rtol=0, atol=limit)


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
def test_files_of_examples_are_sound(name: str) -> None:
    surface = find(name).surface()
    bounds: list[int] = []
    file = encode(surface.lower(), None, bounds.append)
    content = bytes(file.content)
    _, entities = read(content)
    low, high = surface.bounds()
    check_loops(entities, 1e-6 * float(np.abs(high - low).max()))
    assert len(find_kind(entities, 144)) == file.report.faces
    assert len(content) <= bounds[0] <= 40 * len(content) + 10_000
    assert bytes(encode(surface.lower(), None, allow_any).content) == content


@pytest.mark.parametrize("name", SOLIDS)
def test_files_of_solids_are_sound(name: str) -> None:
    _, entities, file = write(read_solid(name))
    check_loops(entities, 1e-6)
    assert len(find_kind(entities, 144)) == file.report.faces


def test_faces_have_their_normal_outside() -> None:
    """The surface of a reversed face runs backwards along u."""
    _, entities, _ = write(read_solid("box"))
    corners = []
    for surface in find_kind(entities, 128):
        numbers = surface.numbers
        assert [int(x) for x in numbers[:4]] == [1, 1, 1, 1]
        # Knots of both directions and weights come first; u varies fastest.
        points = np.array(numbers[9 + 8 + 4 : 9 + 8 + 4 + 12]).reshape(4, 3)
        corners.append(points)
    middle = np.mean(corners, axis=(0, 1))
    for points in corners:
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        assert normal @ (points.mean(axis=0) - middle) > 0


@pytest.mark.parametrize(
    ("name", "whole"), [("sphere", 8), ("nurbs-goblet", 1), ("cylinder", 8), ("bspline-hills", 0)]
)
def test_whole_surfaces_with_poles_or_seams_have_no_loops(name: str, whole: int) -> None:
    """The sphere has eight patches with a pole each, the cylinder as many on its ends."""
    content = encode(find(name).surface().lower(), None, allow_any).content
    _, entities = read(bytes(content))
    faces = [entity.values for entity in find_kind(entities, 144)]
    assert sum(values[1] == "0" for values in faces) == whole
    for values in faces:
        loops = (values[1] == "1") + int(values[2])
        assert all(entities[int(k)].kind == 142 for k in values[3 : 3 + loops])


def test_a_closed_solid_of_one_face_has_no_loops() -> None:
    """The loop of the sphere has one seam and two poles: the face has no border."""
    _, entities, _ = write(read_solid("sphere"))
    (face,) = find_kind(entities, 144)
    assert face.values[1:4] == ["0", "0", "0"]


def test_instances_are_subfigures_with_rotations() -> None:
    bolt = read_solid("bolt") | {"name": "bolt Größe"}
    group = make_group(
        {"name": "left, one; two", "surface": bolt},
        {"name": "right", "surface": bolt, "matrix": place(50, 0.7), "color": [1, 0, 0]},
        {"name": "third", "surface": bolt, "matrix": place(90)},
    )
    globals_, entities, file = write(group)
    assert globals_[2] == "assembly"
    figures = [number for number, entity in entities.items() if entity.kind == 308]
    assert [entities[k].values[1] for k in figures] == ["bolt Gro??e", "bolt Gro??e"]
    placed = find_kind(entities, 408)
    assert [int(entity.values[0]) for entity in placed] == [figures[0], figures[1], figures[0]]
    names = [entities[int(entity.values[-1])].values[1] for entity in placed]
    assert names == ["left, one; two", "right", "third"]
    matrix = entities[placed[1].matrix].numbers
    assert np.allclose(np.reshape(matrix, (3, 4)), place(50, 0.7)[:3])
    assert placed[0].matrix == 0
    assert (file.report.definitions, file.report.instances) == (2, 3)
    colors = Counter(face.color for face in find_kind(entities, 144))
    (red,) = (number for number, entity in entities.items() if entity.kind == 314)
    assert colors == {0: 12, -red: 12}
    assert entities[red].numbers == [100.0, 0.0, 0.0]


def test_long_names_are_continued_on_the_next_record() -> None:
    name = "x" * 40 + ",;" + "y" * 58
    _, entities, _ = write(read_solid("box") | {"name": name})
    assert name in [entity.values[1] for entity in find_kind(entities, 406)]
    (group,) = find_kind(entities, 402)
    assert group.form == 7
    assert int(group.values[0]) == 6


def test_breps_without_a_unit_are_in_millimetres() -> None:
    globals_, _, file = write(read_solid("box"))
    assert globals_[13:15] == ["2", "MM"]
    assert file.report.is_unit_assumed


def test_units_that_iges_lacks_become_millimetres() -> None:
    """The coordinates of bodies and the translations of instances are multiplied."""
    box = read_solid("box")
    group = make_group({"surface": box, "matrix": place(10)}) | {"metres_per_unit": 0.37}
    globals_, entities, file = write(group)
    assert globals_[13:15] == ["2", "MM"]
    assert file.report.metres_per_unit == 0.001
    (move,) = find_kind(entities, 124)
    assert move.numbers[3] == pytest.approx(3700)
    _, plain, _ = write(make_group({"surface": box, "matrix": place(10)}))
    for scaled, line in zip(find_kind(entities, 110), find_kind(plain, 110), strict=True):
        assert scaled.numbers == pytest.approx([370 * x for x in line.numbers])


def test_units_of_files() -> None:
    globals_, _, file = write(read_solid("box") | {"metres_per_unit": 25.4 * 0.001})
    assert globals_[13:15] == ["1", "IN"]
    assert not file.report.is_unit_assumed


def test_assemblies_are_subfigures_of_subfigures() -> None:
    _, entities, _ = write(make_tree(place(100, 1.0)))
    depths = {entity.values[1]: int(entity.values[0]) for entity in find_kind(entities, 308)}
    assert depths == {"bolt": 0, "box": 0, "frame 0": 1, "frame 1": 1}
    roots = [each for each in find_kind(entities, 408) if each.status.startswith("0000")]
    assert [entities[int(each.values[-1])].values[1] for each in roots] == ["frame 0", "frame 1"]


def test_tubes_are_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        encode(find("ribbon").surface().lower(), None, allow_any)
    assert caught.value.issues[0].code == "not_parametric"
