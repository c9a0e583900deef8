"""The draft of a mesh: its leaves, their polygons, samples and triangles, renewed round by round.

If leaves are cut, only their surroundings change. So every leaf, sample and triangle keeps its
number: leaves that are cut and triangles that are replaced are marked, and new ones are appended.
Only the boundaries of new leaves and of the leaves around them are traced. Polygons that do not
change keep their triangles.

A leaf that touches many small leaves, or a finely divided border, has many corners. Its triangles
would be narrow, and the surface over them would lie beside them. So a *crowded* leaf, whose polygon
has too many corners, is cut before it is triangulated.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import NO_NUMBERS, FaceCells, Leaves, Task
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.drafts.cell_boundaries import CellBoundaries, trace_boundaries
from service.engine.adaptive.drafts.draft_triangles import DraftSamples, DraftTriangles, Store
from service.engine.adaptive.drafts.leaf_polygons import LeafPolygons
from service.engine.adaptive.drafts.triangles import TriangleRows, build_triangles
from service.engine.vectors import dot, length

OVERHEAD = 4000
"""Approximate cost of the triangles of one leaf, in multiplications."""

MOST_CORNERS = 64
"""A leaf with more corners than this is crowded. The time to triangulate a polygon grows with the
cube of its number of corners."""

MANY, BENT = 7, 4
"""A leaf with at least `MANY` corners is crowded if the middle of one of its sides is further from
the chord of that side than `BENT` times the allowed deviation, as at the rim of a disc."""


@dataclass(frozen=True, eq=False, slots=True)
class Triangulation:
    """A certified mesh of all faces, before it has normals.

    A sample is a vertex of one face: faces that meet have separate samples at shared vertices,
    because normals and channels may differ there.

    Attributes
    ----------
    face, u, v : ndarray of int, shape (N,)
        Face and place of every sample (see `Faces`), face after face.
    vertex : ndarray of int, shape (N,)
        The vertex of every sample.
    positions : ndarray of float64, shape (V, 3)
        Vertices in model coordinates, not yet rounded; those on the sides of faces
        come first.
    triangles : ndarray of int, shape (T, 3)
        Samples, counter-clockwise in (u, v); face after face. Their three vertices differ.
    bounds : ndarray of float64, shape (T,)
        No point of the part of the surface over the triangle is further than this from the stored
        mesh.
    mesh_bounds : ndarray of float64, shape (T,), or None
        No point of the stored triangle is further than this from the surface.
    """

    face: Ints
    u: Ints
    v: Ints
    vertex: Ints
    positions: FloatArray
    triangles: Ints
    bounds: FloatArray
    mesh_bounds: FloatArray | None


class Draft:
    """A mesh during refinement.

    Attributes
    ----------
    task : Task
    border : Border
    halvings : ndarray of int, shape (M,)
        Number of halvings of the height of the strip after each entry of the border.
    samples : DraftSamples
    polygons : LeafPolygons
    triangles : DraftTriangles
    """

    def __init__(self, task: Task, border: Border, store: Store) -> None:
        self.task, self.border = task, border
        self.halvings = np.zeros(len(border.at), dtype=np.intp)
        self.samples = DraftSamples(task, border, store)
        self.polygons = LeafPolygons(len(border.at))
        self.triangles = DraftTriangles()

    def renew(self, fresh: Leaves, cut: Ints = NO_NUMBERS, flat: Ints = NO_NUMBERS) -> None:
        """Replace the leaves `cut` by `fresh` leaves, and triangulate the strips over `flat` again.

        Parameters
        ----------
        fresh : Leaves
            The new leaves; all leaves in the first round.
        cut : ndarray of int
            Numbers of the leaves that are replaced.
        flat : ndarray of int
            Segments of the border whose strips became flatter.
        """
        old_leaves = self.polygons.leaves
        while True:
            near, far = self.polygons.find_affected(cut, flat, len(self.samples))
            old = np.concatenate([near, far])
            parts = [fresh, old_leaves.take(old)] if len(old) else [fresh]
            leaves = Leaves.join(parts)
            self.task.limits.spend(OVERHEAD * len(leaves))
            boundaries = trace_boundaries(self.border, leaves, self.halvings)
            size = boundaries.start[1:] - boundaries.start[:-1] - leaves.is_fan
            crowded = find_crowded(self.task, leaves, size[: len(fresh) + len(near)])
            if not len(crowded):
                break
            along_v = find_crowded_directions(boundaries, leaves, crowded)
            halves = divide_cells(self.task, leaves.take(crowded).halve(along_v))
            of_fresh = crowded[crowded < len(fresh)]
            of_near = crowded[crowded >= len(fresh)] - len(fresh)
            others = fresh.take(np.delete(np.arange(len(fresh)), of_fresh))
            fresh = Leaves.join([others, halves])
            cut = np.concatenate([cut, near[of_near]])
        # Finding neighbours takes much memory, so all temporary arrays are freed before. `pop`
        # leaves no name for the rows, so that `add` can free them too.
        replacement = [self._replace(boundaries, leaves, fresh, near, (cut, far))]
        del boundaries, leaves, parts, fresh
        self.triangles.add(*replacement.pop(), self.samples)

    def _replace(
        self,
        boundaries: CellBoundaries,
        leaves: Leaves,
        fresh: Leaves,
        near: Ints,
        others: tuple[Ints, Ints],
    ) -> tuple[TriangleRows, Bools]:
        """Store the fresh leaves, and the polygons that changed.

        Parameters
        ----------
        boundaries : CellBoundaries
            The boundaries of `leaves`: the fresh leaves, the leaves near them, and the leaves
            around the near leaves.
        others : (cut, far)
            The leaves that were cut, and the leaves around the near leaves.

        Returns
        -------
        TriangleRows and ndarray of bool, shape (T,)
            New triangles, and which of the old ones are removed.
        """
        cut, far = others
        begin, count = len(self.polygons.is_present), len(fresh)
        number = np.concatenate([begin + np.arange(count), near, far])
        is_old = np.zeros(begin, dtype=bool)
        is_old[np.concatenate([cut, near, far])] = True
        sample = self.samples.number(
            boundaries, self.polygons.mark_samples(is_old, len(self.samples))
        )
        polygon = sample[boundaries.corner]
        changed = np.zeros(len(number), dtype=bool)
        changed[:count] = True
        changed[count : count + len(near)] = self.polygons.find_changed(
            boundaries, polygon, count, near
        )
        rows = changed.nonzero()[0]
        self.polygons.replace(boundaries, fresh, cut, (rows, number[rows]), polygon)
        segments = np.zeros(len(self.border.at), dtype=bool)
        segments[boundaries.touching[0, changed[boundaries.touching[1]]]] = True
        points = self.samples.points[self.samples.vertex[sample]]
        triangles = build_triangles(boundaries, leaves, points, changed, segments)
        replaced = np.zeros(begin + count, dtype=bool)
        replaced[cut] = replaced[number[rows]] = True
        is_removed = self.triangles.find_replaced(replaced, segments)
        leaf = np.where(triangles.leaf < 0, -1, number[triangles.leaf])
        corners = sample[triangles.corners]
        return TriangleRows(corners, leaf, triangles.segment, triangles.base), is_removed

    def finish(self, deviation: FloatArray, mesh: FloatArray | None) -> Triangulation:
        """The mesh, given the bounds (T,) of the parts of the surface over all triangles.

        `deviation` bounds the distances from the parts to the mesh, `mesh` those from the mesh to
        the surface. The bound of a triangle is the largest bound of the parts that it is the
        reference triangle of. The draft cannot be renewed after this.
        """
        triangles, samples = self.triangles, self.samples
        triangles.drop_neighbours()
        is_written = triangles.is_written
        rows = is_written.nonzero()[0]
        flat = (triangles.is_alive & ~is_written).nonzero()[0]
        for values in (deviation, mesh):
            if values is not None and len(flat):
                np.maximum.at(values, triangles.reference[flat], values[flat])
        corners = triangles.corners[rows]
        is_used = np.zeros(len(samples), dtype=bool)
        is_used[self.polygons.polygon] = True
        used, vertex, points = samples.sort(is_used)
        number = np.empty(len(samples), dtype=np.intp)
        number[used] = np.arange(len(used))
        order = np.argsort(samples.face[corners[:, 0]], kind="stable")
        rows = rows[order]
        return Triangulation(
            samples.face[used],
            samples.u[used],
            samples.v[used],
            vertex,
            points,
            number[corners[order]],
            deviation[rows],
            None if mesh is None else mesh[rows],
        )


def find_crowded(task: Task, leaves: Leaves, size: Ints) -> Ints:
    """Rows of the crowded leaves among the first leaves, whose numbers of corners are `size`."""
    many = (size >= MANY).nonzero()[0]
    if not len(many):
        return many
    # Corners, each with the middle of the side after it. Then the distances of these middles from
    # the chords of the sides, and the largest of each leaf.
    u0, u1, v0, v1 = leaves.rectangle[:, many]
    u, v = (u0 + u1) // 2, (v0 + v1) // 2
    us, vs = np.array([u0, u, u1, u1, u1, u, u0, u0]), np.array([v0, v0, v0, v, v1, v1, v1, v])
    face = np.concatenate([leaves.face[many]] * 8)
    points = task.evaluate_points(face, us.ravel(), vs.ravel()).reshape(8, -1, 3)
    difference, along = points[1::2] - points[::2], points[[2, 4, 6, 0]] - points[::2]
    square = np.maximum(dot(along, along, -1), np.finfo(float).tiny)
    difference -= (dot(difference, along, -1) / square)[..., np.newaxis] * along
    distance = length(difference, -1).max(axis=0)
    # The last row of `form` is the allowed deviation.
    crowded: Ints = many[(distance > BENT * leaves.form[-1, many]) | (size[many] > MOST_CORNERS)]
    return crowded


def find_crowded_directions(boundaries: CellBoundaries, cells: FaceCells, crowded: Ints) -> Bools:
    """Whether to halve v, not u, of crowded leaves: whether more of their corners are along v."""
    begin = boundaries.start[crowded]
    row, entry = expand_runs(boundaries.start[crowded + 1] - begin, begin)
    corner = boundaries.corner[entry]
    u0, u1, v0, v1 = cells.rectangle.take(crowded[row], axis=1)
    u, v = boundaries.u[corner], boundaries.v[corner]
    # The sides u = u0 and u = u1 run along v.
    has_end_u, has_end_v = (u == u0) | (u == u1), (v == v0) | (v == v1)
    return np.bincount(row, has_end_u) > np.bincount(row, has_end_v)
