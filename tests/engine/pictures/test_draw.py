"""Pictures against closed forms: outlines, light, colours, lines and curvatures."""

from math import radians, tan

import numpy as np
import pytest

from service.engine.accuracy import Accuracy, Camera
from service.engine.adaptive.tolerances import build_goal
from service.engine.meshers import build_mesher
from service.engine.options import MeshOptions, OverlayName
from service.engine.pictures.camera import UPRIGHT, PictureCamera, build_camera
from service.engine.pictures.draw import draw_picture
from service.engine.pictures.options import PictureStyle, Viewpoint
from service.engine.pictures.shading import compress, shade, to_linear, to_srgb
from service.engine.stored_positions import Storage
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.sizes import SurfaceKind
from tests.strategies import Array

SHADED = PictureStyle()
FRONT = Viewpoint(96, 96, radians(30), position=(0, 0, 6), target=(0, 0, 0))
SQUARE = BezierSurface(np.array([[[-1.0, -1, 0], [-1, 1, 0]], [[1, -1, 0], [1, 1, 0]]]))


def draw(
    surface: SurfaceKind,
    viewpoint: Viewpoint,
    style: PictureStyle = SHADED,
    overlays: tuple[OverlayName, ...] = (),
) -> tuple[Array, PictureCamera]:
    """The pixels of a surface, and the camera."""
    model = surface.lower()
    mesh_options = MeshOptions(places=True, curvatures=style.look != "shaded", overlays=overlays)
    mesher = build_mesher(model, mesh_options, Storage(), has_nodes=True)
    camera = build_camera(viewpoint, np.array([[-1.0, -1, -1], [1, 1, 1]]), model.up)
    x, y, z = camera.eye.tolist()
    accuracy = Accuracy(
        camera=Camera((x, y, z), viewpoint.field_of_view, viewpoint.height), pixel_tolerance=0.25
    )
    mesh = mesher.build_mesh(build_goal(accuracy, mesher.model), 100_000)
    return draw_picture(mesh, camera, style).astype(float), camera


def test_the_outline_of_a_sphere_is_a_circle() -> None:
    pixels, camera = draw(find("sphere").surface(), FRONT)
    # The cone of rays that touch the sphere of radius 1 at the distance 6.
    radius = camera.focus * tan(np.arcsin(1 / 6))
    rows, columns = np.mgrid[:96, :96] + 0.5
    distance = np.hypot(rows - 48, columns - 48)
    alpha = pixels[..., 3] / 255
    assert (alpha[distance < radius - 1] == 1).all()
    assert (alpha[distance > radius + 1] == 0).all()
    assert alpha.sum() == pytest.approx(np.pi * radius**2, rel=1e-2)  # the mesh is inside


def test_the_light_is_that_of_the_exact_normals() -> None:
    """Normals that are interpolated between vertices would differ."""
    pixels, camera = draw(find("sphere").surface(), FRONT)
    rows, columns = np.mgrid[32:64, 32:64].reshape(2, -1)
    rays = camera.find_rays(np.stack([columns, rows]) + 0.5).T
    middle = np.einsum("ij,j->i", rays, -camera.eye)
    normals = camera.eye + (middle - np.sqrt(middle**2 - 35))[:, None] * rays
    # The light is in the frame turned y-up.
    rays, normals = rays @ UPRIGHT.T, normals @ UPRIGHT.T
    glaze = to_linear(np.broadcast_to(np.array([0x2F, 0x86, 0xA0]) / 255, normals.shape))
    expected = 255 * to_srgb(compress(shade(glaze.T, normals.T, rays.T))).T
    found = pixels[rows, columns, :3]
    assert np.abs(found - expected).max() <= 4


def test_a_background_is_behind_and_transparent_pixels_have_no_colour() -> None:
    transparent, _ = draw(SQUARE, FRONT)
    assert (transparent[0, 0] == 0).all()
    assert (transparent[48, 48, 3] == 255).all()
    opaque, _ = draw(SQUARE, FRONT, PictureStyle(background=(1.0, 0.5, 0.0)))
    assert opaque[0, 0].tolist() == [255, 128, 0, 255]
    np.testing.assert_array_equal(opaque[48, 48], transparent[48, 48])


def test_curvatures_have_colours_on_both_sides_of_zero() -> None:
    """The saddle z = x y has negative, a sphere positive Gaussian curvature."""
    for name, is_blue in (("saddle", True), ("sphere", False)):
        viewpoint = Viewpoint(64, 64, radians(30), position=(0, 6, 0.5), target=(0, 0, 0))
        pixels, _ = draw(find(name).surface(), viewpoint, PictureStyle("gaussian"))
        red, _, blue, _ = pixels[32, 32]
        assert (blue > red) == is_blue
    flat, _ = draw(SQUARE, FRONT, PictureStyle("mean"))
    red, green, blue, _ = flat[48, 48]
    assert max(red, green, blue) - min(red, green, blue) < 40


def test_lines_are_drawn_before_the_surface_and_hidden_behind_it() -> None:
    back = Viewpoint(96, 96, radians(30), position=(1.5, 1, 6), target=(0, 0, 0))
    plain, _ = draw(find("sphere").surface(), back)
    lines, _ = draw(find("sphere").surface(), back, overlays=("boundary",))
    changed = np.abs(lines - plain).max(axis=2) > 20
    assert 20 < changed.sum() < 0.2 * (plain[..., 3] > 0).sum()
    # The net of the square is its border.
    net, camera = draw(SQUARE, FRONT, overlays=("control_net",))
    difference = np.abs(net - draw(SQUARE, FRONT)[0]).max(axis=2) > 20
    (x, y, w), _ = camera.place(np.array([[1.0, 0.3, 0]]))
    assert difference[int((y / w)[0]), int((x / w)[0])]
    assert not difference[48, 48]


def test_pictures_are_the_same_each_time() -> None:
    first, second = (draw(find("utah-teapot").surface(), Viewpoint(80, 60))[0] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_the_curvature_of_a_developable_surface_is_not_its_rounding() -> None:
    """The Gaussian curvature of a cylinder is 0: the picture has one hue."""
    pixels, _ = draw(find("cylinder").surface(), Viewpoint(64, 64), PictureStyle("gaussian"))
    shown = pixels[pixels[..., 3] == 255][:, :3]
    assert len(shown) > 100
    assert (shown.max(axis=1) - shown.min(axis=1)).max() < 40
