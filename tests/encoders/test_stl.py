"""STL as text has the numbers of the binary file."""

import io

import numpy as np
import pytest
import trimesh

from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find

ASCII = EncodeOptions(stl="ascii")


def read(content: bytes) -> np.ndarray:
    """The triangles (T, 3, 3) that trimesh reads, with all digits of float32."""
    mesh = trimesh.load(io.BytesIO(content), file_type="stl", process=False)
    assert isinstance(mesh, trimesh.Trimesh)
    return np.asarray(mesh.triangles).astype(np.float32)


@pytest.mark.parametrize("name", ["utah-teapot", "trefoil-tube", "saddle"])
def test_both_forms_have_the_same_triangles(name: str) -> None:
    surface, options = find(name).surface(), MeshOptions((3, 3))
    text = bytes(render(surface, options, BY_NAME["stl"], ASCII))
    binary = bytes(render(surface, options, BY_NAME["stl"]))
    triangles = read(binary)
    assert read(text).tobytes() == (triangles + np.float32(0)).tobytes()
    assert text.startswith(b"solid surface\nfacet normal ")
    assert text.endswith(b"endloop\nendfacet\nendsolid surface\n")
    assert text.count(b"\n") == 2 + 7 * len(triangles)
    size = MeshSize(0, len(triangles), 0, 0, 0, 0, 0)
    assert len(binary) == BY_NAME["stl"].byte_bound(size, EncodeOptions())
    assert len(text) <= BY_NAME["stl"].byte_bound(size, ASCII) < 12 * len(binary)


@pytest.mark.parametrize("scale", [3e37, 1.17549e-38, 1.2345678e-20])
def test_the_longest_numbers_are_within_the_bound(scale: float) -> None:
    """Coordinates near the largest and the smallest numbers of float32."""
    net = -scale * np.random.default_rng(1).uniform(0.1, 1, (3, 3, 3))
    text = bytes(render(BezierSurface(net), MeshOptions((3, 3)), BY_NAME["stl"], ASCII))
    size = MeshSize(0, text.count(b"endfacet"), 0, 0, 0, 0, 0)
    assert size.triangles == 18
    assert len(text) <= BY_NAME["stl"].byte_bound(size, ASCII)
