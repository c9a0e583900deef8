"""OFF with colours, line by line: trimesh passes over them."""

from pathlib import Path

import numpy as np
import pytest

from service.encoders import off
from service.encoders.format import EncodeOptions
from tests.clients.geomview import read_oogl
from tests.meshes import carrying, silo
from tests.oracles.topology import topology


@pytest.mark.parametrize("opacity", [False, True])
def test_four_numbers_behind_every_position(opacity: bool) -> None:
    mesh = carrying(silo(5, 2), opacity)
    assert mesh.colors is not None
    magic, counts, *lines = off.encode(mesh, EncodeOptions()).decode().splitlines()
    assert magic == "COFF"
    vertices, faces, _ = map(int, counts.split())
    assert vertices == len(np.unique(mesh.positions, axis=0))
    table = np.array([[float(x) for x in line.split()] for line in lines[:vertices]])
    loops = [[int(x) for x in line.split()][1:] for line in lines[vertices:]]
    assert len(loops) == faces
    four = np.ones((len(mesh.colors), 4))
    four[:, : mesh.colors.shape[1]] = mesh.colors
    for loop, triangle in zip(loops, mesh.triangles.tolist(), strict=True):
        np.testing.assert_array_equal(table[loop, :3], mesh.positions[triangle])
        np.testing.assert_allclose(table[loop, 3:], four[triangle], rtol=1e-7)
    assert topology(loops).watertight


def test_geomview_reads_it(tmp_path: Path) -> None:
    read = read_oogl(off.encode(carrying(silo(5, 2)), EncodeOptions()), tmp_path)
    assert read.colors is not None
    assert len(read.colors) == len(read.vertices)
