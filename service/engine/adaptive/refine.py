"""Triangulations that are near enough, proved triangle by triangle.

    cells → outlines → triangles → certificate, a closer look → cut what fails, and again

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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.closer import looked_closer
from service.engine.adaptive.cutting.boxes import Leaves, whole
from service.engine.adaptive.cutting.cells import divided
from service.engine.adaptive.cutting.task import Task
from service.engine.adaptive.faces import Faces
from service.engine.adaptive.goal import Goal
from service.engine.adaptive.ground import Ground
from service.engine.adaptive.limits import Budget, Effort
from service.engine.adaptive.polygons.outlines import Outline, outlined
from service.engine.adaptive.polygons.triangles import Triangles, triangulated
from service.engine.adaptive.proof.certificate import Bounds, Parts, certify
from service.engine.adaptive.triangulation import Triangulation

Store = Callable[[FloatArray], FloatArray]

CROWD = 64
"""A leaf with more corners is cut, whatever its triangles are like."""

OVERHEAD = 4000
"""What it takes to make triangles of a leaf, in multiplications, about."""

FLATTER = 2
"""How often the height of a strip is halved when it fails."""


def triangulate(
    ground: Ground,
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
    task = Task(ground, faces, goal, Budget(most, effort or Effort()))
    leaves = divided(task, whole(faces))
    halvings = np.zeros(len(border.at), dtype=np.intp)
    done: _Certified | None = None
    while True:
        task.budget.spend(OVERHEAD * len(leaves))
        outline = outlined(faces, border, leaves.cells, halvings)
        crowded, along_v = _crowded(outline, leaves)
        if not crowded.any():
            positions = _positions(task, border, outline)
            triangles = triangulated(outline, leaves, positions)
            task.budget.count(int(triangles.kept.sum()))
            done = _certified(task, outline, triangles, stored(positions), done)
            crowded, along_v, strips = _failing(outline, leaves, done)
            if not crowded.any() and not len(strips):
                return _finished(outline, positions, done, goal)
            halvings[strips] += FLATTER
        if crowded.any():
            halves = leaves.cells.take(crowded).halved(along_v[crowded])
            new = [divided(task, half) for half in halves]
            leaves = Leaves.joined([leaves.take(~crowded), *new])


@dataclass(frozen=True, eq=False, slots=True)
class _Certified:
    """Triangles with what was proved of each of them, and the samples that they have.

    What is `close` was measured against other triangles than its own and those beside it.
    """

    outline: Outline
    triangles: Triangles
    deviation: FloatArray
    mesh: FloatArray
    passed: Bools
    close: Bools


def _positions(task: Task, border: Border, outline: Outline) -> FloatArray:
    """Positions of all vertices: those of the border, then those within the faces."""
    inner = np.flatnonzero(outline.vertex >= len(border.points))
    face, u, v = outline.face[inner], outline.u[inner], outline.v[inner]
    points = task.positions(face, u, v)
    return np.concatenate([border.points, points])


def _crowded(outline: Outline, leaves: Leaves) -> tuple[Bools, Bools]:
    """Leaves with too many corners, and which of them have more of them along v."""
    size = np.diff(outline.start)
    crowded = size > CROWD
    along_v = np.zeros(len(size), dtype=bool)
    if crowded.any():
        leaf = np.repeat(np.arange(len(size)), size)
        u, v = outline.u[outline.corner], outline.v[outline.corner]
        box = leaves.cells.box[:, leaf]
        on_u = np.bincount(leaf, (u == box[0]) | (u == box[1]), minlength=len(size))
        on_v = np.bincount(leaf, (v == box[2]) | (v == box[3]), minlength=len(size))
        along_v = on_u > on_v
    return crowded, along_v


def _certified(
    task: Task,
    outline: Outline,
    triangles: Triangles,
    positions: FloatArray,
    before: _Certified | None,
) -> _Certified:
    """Bounds of all triangles; those that are as they were before keep theirs."""
    count = len(triangles.host)
    deviation, mesh = np.full(count, np.inf), np.zeros(count)
    passed = np.zeros(count, dtype=bool)
    todo = triangles.host >= 0
    if before is not None:
        same, old = _unchanged(outline, triangles, before)
        deviation[same], mesh[same] = before.deviation[old], before.mesh[old]
        passed[same] = before.passed[old]
        todo[same] = False
    these = np.flatnonzero(todo)
    host = triangles.host[these]
    places = np.stack([outline.u, outline.v], axis=1)

    def bounds(rows: Ints, hosts: Ints, own: Bools) -> Bounds:
        corners = triangles.corners[rows]
        task.budget.spend(task.certifying(outline.face[corners[:, 0]], places[corners]))
        parts = Parts(
            outline.face[corners[:, 0]],
            places[corners],
            outline.vertex[triangles.corners[hosts]],
            triangles.across[hosts],
            own,
        )
        return certify(task.ground, task.faces, parts, positions, task.goal)

    found = bounds(these, host, host == these)
    deviation[these], passed[these] = found.deviation, found.passed
    if found.mesh is not None:
        mesh[these] = found.mesh
    again = these[~found.passed & (triangles.base[these] >= 0) & (triangles.base[these] != these)]
    if len(again):
        other = bounds(again, triangles.base[again], np.zeros(len(again), dtype=bool))
        better = other.passed & (mesh[again] <= 2.0 * other.allowed)
        deviation[again[better]], passed[again[better]] = other.deviation[better], True
    wide = these[~passed[these] & (mesh[these] <= 2.0 * found.allowed)]
    close = np.zeros(count, dtype=bool)
    if len(wide):
        bound, near = looked_closer(task, outline, triangles, positions, wide)
        deviation[wide[near]], passed[wide[near]] = bound[near], True
        close[wide[near]] = True
    return _Certified(outline, triangles, deviation, mesh, passed, close)


def _unchanged(outline: Outline, triangles: Triangles, before: _Certified) -> tuple[Ints, Ints]:
    """Triangles that are there as before, with the same neighbours; and which they were."""
    old = before.outline
    # Samples are in the order of face, u, v in both: where the old ones are among the new.
    both = [
        np.concatenate(pair)
        for pair in ((outline.face, old.face), (outline.u, old.u), (outline.v, old.v))
    ]
    order = np.lexsort(both[::-1])
    same = np.append(
        np.logical_and.reduce([column[order[1:]] == column[order[:-1]] for column in both]), False
    )
    sample = np.full(len(old.face), -1)
    hits = np.flatnonzero(same)
    sample[order[hits + 1] - len(outline.face)] = order[hits]
    vertex = np.full(old.vertices, -1)
    vertex[old.vertex] = np.where(sample >= 0, outline.vertex[sample], -1)
    theirs = before.triangles
    kept = np.flatnonzero(theirs.kept & ~before.close & (sample[theirs.corners] >= 0).all(axis=1))
    if not len(kept):
        return kept, kept
    many = len(outline.face)
    new_keys, new_across = _keyed(triangles.corners, triangles.across, many)
    moved = np.where(theirs.across[kept] >= 0, vertex[theirs.across[kept]], -1)
    moved[(theirs.across[kept] >= 0) & (moved < 0)] = -2
    old_keys, old_across = _keyed(sample[theirs.corners[kept]], moved, many)
    ranks = np.argsort(old_keys)
    place = ranks[np.searchsorted(old_keys[ranks], new_keys).clip(max=len(kept) - 1)]
    same = (old_keys[place] == new_keys) & (old_across[:, place] == new_across).all(axis=0)
    same &= triangles.kept
    # What was measured against the base of its strip needs that base.
    same &= same[triangles.base] | (triangles.base < 0)
    rows = np.flatnonzero(same)
    return rows, kept[place[rows]]


def _keyed(corners: Ints, across: Ints, many: int) -> tuple[Ints, Ints]:
    """A number for each triangle, by the edge at which its least corner begins.

    Of all triangles of places only one has that edge. Then what it has to have in common with
    another, in columns: its last corner, and what is across its edges.
    """
    first = corners.argmin(axis=1)
    rows = np.arange(len(corners))
    begin, end, last = (corners[rows, (first + k) % 3] for k in range(3))
    beyond = [across[rows, (first + k) % 3] for k in range(3)]
    return begin * many + end, np.stack([last, *beyond])


def _failing(outline: Outline, leaves: Leaves, done: _Certified) -> tuple[Bools, Bools, Ints]:
    """Leaves to be cut, whether along v, and segments of the border whose strips do not pass."""
    triangles = done.triangles
    fails, along_v = np.zeros(len(leaves), dtype=bool), leaves.along_v.copy()
    box = leaves.cells.box
    orphans = triangles.leaf[(triangles.host < 0) & (triangles.leaf >= 0)]
    vanished = np.concatenate([orphans, triangles.bare])
    across = triangles.crossed[:, 0]
    if len(vanished):
        fails[vanished] = True
        along_v[vanished] = (
            box[3, vanished] - box[2, vanished] > box[1, vanished] - box[0, vanished]
        )
    if len(across):
        begin = triangles.corners[across, triangles.crossed[:, 1]]
        end = triangles.corners[across, (triangles.crossed[:, 1] + 1) % 3]
        leaf = triangles.leaf[across]
        begin, end, leaf = begin[leaf >= 0], end[leaf >= 0], leaf[leaf >= 0]
        gone = np.zeros((2, len(leaves)), dtype=np.intp)
        np.maximum.at(gone[0], leaf, np.abs(outline.u[end] - outline.u[begin]))
        np.maximum.at(gone[1], leaf, np.abs(outline.v[end] - outline.v[begin]))
        fails[leaf], along_v[leaf] = True, (gone[1] > gone[0])[leaf]
    bad = ~done.passed & (triangles.host >= 0)
    mine = triangles.leaf[bad]
    fails[mine[mine >= 0]] = True
    return fails, along_v, np.unique(triangles.segment[bad & (triangles.leaf < 0)])


def _finished(
    outline: Outline, positions: FloatArray, done: _Certified, goal: Goal
) -> Triangulation:
    """The mesh: triangles that are kept, each with the greatest bound of all that falls to it."""
    triangles = done.triangles
    deviation, mesh = np.zeros(len(triangles.host)), np.zeros(len(triangles.host))
    np.maximum.at(deviation, triangles.host, done.deviation)
    np.maximum.at(mesh, triangles.host, done.mesh)
    kept = np.flatnonzero(triangles.kept)
    order = kept[np.argsort(outline.face[triangles.corners[kept, 0]], kind="stable")]
    return Triangulation(
        outline.face,
        outline.u,
        outline.v,
        outline.vertex,
        positions,
        triangles.corners[order],
        deviation[order],
        mesh[order] if goal.two_sided else None,
    )
