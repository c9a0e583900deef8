"""Pictures: how far points may be drawn from their places, and how much memory that takes."""

import tracemalloc
from math import radians

import numpy as np
import pytest

from service.engine.adaptive.tolerances import build_goal
from service.engine.pictures.camera import build_camera
from service.engine.pictures.options import PIXEL_TOLERANCE, PictureOptions, Viewpoint
from service.pipeline.picture import find_accuracy, plan_picture
from service.surface.examples.catalogue import find


@pytest.mark.parametrize("field_of_view", [0.1, 0.5, 1.5, 2.8])
@pytest.mark.parametrize("size", [(512, 512), (2048, 64), (64, 900)])
def test_a_distance_within_the_goal_is_within_the_tolerance_anywhere_in_the_picture(
    field_of_view: float, size: tuple[int, int]
) -> None:
    """Also in the corners, where a distance looks larger than in the middle."""
    viewpoint = Viewpoint(*size, field_of_view, position=(3, 4, 5), target=(0, 0, 0))
    camera = build_camera(viewpoint, np.zeros((1, 3)), "y")
    goal = build_goal(find_accuracy(camera), find("sphere").surface().lower())
    rng = np.random.default_rng(1)
    pixels = np.concatenate([rng.uniform(0, size, (4000, 2)), [[0, 0], size, [0, size[1]]]])
    depth = rng.uniform(1, 50, len(pixels))
    rays = camera.find_rays(pixels.T).T
    points = camera.eye + rays * (depth / (rays @ camera.axes[2]))[:, None]
    offsets = rng.normal(size=points.shape)
    # Across the ray, away from the middle, is the direction that looks largest.
    offsets[::2] = np.cross(rays[::2], np.cross(camera.axes[2], rays[::2])) + 1e-9
    offsets /= np.linalg.norm(offsets, axis=1)[:, None]
    allowed = goal.find_allowed(np.linalg.norm(points - camera.eye, axis=1))
    places = []
    for moved in (points, points + allowed[:, None] * offsets):
        (x, y, w), _ = camera.place(moved)
        places.append(np.stack([x / w, y / w]))
    errors = np.hypot(*(places[1] - places[0]))
    assert errors.max() <= PIXEL_TOLERANCE
    assert errors.max() > 0.9 * PIXEL_TOLERANCE


@pytest.mark.parametrize("name", ["saddle", "pipe-tee", "trefoil-tube"])
def test_a_picture_takes_no_more_memory_than_planned(name: str) -> None:
    viewpoint = Viewpoint(1500, 1500, radians(30))
    work = plan_picture(find(name).surface(), PictureOptions(viewpoint))
    plan_picture(find(name).surface(), PictureOptions(Viewpoint(16, 16))).run()  # fill the caches
    tracemalloc.start()
    work.run()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak <= work.cost.memory


def test_a_camera_may_stand_among_the_windings_of_a_tube() -> None:
    """It is inside the box of the tube, but far enough from the tube itself."""
    viewpoint = Viewpoint(
        128, 128, radians(75), position=(2.693, 0.950, -0.419), target=(0.288, 1.290, -1.087)
    )
    assert plan_picture(find("trefoil-tube").surface(), PictureOptions(viewpoint)).run()
