"""Cameras: directions, the frame turned y-up, and views that show a whole model."""

from math import radians, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.pictures.camera import MARGIN, build_camera
from service.engine.pictures.options import Viewpoint

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


@pytest.mark.parametrize(
    ("azimuth", "elevation", "forward"),
    [(0, 0, [0, 0, -1]), (90, 0, [-1, 0, 0]), (0, 90, [0, -1, 0]), (180, 0, [0, 0, 1]),
     (0, -90, [0, 1, 0])],
)  # fmt: skip
def test_directions(azimuth: float, elevation: float, forward: list[float]) -> None:
    viewpoint = Viewpoint(azimuth=azimuth, elevation=elevation)
    camera = build_camera(viewpoint, CUBE, "y")
    np.testing.assert_allclose(camera.axes[2], forward, atol=1e-12)
    # Right, up and backward are a right-handed frame.
    np.testing.assert_allclose(np.linalg.det(camera.axes), -1, atol=1e-12)
    # From a model whose vertical axis is z, (x, y, z) is (x, z, −y) there.
    x, y, z = forward
    turned = build_camera(viewpoint, CUBE, "z")
    np.testing.assert_allclose(turned.axes[2], [x, -z, y], atol=1e-12)


viewpoints = st.builds(
    Viewpoint,
    width=st.sampled_from([64, 90]),
    height=st.sampled_from([64, 30]),
    field_of_view=st.floats(0.1, 2.5),
    orthographic=st.booleans(),
    azimuth=st.floats(-180, 180),
    elevation=st.floats(-90, 90),
)


@given(viewpoints, st.sampled_from([1e-6, 1.0, 1e7]), st.integers(0, 9))
def test_a_camera_without_a_position_shows_all_points(
    viewpoint: Viewpoint, scale: float, seed: int
) -> None:
    points = np.random.default_rng(seed).normal(size=(20, 3)) * scale + 3 * scale
    size = viewpoint.width, viewpoint.height
    camera = build_camera(viewpoint, points, "y")
    corners, depth = camera.place(points)
    assert (depth > 0).all()
    # The model touches the margin on one side.
    places = np.abs(corners[:2] / corners[2] / np.array(size)[:, None] - 0.5) * 2
    assert places.max() == pytest.approx(MARGIN, rel=1e-6)


def test_zoom_enlarges_the_picture_about_its_middle() -> None:
    near, far = (build_camera(Viewpoint(zoom=zoom), CUBE, "y") for zoom in (3.0, 1.0))
    (x, y, w), _ = near.place(CUBE)
    (x1, y1, w1), _ = far.place(CUBE)
    np.testing.assert_allclose(x / w - 256, 3 * (x1 / w1 - 256))
    np.testing.assert_allclose(y / w - 256, 3 * (y1 / w1 - 256))


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_camera_with_a_position_looks_at_its_target(orthographic: bool) -> None:
    viewpoint = Viewpoint(
        200, 100, radians(40), orthographic, position=(3, 4, 5), target=(1, 1, -1)
    )
    camera = build_camera(viewpoint, CUBE, "y")
    target = np.array([1.0, 1, -1])
    up = camera.axes[1] * 7 * tan(radians(20))  # the distance is 7
    (x, y, w), depth = camera.place(np.stack([target, target + up]))
    np.testing.assert_allclose([x / w, y / w], [[100, 100], [50, 0]], atol=1e-9)
    np.testing.assert_allclose(depth, 7)
    rays = camera.find_rays(np.array([[100.0, 100], [50, 0]])).T
    np.testing.assert_allclose(rays[0], camera.axes[2])
    angle = 0 if orthographic else radians(20)
    assert rays[1] @ camera.axes[2] == pytest.approx(np.cos(angle))


def test_a_reduced_camera_has_the_same_view() -> None:
    camera = build_camera(Viewpoint(640, 480), CUBE, "y")
    small = camera.reduce(64)
    assert small.size == (64, 48)
    (x, y, w), _ = camera.place(CUBE)
    (x1, y1, w1), _ = small.place(CUBE)
    np.testing.assert_allclose(x / w, 10 * x1 / w1)
    np.testing.assert_allclose(y / w, 10 * y1 / w1)
    assert small.reduce(64) is small


def test_a_model_of_one_point_has_a_camera() -> None:
    for orthographic in (False, True):
        camera = build_camera(Viewpoint(orthographic=orthographic), np.zeros((1, 3)), "y")
        assert np.isfinite(camera.place(np.zeros((1, 3)))[0]).all()
