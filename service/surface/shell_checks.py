"""Checks of the shells of a brep on its creation: their faces, and the uses of their edges.

The functions return faults, as those of `service.surface.brep_checks`.
"""

from collections import defaultdict
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np

from service.bases.arrays import Ints
from service.errors import Issue, count_nouns, pointer
from service.surface.brep_checks import Fault, range_text
from service.surface.brep_model import BrepModel
from service.surface.spline_tables import find_starts


def find_shell_faults(model: BrepModel) -> list[Fault]:
    """Unknown, repeated and missing faces of shells."""
    faces, count = model.shell_faces, model.face_count
    shells = np.repeat(np.arange(len(model.shell_counts)), model.shell_counts)
    position = np.arange(len(faces)) - find_starts(model.shell_counts)[shells]
    is_known = (faces >= 0) & (faces < count)
    uses = np.bincount(faces[is_known], minlength=count)
    if is_known.all() and (uses == 1).all():
        return []
    faults, seen = [], set()
    for row in np.flatnonzero(~is_known | (uses[np.where(is_known, faces, 0)] > 1)).tolist():
        where = pointer(("shells", shells.item(row), "faces", position.item(row)))
        face = faces.item(row)
        if not is_known[row]:
            message = "A shell lists faces by their numbers, from 0."
            needed = range_text(count, "faces")
            faults.append(Fault(Issue("unknown_face", message, where, f"face {face}", needed)))
        elif face in seen:
            message = "Each face belongs to one shell."
            got = f"face {face} once more"
            faults.append(Fault(Issue("repeated_face", message, where, got, "each face once")))
        seen.add(face)
    missing = np.flatnonzero(uses == 0)
    if len(missing):
        message = "Each face belongs to one shell."
        got = (
            f"{count_nouns(len(missing), 'faces')} in no shell, the first of them face {missing[0]}"
        )
        faults.append(Fault(Issue("missing_face", message, "/shells", got, "each face once")))
    return faults


@dataclass(frozen=True, eq=False)
class EdgeUses:
    """How often the coedges of each shell run along each edge, and in which direction.

    Of a reversed face the coedges count in the other direction, so that in an oriented shell every
    edge is used once in each direction. Degenerate edges do not count.

    Attributes
    ----------
    shells, edges : ndarray of int, shape (n,)
        Each pair of a shell and an edge of it, ascending.
    forward, backward : ndarray of int, shape (n,)
        Numbers of coedges.
    rows : ndarray of int, shape (C,)
        The pair of each coedge; −1 for those that do not count.
    """

    shells: Ints
    edges: Ints
    forward: Ints
    backward: Ints
    rows: Ints


def count_uses(model: BrepModel) -> EdgeUses:
    """The uses of the edges of all shells; skipped faces have no coedges."""
    edges, faces = model.coedge_edges, model.coedge_faces
    is_counted = edges >= 0
    is_counted[is_counted] = ~model.is_degenerate[edges[is_counted]]
    counted = np.flatnonzero(is_counted)
    keys = model.face_shells[faces[counted]] * len(model.edge_vertices) + edges[counted]
    pairs, numbers = np.unique(keys, return_inverse=True)
    directions = (model.coedge_reversed ^ model.is_reversed[faces])[counted]
    rows = np.full(len(edges), -1)
    rows[counted] = numbers
    size = len(pairs)
    shells, pair_edges = np.divmod(pairs, max(1, len(model.edge_vertices)))
    return EdgeUses(
        shells,
        pair_edges,
        np.bincount(numbers[~directions], minlength=size),
        np.bincount(numbers[directions], minlength=size),
        rows,
    )


def find_direction_faults(model: BrepModel, uses: EdgeUses) -> list[Fault]:
    """Edges that both faces of a shell run along in the same direction.

    The face of a fault is chosen so that few faces are left out: again and again the face with the
    most such edges, of several the last.
    """
    is_wrong = (uses.forward + uses.backward == 2) & (uses.forward != 1)
    if not is_wrong.any():
        return []
    coedges = np.flatnonzero(uses.rows >= 0)
    coedges = coedges[is_wrong[uses.rows[coedges]]]
    coedges = coedges[np.argsort(uses.rows[coedges], kind="stable")].reshape(-1, 2)
    faces = model.coedge_faces[coedges]
    chosen = _choose_faces(faces.tolist())
    return [
        Fault(
            Issue(
                "used_twice_same_direction",
                "Where two faces of a shell meet, they run along their edge in opposite "
                "directions, so that both normals are on the same side of the shell.",
                f"/edges/{model.coedge_edges[first]}",
                f"face {pair[0]} and face {pair[1]} in the same direction"
                if pair[0] != pair[1]
                else f"face {pair[0]} twice in the same direction",
                "opposite directions; see `reversed` of loops and of faces",
            ),
            face,
        )
        for (first, _), pair, face in zip(coedges.tolist(), faces.tolist(), chosen, strict=True)
    ]


def _choose_faces(pairs: list[list[int]]) -> list[int]:
    """For each pair of faces one of them, so that few faces are chosen in all."""
    pairs_of: dict[int, list[int]] = defaultdict(list)
    for number, pair in enumerate(pairs):
        for face in set(pair):
            pairs_of[face].append(number)
    counts = {face: len(numbers) for face, numbers in pairs_of.items()}
    heap = [(-count, -face) for face, count in counts.items()]
    heapify(heap)
    chosen = [-1] * len(pairs)
    while heap:
        count, negative = heappop(heap)
        face = -negative
        if -count != counts[face]:
            continue  # the face is in the heap once more, with its present count
        for number in pairs_of[face]:
            if chosen[number] < 0:
                chosen[number] = face
                other = sum(pairs[number]) - face
                counts[other] -= 1
                heappush(heap, (-counts[other], -other))
    return chosen


def find_open_shells(model: BrepModel, uses: EdgeUses) -> Ints:
    """Shells that are said to be closed, but have an edge with a border."""
    has_border = np.zeros(len(model.is_closed), bool)
    has_border[uses.shells[uses.forward != uses.backward]] = True
    # A loop that is given by its pcurves alone shares no edge with another face.
    has_border[model.face_shells[model.coedge_faces[model.coedge_edges == -1]]] = True
    return np.flatnonzero(has_border & model.is_closed)


def word_open_shell(uses: EdgeUses, shell: int) -> Issue:
    """The issue for one of the shells of `find_open_shells`."""
    rows = np.flatnonzero((uses.forward != uses.backward) & (uses.shells == shell))
    got = "a loop that is given by its pcurves alone, so that it shares no edge"
    if len(rows):
        first = rows.item(0)
        total = uses.forward.item(first) + uses.backward.item(first)
        got = (
            f"{count_nouns(len(rows), 'edges')} with a border; edge {uses.edges[first]} has "
            f"{count_nouns(total, 'coedges')}"
        )
    return Issue(
        "not_closed",
        "At each edge of a closed shell, as many coedges run in one direction as in the other.",
        f"/shells/{shell}",
        got,
        'two coedges at each edge; or `"closed": false`',
    )
