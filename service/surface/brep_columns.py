"""The columns of a brep, the same in a request and after lowering."""

from dataclasses import dataclass
from typing import TypeAlias

from service.bases.arrays import Bools, FloatArray, Ints
from service.surface.spline_tables import CurveTable, SurfaceTable

FaceColor: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue, opacity; sRGB, 0 … 1."""


@dataclass(frozen=True, eq=False, slots=True)
class BrepColumns:
    """V vertices, E edges, F faces with L loops of C coedges, and H shells.

    Loops are in the order of their faces, and coedges in the order of their loops. A pcurve runs
    along the direction of its edge, at the parameters of the edge's curve up to an affine map. The
    material of a face is on the left of its loops, seen against du × dv, also if the face is
    reversed. In a request, an edge may have unknown vertices, and a loop unknown edges, if invalid
    faces are skipped.

    Attributes
    ----------
    vertices : ndarray of float64, shape (V, 3)
        Model units.
    edge_vertices : ndarray of int, shape (E, 2)
        The vertices at the start and at the end of each edge.
    edge_curves : ndarray of int, shape (E,)
        Numbers of the edges' curves in `curves`; −1 for degenerate edges. In a request they are −1
        for lines, too.
    is_degenerate : ndarray of bool, shape (E,)
        Whether an edge is a point: the side of a surface that is collapsed, a pole.
    curves : CurveTable
        Curves of edges, D = 3. After lowering, lines are curves of degree 1 with the parameters
        [0, 1].
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
    """

    vertices: FloatArray
    edge_vertices: Ints
    edge_curves: Ints
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


def list_colors(palette: FloatArray, numbers: Ints) -> list[FaceColor | None]:
    """The colour of each face, from `palette` and `face_colors`; None for a face without one."""
    colors: list[FaceColor] = [(r, g, b, opacity) for r, g, b, opacity in palette.tolist()]
    return [colors[number] if number >= 0 else None for number in numbers.tolist()]
