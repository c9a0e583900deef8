"""Files that users may have: curl sends them to the service, and Geomview reads the responses."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.bspline import BsplineSurface
from tests.clients.geomview import read_oogl
from tools.programs import find_program

GEOMVIEW = Path("/usr/share/geomview/geom")


def post_file(url: str, file: Path, media_type: str) -> bytes:
    """The body of the response to a POST request with this file as its body, sent by curl."""
    command = [
        find_program("curl"),
        "--silent",
        "--show-error",
        "--fail",
        "--data-binary",
        f"@{file}",
        "--header",
        f"Content-Type: {media_type}",
        url,
    ]
    return subprocess.run(command, capture_output=True, timeout=60, check=True).stdout


def test_an_array_sent_by_curl_becomes_a_mesh(server: str, tmp_path: Path) -> None:
    net = np.random.default_rng(5).normal(size=(100, 100, 3))
    np.save(tmp_path / "net.npy", net)
    url = f"{server}/v1/mesh?type=bspline&format=glb&resolution=1"
    surface = BsplineSurface(net, (3, 3), ("clamped", "clamped"))
    expected = render(surface, MeshOptions((1, 1)), BY_NAME["glb"])
    assert post_file(url, tmp_path / "net.npy", "application/x-npy") == expected


@pytest.mark.parametrize("name", ["teapot.bez", "octant.bez", "pieces/linkB.bez", "torus.bez"])
def test_geomview_reads_the_same_patches_from_its_file_and_from_the_response(
    server: str, tmp_path: Path, name: str
) -> None:
    file = GEOMVIEW / name
    if not file.exists():
        pytest.skip("Geomview's examples are not installed")
    response = post_file(f"{server}/v1/mesh?format=oogl&oogl=bez", file, "model/x-oogl")
    mesh_of_file, mesh_of_response = (
        read_oogl(content, tmp_path) for content in (file.read_bytes(), response)
    )
    assert len(mesh_of_file.vertices) == len(mesh_of_response.vertices) > 0
    assert mesh_of_file.faces == mesh_of_response.faces
    np.testing.assert_allclose(mesh_of_response.vertices, mesh_of_file.vertices, atol=1e-5)
