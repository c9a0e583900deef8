"""NumPy reads the arrays of NPZ; they are those of the JSON form, in the order of its faces."""

import json
import re
from contextlib import redirect_stdout
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.lib.npyio import NpzFile

from service.cli.main import main
from service.encoders import json_mesh, npz
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh import Mesh
from tools.meshes import Faces, add_attributes, add_overlays, build_silo

OPTIONS = EncodeOptions()
PAGE = Path(__file__).parents[2] / "docs" / "formats.md"


def read(mesh: Mesh) -> NpzFile:
    """The arrays of the file of a mesh."""
    file: NpzFile = np.load(BytesIO(npz.encode(mesh, OPTIONS)), allow_pickle=False)
    return file


def read_text(file: NpzFile, name: str) -> Any:
    """The value of a text of the file."""
    return json.loads(bytes(file[name]))


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_the_arrays_are_those_of_the_json_form(faces: Faces) -> None:
    mesh = add_overlays(add_attributes(build_silo(6, 2, faces), opacity=True))
    mesh = replace(mesh, origin=np.array([1e6, 0.5, 2.0]))
    file, document = read(mesh), json.loads(json_mesh.encode(mesh, OPTIONS))
    corners = np.array(document["vertices"])[_pad(document["faces"])]
    np.testing.assert_array_equal(file["vertices"][file["faces"]], corners)
    np.testing.assert_array_equal(file["faces"], _pad(document["attribute_faces"]))
    for name in ("normals", "uvs", "colors"):
        np.testing.assert_array_equal(file[name], np.array(document[name], file[name].dtype))
    for name, rows in document["attributes"].items():
        np.testing.assert_array_equal(file[f"attributes/{name}"], np.array(rows))
    assert read_text(file, "parts") == document["parts"]
    assert read_text(file, "report") == document["report"]
    for line, expected in zip(read_text(file, "lines"), document["lines"], strict=True):
        assert line["name"] == expected["name"]
        segments = file["line_segments"][slice(*line["segments"])]
        np.testing.assert_array_equal(
            file["line_vertices"][segments],
            np.array(expected["vertices"])[np.array(expected["segments"])],
        )


def _pad(faces: list[list[int]]) -> Any:
    """Faces as an array: among quads, a triangle repeats its last corner."""
    width = max(map(len, faces))
    return np.array([face + face[-1:] * (width - len(face)) for face in faces])


def test_welds_close_the_mesh() -> None:
    mesh = build_silo(6, 2)
    file = read(mesh)
    faces = file["welds"][file["faces"]]
    loaded = trimesh.Trimesh(file["vertices"], faces, process=False)
    assert loaded.is_watertight
    assert not trimesh.Trimesh(file["vertices"], file["faces"], process=False).is_watertight
    assert "welds" not in read(replace(mesh, welds=None))


def test_missing_arrays_are_left_out() -> None:
    file = read(replace(build_silo(), normals=None, uvs=None, welds=None))
    assert set(file) == {"vertices", "faces", "parts", "report"}
    assert [file[name].dtype for name in ("vertices", "faces")] == [np.float64, np.uint32]


def test_the_program_of_the_page_prints_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    section = PAGE.read_text(encoding="utf-8").split("## NPZ")[1]
    source, printed = re.findall(r"^```\w+\n(.*?)^```$", section, re.M | re.S)[:2]
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", "utah-teapot", "-o", "teapot.npz"]) == 0
    with redirect_stdout(StringIO()) as output:
        exec(compile(source, PAGE.name, "exec"), {})
    assert output.getvalue() == printed
