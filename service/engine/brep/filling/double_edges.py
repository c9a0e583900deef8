"""Edges inside faces that join the same two points as another edge of the mesh.

A directed edge of the mesh must occur once. Two edges of breps with the same vertices have a sample
between these, but an edge inside a face may join two points that an edge of another face joins too,
or another one of the same face. It is then cut.

Proof in docs/proofs.md: "No crack between trimmed faces".
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.brep.filling.triangles import join_ends
from service.engine.vectors import NEXT


def find_double_edges(points: Ints, fixed: Bools) -> Ints:
    """Edges inside faces that are cut so that no directed edge of the mesh occurs twice.

    Parameters
    ----------
    points : ndarray of int, shape (3, T)
        The points of all triangles of all faces.
    fixed : ndarray of bool, shape (3, T)
        Which edges are on borders.

    Returns
    -------
    ndarray of int, shape (m,)
        Edge k of triangle t has the number k T + t. Triangles with two equal points have none.
    """
    begins, ends = points, points[NEXT]
    proper = np.concatenate((np.all(begins != ends, axis=0),) * 3).nonzero()[0]
    directed = (begins << 32 | ends).ravel()[proper]
    ordered = np.sort(directed)
    if not (ordered[1:] == ordered[:-1]).any():
        return np.empty(0, np.intp)
    order = np.argsort(directed)
    directed = directed[order]
    again = np.flatnonzero(directed[1:] == directed[:-1])
    # All edges between these points that are inside faces.
    keys = join_ends(begins, ends).ravel()
    doubled = np.unique(keys[proper[order[again]]])
    at = np.searchsorted(doubled, keys[proper])
    at[at == len(doubled)] = 0
    chosen: Ints = proper[(doubled[at] == keys[proper]) & ~fixed.ravel()[proper]]
    return chosen
