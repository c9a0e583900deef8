"""Draws a picture of a mesh: triangles and lines to pixels, with the light of the room."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.mesh.mesh import Mesh
from service.engine.pictures.camera import UPRIGHT, PictureCamera
from service.engine.pictures.curvature_colors import color_curvatures, find_range
from service.engine.pictures.lines import draw_lines
from service.engine.pictures.options import PictureStyle
from service.engine.pictures.parts import list_parts
from service.engine.pictures.raster import Visible, find_visible
from service.engine.pictures.shading import compress, shade, to_linear, to_srgb
from service.engine.scenes.scene import Scene
from service.engine.vectors import Vectors

Pixels: TypeAlias = NDArray[np.uint8]

RANGE_PIXELS = 128
"""The range of colours of curvatures is that of a picture of this size."""

LINE_COLORS = {"control_net": (0.36, 0.29, 0.21), "boundary": (0.05, 0.16, 0.20)}
ISOCURVE_COLOR = (0.05, 0.16, 0.20)
LINE_WIDTH = 1.25
"""sRGB colours of lines, by the names of overlays, and their width in pixels."""


def draw_picture(mesh: Mesh | Scene, camera: PictureCamera, style: PictureStyle) -> Pixels:
    """Draw a mesh by tolerance that was made with `MeshOptions.places`.

    Returns
    -------
    ndarray of uint8, shape (height, width, 4)
        sRGB, and alpha, by which the colours are not multiplied.
    """
    drawing = _Drawing(mesh, camera, style)
    width, height = camera.size
    pixels = np.zeros((height * width, 4), np.uint8)
    for visible in drawing.list_strips():
        checkpoint()
        drawing.write(visible, pixels)
    if style.background is not None:
        empty = pixels[:, 3] == 0
        pixels[empty] = [*_to_bytes(np.array(style.background, float)).tolist(), 255]
    return pixels.reshape(height, width, 4)


class _Drawing:
    """The parts and lines of a picture, numbered as triangles one after the other."""

    def __init__(self, mesh: Mesh | Scene, camera: PictureCamera, style: PictureStyle) -> None:
        self._camera, self._style = camera, style
        self._parts = list(list_parts(mesh))
        self._turn = UPRIGHT if mesh.up == "z" else np.eye(3)
        corners: list[FloatArray] = []
        depths: list[FloatArray] = []
        triangles: list[Ints] = []
        counts: list[int] = []
        lines: list[FloatArray] = []
        vertices = 0
        for part in self._parts:
            placed, depth = camera.place(part.positions)
            corners.append(placed)
            depths.append(depth)
            triangles.append(part.mesh.triangles.astype(np.intp) + vertices)
            counts.append(len(part.mesh.triangles))
            vertices += len(depth)
        for part in self._parts:
            for overlay, points in part.place_lines():
                drawn = draw_lines(camera, points, overlay.segments, LINE_WIDTH)
                corners.append(drawn.corners)
                depths.append(drawn.depths)
                triangles.append(drawn.triangles + vertices)
                counts.append(len(drawn.triangles))
                lines.append(to_linear(np.array(LINE_COLORS.get(overlay.name, ISOCURVE_COLOR))))
                vertices += len(drawn.depths)
        self._ends = np.cumsum([0, *counts])
        self._line_colors = lines
        self._corners = np.concatenate(corners, axis=1)
        self._depths = np.concatenate(depths)
        self._triangles = np.concatenate(triangles)
        self._range = self._find_range() if style.look != "shaded" else 0.0

    def list_strips(self) -> Iterator[Visible]:
        """The visible pairs of pixel and triangle."""
        return find_visible(self._corners, self._depths, self._triangles, self._camera.size)

    def write(self, visible: Visible, pixels: Pixels) -> None:
        """Write the pixels of a strip."""
        if not len(visible.pixel):
            return
        light = self._find_light(visible)
        first, last = int(visible.pixel.min()), int(visible.pixel.max()) + 1
        place = visible.pixel - first
        opacity, *sums = (
            np.bincount(place, visible.share * each, last - first).astype(np.float64)
            for each in (1.0, *light)
        )
        covered = np.flatnonzero(opacity)
        opacity, colors = opacity[covered], np.stack(sums)[:, covered]
        if self._style.background is None:
            colors /= opacity
        else:
            behind = to_linear(np.array(self._style.background))
            colors += behind[:, np.newaxis] * (1.0 - opacity)
            opacity = np.ones(opacity.shape)
        pixels[first + covered, :3] = _to_bytes(to_srgb(colors)).T
        pixels[first + covered, 3] = _to_bytes(opacity)

    def _find_light(self, visible: Visible) -> Vectors:
        """The linear colours (3, K) of all pairs."""
        light = np.empty((3, len(visible.pixel)))
        width = self._camera.size[0]
        for number, rows in self._group(visible.triangle):
            triangle = visible.triangle[rows] - self._ends[number]
            if number >= len(self._parts):
                light[:, rows] = self._line_colors[number - len(self._parts)][:, np.newaxis]
                continue
            part, weights = self._parts[number], visible.weights[:, rows]
            row, column = np.divmod(visible.pixel[rows], width)
            rays = self._turn @ self._camera.find_rays(np.stack([column, row]) + 0.5)
            normals = self._turn @ part.find_normals(triangle, weights).T
            if self._style.look == "shaded":
                albedo = part.find_colors(triangle, weights)
            else:
                mean = self._style.look == "mean"
                values = part.find_curvatures(triangle, weights, mean=mean)
                albedo = to_linear(color_curvatures(values, self._range))
            light[:, rows] = compress(shade(albedo.T, normals, rays))
        return light

    def _find_range(self) -> float:
        """The range of colours, from a smaller picture."""
        camera = self._camera.reduce(RANGE_PIXELS)
        scale = np.array([[camera.size[0] / self._camera.size[0]]] * 2 + [[1.0]])
        mean = self._style.look == "mean"
        values, shares = [], []
        strips = find_visible(self._corners * scale, self._depths, self._triangles, camera.size)
        for visible in strips:
            for number, rows in self._group(visible.triangle):
                if number < len(self._parts):
                    triangle = visible.triangle[rows] - self._ends[number]
                    weights = visible.weights[:, rows]
                    values.append(self._parts[number].find_curvatures(triangle, weights, mean=mean))
                    shares.append(visible.share[rows])
        points = np.concatenate([part.positions for part in self._parts])
        extent = (float(np.ptp(points, axis=0).max()) if len(points) else 0.0) or 1.0
        empty = np.zeros(0)
        return find_range(
            np.concatenate([empty, *values]), np.concatenate([empty, *shares]), extent ** (2 - mean)
        )

    def _group(self, triangle: Ints) -> list[tuple[int, Ints]]:
        """The numbers of parts and lines, with the rows of their triangles."""
        number = np.searchsorted(self._ends, triangle, side="right") - 1
        order = np.argsort(number, kind="stable")
        ends = np.searchsorted(number[order], np.arange(len(self._ends)))
        runs = enumerate(pairwise(ends.tolist()))
        return [(k, order[a:b]) for k, (a, b) in runs if b > a]


def _to_bytes(values: FloatArray) -> Pixels:
    """Components from 0 to 1 as bytes."""
    return np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)
