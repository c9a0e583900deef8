"""Triangulations that are near enough, proved triangle by triangle.

    cells → outlines → triangles → certificate, refined bounds → cut what fails, and again

Only what a round changed is looked at again in the next (`draft`).

**Why this ends.** Let ε be the tolerance (the least that is allowed anywhere). Every round in which
anything fails cuts a leaf in two, or halves the height of a strip twice. There are finitely many
boxes of places and finitely many heights, so the rounds end, with a mesh or with
`tolerance_too_small`. That the latter comes only from rounding:

1. A leaf that is cut is not small. If the net of a leaf is within ε of every one of its points,
   then all its triangles pass: each has a vertex of the leaf, which is on the surface over it, so
   all of the triangle's net is within ε of its host; one whose host is beside it shares that one's
   vertex. The cut is in the direction in which the
   surface bends more, with a bonus for the longer one: as a leaf becomes short in one direction it
   stops to bend in it, and the other has its turn. So lengths in both directions go to 0.
2. The strip over a segment of the border, as it becomes flat, has nets that contract into the hull
   of the segment's own net, which is within 0.95 ε of the segment (`divide_border` sees to that),
   and the segment is a side of the strip's own base triangle: there all the strip passes.
3. Leaves that leave a piece of the border bare, or have an edge that is there already, do so
   because two of their corners are one vertex, which no two places inside a face are: they reach
   from side to side, and are cut between them.
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import row_runs
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import Cells, build_whole_cells
from service.engine.adaptive.cutting.subdivision import divide_cells
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.draft import Draft, Store
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.adaptive.refined_bound import CLOSE, refine_bounds
from service.engine.adaptive.triangulation import Triangulation
from service.engine.bounds.certificate import certify
from service.engine.bounds.faces import Faces
from service.engine.bounds.goal import Goal
from service.engine.bounds.parts import Parts
from service.engine.bounds.patch_nets import PatchNets

SOME = 1 << 15
"""Triangles that are proved at a time, so that what is gathered for it stays small."""

FLATTER = 2
"""How often the height of a strip is halved when it fails."""


def triangulate(
    patch_nets: PatchNets,
    faces: Faces,
    border: Border,
    goal: Goal,
    *,
    stored: Store,
    most: int,
    effort: Effort | None = None,
) -> Triangulation:
    """The mesh of all faces, every triangle of which meets the goal.

    Parameters
    ----------
    stored : callable
        What a format makes of positions (V, 3), as float64 again.
    most : int
        Triangles that are allowed.
    effort : Effort, optional
        What it may take, and what it took.

    Raises
    ------
    TooLarge
        `too_many_triangles` as soon as that is certain, `too_costly`.
    InvalidRequest
        `tolerance_too_small` if places are not fine enough.
    """
    task = Task(patch_nets, faces, goal, MeshLimits(most, effort or Effort()))
    draft, proofs = Draft(task, border, stored), Proofs()
    draft.renew(divide_cells(task, build_whole_cells(faces)))
    while True:
        task.budget.count(int(draft.kept.sum()))
        proofs.renew(draft)
        cut, along_v, strips = _find_failing(draft, proofs.passed)
        if not len(cut) and not len(strips):
            return draft.finish(proofs.deviation, proofs.mesh if goal.two_sided else None)
        draft.halvings[strips] += FLATTER
        assert draft.leaves is not None
        halves = draft.leaves.cells.take(cut).halve(along_v)
        draft.renew(divide_cells(task, Cells.concatenate([*halves])), cut, strips)


class Proofs:
    """What was proved of each triangle of a draft.

    Attributes
    ----------
    deviation, mesh : ndarray of float64, shape (T,)
    passed : ndarray of bool, shape (T,)
    close : ndarray of bool, shape (T,)
        What was measured in quarters, also against the triangles beside its own.
    """

    def __init__(self) -> None:
        self.deviation = self.mesh = np.zeros(0)
        self.passed = self.close = np.zeros(0, dtype=bool)

    def renew(self, draft: Draft) -> None:
        """Bounds of all triangles that are new, or measured against what has changed."""
        count, dirty = len(draft.host), draft.dirty
        more = count - len(self.passed)
        self.deviation = np.concatenate([self.deviation, np.full(more, np.inf)])
        self.mesh = np.concatenate([self.mesh, np.zeros(more)])
        self.passed, self.close = (
            np.concatenate([values, np.zeros(more, dtype=bool)])
            for values in (self.passed, self.close)
        )
        todo = dirty | dirty[draft.host] | ((draft.base >= 0) & dirty[draft.base])
        close = (self.close & ~todo & draft.alive).nonzero()[0]
        beside = draft.beside[draft.host[close]]
        todo[close[(dirty[beside] & (beside >= 0)).any(axis=1)]] = True
        todo &= draft.alive & (draft.host >= 0)
        these = todo.nonzero()[0]
        self.close[these] = False
        for first, last in row_runs(len(these), SOME):
            self._prove(draft, these[first:last])

    def _prove(self, draft: Draft, these: Ints) -> None:
        """Bounds of some triangles: against their hosts, the bases of strips, those beside."""
        task, count = draft.task, len(these)
        other = ((draft.base[these] >= 0) & (draft.base[these] != these)).nonzero()[0]
        rows = np.concatenate([these, these[other]])
        hosts = np.concatenate([draft.host[these], draft.base[these[other]]])
        own = hosts == rows
        corners = draft.corners[rows]
        face, places = draft.face[corners[:, 0]], np.stack([draft.u[corners], draft.v[corners]], 2)
        task.budget.spend(task.estimate_work(face, places))
        vertices = draft.vertices[hosts]
        parts = Parts(face, places, vertices, draft.across[hosts], own)
        found = certify(task.patch_nets, task.faces, parts, draft.positions, task.goal)
        deviation, allowed, passed = found.deviation[:count], found.allowed, found.passed[:count]
        mesh = np.zeros(count) if found.mesh is None else found.mesh[:count]
        if len(other):
            better = ~passed[other] & (found.deviation[count:] <= allowed[count:])
            better &= mesh[other] <= 2.0 * allowed[count:]
            chosen = other[better]
            deviation[chosen], passed[chosen] = found.deviation[count:][better], True
        tried = ~passed & (mesh <= 2.0 * allowed[:count]) & (deviation <= CLOSE * allowed[:count])
        wide = tried.nonzero()[0]
        if len(wide):
            bound, near = refine_bounds(draft, these[wide])
            deviation[wide[near]], passed[wide[near]] = bound[near], True
            self.close[these[wide[near]]] = True
        self.deviation[these], self.mesh[these], self.passed[these] = deviation, mesh, passed


def _find_failing(draft: Draft, passed: Bools) -> tuple[Ints, Bools, Ints]:
    """Leaves to be cut, whether along v, and segments of the border whose strips do not pass."""
    leaves = draft.leaves
    assert leaves is not None
    fails, along_v = np.zeros(len(leaves), dtype=bool), leaves.along_v.copy()
    box = leaves.cells.box
    orphans = draft.leaf[draft.alive & (draft.host < 0) & (draft.leaf >= 0)]
    vanished = np.concatenate([orphans, draft.bare])
    across = draft.crossed[:, 0]
    if len(vanished):
        fails[vanished] = True
        along_v[vanished] = (
            box[3, vanished] - box[2, vanished] > box[1, vanished] - box[0, vanished]
        )
    if len(across):
        begin = draft.corners[across, draft.crossed[:, 1]]
        end = draft.corners[across, (draft.crossed[:, 1] + 1) % 3]
        leaf = draft.leaf[across]
        begin, end, leaf = begin[leaf >= 0], end[leaf >= 0], leaf[leaf >= 0]
        gone = np.zeros((2, len(leaves)), dtype=np.intp)
        np.maximum.at(gone[0], leaf, np.abs(draft.u[end] - draft.u[begin]))
        np.maximum.at(gone[1], leaf, np.abs(draft.v[end] - draft.v[begin]))
        fails[leaf], along_v[leaf] = True, (gone[1] > gone[0])[leaf]
    bad = draft.alive & ~passed & (draft.host >= 0)
    mine = draft.leaf[bad]
    fails[mine[mine >= 0]] = True
    cut = (fails & draft.present).nonzero()[0]
    return cut, along_v[cut], np.unique(draft.segment[bad & (draft.leaf < 0)])
