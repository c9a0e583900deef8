"""Which breps are closed."""

import numpy as np

from service.engine.brep.prepared import PreparedBrep


def is_closed(prepared: PreparedBrep) -> bool:
    """Whether all shells of a brep are closed, with all faces, and its faces fit at all edges.

    They fit if coedges run along each edge as often in one direction as in the other; those of
    reversed faces count the other way round.
    """
    if prepared.skipped_faces or not prepared.model.is_closed.all():
        return False
    edge, face = prepared.coedge_edges, prepared.coedge_faces
    turns = np.where(prepared.coedge_reversed != prepared.is_reversed[face], -1.0, 1.0)
    turns[prepared.is_degenerate[edge]] = 0.0
    return not np.bincount(edge, turns).any()
