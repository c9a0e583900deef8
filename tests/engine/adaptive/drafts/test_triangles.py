"""Polygons of leaves as triangles, their reference triangles and their neighbours."""

import numpy as np

from service.engine.adaptive.cutting.cells import Task, build_whole_cells
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.drafts.cell_boundaries import CellBoundaries, trace_boundaries
from service.engine.adaptive.drafts.draft import Draft
from service.engine.adaptive.drafts.draft_triangles import DraftTriangles
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.nets.patch_nets import PatchNets
from tests.engine.adaptive.bordering import build_border
from tests.strategies import Array, build_model, translate


def build_first_triangles(
    nets: list[Array], tolerance: float
) -> tuple[CellBoundaries, DraftTriangles]:
    """The first triangles of a model, before any is certified."""
    model = build_model(nets)
    result = build_border(model, Goal(tolerance))
    task = Task(PatchNets.of(model), result.faces, Goal(tolerance), MeshLimits())
    draft = Draft(task, result.border, lambda positions: positions)
    leaves = divide_cells(task, build_whole_cells(result.faces))
    draft.renew(leaves)
    # The draft traces these boundaries, too, and has their samples in the same order.
    boundaries = trace_boundaries(draft.border, leaves, draft.halvings)
    return boundaries, draft.triangles


def build_arch(height: float) -> Array:
    """A square that bends along both directions."""
    u, v = np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], indexing="ij")
    return np.stack([u, v, height * (u * (1 - u) + v * (1 - v))], axis=-1)


def test_neighbours_are_of_the_same_face() -> None:
    """Two squares with a common side: triangles of one have no neighbours in the other."""
    patches = [build_arch(0.5), translate(build_arch(0.5), 1.0)]
    boundaries, triangles = build_first_triangles(patches, 0.02)
    face = boundaries.face[triangles.corners[:, 0]]
    # `across` has the third vertex of the neighbour at each edge, or −1.
    inner = triangles.across >= 0
    for number, patch in enumerate(patches):
        _, alone = build_first_triangles([patch], 0.02)
        assert np.count_nonzero(inner[face == number]) == np.count_nonzero(alone.across >= 0)
    vertices = boundaries.vertex[triangles.corners]
    for triangle, edge in np.argwhere(inner):
        ends = set(vertices[triangle, [edge, (edge + 1) % 3]].tolist())
        (third_vertex,) = (
            set(vertices[other].tolist()) - ends
            for other in np.flatnonzero(face == face[triangle])
            if other != triangle and ends < set(vertices[other].tolist())
        )
        assert third_vertex == {triangles.across[triangle, edge]}


def test_triangles_at_a_pole_have_reference_triangles() -> None:
    """One side is a point: each leaf beside it has a flat triangle, and the reference triangle of
    the flat one is in the same leaf."""
    net = build_arch(0.5)
    net[0] = net[0, 0]
    boundaries, result = build_first_triangles([net], 0.01)
    flat = np.flatnonzero(~result.is_written)
    assert len(flat) > 1
    assert (result.reference >= 0).all()
    assert result.is_written[result.reference[flat]].all()
    assert (result.leaf[result.reference[flat]] == result.leaf[flat]).all()
    assert (boundaries.u[result.corners[flat]] == 0).sum(axis=1).tolist() == [2] * len(flat)
    assert not len(result.bare)  # leaves at the border that have only flat triangles there
    assert not len(result.crossed)  # edges of more than two triangles


def test_borders_without_vertices_have_strips() -> None:
    """The side u = 0 is straight, so it has no vertices, but leaves have corners on it.

    These corners are lifted: moved into the face. The strip between them and a segment of the
    border has one triangle for each lifted corner; one of them, the base, has the whole segment.
    """
    u, v = np.meshgrid(np.arange(4) / 3, np.arange(4) / 3, indexing="ij")
    net = np.stack([u, v, v * (1 - v) * np.array([0.0, 3.0, -3.0, 3.0])[:, None]], axis=-1)
    net[0, :, 2] = 0.0
    boundaries, result = build_first_triangles([net], 0.01)
    strips = result.leaf < 0  # triangles of strips belong to no leaf
    assert strips.any()
    assert (boundaries.u[boundaries.lifted] > 0).all()
    # A base is its own base.
    bases = np.unique(result.base[strips])
    assert np.array_equal(result.base[bases], bases)
    assert np.count_nonzero(strips) == len(boundaries.lifted)
    ends = boundaries.vertex[boundaries.ends].T
    for segment in np.unique(boundaries.segment):
        a, b = ends[boundaries.segment == segment][0]
        # Each triangle of the strip has an end of the segment; the base alone has both.
        strip = boundaries.vertex[result.corners[strips & (result.segment == segment)]]
        has_a, has_b = (strip == a).any(axis=1), (strip == b).any(axis=1)
        assert (has_a | has_b).all()
        assert (has_a & has_b).sum() == 1
