"""The forms of a mesh in OOGL: the text of the file, and the mesh that Geomview reads from it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.encoders import oogl
from service.encoders.format import EncodeOptions, OoglForm
from service.engine.mesh.mesh import Mesh
from service.errors import UnsupportedByFormat
from tests.clients.geomview import read_oogl
from tools.meshes import add_attributes, add_overlays, build_sheet, build_silo, remove_faces


def encode(mesh: Mesh, form: OoglForm | None = None) -> bytes:
    return oogl.encode(mesh, EncodeOptions(form))


def read_lines(content: bytes) -> list[str]:
    return content.decode("ascii").splitlines()


def list_vertices(sheet: Mesh, form: OoglForm) -> list[int]:
    """The vertices of a sheet in the order of the file, in which they begin after two lines.

    MESH lists the samples of the only patch with u fastest, OFF lists the vertices.
    """
    if form == "off":
        return list(range(len(sheet.positions)))
    (patch,) = sheet.grids[0]
    order: list[int] = patch.T.ravel().tolist()
    return order


@pytest.mark.parametrize("form", ["mesh", "off"])
def test_positions_are_written_with_all_digits(form: OoglForm, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    positions = rng.standard_normal((16, 3)) * 10.0 ** rng.integers(-30, 30, (16, 1))
    mesh = replace(build_sheet(3), positions=positions)
    content = encode(mesh, form)
    order = list_vertices(mesh, form)
    rows = [[float(x) for x in line.split()[:3]] for line in read_lines(content)[2:18]]
    assert rows == positions[order].tolist()
    # Geomview stores float32, and its last bit may be wrong.
    geomview_mesh = read_oogl(content, tmp_path)
    np.testing.assert_allclose(geomview_mesh.vertices, positions[order], rtol=2.0**-22)


@pytest.mark.parametrize("value", [1e-30, 1.5e22, -0.0, 1e-5, 123456789.0, -1e-7])
def test_geomview_reads_every_number(value: float, tmp_path: Path) -> None:
    mesh = add_overlays(build_sheet(2))
    mesh = replace(mesh, positions=mesh.positions + value)
    for form in ("cquad", "mesh", "off"):
        read_oogl(encode(mesh, form), tmp_path)


@pytest.mark.parametrize(("form", "prefix", "tail"), [("mesh", "UCN", [0.0]), ("off", "STCN", [])])
def test_a_line_has_position_normal_color_and_texture_coordinates(
    form: OoglForm, prefix: str, tail: list[float], tmp_path: Path
) -> None:
    """MESH has a third texture coordinate, which is 0."""
    mesh = add_attributes(build_sheet(3))
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.colors is not None
    content = encode(mesh, form)
    lines = read_lines(content)
    assert lines[1].startswith(f"{{ = {prefix}{form.upper()} ")
    for line, k in zip(lines[2:18], list_vertices(mesh, form), strict=True):
        color = [*mesh.colors[k].tolist(), 1.0]
        expected = [*mesh.positions[k], *mesh.normals[k], *color, *mesh.uvs[k], *tail]
        np.testing.assert_allclose([float(x) for x in line.split()], expected, rtol=1e-7)
    assert len(read_oogl(content, tmp_path).faces) == (9 if form == "mesh" else 18)


def test_the_default_form_is_cquad_for_meshes_with_grids_and_off_for_others() -> None:
    mesh = add_overlays(build_silo())
    assert encode(mesh) == encode(mesh, "cquad")
    mesh_without_grids = replace(mesh, grids=())
    assert encode(mesh_without_grids) == encode(mesh_without_grids, "off")


@pytest.mark.parametrize(
    ("mesh", "form", "reason"),
    [
        (replace(build_silo(), grids=()), "cquad", "grid"),
        (replace(build_silo(), grids=()), "mesh", "grid"),
        (build_silo(), "bez", "patches"),
        (remove_faces(build_silo()), None, "faces"),
    ],
)
def test_a_form_that_cannot_store_the_mesh_is_refused(
    mesh: Mesh, form: OoglForm | None, reason: str
) -> None:
    with pytest.raises(UnsupportedByFormat, match=reason) as error:
        encode(mesh, form)
    (issue,) = error.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/oogl")
