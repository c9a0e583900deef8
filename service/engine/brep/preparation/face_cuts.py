"""Faces that are cut, because their loops run around closed directions or do not surround them."""

import numpy as np

from service.bases.arrays import Ints
from service.cancellation import checkpoint
from service.engine.brep.preparation.arcs import ArcLoop, CutLoops
from service.engine.brep.preparation.cut_lines import sample_arcs
from service.engine.brep.preparation.cut_topology import finish_cuts
from service.engine.brep.preparation.loop_polygons import sample_loops
from service.engine.brep.preparation.private_seams import Cutter, NotClosed, SourcedLoop
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import ClosedSurfaces


def cut_faces(
    surfaces: ClosedSurfaces, topology: Topology, turns: Ints, tolerance: float
) -> tuple[Topology, list[int], list[int]]:
    """Cut the faces whose loops run around a closed axis, or leave out natural borders.

    Parameters
    ----------
    turns : ndarray of int, shape (L, 2)
        How often each loop runs around along both axes.
    tolerance : float
        Uncertainty of the new edges. Model units.

    Returns
    -------
    topology : Topology
    cut : list of int
        The faces that were cut.
    unbounded : list of int
        Loops of the model whose material reaches a border of the surface that no loop has.
    """
    on_closed = np.flatnonzero(surfaces.is_closed[topology.loop_faces].any(axis=1))
    areas = np.zeros(len(turns))
    areas[on_closed] = sample_loops(topology, on_closed).find_areas()
    is_whole = (turns == 0).all(axis=1)
    # Faces with a loop that runs around, or with no loop about them.
    is_chosen = np.zeros(len(surfaces.surfaces), bool)
    is_chosen[topology.loop_faces[on_closed]] = True
    is_chosen[topology.loop_faces[is_whole & (areas > 0)]] = False
    is_chosen[topology.loop_faces[on_closed[~is_whole[on_closed]]]] = True
    work, unbounded = CutLoops(surfaces, topology), []
    for face in is_chosen.nonzero()[0].tolist():
        checkpoint()
        first, last = np.searchsorted(topology.loop_faces, [face, face + 1]).tolist()
        numbers = range(first, last)
        loops = [
            SourcedLoop(int(topology.loop_sources[k]), work.list_arcs(k), turns[k].astype(float))
            for k in numbers
        ]
        try:
            work.loops[face] = [(loop.source, loop.arcs) for loop in _cut_face(work, face, loops)]
        except NotClosed:
            unbounded.append(int(topology.loop_sources[numbers[0]]))
    return (finish_cuts(work, tolerance) if work.loops else topology), list(work.loops), unbounded


def _cut_face(work: CutLoops, face: int, loops: list[SourcedLoop]) -> list[SourcedLoop]:
    """The loops of one face after all cuts that it needs."""
    surfaces = work.surfaces
    axes = surfaces.is_closed[face].nonzero()[0].tolist()
    for is_second in (False, True):
        turned = [axis for axis in axes if any(loop.turns[axis] for loop in loops)]
        if turned:
            axis = turned[0]
        elif not any(_find_area(work, loop.arcs) > 0 for loop in loops):
            axis = axes[0]
        else:
            return loops
        cutter = Cutter(surfaces, work, (face, axis), is_cut=is_second)
        loops = cutter.cut(loops, is_whole=not turned)
        axes = [other for other in axes if other != axis]
        if not axes:
            break
    if any(loop.turns.any() for loop in loops):
        raise NotClosed
    return loops


def _find_area(work: CutLoops, arcs: ArcLoop) -> float:
    """The area that arcs enclose, positive if they run counter-clockwise."""
    x, y = sample_arcs(work, arcs)[0].T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)
