"""Regions of faces: closed loops in the parameters, whatever the surface is like.

Coedges are joined across periods and poles, faces without loops get their natural borders, and
loops that run around a closed direction are cut.
"""

import numpy as np

from service.bases.arrays import Ints
from service.engine.brep.preparation.chains import drop_points, join_chains
from service.engine.brep.preparation.face_cuts import cut_faces
from service.engine.brep.preparation.natural_loops import add_natural_loops
from service.engine.brep.preparation.periods import place_loops
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import ClosedSurfaces


def make_regions(
    surfaces: ClosedSurfaces, topology: Topology, bare: Ints, tolerance: float
) -> tuple[Topology, list[int]]:
    """A topology in which every face is the inside of closed loops of parameter curves.

    Parameters
    ----------
    bare : ndarray of int, shape (k,)
        Faces without loops.
    tolerance : float
        Uncertainty of the edges that are added. Model units.

    Returns
    -------
    topology : Topology
    unbounded : list of int
        Loops of the model whose material reaches a border of the surface that no loop has.
    """
    unbounded: list[int] = []
    is_bare = np.zeros(len(surfaces.surfaces), bool)
    is_bare[bare] = is_bare[topology.loop_faces] = True
    topology = drop_points(topology)
    # A face whose only loop is a pole is its whole surface.
    is_bare[topology.loop_faces] = False
    bare = is_bare.nonzero()[0]
    if len(topology.loop_counts):
        topology, turns = join_chains(surfaces, topology, tolerance)
        topology, cut, unbounded = cut_faces(surfaces, topology, turns, tolerance)
        is_given = topology.is_given | (topology.edge_curves[topology.coedge_edges] < 0)
        is_free = ~np.logical_and.reduceat(is_given, topology.loop_starts)
        # Of several loops, one may be a period away from where the others are.
        is_free |= np.bincount(topology.loop_faces)[topology.loop_faces] > 1
        is_free &= surfaces.is_closed[topology.loop_faces].any(axis=1)
        is_cut = np.zeros(len(is_bare), bool)
        is_cut[cut] = True
        is_free |= is_cut[topology.loop_faces]
        free = is_free.nonzero()[0]
        if len(free):
            faces = np.unique(topology.loop_faces[free])
            loops = np.isin(topology.loop_faces, faces).nonzero()[0]
            topology = place_loops(surfaces, topology, loops)
    if len(bare):
        topology = add_natural_loops(surfaces, topology, bare, surfaces.low[bare], tolerance)
    return topology, unbounded
