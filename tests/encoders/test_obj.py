"""OBJ, line by line: what trimesh does not tell, as groups, lines and parameters."""

from dataclasses import replace

import numpy as np
import pytest

from service.encoders import obj
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh import Mesh
from tests.meshes import Faces, carrying, silo, with_overlays
from tests.oracles.topology import topology


def records(mesh: Mesh) -> list[list[str]]:
    text = obj.encode(mesh, EncodeOptions()).decode()
    return [line.split() for line in text.splitlines()]


def numbers(found: list[list[str]], kind: str) -> np.ndarray:
    return np.array([[float(x) for x in words] for key, *words in found if key == kind])


def corners(found: list[list[str]]) -> list[list[tuple[int, ...]]]:
    """Zero-based numbers of each corner of each face, as many as there are."""
    return [
        [tuple(int(n) - 1 for n in word.split("/") if n) for word in words]
        for key, *words in found
        if key == "f"
    ]


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_each_corner_has_position_parameters_and_normal(faces: Faces) -> None:
    mesh = silo(5, 2, faces)
    assert mesh.normals is not None
    assert mesh.uvs is not None
    found = records(mesh)
    v, vt, vn = (numbers(found, kind) for kind in ("v", "vt", "vn"))
    expected = [
        face
        for part in mesh.parts
        for face in (
            *mesh.quads[slice(*part.quads)].tolist(),
            *mesh.triangles[slice(*part.triangles)].tolist(),
        )
    ]
    for face, vertices in zip(corners(found), expected, strict=True):
        for (a, b, c), vertex in zip(face, vertices, strict=True):
            np.testing.assert_array_equal(v[a], mesh.positions[vertex])
            np.testing.assert_allclose(vt[b], mesh.uvs[vertex], rtol=1e-7)
            np.testing.assert_allclose(vn[c], mesh.normals[vertex], rtol=1e-7)


def test_colors_stand_behind_positions() -> None:
    """One position has one line, as its colour is one; the body stays closed by its indices."""
    mesh = carrying(silo(5, 2), opacity=True)
    assert mesh.colors is not None
    found = records(mesh)
    v = numbers(found, "v")
    assert len(np.unique(v[:, :3], axis=0)) == len(v)
    for face, vertices in zip(corners(found), mesh.triangles.tolist(), strict=True):
        for (a, *_), vertex in zip(face, vertices, strict=True):
            np.testing.assert_array_equal(v[a, :3], mesh.positions[vertex])
            np.testing.assert_allclose(v[a, 3:], mesh.colors[vertex, :3], rtol=1e-7)
    assert topology([[corner[0] for corner in face] for face in corners(found)]).watertight


def test_a_position_of_two_colors_has_two_lines() -> None:
    """Each vertex finds its own."""
    mesh = silo(5, 2)
    either = np.random.default_rng(2).integers(0, 2, (len(mesh.positions), 3)).astype(np.float64)
    mesh = replace(mesh, colors=either)
    found = records(mesh)
    v = numbers(found, "v")
    assert mesh.report.vertices > len(np.unique(v[:, :3], axis=0))
    assert len(np.unique(v, axis=0)) == len(v) > len(np.unique(v[:, :3], axis=0))
    assert mesh.colors is not None
    for face, vertices in zip(corners(found), mesh.triangles.tolist(), strict=True):
        for (a, *_), vertex in zip(face, vertices, strict=True):
            np.testing.assert_array_equal(v[a], [*mesh.positions[vertex], *mesh.colors[vertex]])


@pytest.mark.parametrize(
    ("uvs", "normals", "corner"),
    [(True, True, "1/1/1"), (False, True, "1//1"), (True, False, "1/1"), (False, False, "1")],
)
def test_corners_name_only_what_is_there(uvs: bool, normals: bool, corner: str) -> None:
    mesh = silo()
    mesh = mesh if uvs else replace(mesh, uvs=None)
    mesh = mesh if normals else replace(mesh, normals=None)
    found = records(mesh)
    first = next(words for words in found if words[0] == "f")
    assert first[1] == corner
    kinds = {words[0] for words in found}
    assert ("vt" in kinds, "vn" in kinds) == (uvs, normals)


def test_parts_are_groups_and_overlays_objects_of_lines() -> None:
    mesh = with_overlays(silo())
    found = records(mesh)
    names = [words for words in found if words[0] in "og"]
    assert names == [
        ["o", "silo"],
        ["g", "base"],
        ["g", "wall"],
        ["g", "roof"],
        ["o", "control_net"],
        ["o", "boundary"],
    ]
    v = numbers(found, "v")
    expected = [overlay.positions[overlay.segments] for overlay in mesh.overlays]
    lines = numbers(found, "l").astype(int) - 1
    np.testing.assert_array_equal(v[lines], np.concatenate(expected))


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("a b", b"a_b"),
        ("a\nf 1 2 3", b"a_f_1_2_3"),
        ("", b"_"),
        (" \t\x00", b"_"),
        ("ü", "ü".encode()),
    ],
)
def test_a_name_cannot_end_its_line(name: str, written: bytes) -> None:
    content = obj.encode(replace(silo(), name=name), EncodeOptions())
    assert content.splitlines()[0] == b"o " + written
    assert content.count(b"\nf ") == len(silo().triangles)
