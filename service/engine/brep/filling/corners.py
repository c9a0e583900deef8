"""The corners of triangles: places of faces, and the points of the mesh there."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.brep.borders.border_vertices import BorderVertices
from service.engine.brep.filling.triangles import join_ends
from service.engine.trims.places import Places
from service.engine.vectors import NEXT, length


@dataclass(eq=False, slots=True)
class FaceCorners:
    """K corners, of all faces: those of the borders come first, then those inside. They only grow.

    Attributes
    ----------
    surface : Places
        The surfaces of all faces over their places.
    positions : ndarray of float64, shape (N, 3)
        Points of the mesh: vertices and samples of edges come first, then points inside faces.
    places : ndarray of int, shape (K, 2)
    faces, points : ndarray of int, shape (K,)
        The face of each corner, and its row in `positions`.
    residuals : ndarray of float64, shape (K,)
        How far the surface at each place is from its point; 0 inside faces, up to rounding.
    on_border : int
        Number of corners on borders.
    segments : ndarray of int
        `join_ends` of the segments of borders, ascending.
    scales : ndarray of float64, shape (F,)
        Powers of two by which v is multiplied where shapes of triangles are compared.
    """

    surface: Places
    positions: FloatArray
    places: Ints
    faces: Ints
    points: Ints
    residuals: FloatArray
    on_border: int
    segments: Ints
    scales: FloatArray

    @classmethod
    def of(
        cls, surface: Places, border: BorderVertices, positions: FloatArray, scales: FloatArray
    ) -> "FaceCorners":
        """The corners on borders."""
        segments = np.sort(join_ends(*border.segments.T))
        segments = segments.take(find_begins(segments))
        apart = surface.evaluate(border.faces, border.places) - positions[border.vertices]
        return cls(
            *(surface, positions, border.places, border.faces, border.vertices),
            *(length(apart, -1), len(border.places), segments, scales),
        )

    def add(self, faces: Ints, places: Ints) -> None:
        """Add corners (m,) inside faces at places (m, 2), with points on their surfaces."""
        points = len(self.positions) + np.arange(len(faces))
        self.positions = np.concatenate([self.positions, self.surface.evaluate(faces, places)])
        self.places = np.concatenate([self.places, places])
        self.faces = np.concatenate([self.faces, faces])
        self.points = np.concatenate([self.points, points])
        self.residuals = np.concatenate([self.residuals, np.zeros(len(faces))])

    def find_fixed(self, corners: Ints) -> Bools:
        """Which edges of triangles (3, T) are segments of borders, shape (3, T)."""
        on_border = corners < self.on_border
        triangle_edges = (on_border & on_border[NEXT]).nonzero()
        keys = join_ends(corners[triangle_edges], corners[NEXT][triangle_edges])
        at = np.searchsorted(self.segments, keys)
        at[at == len(self.segments)] = 0
        fixed = np.zeros(corners.shape, bool)
        fixed[triangle_edges] = self.segments[at] == keys
        return fixed
