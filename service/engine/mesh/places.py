"""Places of the vertices of a mesh on its surface, from which values between them follow."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.surface.lowered import PatchModel


class PlacedFaces(Protocol):
    """Rectangles of patches: span (k, l) of face f is patch `first[f] + k stride[f] + l`."""

    @property
    def first(self) -> Ints:
        """Shape (F,)."""

    @property
    def stride(self) -> Ints:
        """Shape (F,)."""

    def find_spans(self, face: Ints, axis: int, low: Ints, high: Ints) -> tuple[Ints, Ints]:
        """The first and the last span that intervals of places touch."""

    def knots_at(self, face: Ints, axis: int, span: Ints) -> tuple[Ints, Ints]:
        """The places at which spans begin and end."""


@dataclass(frozen=True, eq=False, slots=True)
class SurfacePlaces:
    """The places of V vertices. All corners of a triangle are on the same face.

    Attributes
    ----------
    model : PatchModel
        The patches of the faces, in the coordinates of the mesh.
    faces : PlacedFaces
    face : ndarray of int, shape (V,)
    at : ndarray of float64, shape (V, 2)
        In the units of places of `faces`.
    """

    model: PatchModel
    faces: PlacedFaces
    face: Ints
    at: FloatArray

    def take(self, rows: Ints) -> "SurfacePlaces":
        """The places of some of the vertices."""
        return replace(self, face=self.face[rows], at=self.at[rows])

    def locate(self, corners: Ints, weights: FloatArray) -> tuple[Ints, FloatArray, FloatArray]:
        """Patches, u and v, (m,) each, of points of triangles.

        Parameters
        ----------
        corners : ndarray of int, shape (m, 3)
            The vertices of the triangle of each point.
        weights : ndarray of float64, shape (3, m)
            Its barycentric coordinates.

        The parameters are those of the patch, in [0, 1]; of a triangular patch those of the square
        of which one side is a point.
        """
        face = self.face[corners[:, 0]]
        patch, parameters = self.faces.first[face], []
        for axis, at in enumerate(self.at.T):
            place = (at[corners.T] * weights).sum(axis=0)
            whole = np.floor(place).astype(np.intp)
            span, _ = self.faces.find_spans(face, axis, whole, whole)
            begin, end = self.faces.knots_at(face, axis, span)
            parameters.append(np.clip((place - begin) / np.maximum(end - begin, 1), 0.0, 1.0))
            patch = patch + (span * self.faces.stride[face] if axis == 0 else span)
        return patch, parameters[0], parameters[1]
