"""The regions of trimmed faces as panels: Green's theorem, with exact bookkeeping.

For a loop and a base line u = b, ∫∫ g du dv over its inside is ∮ F dv with F = ∫_b g du. Of a piece
of the loop over patch (I, J), F is the integral from the base line, if that is in column I, or from
the side of the patch that is nearer to it, plus those over whole patches between. So each piece has
a panel, and adds its range of v, with a sign, to all patches between it and the base line. Ranges
that cancel are left out. In each face u and v are exchanged where that takes fewer panels.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, mark_begins
from service.engine.measures.panels import PanelRows, Panels
from service.engine.parts.measures.border_pieces import BorderPieces, PieceRows
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.trims.surfaces import FaceSurfaces


@dataclass(frozen=True, eq=False, slots=True)
class _BaseLines:
    """The base lines of all loops, across one axis, as seen from m pieces of loops.

    Attributes
    ----------
    column : ndarray of int, shape (m,)
        The column of patches with the base line.
    base : ndarray of float64, shape (m,)
        The coordinate, in the patch of a piece, from which its panel begins: of the base line, or
        of the nearer side.
    steps : ndarray of int, shape (m,)
        The number of whole patches between, with the sign of the piece's side.
    """

    column: Ints
    base: FloatArray
    steps: Ints

    @classmethod
    def of(cls, span: Ints, ends: FloatArray, loop: Ints, count: int) -> "_BaseLines":
        """Lines in the middles of loops.

        `span` (m,) are columns of pieces, and `ends` (2, m) coordinates of their ends.
        """
        first, last = np.full(count, np.iinfo(np.intp).max), np.full(count, -1)
        np.minimum.at(first, loop, span)
        np.maximum.at(last, loop, span)
        low, high = np.full(count, 1.0), np.zeros(count)
        np.minimum.at(low, loop, ends.min(axis=0))
        np.maximum.at(high, loop, ends.max(axis=0))
        # Over several columns the line is a side between two of them.
        is_single = first == last
        column = np.where(is_single, first, (first + last + 1) // 2)[loop]
        line = np.where(is_single, (low + high) / 2, 0.0)[loop]
        base = np.where(span == column, line, np.where(span > column, 0.0, 1.0))
        steps = np.where(span > column, span - column, np.minimum(span + 1 - column, 0))
        return cls(column, base, steps)


@dataclass(frozen=True, eq=False, slots=True)
class _Draft:
    """Panels of patches of any degree; `patches` (K,) are numbers of patches."""

    curves: FloatArray
    base: FloatArray
    sign: FloatArray
    patches: Ints
    faces: Ints


@dataclass(frozen=True, eq=False)
class PanelPlan:
    """Which panels the faces of a placed brep get.

    Attributes
    ----------
    placed : PlacedBrep
    borders : BorderPieces
    ends : ndarray of float64, shape (2, 2, m)
        The coordinates of the ends of pieces: axis, end.
    is_constant : ndarray of bool, shape (2, m)
        Whether a coordinate is the same for a whole piece.
    lines : tuple of _BaseLines
        Across both axes.
    work : ndarray of int, shape (2, F)
        How many panels each face has, at most, if they are along u, and if they are along v.
    """

    placed: PlacedBrep
    borders: BorderPieces
    ends: FloatArray
    is_constant: Bools
    lines: tuple[_BaseLines, _BaseLines]
    work: Ints

    @classmethod
    def of(cls, placed: PlacedBrep, borders: BorderPieces) -> "PanelPlan":
        """The plan for all faces."""
        pieces, faces = borders.pieces, len(placed.prepared.surfaces)
        loop = placed.prepared.coedge_loops[pieces.coedge]
        count = int(loop.max(initial=-1)) + 1
        ends, is_constant = _summarize(borders)
        u, v = (_BaseLines.of(pieces.span[axis], ends[axis], loop, count) for axis in range(2))
        work = np.zeros((2, faces), np.intp)
        for axis, line in enumerate((u, v)):
            panels = np.where(is_constant[1 - axis], 0, 1 + np.abs(line.steps))
            np.add.at(work[axis], pieces.face, panels)
        return cls(placed, borders, ends, is_constant, (u, v), work)

    @property
    def count(self) -> int:
        """The number of panels, at most."""
        return int(self.work.min(axis=0).sum())

    def build(self) -> list[Panels]:
        """The panels of all faces, in the frame of the placed brep."""
        surfaces, pieces = self.placed.prepared.surfaces, self.borders.pieces
        is_exchanged = (self.work[1] < self.work[0])[pieces.face]
        panels: list[Panels] = []
        for axis, line in enumerate(self.lines):
            chosen = is_exchanged == bool(axis)
            if not chosen.any():
                continue
            ends, varies = self.ends[1 - axis], ~self.is_constant[1 - axis]
            drafts = _draft_pieces(self.borders, line, chosen & varies, axis)
            drafts += _draft_patches(surfaces, pieces, line, ends, (chosen, axis))
            panels += _group_drafts(self.placed, drafts, exchanged=bool(axis))
        return panels


def _summarize(parts: BorderPieces) -> tuple[FloatArray, Bools]:
    """The ends of pieces, (2, 2, m): axis, end; and whether a coordinate is constant, (2, m)."""
    count = len(parts.pieces.coedge)
    ends, is_constant = np.empty((2, 2, count)), np.empty((2, count), bool)
    for nets in parts.nets:
        points = nets.values[:2]
        if len(nets.values) > 2:
            # The first and the last control point are as before the product with their weights.
            points = points / nets.values[2]
        ends[:, :, nets.rows] = points[:, [0, -1]]
        is_constant[:, nets.rows] = (points == points[:, :1]).all(axis=1)
    return ends, is_constant


def _draft_pieces(parts: BorderPieces, line: _BaseLines, chosen: Bools, axis: int) -> list[_Draft]:
    """The panels between pieces and base lines, or sides, of the same patch."""
    drafts = []
    for nets in parts.nets:
        kept = chosen[nets.rows].nonzero()[0]
        rows, values = nets.rows[kept], nets.values[:, :, kept]
        w = values[2] if len(values) > 2 else 1.0
        kept = (values[axis] != line.base[rows] * w).any(axis=0).nonzero()[0]
        rows, values = rows[kept], values[:, :, kept]
        order = [axis, 1 - axis, *range(2, len(values))]
        sign = np.full(len(rows), -1.0 if axis else 1.0)
        pieces = parts.pieces
        drafts.append(
            _Draft(values[order], line.base[rows], sign, pieces.patch[rows], pieces.face[rows])
        )
    return drafts


def _draft_patches(
    surfaces: FaceSurfaces,
    pieces: PieceRows,
    line: _BaseLines,
    ends: FloatArray,
    selection: tuple[Bools, int],
) -> list[_Draft]:
    """The parts of whole patches between pieces and base lines.

    `ends` (2, m) are the coordinates of pieces that panels run along; `selection` are the pieces
    that count, and the axis of panels.
    """
    chosen, axis = selection
    rows = np.flatnonzero(chosen & (line.steps != 0) & (ends[0] != ends[1]))
    if not len(rows):
        return []
    piece, number = expand_runs(np.abs(line.steps[rows]))
    piece = rows[piece]
    side = np.sign(line.steps[piece])
    span = pieces.span[:, piece]
    span[axis] -= side * (number + 1)
    face = pieces.face[piece]
    patch = surfaces.faces.first[face] + span[0] * surfaces.faces.stride[face] + span[1]
    begin, end = ends[:, piece]
    sign = side * (-1 if axis else 1)
    # Each range adds its sign at its beginning, and subtracts it at its end.
    at = np.concatenate([begin, end])
    change = np.concatenate([sign, -sign])
    patch, face = np.tile(patch, 2), np.tile(face, 2)
    order = np.lexsort((at, patch))
    at, change, patch, face = at[order], change[order], patch[order], face[order]
    total = np.cumsum(change)
    # At equal places only the last total counts; then, only where it changes.
    is_last = np.append((at[1:] != at[:-1]) | (patch[1:] != patch[:-1]), True)
    at, total, patch, face = (values[is_last] for values in (at, total, patch, face))
    is_new = mark_begins(total) | mark_begins(patch)
    at, total, patch, face = (values[is_new] for values in (at, total, patch, face))
    begins = np.flatnonzero(total)
    low, high = at[begins], at[begins + 1]
    count = len(begins)
    curves = np.array([np.ones((2, count)), [low, high]])
    faces, patches = face[begins], patch[begins]
    return [_Draft(curves, np.zeros(count), total[begins].astype(np.float64), patches, faces)]


def _group_drafts(placed: PlacedBrep, drafts: Sequence[_Draft], *, exchanged: bool) -> list[Panels]:
    """Panels by the group of their patches, and by the degree of their curves."""
    nets, patches = placed.prepared.surfaces.nets, placed.patches
    by_kind: dict[tuple[int, int, int], list[PanelRows]] = {}
    for draft in drafts:
        for number in np.unique(nets.group[draft.patches]).tolist():
            rows = np.flatnonzero(nets.group[draft.patches] == number)
            curves = draft.curves[:, :, rows]
            if len(curves) > 2:
                _, exponent = np.frexp(curves[2].max(axis=0))
                curves = np.ldexp(curves, -exponent)
            panels = PanelRows(
                curves,
                draft.base[rows],
                np.zeros(len(rows)),
                np.ones(len(rows)),
                nets.row[draft.patches[rows]],
                draft.faces[rows],
                draft.sign[rows],
                placed.sides[draft.faces[rows]],
                np.zeros(len(rows), np.intp),
            )
            by_kind.setdefault((number, *curves.shape[:2]), []).append(panels)
    result = []
    for (number, _, _), parts in by_kind.items():
        own = patches[number].exchange_parameters() if exchanged else patches[number]
        result.append(Panels(own, PanelRows.join(parts)))
    return result
