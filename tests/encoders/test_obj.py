"""OBJ: the lines of the file, of which trimesh ignores some."""

from dataclasses import replace

import numpy as np
import pytest

from service.encoders import obj
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh import Mesh
from tools.meshes import build_silo


def read_records(mesh: Mesh) -> list[list[str]]:
    """The words of each line of the file."""
    text = obj.encode(mesh, EncodeOptions()).decode()
    return [line.split() for line in text.splitlines()]


def read_numbers(records: list[list[str]], keyword: str) -> np.ndarray:
    """The numbers of all lines that begin with this keyword, for example `v`."""
    return np.array([[float(x) for x in words] for key, *words in records if key == keyword])


def read_corners(records: list[list[str]]) -> list[list[tuple[int, ...]]]:
    """For each corner of each face, zero-based indices of its position, uv and normal."""
    return [
        [tuple(int(number) - 1 for number in word.split("/") if number) for word in words]
        for key, *words in records
        if key == "f"
    ]


def test_a_position_with_two_colors_has_two_lines() -> None:
    """A line `v` has a position and a color, so only vertices with both equal share a line."""
    mesh = build_silo(5, 2)
    colors = np.random.default_rng(2).integers(0, 2, (len(mesh.positions), 3)).astype(np.float64)
    mesh = replace(mesh, colors=colors)
    records = read_records(mesh)
    rows = read_numbers(records, "v")
    positions = np.unique(rows[:, :3], axis=0)
    # At creases, at the seam and at the apex, several vertices share a position.
    assert len(mesh.positions) > len(positions)
    assert len(np.unique(rows, axis=0)) == len(rows) > len(positions)
    for face, vertices in zip(read_corners(records), mesh.triangles.tolist(), strict=True):
        for (row, *_), vertex in zip(face, vertices, strict=True):
            np.testing.assert_array_equal(rows[row], [*mesh.positions[vertex], *colors[vertex]])


@pytest.mark.parametrize(
    ("has_uvs", "has_normals", "corner"),
    [(True, True, "1/1/1"), (False, True, "1//1"), (True, False, "1/1"), (False, False, "1")],
)
def test_corners_refer_only_to_elements_of_the_file(
    has_uvs: bool, has_normals: bool, corner: str
) -> None:
    mesh = build_silo()
    mesh = mesh if has_uvs else replace(mesh, uvs=None)
    mesh = mesh if has_normals else replace(mesh, normals=None)
    records = read_records(mesh)
    first_face = next(words for words in records if words[0] == "f")
    assert first_face[1] == corner
    keywords = {words[0] for words in records}
    assert ("vt" in keywords, "vn" in keywords) == (has_uvs, has_normals)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a b", b"a_b"),
        ("a\nf 1 2 3", b"a_f_1_2_3"),
        ("", b"_"),
        (" \t\x00", b"_"),
        ("ü", "ü".encode()),
    ],
)
def test_blanks_and_control_characters_in_names_are_replaced(name: str, expected: bytes) -> None:
    content = obj.encode(replace(build_silo(), name=name), EncodeOptions())
    assert content.splitlines()[0] == b"o " + expected
    assert content.count(b"\nf ") == len(build_silo().triangles)
