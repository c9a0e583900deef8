"""OOGL forms made from a mesh: our text, and what Geomview itself reads in it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.encoders import oogl
from service.encoders.format import EncodeOptions, OoglForm
from service.engine.mesh.mesh import Mesh
from service.errors import UnsupportedByFormat
from tests.clients.geomview import read_oogl
from tests.meshes import carrying, sheet, silo, with_overlays, without_faces


def encode(mesh: Mesh, form: OoglForm | None = None) -> bytes:
    return oogl.encode(mesh, EncodeOptions(form))


def lines(content: bytes) -> list[str]:
    return content.decode("ascii").splitlines()


@pytest.mark.parametrize("form", ["mesh", "off"])
def test_positions_keep_all_their_digits(form: OoglForm, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    positions = rng.standard_normal((16, 3)) * 10.0 ** rng.integers(-30, 30, (16, 1))
    mesh = replace(sheet(3), positions=positions)
    content = encode(mesh, form)
    order = mesh.grids[0][0].T.ravel() if form == "mesh" else np.arange(16)
    written = [[float(x) for x in line.split()[:3]] for line in lines(content)[2:18]]
    assert written == positions[order].tolist()
    # Geomview stores float32 and has a number reader of its own, which may miss by one.
    read = read_oogl(content, tmp_path)
    np.testing.assert_allclose(read.vertices, positions[order], rtol=2.0**-22)


@pytest.mark.parametrize("value", [1e-30, 1.5e22, -0.0, 1e-5, 123456789.0, -1e-7])
def test_no_number_puzzles_geomview(value: float, tmp_path: Path) -> None:
    mesh = with_overlays(sheet(2))
    odd = replace(mesh, positions=mesh.positions + value)
    for form in ("cquad", "mesh", "off"):
        read_oogl(encode(odd, form), tmp_path)


def test_seed_form_lists_the_corners_of_every_cell_in_its_own_order() -> None:
    mesh = silo(4, 2)
    found = lines(encode(mesh, "cquad"))
    assert found[:2] == ["LIST", "{ = CQUAD"]
    assert found[-1] == "}"
    expected = [
        "{:g} {:g} {:g} 1 1 1 1".format(*mesh.positions[grid[0, i + di, j + dj]].tolist())
        for grid in mesh.grids
        for i in range(4)
        for j in range(2)
        for di, dj in ((0, 0), (0, 1), (1, 1), (1, 0))
    ]
    assert found[2:-1] == expected


def test_control_net_is_one_skeleton_a_cell_and_the_boundary_one_in_all() -> None:
    text = encode(with_overlays(silo()), "cquad").decode()
    _, net = text.split("}\n", 1)
    assert net == (
        "{ = SKEL 4 1\n0 0 0\n0 1 0\n1 1 0.125\n1 0 0\n5 0 1 2 3 0\n}\n"
        "{ = SKEL 4 1\n1 0 0\n1 1 0.125\n2 1 0.25\n2 0 0\n5 0 1 2 3 0\n}\n"
        "{ = SKEL 3 3\n0.0 0.0 0.0\n1.0 0.0 0.5\n0.0 1.0 0.25\n2 0 1\n2 1 2\n2 2 0\n}\n"
    )


def test_mesh_form_runs_u_fastest() -> None:
    mesh = replace(silo(4, 2), uvs=None)
    assert mesh.normals is not None
    found = lines(encode(mesh, "mesh"))
    assert found[0] == "LIST"
    for k, grid in enumerate(mesh.grids):
        block = found[1 + 17 * k : 18 + 17 * k]
        assert (block[0], block[-1]) == ("{ = NMESH 5 3", "}")
        values = np.array([[float(x) for x in line.split()] for line in block[1:-1]])
        for j in range(3):
            for i in range(5):
                row = grid[0, i, j]
                expected = [*mesh.positions[row], *mesh.normals[row]]
                np.testing.assert_allclose(values[j * 5 + i], expected, rtol=1e-7, atol=0)


@pytest.mark.parametrize(("form", "prefix", "tail"), [("mesh", "UCN", [0.0]), ("off", "STCN", [])])
def test_a_vertex_is_position_normal_color_texture(
    form: OoglForm, prefix: str, tail: list[float], tmp_path: Path
) -> None:
    mesh = carrying(sheet(3))
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.colors is not None
    content = encode(mesh, form)
    found = lines(content)
    assert found[1].startswith(f"{{ = {prefix}{form.upper()} ")
    order = mesh.grids[0][0].T.ravel() if form == "mesh" else np.arange(16)
    for line, k in zip(found[2:18], order.tolist(), strict=True):
        color = [*mesh.colors[k].tolist(), 1.0]
        expected = [*mesh.positions[k], *mesh.normals[k], *color, *mesh.uvs[k], *tail]
        np.testing.assert_allclose([float(x) for x in line.split()], expected, rtol=1e-7)
    assert len(read_oogl(content, tmp_path).faces) == (9 if form == "mesh" else 18)


def test_the_default_is_the_seed_form_where_there_are_grids() -> None:
    mesh = with_overlays(silo())
    assert encode(mesh) == encode(mesh, "cquad")
    gridless = replace(mesh, grids=())
    assert encode(gridless) == encode(gridless, "off")


@pytest.mark.parametrize(
    ("mesh", "form", "reason"),
    [
        (replace(silo(), grids=()), "cquad", "grid"),
        (replace(silo(), grids=()), "mesh", "grid"),
        (silo(), "bez", "patches"),
        (without_faces(silo()), None, "faces"),
    ],
)
def test_a_form_that_cannot_hold_the_mesh_is_refused(
    mesh: Mesh, form: OoglForm | None, reason: str
) -> None:
    with pytest.raises(UnsupportedByFormat, match=reason) as refused:
        encode(mesh, form)
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/oogl")
