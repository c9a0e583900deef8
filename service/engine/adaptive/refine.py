"""Refines triangulations until every triangle is proved to be near enough.

    cells → boundaries → triangles → certificate, refined bounds → cut where it fails, and again

Each round proves only the triangles that the round before changed (`drafts`). A part whose bound is
a little too large is cut into four at the middles of its edges, because the nets of the quarters
are nearer to the surface; each quarter is certified against the reference triangle of the part. The
rounds end, with a mesh or, if rounding is too large for the tolerance, with `tolerance_too_small`.

Proofs in docs/proofs.md: "The certificate", "Refinement ends" and "Only rounding makes a tolerance
too small".
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, row_runs
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import Leaves, Task, build_whole_cells
from service.engine.adaptive.cutting.heights import maximize_heights
from service.engine.adaptive.cutting.subdivision import AHEAD, divide_cells
from service.engine.adaptive.drafts.draft import Draft, Triangulation
from service.engine.adaptive.drafts.draft_triangles import Store
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.certificate import PartBounds, certify
from service.engine.bounds.clip import Parts
from service.engine.bounds.faces import SPAN, Faces
from service.engine.bounds.goal import Goal
from service.engine.nets.patch_nets import PatchNets

CHUNK = 1 << 15
"""Triangles in one block of proofs, so that temporary arrays stay small."""

PLAIN = 4
"""Number of corners of a leaf that is two triangles."""

LONG = 8.0
"""If a leaf is more than this many times as long in one direction as in the other, its vertices are
no reason to cut it in the shorter direction."""

FLATTER = 2
"""Number of halvings of the height of a strip that fails."""

CLOSE = 1.5
"""The bound of a part is refined if it is at most this factor times the allowed deviation."""

QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
)
"""Corners of the four quarters of a triangle, in halves of barycentric coordinates."""


def triangulate(
    patch_nets: PatchNets,
    faces: Faces,
    border: Border,
    goal: Goal,
    *,
    store: Store,
    most: int,
    effort: Effort | None = None,
) -> Triangulation:
    """The mesh of all faces, in which every triangle meets the goal.

    Parameters
    ----------
    store : callable
        See `Store`.
    most, effort
        Limits, as for `ModelMesher.build_mesh`, which lists the errors.
    """
    task = Task(patch_nets, faces, goal, MeshLimits(most, effort or Effort()))
    draft, proofs = Draft(task, border, store), Proofs()
    # Most faces are cut several times, so the halves of cells are estimated ahead.
    draft.renew(divide_cells(task, build_whole_cells(faces), AHEAD))
    while True:
        task.limits.count(int(draft.triangles.is_written.sum()))
        proofs.renew(draft)
        cut, along_v, strips = _find_failing(draft, proofs.meets_goal)
        if not len(cut) and not len(strips):
            return draft.finish(proofs.deviation, proofs.mesh if goal.two_sided else None)
        draft.halvings[strips] += FLATTER
        is_plain = draft.polygons.size[cut] == PLAIN
        fresh = replace_failing(task, draft.polygons.leaves.take(cut), along_v, is_plain)
        draft.renew(fresh, cut, strips)


def replace_failing(task: Task, failing: Leaves, along_v: Bools, is_plain: Bools) -> Leaves:
    """The leaves that replace failing leaves: fans where these may pass, elsewhere halves.

    A fan changes no leaf beside it. It replaces only a leaf of two triangles, and only if a
    quadratic surface (`Leaves.form`) is within the allowed deviation of the fan: along the sides,
    and along the lines from the middle to the corners, over which heights are 1/4 of those over the
    diagonals.
    """
    a, b, c = failing.form[3:6]
    allowed = failing.form[6]
    # Heights between the surface and the lines from the middle to the corners, on the diagonal from
    # (0, 0) to (1, 1) and on the other one.
    rising, falling = (a + 2.0 * b + c) * 0.25, (a - 2.0 * b + c) * 0.25
    # Columns: triangles of the fan on sides along u, and on sides along v; rows: their edges.
    edges = np.array([[a, c], [rising, rising], [falling, falling]])
    to_fan = is_plain & ~failing.is_fan & (maximize_heights(edges).max(axis=0) <= allowed)
    fans, rest = failing.take(to_fan), failing.take(~to_fan)
    fans = replace(fans, is_fan=np.ones(len(fans), dtype=bool))
    if not len(rest):
        return fans
    return Leaves.join([divide_cells(task, rest.halve(along_v[~to_fan])), fans])


class Proofs:
    """Proved bounds of each triangle of a draft.

    Attributes
    ----------
    deviation, mesh : ndarray of float64, shape (T,)
        Bounds of the distance from the surface to the mesh, and from the mesh to the surface.
    meets_goal : ndarray of bool, shape (T,)
    """

    def __init__(self) -> None:
        self.deviation = self.mesh = np.zeros(0)
        self.meets_goal = np.zeros(0, dtype=bool)

    def renew(self, draft: Draft) -> None:
        """Prove all triangles that changed, or whose reference or base triangle changed."""
        triangles = draft.triangles
        count, changed = len(triangles), triangles.is_changed
        added = count - len(self.meets_goal)
        self.deviation = np.concatenate([self.deviation, np.full(added, np.inf)])
        self.mesh = np.concatenate([self.mesh, np.zeros(added)])
        self.meets_goal = np.concatenate([self.meets_goal, np.zeros(added, dtype=bool)])
        todo = changed | changed[triangles.reference]
        todo |= (triangles.base >= 0) & changed[triangles.base]
        # Triangles without a reference triangle (−1) are left out, whatever `changed[-1]` is.
        todo &= triangles.is_alive & (triangles.reference >= 0)
        rows = todo.nonzero()[0]
        for first, last in row_runs(len(rows), CHUNK):
            self._prove(draft, rows[first:last])

    def _prove(self, draft: Draft, rows: Ints) -> None:
        """Prove some triangles: against their reference triangles or the bases of their strips."""
        triangles, count = draft.triangles, len(rows)
        base = triangles.base[rows]
        # In strips, triangles other than the base are tried against the base, too.
        other = ((base >= 0) & (base != rows)).nonzero()[0]
        measured = np.concatenate([rows, rows[other]])
        references = np.concatenate([triangles.reference[rows], base[other]])
        places, face = _find_places(draft, measured)
        bounds = _certify(draft, face, places, references, references == measured)
        deviation, allowed = bounds.deviation[:count], bounds.allowed
        meets_goal = bounds.meets_goal[:count]
        mesh = np.zeros(count) if bounds.mesh is None else bounds.mesh[:count]
        if len(other):
            # From the mesh to the surface a goal allows twice the deviation.
            better = ~meets_goal[other] & (bounds.deviation[count:] <= allowed[count:])
            better &= mesh[other] <= 2.0 * allowed[count:]
            chosen = other[better]
            deviation[chosen], meets_goal[chosen] = bounds.deviation[count:][better], True
        is_close = (
            ~meets_goal & (mesh <= 2.0 * allowed[:count]) & (deviation <= CLOSE * allowed[:count])
        )
        tried = is_close.nonzero()[0]
        if len(tried):
            refined = refine_bounds(draft, rows[tried])
            is_met = refined < np.inf
            deviation[tried[is_met]], meets_goal[tried[is_met]] = refined[is_met], True
        self.deviation[rows], self.mesh[rows], self.meets_goal[rows] = deviation, mesh, meets_goal


def _find_failing(draft: Draft, meets_goal: Bools) -> tuple[Ints, Bools, Ints]:
    """The leaves to be cut, whether to halve v, and segments of the border whose strips fail."""
    leaves, triangles, samples = draft.polygons.leaves, draft.triangles, draft.samples
    fails, along_v = np.zeros(len(leaves), dtype=bool), leaves.along_v.copy()
    box = leaves.rectangle
    has_reference = triangles.reference >= 0
    # Triangles of strips have leaf −1.
    orphans = triangles.leaf[triangles.is_alive & ~has_reference & (triangles.leaf >= 0)]
    # Leaves with a flat triangle that has no reference triangle, or with a piece of the border that
    # is not an edge of any triangle.
    degenerate = np.concatenate([orphans, triangles.bare])
    if len(degenerate):
        fails[degenerate] = True
        along_v[degenerate] = (
            box[3, degenerate] - box[2, degenerate] > box[1, degenerate] - box[0, degenerate]
        )
    # Triangles with an edge that more than two triangles have; their leaves are cut in the
    # direction in which such an edge is longest.
    crossed, edge = triangles.crossed.T
    if len(crossed):
        begin, end = triangles.corners[crossed, edge], triangles.corners[crossed, (edge + 1) % 3]
        leaf = triangles.leaf[crossed]
        begin, end, leaf = begin[leaf >= 0], end[leaf >= 0], leaf[leaf >= 0]
        extent = np.zeros((2, len(leaves)), dtype=np.intp)
        np.maximum.at(extent[0], leaf, np.abs(samples.u[end] - samples.u[begin]))
        np.maximum.at(extent[1], leaf, np.abs(samples.v[end] - samples.v[begin]))
        fails[leaf], along_v[leaf] = True, (extent[1] > extent[0])[leaf]
    # The cuts of the leaves above have their directions; those of all others may be chosen.
    is_free = ~fails
    failing = triangles.is_alive & ~meets_goal & has_reference
    leaf = triangles.leaf[failing]
    fails[leaf[leaf >= 0]] = True
    cut = (fails & draft.polygons.is_present).nonzero()[0]
    along_v = along_v[cut]
    if len(cut):
        along_v = np.where(is_free[cut], _prefer_vertices(draft, cut, along_v), along_v)
    return cut, along_v, np.unique(triangles.segment[failing & (triangles.leaf < 0)])


def _prefer_vertices(draft: Draft, cut: Ints, along_v: Bools) -> Bools:
    """Whether to halve v, not u: the direction in which more ends of the cut are vertices already.

    A cut between vertices adds fewer vertices to the leaves beside it. Without this choice the
    leaves of a ring of equal leaves fail one after another, each because the leaf beside it was
    cut. `along_v` decides if both numbers are equal, or if the leaf is more than `LONG` times as
    long in the direction with fewer of them.
    """
    polygons, samples = draft.polygons, draft.samples
    leaf, row = expand_runs(polygons.size[cut], polygons.first[cut])
    leaves, corner = polygons.leaves.take(cut), polygons.polygon[row]
    u0, u1, v0, v1 = leaves.rectangle[:, leaf]
    u, v = samples.u[corner], samples.v[corner]
    # Corners at an end of the cut that halves u, and of the cut that halves v.
    ends_u_cut = (2 * u == u0 + u1) & ((v == v0) | (v == v1))
    ends_v_cut = (2 * v == v0 + v1) & ((u == u0) | (u == u1))
    v_surplus = np.bincount(leaf, ends_v_cut, len(cut)) - np.bincount(leaf, ends_u_cut, len(cut))
    long_u, long_v = np.sqrt(leaves.form[0]), np.sqrt(leaves.form[2])
    prefers_v = (v_surplus > 0) & (LONG * long_v >= long_u)
    prefers_u = (v_surplus < 0) & (LONG * long_u >= long_v)
    chosen: Bools = prefers_v | (along_v & ~prefers_u)
    return chosen


def refine_bounds(draft: Draft, rows: Ints) -> FloatArray:
    """Bounds (m,) of the parts over these triangles by their quarters; inf if a quarter fails."""
    places, face = _find_places(draft, rows)
    # Only parts in one patch whose quarters have corners at places (integers), so that the quarters
    # cover the part.
    inner = places.max(axis=0) <= (places.min(axis=0) // SPAN + 1) * SPAN
    # Twice the corners of the quarters.
    corners = (QUARTERS.reshape(12, 3) @ places.reshape(3, -1)).reshape(4, 3, 2, -1)
    cut = (inner.all(axis=0) & (corners % 2 == 0).all(axis=(0, 1, 2))).nonzero()[0]
    quarters = (corners[..., cut] // 2).transpose(1, 2, 3, 0).reshape(3, 2, -1)
    reference = draft.triangles.reference[rows[cut]].repeat(4)
    # The reference triangle lies over the whole part, not over one quarter.
    is_own = np.zeros(len(reference), dtype=bool)
    bounds = _certify(draft, face[cut].repeat(4), quarters, reference, is_own)
    deviation = np.where(bounds.deviation <= bounds.allowed, bounds.deviation, np.inf)
    refined = np.full(len(rows), np.inf)
    refined[cut] = deviation.reshape(-1, 4).max(axis=1)
    return refined


def _find_places(draft: Draft, rows: Ints) -> tuple[Ints, Ints]:
    """The places (3, 2, m) of the corners of triangles, and their faces (m,)."""
    corners, samples = draft.triangles.corners[rows].T, draft.samples
    return np.stack([samples.u[corners], samples.v[corners]], axis=1), samples.face[corners[0]]


def _certify(draft: Draft, face: Ints, places: Ints, reference: Ints, is_own: Bools) -> PartBounds:
    """Bounds of parts (3, 2, m) of faces, given the numbers (m,) of their reference triangles."""
    task, triangles = draft.task, draft.triangles
    task.limits.spend(task.estimate_work(face, places))
    vertices, across = triangles.vertices[reference].T, triangles.across[reference].T
    parts = Parts(face, places, vertices, across, is_own)
    return certify(task.patch_nets, task.faces, parts, draft.samples.positions, task.goal)
