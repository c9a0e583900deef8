"""OOGL with Bézier patches: the control points are unchanged; Geomview computes the surface."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from service.encoders.oogl_patches import encode_patches
from service.errors import UnsupportedByFormat
from service.surface.batches import Channel, TensorPatches
from service.surface.lowered import Part, PatchModel
from tests.clients.geomview import read_oogl

Array = NDArray[np.float64]

SAMPLES = 10
"""Samples along each side of a patch that Geomview computes by default."""


def build_model(*batches: TensorPatches) -> PatchModel:
    count = sum(batch.count for batch in batches)
    return PatchModel("model", batches, (Part("model", 0, count),))


def build_net(p: int, q: int, patches: int = 1, *, seed: int = 1) -> Array:
    """Random control points (patches, p+1, q+1, 3)."""
    rng = np.random.default_rng((seed, p, q))
    return rng.uniform(-1, 1, (patches, p + 1, q + 1, 3))


def build_quarter_cylinder() -> TensorPatches:
    """A quarter of a cylinder of radius 1 and height 2: one rational patch."""
    arc = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    points = np.array([[[[x, y, z] for z in (0.0, 2.0)] for x, y in arc]])
    weights = np.array([[[w, w] for w in (1.0, np.sqrt(0.5), 1.0)]])
    return TensorPatches(points, weights)


def de_casteljau(points: Array, t: float) -> Array:
    """The point at parameter t of a Bézier curve whose control points are along axis 0."""
    while len(points) > 1:
        points = (1 - t) * points[:-1] + t * points[1:]
    point: Array = points[0]
    return point


@pytest.mark.parametrize("degree", [(1, 1), (2, 3), (3, 3), (9, 1), (10, 4), (12, 12)])
def test_points_of_geomview_are_on_the_surface(degree: tuple[int, int], tmp_path: Path) -> None:
    points = build_net(*degree)
    mesh = read_oogl(encode_patches(build_model(TensorPatches(points))), tmp_path)
    t = np.arange(SAMPLES) / (SAMPLES - 1)
    expected = np.array([de_casteljau(de_casteljau(points[0], u), v) for v in t for u in t])
    assert len(mesh.vertices) == SAMPLES * SAMPLES
    # Geomview has another order of points, so each is compared with the nearest.
    distances = np.linalg.norm(expected[:, None] - mesh.vertices, axis=-1)
    assert max(distances.min(axis=0).max(), distances.min(axis=1).max()) < 2e-5


def test_rational_patches_are_written_in_homogeneous_coordinates(tmp_path: Path) -> None:
    content = encode_patches(build_model(build_quarter_cylinder()))
    root = repr(float(np.sqrt(0.5)))
    assert content.decode().splitlines()[:5] == [
        "LIST",
        "{ = BEZ 2 1 4",
        "1.0 0.0 0.0 1.0",
        f"{root} {root} 0.0 {root}",
        "0.0 1.0 0.0 1.0",
    ]
    mesh = read_oogl(content, tmp_path)
    np.testing.assert_allclose(np.hypot(*mesh.vertices[:, :2].T), 1, atol=1e-6)


def test_corners_have_their_colors(tmp_path: Path) -> None:
    """BEZ has colours at the four corners only, so a net of colours must have degree (1, 1).

    Geomview then computes the same colours as the service.
    """
    colors = np.random.default_rng(6).random((2, 2, 2, 4))
    points = build_net(2, 1, patches=2)
    points[1] += 9  # so that no point of one patch is near the other patch
    batch = TensorPatches(points, channels=(Channel("colors", "colors", colors),))
    content = encode_patches(build_model(batch))
    assert content.startswith(b"LIST\n{ = CBEZ 2 1 3\n")
    mesh = read_oogl(content, tmp_path)
    assert mesh.colors is not None
    t = np.arange(SAMPLES) / (SAMPLES - 1)
    pairs = [(u, v) for v in t for u in t]
    expected = np.array(
        [
            [*de_casteljau(de_casteljau(net, u), v), *de_casteljau(de_casteljau(color_net, u), v)]
            for net, color_net in zip(points, colors, strict=True)
            for u, v in pairs
        ]
    )
    rows = np.hstack([mesh.vertices, mesh.colors])
    distances = np.abs(expected[:, None] - rows).max(axis=-1)
    assert max(distances.min(axis=0).max(), distances.min(axis=1).max()) < 2e-5


@pytest.mark.parametrize("degree", [(13, 1), (1, 13)])
def test_degrees_above_12_are_refused(degree: tuple[int, int]) -> None:
    with pytest.raises(UnsupportedByFormat) as error:
        encode_patches(build_model(TensorPatches(build_net(*degree))))
    (issue,) = error.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/oogl")
