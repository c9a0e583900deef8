"""OOGL with triangular Bézier patches, which become tensor-product patches; Geomview reads them."""

from pathlib import Path

import numpy as np
import pytest

from oracles import triangles
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import plan_mesh
from service.surface.bezier import TriangleSurface
from service.surface.examples.catalogue import find
from tests.clients.geomview import read_oogl


def test_points_of_geomview_are_on_the_sphere(tmp_path: Path) -> None:
    """In OOGL a triangular patch is a tensor-product patch with a pole: the same surface."""
    plan = plan_mesh(
        find("octahedral-sphere").surface(), MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez")
    )
    mesh = read_oogl(bytes(plan.run().content), tmp_path)
    # Geomview computes 10 × 10 points for each of the eight patches, in single precision.
    assert len(mesh.vertices) == 800
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 1e-6


@pytest.mark.parametrize(("degree", "is_refused"), [(12, False), (13, True)])
def test_degrees_above_12_are_refused(degree: int, is_refused: bool, tmp_path: Path) -> None:
    net = np.array([(j, k, j * k) for _, j, k in triangles.keys(degree)], dtype=float)
    surface = TriangleSurface(net)
    plan = plan_mesh(surface, MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez"))
    if not is_refused:
        assert len(read_oogl(bytes(plan.run().content), tmp_path).vertices) == 100
        return
    with pytest.raises(UnsupportedByFormat) as error:
        plan.run()
    assert error.value.issues[0].got == "degree 13"
