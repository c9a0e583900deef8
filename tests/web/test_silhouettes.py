"""Pictures have the silhouettes that three.js draws of a fine mesh with the same camera.

three.js draws a pixel for each of the four samples that our pictures take of one. A pixel belongs
to a silhouette if at least half of its samples show the surface.
"""

import base64
from io import BytesIO
from math import atan, radians, tan

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import JSHandle

from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.engine.pictures.options import PictureOptions, Viewpoint
from service.pipeline.mesh import render
from service.pipeline.picture import plan_picture
from service.surface.examples.catalogue import find
from tools.browser import Stage

FINE = 1e-4
"""The tolerance of the fine mesh, in diagonals of the surface: some hundredths of a pixel."""

NAMES = ("utah-teapot", "tea-service", "trefoil-tube", "bspline-hills",
         "plate-with-holes", "pipe-tee")  # fmt: skip
"""Patches, a group, a tube, an open surface, and two trimmed parts."""

SAMPLES = 2
"""The samples of a pixel, in each direction."""

SIZES = ((256, 256), (320, 180), (150, 300))

IMPORT = "const { loadModel, drawSilhouette } = await import('/silhouette.js');"


def list_viewpoints(middle: NDArray[np.float64], radius: float) -> list[Viewpoint]:
    """Ten cameras around a ball that holds a surface: seven outside, two inside, one orthographic.

    The second is opposite to the first. Those inside have a part of the surface behind them.
    """
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(10, 3))
    directions[1] = -directions[0]
    viewpoints = []
    for number, direction in enumerate(directions):
        distance = 0.7 if number in (7, 8) else rng.uniform(1.5, 6)
        angle = radians(75.0) if distance < 1 else 2 * atan(0.9 / distance)
        position = middle + distance * radius * direction / np.linalg.norm(direction)
        target = middle + 0.2 * radius * rng.normal(size=3)
        width, height = SIZES[number % len(SIZES)]
        viewpoint = Viewpoint(
            width,
            height,
            angle,
            orthographic=number == 9,
            position=tuple(position.tolist()),
            target=tuple(target.tolist()),
        )
        viewpoints.append(viewpoint)
    return viewpoints


def read_alpha(picture: bytes) -> NDArray[np.uint8]:
    """The opacity (height, width) of the pixels of a PNG file."""
    return np.asarray(Image.open(BytesIO(picture)).convert("RGBA"))[..., 3]


def draw_ours(name: str, viewpoint: Viewpoint) -> NDArray[np.bool_]:
    """The silhouette in the picture of a surface."""
    work = plan_picture(find(name).surface(), PictureOptions(viewpoint))
    return np.asarray(read_alpha(work.run()) >= 128)


def draw_theirs(stage: Stage, model: JSHandle, viewpoint: Viewpoint) -> NDArray[np.bool_]:
    """The silhouette of a model in three.js."""
    assert viewpoint.position is not None
    assert viewpoint.target is not None
    distance = float(np.linalg.norm(np.subtract(viewpoint.position, viewpoint.target)))
    half_height = distance * tan(viewpoint.field_of_view / 2)
    width, height = viewpoint.width, viewpoint.height
    camera = {
        "position": viewpoint.position,
        "target": viewpoint.target,
        "fieldOfView": viewpoint.field_of_view,
        "halfHeight": half_height if viewpoint.orthographic else None,
        "size": [SAMPLES * width, SAMPLES * height],
    }
    draw = f"async ([model, camera]) => {{ {IMPORT} return drawSilhouette(model, camera); }}"
    url = stage.page.evaluate(draw, [model, camera])
    is_shown = read_alpha(base64.b64decode(url.partition(",")[2])) > 0
    counts = is_shown.reshape(height, SAMPLES, width, SAMPLES).sum(axis=(1, 3))
    return np.asarray(counts >= SAMPLES**2 / 2)


def spread(silhouette: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels that are in a silhouette, or beside one that is."""
    height, width = silhouette.shape
    padded = np.pad(silhouette, 1)
    shifted = [padded[i : i + height, j : j + width] for i in range(3) for j in range(3)]
    return np.asarray(np.logical_or.reduce(shifted))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_silhouettes_are_those_of_a_fine_mesh_in_three(stage: Stage, name: str) -> None:
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=FINE))
    mesh = render(find(name).surface(), options, BY_NAME["glb"])
    url = f"data:model/gltf-binary;base64,{base64.b64encode(mesh).decode()}"
    model = stage.page.evaluate_handle(f"async (url) => {{ {IMPORT} return loadModel(url); }}", url)
    x, y, z, radius = model.evaluate("({ ball }) => [...ball.center.toArray(), ball.radius]")
    for number, viewpoint in enumerate(list_viewpoints(np.array([x, y, z]), radius)):
        ours, theirs = draw_ours(name, viewpoint), draw_theirs(stage, model, viewpoint)
        assert 0.05 < theirs.mean() < 0.99
        assert not (ours & ~spread(theirs)).any(), number
        assert not (theirs & ~spread(ours)).any(), number
        # Few pixels differ at all: those that an outline divides into halves.
        assert (ours != theirs).sum() <= 0.02 * theirs.sum(), number
