"""The proof for breps: every point of every face, inside of its loops, is near the mesh.

A face is its surface over the parameters inside of its loops (`oracles.regions`). Its patches are
halved into cells. A cell that no loop meets is inside or outside, as the winding number about a
place in it says. Cells that are outside are dropped, cells that are inside are proved as in
`tools.judge.proof`. A cell that a loop meets is proved whole, though a part of it may be outside;
where this fails, it is halved until it is smaller than `SLACK` of the tolerance. Then it contains a
point of the border of the face, so it is enough that it is within the bound plus its own size.

Loops are those of the given parameter curves. Where these are further from the edges than the
uncertainty of the document, they are traced along the edges, without code of the service.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from oracles.brep_documents import read_surface
from oracles.regions import Region, build_region
from tools.judge.exact import Array, Exact, list_nets
from tools.judge.hulls import cut_net
from tools.judge.proof import (
    CHUNK,
    DEEPEST,
    SLENDER,
    Index,
    Mesh,
    U,
    bound_distances,
    find_violation,
    halve_pieces,
    project_points,
)

SLACK = 0.1
"""Size of the smallest cells at loops, as a share of the tolerance."""

FLATNESS = 1e-5
"""Radius of the pieces of loops, as a share of the box of the loops of a face."""

LATE = 7
"""Halvings after which the nearest of all triangles are searched, and violations are."""

MOST = 1 << 21
"""Most cells of a face."""


@dataclass
class BrepProof:
    """Result of a proof: cells that were examined and that stay undecided, and a violation.

    `bordering` counts the cells at loops that were proved with their size added to the bound.
    `beyond` is the distance of a point of the face `face` whose distance from the mesh exceeds the
    bound; it ends the proof.
    """

    pieces: int = 0
    exact: int = 0
    bordering: int = 0
    undecided: int = 0
    beyond: float | None = None
    face: int | None = None


class Cells(NamedTuple):
    """Cells of one surface: pieces (4, m, p+1, q+1), and labels (3, m) as in `cut_net`.

    `pairs` are the numbers of cells and of the pieces of loops that they may meet, `is_inside` (m,)
    whether a cell is known to be inside. All come from the same number of halvings.
    """

    pieces: Array
    labels: Index
    pairs: tuple[Index, Index]
    is_inside: Any
    halvings: int


@dataclass
class Face:
    """A face as the proof reads it: its exact nets, boxes of parameters, and its region.

    `boxes` (n, 2, 2) are the parameters of each patch: rows low and high, columns u and v. `scale`
    (4,) are the largest homogeneous numbers of the nets.
    """

    net: Exact
    boxes: Array
    region: Region | None
    scale: Array = field(init=False)

    def __post_init__(self) -> None:
        self.scale = np.abs(self.net.astype(np.float64)).reshape(-1, 4).max(axis=0)

    def find_boxes(self, labels: Index) -> tuple[Array, Array]:
        """The corners (m, 2) of the parameters of cells, low and high."""
        row, numbers = labels[0], labels[1:].T
        depth = np.frexp(numbers.astype(np.float64))[1] - 1
        parts = np.ldexp(1.0, depth)
        low, high = self.boxes[row, 0], self.boxes[row, 1]
        share = (numbers - parts) / parts
        return low + share * (high - low), low + (share + 1 / parts) * (high - low)


def prove_brep(
    brep: dict[str, Any], corners: Array, origin: Array, bound: float, tolerance: float
) -> BrepProof:
    """Shows that all points of the faces of a document are within `bound` of the triangles.

    The corners (T, 3, 3) are relative to `origin` (3,).
    """
    proof, mesh = BrepProof(), Mesh(corners)
    for number, entry in enumerate(brep["faces"]):
        (net,) = list_nets(entry["surface"], origin)
        face = Face(net, list_boxes(entry["surface"]), build_region(brep, number, FLATNESS))
        prove_face(proof, mesh, face, bound=bound, slack=SLACK * tolerance)
        if proof.beyond is not None:
            proof.face = number
            return proof
    return proof


def list_boxes(surface: dict[str, Any]) -> Array:
    """The parameters (n, 2, 2) of the patches of a surface, in the order of `list_nets`."""
    net = read_surface(surface)
    spans = []
    for knots, degree in zip(net.knots, net.degree, strict=True):
        ends = np.unique(knots[degree : len(knots) - degree])
        spans.append(np.stack([ends[:-1], ends[1:]], axis=1))
    u, v = (x.ravel() for x in np.indices([len(each) for each in spans]))
    return np.stack([spans[0][u], spans[1][v]], axis=2)


def prove_face(proof: BrepProof, mesh: Mesh, face: Face, *, bound: float, slack: float) -> None:
    """Proves one face, and adds the result to `proof`."""
    count = len(face.net)
    nothing = np.empty(0, dtype=np.intp)
    pairs = (nothing, nothing)
    if face.region is not None:
        pairs = face.region.find_meetings(face.boxes[:, 0], face.boxes[:, 1])
    labels = np.stack([np.arange(count), *np.ones((2, count), dtype=np.intp)])
    pieces = np.moveaxis(face.net.astype(np.float64), -1, 0)
    stack = [Cells(pieces, labels, pairs, np.full(count, face.region is None), 0)]
    examined = 0
    while stack and proof.beyond is None:
        cells = _drop_outside(face, stack.pop())
        examined += cells.labels.shape[1]
        proof.pieces += cells.labels.shape[1]
        if cells.halvings >= DEEPEST or examined > MOST:
            proof.undecided += cells.labels.shape[1]
            continue
        left, points_and_gaps = _prove_cells(proof, mesh, face, cells, bound=bound, slack=slack)
        if len(left) and proof.beyond is None:
            stack += _halve_cells(_select(cells, left), points_and_gaps)


def _drop_outside(face: Face, cells: Cells) -> Cells:
    """The cells that are inside, and those that a loop may meet."""
    if face.region is None:
        return cells
    low, high = face.find_boxes(cells.labels)
    pairs = face.region.find_meetings(low, high, cells.pairs)
    is_met = np.zeros(len(low), bool)
    is_met[pairs[0]] = True
    is_inside = cells.is_inside.copy()
    open_cells = np.flatnonzero(~is_met & ~is_inside)
    winding = face.region.wind((low + high)[open_cells] / 2) + face.region.base
    is_inside[open_cells] = winding >= 1
    cells = cells._replace(pairs=pairs, is_inside=is_inside)
    return _select(cells, np.flatnonzero(is_met | is_inside))


def _select(cells: Cells, rows: Index) -> Cells:
    number = np.full(cells.labels.shape[1], -1)
    number[rows] = np.arange(len(rows))
    box, piece = cells.pairs
    kept = number[box] >= 0
    return Cells(
        cells.pieces[:, rows],
        cells.labels[:, rows],
        (number[box[kept]], piece[kept]),
        cells.is_inside[rows],
        cells.halvings,
    )


def _prove_cells(
    proof: BrepProof, mesh: Mesh, face: Face, cells: Cells, *, bound: float, slack: float
) -> tuple[Index, Array]:
    """Numbers of the cells that are not proved, and their points with distances (4, m, …)."""
    pieces, labels = cells.pieces, cells.labels
    if not pieces.shape[1]:
        return np.empty(0, dtype=np.intp), np.empty((4, 0, 1, 1))
    points = project_points(pieces)
    size = max(mesh.size, float(np.abs(points).max()))
    # The errors are those of `tools.judge.proof`.
    share = (1 + cells.halvings * max(pieces.shape[2:])) * U
    weight_error, least_weight = share * face.scale[3], float(pieces[3].min())
    assert least_weight > 2 * weight_error, "weights that rounding may have turned negative"
    point_error = share * float(face.scale[:3].max()) + size * weight_error
    point_error /= least_weight - weight_error
    radius = 2 * point_error + 512 * U * size
    late = cells.halvings >= LATE
    bounds, edges, gaps = bound_distances(mesh, points, of_all=late)
    is_left = ~(bounds + radius <= bound)
    extent = np.linalg.norm(points.max(axis=(2, 3)) - points.min(axis=(2, 3)), axis=0)
    is_small = ~cells.is_inside & (extent <= slack)
    is_bordering = is_left & is_small & (bounds + radius <= bound + extent)
    proof.bordering += int(is_bordering.sum())
    is_left &= ~is_bordering
    is_doubtful = is_left & cells.is_inside & (bounds - radius <= bound)
    for k in np.flatnonzero(is_doubtful):
        row, u, v = labels[:, k].tolist()
        if mesh.is_near(cut_net(face.net[row], u, v), edges[k], bound):
            is_left[k], proof.exact = False, proof.exact + 1
    left = np.flatnonzero(is_left)
    if late and len(left):
        inside = left[cells.is_inside[left]]
        if len(inside):
            proof.beyond = find_violation(
                mesh, face.net, points[:, inside], labels[:, inside], bound=bound, radius=radius
            )
        small = left[is_small[left]]
        if len(small) and proof.beyond is None:
            # Each of these cells contains a point of a loop; a corner may be further by its size.
            more = bound + 2 * slack
            proof.beyond = find_violation(
                mesh, face.net, points[:, small], labels[:, small], bound=more, radius=radius
            )
    points_and_gaps = np.concatenate([points[:, left] / SLENDER, gaps[np.newaxis, left]])
    return left, points_and_gaps


def _halve_cells(cells: Cells, points_and_gaps: Array) -> list[Cells]:
    """Both halves of all cells, in groups of at most `CHUNK`."""
    count = cells.labels.shape[1]
    numbered = np.stack([np.arange(count), cells.labels[1], cells.labels[2]])
    pieces, labels = halve_pieces(cells.pieces, numbered, points_and_gaps)
    parents = labels[0]
    labels = np.stack([cells.labels[0, parents], labels[1], labels[2]])
    box, piece = cells.pairs
    order = np.argsort(box, kind="stable")
    box, piece = box[order], piece[order]
    begins, counts = np.searchsorted(box, np.arange(count)), np.bincount(box, minlength=count)
    groups = []
    for start in range(0, len(parents), CHUNK):
        some = slice(start, start + CHUNK)
        own = parents[some]
        lengths = counts[own]
        child = np.repeat(np.arange(len(own)), lengths)
        offset = np.arange(len(child)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        pairs = child, piece[np.repeat(begins[own], lengths) + offset]
        groups.append(
            Cells(pieces[:, some], labels[:, some], pairs, cells.is_inside[own], cells.halvings + 1)
        )
    return groups
