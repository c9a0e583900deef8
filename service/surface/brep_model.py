"""The lowered form of a brep: faces, loops, coedges, edges, vertices and shells as columns."""

from dataclasses import dataclass
from functools import cached_property
from math import dist

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.errors import Issue
from service.surface.checks import Up
from service.surface.placement import Box, find_box
from service.surface.spline_tables import CurveTable, SurfaceTable, find_starts


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
class BrepModel:
    """A solid or open shells: V vertices, E edges, F faces with L loops of C coedges.

    Loops are in the order of their faces, and coedges in the order of their loops. A pcurve runs
    along the direction of its edge, at the parameters of the edge's curve up to an affine map. The
    material of a face is on the left of its loops, seen against du × dv, also if the face is
    reversed. A face without loops is its whole surface, unless it is in `skipped`.

    Attributes
    ----------
    name : str
    up : "y" or "z"
    vertices : ndarray of float64, shape (V, 3)
        Model units.
    vertex_uncertainties : ndarray of float64, shape (V,)
        Model units.
    edge_vertices : ndarray of int, shape (E, 2)
        The vertices at the start and at the end of each edge.
    edge_curves : ndarray of int, shape (E,)
        Numbers of the edges' curves in `curves`; −1 for degenerate edges.
    edge_uncertainties : ndarray of float64, shape (E,)
        Model units.
    is_degenerate : ndarray of bool, shape (E,)
        Whether an edge is a point: the side of a surface that is collapsed, a pole.
    curves : CurveTable
        Curves of edges, D = 3. Lines have become curves of degree 1 with the parameters [0, 1].
    surfaces : SurfaceTable
        The surface of each face, F in all.
    face_names : tuple of str
        F names; "" for a face without a name.
    palette : ndarray of float64, shape (K, 4)
        The distinct colours of faces in the order of their first faces: red, green, blue, opacity,
        sRGB, 0 … 1.
    face_colors : ndarray of int, shape (F,)
        The number of each face's colour in `palette`; −1 for a face without a colour.
    is_reversed : ndarray of bool, shape (F,)
        Whether the normal of a face is −(du × dv).
    loop_faces : ndarray of int, shape (L,)
        The face of each loop; never decreasing.
    loop_counts : ndarray of int, shape (L,)
        Number of coedges of each loop, at least 1.
    coedge_edges : ndarray of int, shape (C,)
        The edge of each coedge; −1 in a loop that is given by its pcurves alone.
    coedge_reversed : ndarray of bool, shape (C,)
        Whether a loop runs along its edge (or along its pcurve) from the end to the start.
    coedge_pcurves : ndarray of int, shape (C,)
        Numbers of the coedges' pcurves in `pcurves`; −1 for a pcurve that is to be made.
    pcurves : CurveTable
        Parameter curves, D = 2.
    shell_counts : ndarray of int, shape (H,)
        Number of faces of each shell; 0 if all faces of a shell are skipped.
    shell_faces : ndarray of int, shape (Σ shell_counts,)
        The faces of the shells, shell after shell. Each face that is not skipped is there once.
    is_closed : ndarray of bool, shape (H,)
        Whether the request says that a shell is closed, and no face of it is skipped.
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
    vertices: FloatArray
    vertex_uncertainties: FloatArray
    edge_vertices: Ints
    edge_curves: Ints
    edge_uncertainties: FloatArray
    is_degenerate: Bools
    curves: CurveTable
    surfaces: SurfaceTable
    face_names: tuple[str, ...]
    palette: FloatArray
    face_colors: Ints
    is_reversed: Bools
    loop_faces: Ints
    loop_counts: Ints
    coedge_edges: Ints
    coedge_reversed: Bools
    coedge_pcurves: Ints
    pcurves: CurveTable
    shell_counts: Ints
    shell_faces: Ints
    is_closed: Bools
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
