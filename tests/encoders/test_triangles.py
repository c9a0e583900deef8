"""Surfaces with triangular patches, written in every format and read back by what others made."""

from pathlib import Path

import numpy as np
import pytest

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import plan_mesh
from service.surface.channels import Channels
from service.surface.examples import find
from service.surface.triangle import TriangleSurface
from tests.clients.geomview import read_oogl
from tests.oracles import triangles


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
