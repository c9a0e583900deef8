"""Surfaces with triangular patches, written in every format and read back by what others made."""

from io import BytesIO
from math import pi
from pathlib import Path

import numpy as np
import pytest
import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions, OverlayName
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import plan_mesh
from service.surface.channels import Channels
from service.surface.examples import find
from service.surface.rounded import rounded_box
from service.surface.triangle import TriangleSurface
from tests.clients.geomview import read_oogl
from tests.oracles import triangles

OVERLAYS: tuple[OverlayName, ...] = ("control_net", "boundary")
EXAMPLES = ("monkey-saddle", "octahedral-sphere", "rounded-box")
FORMATS = [(name, None) for name in BY_NAME if name != "oogl"] + [("oogl", "off"), ("oogl", "bez")]


def colored(degree: int = 5) -> TriangleSurface:
    """A triangle that carries everything a surface can carry, each in a degree of its own."""
    rng = np.random.default_rng(degree)
    net = np.array([(j, k, 0) for _, j, k in triangles.keys(degree)], dtype=float)
    net[:, 2] = rng.uniform(-1, 1, len(net))
    carried = Channels(
        colors=rng.uniform(0, 1, (6, 4)),
        uvs=np.array([[0.0, 0], [2, 0], [0, 2]]),
        attributes=(("height", rng.uniform(-9, 9, (10, 1))), ("six", rng.uniform(0, 1, (1, 6)))),
    )
    return TriangleSurface(net, rng.uniform(0.5, 2, len(net)), "z", "sail", carried)


@pytest.mark.parametrize("name", ["stl", "obj", "ply", "off"])
def test_trimesh_reads_a_closed_body_of_the_right_volume(name: str) -> None:
    """The rounded box: a box, its faces and edges made thicker, and a sphere in pieces."""
    half, radius = np.array([1.0, 0.7, 0.5]), 0.3
    x, y, z = 2 * half
    faces, edges = 2 * (x * y + y * z + z * x), x + y + z
    truth = x * y * z + faces * radius + edges * pi * radius**2 + 4 / 3 * pi * radius**3
    known = BY_NAME[name]
    content = plan_mesh(rounded_box(), MeshOptions((16, 16)), known).run().content
    scene = trimesh.load_scene(
        BytesIO(content), file_type=name, process=True, merge_norm=True, merge_tex=True
    )
    (loaded,) = scene.geometry.values()
    assert isinstance(loaded, trimesh.Trimesh)
    assert loaded.is_watertight
    assert loaded.is_winding_consistent
    assert len(loaded.faces) == 18 * 512 + 8 * 256
    assert 0 < 1 - loaded.volume / truth < 1e-3


def test_geomview_dices_the_very_sphere(tmp_path: Path) -> None:
    """The exact form of a triangle is a square with a pole, and just as round."""
    work = plan_mesh(
        find("octahedral-sphere").surface(), MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez")
    )
    read = read_oogl(work.run().content, tmp_path)
    # Eight patches of 10 × 10 points each, single precision.
    assert len(read.vertices) == 800
    assert np.abs(np.linalg.norm(read.vertices, axis=1) - 1).max() < 1e-6


@pytest.mark.parametrize(("degree", "refused"), [(12, False), (13, True)])
def test_the_exact_form_ends_at_degree_12(degree: int, refused: bool, tmp_path: Path) -> None:
    work = plan_mesh(colored(degree), MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez"))
    if not refused:
        assert len(read_oogl(work.run().content, tmp_path).vertices) == 100
        return
    with pytest.raises(UnsupportedByFormat) as caught:
        work.run()
    assert caught.value.issues[0].got == "degree 13"
