"""Whether points of the surfaces of faces are inside their trims, given the gaps of edges.

An edge is a curve of space, and the border of a region is a curve on the surface; they are apart by
at most a proved gap. A point that is nearer to an edge than this is neither inside nor outside.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.edge_tree import EdgeTree
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.inside import UNDECIDED


def find_inside(
    prepared: PreparedBrep, face: Ints, parameters: FloatArray, points: FloatArray
) -> Ints:
    """Whether points of faces (m,) are inside their trims: `INSIDE`, `OUTSIDE` or `UNDECIDED`.

    Parameters
    ----------
    parameters : ndarray of float64, shape (m, 2)
        Of the surfaces of the faces.
    points : ndarray of float64, shape (m, 3)
        The points of the surfaces there.
    """
    inside = prepared.regions.find_inside(face, parameters).inside
    decided = (inside != UNDECIDED).nonzero()[0]
    is_near = find_near_edges(prepared, face[decided], points[decided])
    inside[decided[is_near]] = UNDECIDED
    return inside


def find_near_edges(prepared: PreparedBrep, face: Ints, points: FloatArray) -> Bools:
    """Whether points (m, 3) of faces (m,) are nearer to an edge of the face than its gap.

    True where the distance is at most the gap, and never where it is more than 5/4 of the gap and
    rounding. Seams and poles do not count.
    """
    return EdgeTree.of_borders(prepared, len(face)).find_near(face, points)
