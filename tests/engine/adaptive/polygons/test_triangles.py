"""Outlines of leaves as triangles, their hosts and their neighbours."""

import numpy as np

from service.engine.adaptive.cutting.cells import build_whole_cells
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.draft import Draft
from service.engine.adaptive.limits import MeshLimits
from service.engine.adaptive.polygons.cell_boundaries import CellBoundaries, trace_boundaries
from service.engine.bounds.goal import Goal
from service.engine.bounds.patch_nets import PatchNets
from tests.engine.adaptive.bordering import bordered
from tests.strategies import Array, model_of, moved


def triangles_of(nets: list[Array], tolerance: float) -> tuple[CellBoundaries, Draft]:
    """The first triangles of a model, before any is certified."""
    model = model_of(nets)
    found = bordered(model, Goal(tolerance))
    task = Task(PatchNets.of(model), found.faces, Goal(tolerance), MeshLimits())
    draft = Draft(task, found.border, lambda positions: positions)
    leaves = divide_cells(task, build_whole_cells(found.faces))
    draft.renew(leaves)
    # The first samples are those of the outline, in its order.
    return trace_boundaries(draft.rim, leaves.cells, draft.halvings), draft


def arched(height: float) -> Array:
    """A square that bends along both directions."""
    u, v = np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], indexing="ij")
    return np.stack([u, v, height * (u * (1 - u) + v * (1 - v))], axis=-1)


def test_neighbours_are_of_the_same_face() -> None:
    """Two squares with a side in common: each is as if the other were not there."""
    patches = [arched(0.5), moved(arched(0.5), 1.0)]
    outline, found = triangles_of(patches, 0.02)
    face = outline.face[found.corners[:, 0]]
    inner = found.beside >= 0
    assert (face[found.beside] == face[:, None])[inner].all()
    for number, patch in enumerate(patches):
        _, alone = triangles_of([patch], 0.02)
        assert np.count_nonzero(inner[face == number]) == np.count_nonzero(alone.beside >= 0)
    for triangle, edge in np.argwhere(inner):
        other = found.beside[triangle, edge]
        ends = outline.vertex[found.corners[triangle, [edge, (edge + 1) % 3]]]
        rest = set(outline.vertex[found.corners[other]].tolist()) - set(ends.tolist())
        assert rest == {found.across[triangle, edge]}


def test_what_falls_to_a_pole_has_a_host() -> None:
    """One side is a point: a triangle less for every leaf at it, and nobody without a host."""
    net = arched(0.5)
    net[0] = net[0, 0]
    outline, found = triangles_of([net], 0.01)
    lost = np.flatnonzero(~found.kept)
    assert len(lost) > 1
    assert (found.host >= 0).all()
    assert found.kept[found.host[lost]].all()
    assert (found.leaf[found.host[lost]] == found.leaf[lost]).all()
    assert (outline.u[found.corners[lost]] == 0).sum(axis=1).tolist() == [2] * len(lost)
    assert not len(found.bare)
    assert not len(found.crossed)


def test_borders_without_vertices_have_strips() -> None:
    """A side that is straight, and leaves that end on it: their corners are lifted."""
    u, v = np.meshgrid(np.arange(4) / 3, np.arange(4) / 3, indexing="ij")
    net = np.stack([u, v, v * (1 - v) * np.array([0.0, 3.0, -3.0, 3.0])[:, None]], axis=-1)
    net[0, :, 2] = 0.0
    outline, found = triangles_of([net], 0.01)
    strips = found.leaf < 0
    assert strips.any()
    assert (outline.u[outline.lifted] > 0).all()
    bases = np.unique(found.base[strips])
    assert np.array_equal(found.base[bases], bases)
    assert np.count_nonzero(strips) == len(outline.lifted)
    ends = outline.vertex[outline.ends].T
    for segment in np.unique(outline.segment):
        a, b = ends[outline.segment == segment][0]
        mine = outline.vertex[found.corners[strips & (found.segment == segment)]]
        assert ((mine == a) | (mine == b)).any(axis=1).all()
        assert ((mine == a).any(axis=1) & (mine == b).any(axis=1)).sum() == 1
