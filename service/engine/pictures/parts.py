"""Normals, colours and curvatures of the surface at the places of a picture.

They are evaluated at the parameters of each place, and not interpolated from the vertices: the
triangles of a mesh by tolerance may be long, and would show as facets.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.adaptive.samples import PatchPlaces, evaluate_channel, evaluate_curvatures
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.mesh.mesh import Mesh, Overlay
from service.engine.mesh.places import SurfacePlaces
from service.engine.pictures.shading import to_linear
from service.engine.scenes.placing import place_normals, place_points
from service.engine.scenes.scene import Scene
from service.engine.vectors import dot, normalize
from service.surface.lowered import Color

GLAZE = (0x2F / 255, 0x86 / 255, 0xA0 / 255, 1.0)
"""sRGB of a surface that has no colour of its own."""


@dataclass(frozen=True, eq=False, slots=True)
class PicturePart:
    """The mesh of one copy in a picture.

    Attributes
    ----------
    mesh : Mesh
    matrix : ndarray of float64, shape (4, 4), or None
        The placement of the copy.
    positions : ndarray of float64, shape (V, 3)
        Placed vertices.
    colors : ndarray of float64, shape (T, 3)
        Linear colours of the triangles.
    """

    mesh: Mesh
    matrix: FloatArray | None
    positions: FloatArray
    colors: FloatArray

    def _corners(self, triangle: Ints) -> Ints:
        """The vertices (m, 3) of triangles."""
        return self.mesh.triangles[triangle].astype(np.intp)

    def place_lines(self) -> Iterator[tuple[Overlay, FloatArray]]:
        """The overlays, and the placed points (K, 3) of each."""
        for overlay in self.mesh.overlays:
            yield overlay, place_points(overlay.positions, self.matrix, self.mesh.origin)

    def find_normals(self, triangle: Ints, weights: FloatArray) -> FloatArray:
        """Unit normals (m, 3) at places of triangles, which may be on either side."""
        corners = self._corners(triangle)
        if self.mesh.places is None:
            normals = normalize(self._mix_normals(corners, weights), -1)
        else:
            normals = _evaluate_normals(self.mesh.places, corners, weights)
        return place_normals(normals, self.matrix)

    def _mix_normals(self, corners: Ints, weights: FloatArray) -> FloatArray:
        """Means (m, 3) of the normals of vertices."""
        normals = self.mesh.normals
        assert normals is not None  # the options of pictures ask for them
        return np.asarray(sum(weights[k][:, np.newaxis] * normals[corners[:, k]] for k in range(3)))

    def find_colors(self, triangle: Ints, weights: FloatArray) -> FloatArray:
        """Linear colours (m, 3) at places of triangles."""
        mesh, corners = self.mesh, self._corners(triangle)
        places = mesh.places
        if places is not None:
            for number, channel in enumerate(places.model.batches[0].channels):
                if channel.kind == "colors":
                    samples = PatchPlaces(*places.locate(corners, weights), vertex=corners[:, 0])
                    values = evaluate_channel(places.model, samples, number, np.float64)
                    return to_linear(values[:, :3])
        if mesh.colors is None:
            return self.colors[triangle]
        linear = to_linear(np.asarray(mesh.colors[:, :3], np.float64))
        return np.asarray(sum(weights[k][:, np.newaxis] * linear[corners[:, k]] for k in range(3)))

    def find_curvatures(self, triangle: Ints, weights: FloatArray, *, mean: bool) -> FloatArray:
        """Gaussian or mean curvature (m,) at places of triangles; NaN where there is none."""
        places = self.mesh.places
        if places is None:
            return np.full(len(triangle), np.nan)
        corners = self._corners(triangle)
        samples = PatchPlaces(*places.locate(corners, weights), vertex=corners[:, 0])
        values = evaluate_curvatures(places.model, samples, np.float64)[int(mean)].values.ravel()
        if not mean:
            return np.asarray(values)
        # Its sign is that for the normals of the vertices, which may be reversed.
        side = dot(
            _evaluate_normals(places, corners, weights), self._mix_normals(corners, weights), -1
        )
        return np.where(side < 0, -values, values)


def _evaluate_normals(places: SurfacePlaces, corners: Ints, weights: FloatArray) -> FloatArray:
    """Unit normals (m, 3) of du × dv, before placing."""
    normals, _ = evaluate_scattered_normals(places.model.batches, *places.locate(corners, weights))
    return normals


def list_parts(mesh: Mesh | Scene) -> Iterator[PicturePart]:
    """The parts of a picture of a mesh, or of all copies of a scene."""
    if isinstance(mesh, Mesh):
        yield _build_part(mesh, None, None)
        return
    for node in mesh.nodes:
        yield _build_part(mesh.meshes[node.model], node.matrix, node.color)


def list_points(parts: Iterable[PicturePart]) -> FloatArray:
    """The points (n, 3) of all faces and lines of a picture."""
    points = [
        each for part in parts for each in (part.positions, *(p for _, p in part.place_lines()))
    ]
    return np.concatenate([np.zeros((0, 3)), *points])


def _build_part(mesh: Mesh, matrix: FloatArray | None, color: Color | None) -> PicturePart:
    colors = np.empty((len(mesh.triangles), 3))
    colors[:] = to_linear(np.array((color or GLAZE)[:3]))
    for part in mesh.parts:
        if part.color is not None:
            colors[slice(*part.triangles)] = to_linear(np.array(part.color[:3]))
    return PicturePart(mesh, matrix, place_points(mesh.positions, matrix, mesh.origin), colors)
