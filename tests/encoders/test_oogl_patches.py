"""The exact OOGL form: unchanged control points, and the surface that Geomview makes from them."""

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

DICE = 10
"""Points along each side into which Geomview divides a patch by default."""


def build_model(*batches: TensorPatches) -> PatchModel:
    count = sum(batch.count for batch in batches)
    return PatchModel("model", batches, (Part("model", 0, count),))


def build_net(p: int, q: int, patches: int = 1, *, seed: int = 1) -> Array:
    rng = np.random.default_rng((seed, p, q))
    return rng.uniform(-1, 1, (patches, p + 1, q + 1, 3))


def build_quarter_cylinder() -> TensorPatches:
    arc = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    points = np.array([[[[x, y, z] for z in (0.0, 2.0)] for x, y in arc]])
    weights = np.array([[[w, w] for w in (1.0, np.sqrt(0.5), 1.0)]])
    return TensorPatches(points, weights)


def de_casteljau(points: Array, t: float) -> Array:
    """Point of a Bézier curve of control points along axis 0."""
    while len(points) > 1:
        points = (1 - t) * points[:-1] + t * points[1:]
    point: Array = points[0]
    return point


@pytest.mark.parametrize("degree", [(1, 1), (2, 3), (3, 3), (9, 1), (10, 4), (12, 12)])
def test_points_of_geomview_are_on_the_surface(degree: tuple[int, int], tmp_path: Path) -> None:
    points = build_net(*degree)
    read = read_oogl(encode_patches(build_model(TensorPatches(points))), tmp_path)
    t = np.arange(DICE) / (DICE - 1)
    expected = np.array([de_casteljau(de_casteljau(points[0], u), v) for v in t for u in t])
    assert len(read.vertices) == DICE * DICE
    # Compared with the nearest point, because Geomview has another order of points.
    distance = np.linalg.norm(expected[:, None] - read.vertices, axis=-1)
    assert max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 2e-5


def test_rational_patches_are_homogeneous(tmp_path: Path) -> None:
    content = encode_patches(build_model(build_quarter_cylinder()))
    root = repr(float(np.sqrt(0.5)))
    assert content.decode().splitlines()[:5] == [
        "LIST",
        "{ = BEZ 2 1 4",
        "1.0 0.0 0.0 1.0",
        f"{root} {root} 0.0 {root}",
        "0.0 1.0 0.0 1.0",
    ]
    read = read_oogl(content, tmp_path)
    np.testing.assert_allclose(np.hypot(*read.vertices[:, :2].T), 1, atol=1e-6)


def test_corners_have_their_colors(tmp_path: Path) -> None:
    """A net of degree (1, 1) is all that BEZ can say: Geomview's colours are then the surface's."""
    colors = np.random.default_rng(6).random((2, 2, 2, 4))
    points = build_net(2, 1, patches=2)
    points[1] += 9
    batch = TensorPatches(points, channels=(Channel("colors", "colors", colors),))
    content = encode_patches(build_model(batch))
    assert content.startswith(b"LIST\n{ = CBEZ 2 1 3\n")
    read = read_oogl(content, tmp_path)
    assert read.colors is not None
    t = np.arange(DICE) / (DICE - 1)
    pairs = [(u, v) for v in t for u in t]
    expected = np.array(
        [
            [*de_casteljau(de_casteljau(n, u), v), *de_casteljau(de_casteljau(c, u), v)]
            for n, c in zip(points, colors, strict=True)
            for u, v in pairs
        ]
    )
    result = np.hstack([read.vertices, read.colors])
    distance = np.abs(expected[:, None] - result).max(axis=-1)
    assert max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 2e-5


@pytest.mark.parametrize("degree", [(13, 1), (1, 13)])
def test_higher_degrees_are_refused(degree: tuple[int, int]) -> None:
    with pytest.raises(UnsupportedByFormat) as refused:
        encode_patches(build_model(TensorPatches(build_net(*degree))))
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/oogl")
