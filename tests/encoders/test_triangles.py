"""Surfaces with triangular patches, written in every format and read by other programs."""

from pathlib import Path

import numpy as np
import pytest

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import plan_mesh
from service.surface.examples import find
from service.surface.triangle import TriangleSurface
from tests.clients.geomview import read_oogl
from tests.oracles import triangles


def test_points_of_geomview_are_on_the_sphere(tmp_path: Path) -> None:
    """The exact form of a triangle is a square with a pole, and just as round."""
    work = plan_mesh(
        find("octahedral-sphere").surface(), MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez")
    )
    read = read_oogl(bytes(work.run().content), tmp_path)
    # Eight patches of 10 × 10 points each, single precision.
    assert len(read.vertices) == 800
    assert np.abs(np.linalg.norm(read.vertices, axis=1) - 1).max() < 1e-6


@pytest.mark.parametrize(("degree", "refused"), [(12, False), (13, True)])
def test_the_exact_form_ends_at_degree_12(degree: int, refused: bool, tmp_path: Path) -> None:
    net = np.array([(j, k, j * k) for _, j, k in triangles.keys(degree)], dtype=float)
    surface = TriangleSurface(net)
    work = plan_mesh(surface, MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez"))
    if not refused:
        assert len(read_oogl(bytes(work.run().content), tmp_path).vertices) == 100
        return
    with pytest.raises(UnsupportedByFormat) as caught:
        work.run()
    assert caught.value.issues[0].got == "degree 13"
