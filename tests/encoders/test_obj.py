"""OBJ, line by line: groups, lines and parameters, which trimesh does not read."""

from dataclasses import replace

import numpy as np
import pytest

from service.encoders import obj
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh_value import Mesh
from tests.meshes import build_silo


def read_records(mesh: Mesh) -> list[list[str]]:
    text = obj.encode(mesh, EncodeOptions()).decode()
    return [line.split() for line in text.splitlines()]


def read_numbers(records: list[list[str]], kind: str) -> np.ndarray:
    return np.array([[float(x) for x in words] for key, *words in records if key == kind])


def read_corners(records: list[list[str]]) -> list[list[tuple[int, ...]]]:
    """Zero-based indices of each corner of each face."""
    return [
        [tuple(int(n) - 1 for n in word.split("/") if n) for word in words]
        for key, *words in records
        if key == "f"
    ]


def test_a_position_of_two_colors_has_two_lines() -> None:
    """Each corner has its own texture coordinates and normal."""
    mesh = build_silo(5, 2)
    either = np.random.default_rng(2).integers(0, 2, (len(mesh.positions), 3)).astype(np.float64)
    mesh = replace(mesh, colors=either)
    result = read_records(mesh)
    v = read_numbers(result, "v")
    assert mesh.report.vertices > len(np.unique(v[:, :3], axis=0))
    assert len(np.unique(v, axis=0)) == len(v) > len(np.unique(v[:, :3], axis=0))
    assert mesh.colors is not None
    for face, vertices in zip(read_corners(result), mesh.triangles.tolist(), strict=True):
        for (a, *_), vertex in zip(face, vertices, strict=True):
            np.testing.assert_array_equal(v[a], [*mesh.positions[vertex], *mesh.colors[vertex]])


@pytest.mark.parametrize(
    ("uvs", "normals", "corner"),
    [(True, True, "1/1/1"), (False, True, "1//1"), (True, False, "1/1"), (False, False, "1")],
)
def test_corners_name_existing_elements_only(uvs: bool, normals: bool, corner: str) -> None:
    mesh = build_silo()
    mesh = mesh if uvs else replace(mesh, uvs=None)
    mesh = mesh if normals else replace(mesh, normals=None)
    result = read_records(mesh)
    first = next(words for words in result if words[0] == "f")
    assert first[1] == corner
    kinds = {words[0] for words in result}
    assert ("vt" in kinds, "vn" in kinds) == (uvs, normals)


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
    content = obj.encode(replace(build_silo(), name=name), EncodeOptions())
    assert content.splitlines()[0] == b"o " + written
    assert content.count(b"\nf ") == len(build_silo().triangles)
