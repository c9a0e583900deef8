"""The lowered form of a brep: faces, loops, coedges, edges, vertices and shells as columns."""

from dataclasses import dataclass
from functools import cached_property
from math import dist

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.errors import Issue
from service.surface.brep_columns import BrepColumns
from service.surface.checks import Up
from service.surface.placement import Box, find_box
from service.surface.spline_tables import find_starts


@dataclass(frozen=True, slots=True)
class SkippedFace:
    """A face that is left out.

    It is invalid, and the request said `"invalid_faces": "skip"`; or its edges are off its surface;
    or its loops cross as polygons of one mesh. `issue` says why; its pointer is relative to the
    brep. The surface of an invalid face stays in the table of surfaces, so that the numbers of
    other faces do not change, but the face has no loops, and no shell lists it.
    """

    face: int
    issue: Issue


@dataclass(frozen=True, eq=False)
class BrepModel(BrepColumns):
    """A solid or open shells: the columns of a brep, checked, without the faces that are skipped.

    A face without loops is its whole surface, unless it is in `skipped`.

    Attributes
    ----------
    name : str
    up : "y" or "z"
    vertex_uncertainties : ndarray of float64, shape (V,)
        Model units.
    edge_uncertainties : ndarray of float64, shape (E,)
        Model units.
    uncertainty : float
        A given pcurve is used if it is at most this far from its edge. Model units.
    skips_invalid : bool
        Whether invalid faces are left out and listed; otherwise they refuse the brep.
    skipped : tuple of SkippedFace
        The faces that were left out on creation, by number.
    stretch : ndarray of float64, shape (4, 4), or None
        For copies in a group: their placement without its translation and rotation. Curvatures are
        those of the surfaces after this matrix.
    prepared_box : Box or None
        A smaller box than that of whole nets, if the brep has been prepared for meshing.
    """

    name: str
    up: Up
    vertex_uncertainties: FloatArray
    edge_uncertainties: FloatArray
    uncertainty: float
    skips_invalid: bool = False
    skipped: tuple[SkippedFace, ...] = ()
    stretch: FloatArray | None = None
    prepared_box: Box | None = None

    @property
    def patch_count(self) -> int:
        """The number of Bézier patches that a mesh by resolution would divide, 0."""
        return 0

    @property
    def face_count(self) -> int:
        """Number of faces F, with those that are skipped."""
        return len(self.surfaces)

    @cached_property
    def loop_starts(self) -> Ints:
        """The first coedge of each loop, and the number of coedges; (L+1,)."""
        return find_starts(self.loop_counts)

    @cached_property
    def coedge_loops(self) -> Ints:
        """The loop of each coedge, (C,)."""
        return np.repeat(np.arange(len(self.loop_counts)), self.loop_counts)

    @cached_property
    def coedge_faces(self) -> Ints:
        """The face of each coedge, (C,)."""
        return self.loop_faces[self.coedge_loops]

    @cached_property
    def face_shells(self) -> Ints:
        """The shell of each face, (F,); −1 for skipped faces."""
        shells = np.full(self.face_count, -1)
        shells[self.shell_faces] = np.repeat(np.arange(len(self.shell_counts)), self.shell_counts)
        return shells

    @cached_property
    def bounds(self) -> Box:
        """Least and greatest coordinates of all vertices, control points of edges and whole nets.

        The brep is inside. The box of a prepared brep is smaller, because there the nets are
        restricted to the boxes of the pcurves.
        """
        if self.prepared_box is not None:
            return self.prepared_box
        return find_box(np.concatenate([self.vertices, self.curves.points, self.surfaces.points]))

    @property
    def diagonal(self) -> float:
        """Diagonal of the box `bounds`."""
        return dist(*(bound.tolist() for bound in self.bounds))
