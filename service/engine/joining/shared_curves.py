"""Open edges that are the same curve in pieces: where they must be cut to become equal edges.

Two borders may be one curve though no edge of theirs is: one surface has a knot where the other has
none, or two surfaces meet a third one along one edge of it. A Bézier curve over an interval is
determined by the interval, and stays the same after raising its degree, after inserting knots and
after a linear change of the parameter. So:

1. A corner that lies on an open edge, and not at its ends, may cut it: at the parameter t of which
   B(t) is the corner, found by Gauss–Newton steps t ← t − (B(t) − c) · B' / B' · B'.
2. Pieces between the same two corners are one curve if they agree at 2 n + 1 parameters, n the
   highest degree of all.
3. A cut is made if a piece beside it is one curve with a piece of another edge.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.cache import Cache
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.clustering import leaders
from service.engine.joining.near_points import run_starts
from service.engine.mesh.connectivity import hash_arrays
from service.engine.mesh.edges import EdgeCurves
from service.engine.mesh.seams import Seams
from service.surface.sides import BEGINS, ENDS

STEPS = 12
"""Gauss–Newton steps: each doubles the digits."""

MAX_PAIRS = 1 << 22
"""Corners in boxes about edges that are looked at; a model with more is left as it is."""

FEW_PAIRS = 1 << 14
"""Up to here all pairs of an edge and a corner are looked at together."""

DIRECTIONS = np.array(
    [
        *((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)),
        *((1.0, 1, 0), (1.0, -1, 0), (1.0, 0, 1), (1.0, 0, -1), (0, 1.0, 1), (0, 1.0, -1)),
        *((1.0, 1, 1), (1.0, 1, -1), (1.0, -1, 1), (1.0, -1, -1)),
    ]
)
"""The axes, and the diagonals between two of them and between all: bounds along these are close."""

CHUNK = 1 << 18
"""Numbers that are worked on at a time, roughly."""

APART = 64.0
"""A corner that is nearer to an end of an edge, in units of the reach, does not cut it."""

MAX_SLACK = 1e-6
"""Largest difference of parameters that are taken for one."""


@dataclass(frozen=True, eq=False, slots=True)
class Cuts:
    """Where sides of patches must be cut: all of shape (K,).

    `patch`, `side` (`service.surface.sides`); `at`, strictly between 0 and 1, along the side;
    `slack`, within which another parameter of the patch is the same.
    """

    patch: Ints
    side: Ints
    at: FloatArray
    slack: FloatArray

    @property
    def nbytes(self) -> int:
        """Bytes held, a key among them."""
        return 256 + 32 * len(self.at)


@dataclass(frozen=True, eq=False, slots=True)
class _Open:
    """The open edges that are lines, E of them: sides (patch · 4 + side) and corners, (E,)."""

    curves: tuple[EdgeCurves, ...]
    row: Ints
    side: Ints
    begin: Ints
    end: Ints
    corners: FloatArray


_NONE: Ints = np.empty(0, np.intp)
NOWHERE = Cuts(_NONE, _NONE, np.empty(0), np.empty(0))
"""No cuts."""

KNOWN: Cache[Cuts] = Cache(1 << 20)
"""The cuts of open edges that were seen before."""


def find_cuts(seams: Seams, reach: float) -> Cuts:
    """Where open edges must be cut to be one with others, found once for the same open edges.

    Parameters
    ----------
    reach : float
        Points at most this far apart are one, in model units.
    """
    known, arrays = seams.connectivity, []
    if known.open_count < 3:
        return NOWHERE
    for group in seams.curves:
        rows = known.open_lines[group.ids].nonzero()[0]
        arrays += [group.points.take(rows, axis=0)]
        arrays += [] if group.weights is None else [group.weights.take(rows, axis=0)]
    key = ("cuts", known.key, reach, hash_arrays(*arrays))
    return KNOWN.get(key, lambda: _cuts(seams, reach))


def _cuts(seams: Seams, reach: float) -> Cuts:
    found = _open_edges(seams)
    edge, corner = _corners_in_boxes(found, reach)
    if not len(edge) or len(edge) > MAX_PAIRS:
        return NOWHERE
    checkpoint()
    at, slack, lies = _places(found, edge, found.corners[corner], reach)
    edge, corner, at, slack = edge[lies], corner[lies], at[lies], slack[lies]
    if not len(edge):
        return NOWHERE
    order = np.lexsort((at, edge))
    edge, corner, at, slack = edge[order], corner[order], at[order], slack[order]
    kept = _beside_shared(found, edge, corner, at, reach)
    side = found.side[edge[kept]]
    turned = seams.backward.ravel()[side]
    at = np.where(turned, 1 - at[kept], at[kept])
    return Cuts(side // 4, side % 4, at, slack[kept])


def _open_edges(seams: Seams) -> _Open:
    known = seams.connectivity
    lines = np.flatnonzero(known.open_lines[known.edge.ravel()] & ~known.collapsed.ravel())
    edge = known.edge.ravel()[lines]
    row = np.full(len(known.users), -1)
    row[edge] = np.arange(len(edge))
    ends = [known.corner[:, which].ravel()[lines] for which in (BEGINS, ENDS)]
    against = known.backward.ravel()[lines]
    begin, end = np.where(against, ends[1], ends[0]), np.where(against, ends[0], ends[1])
    return _Open(seams.curves, row, lines, begin, end, seams.corner_points)


@dataclass(frozen=True, eq=False, slots=True)
class OpenBorder:
    """The open edges of a model, K of them.

    `curves`, numbered from 0; `begin` and `end` (K,), where each edge has its ends among the
    `corners` (C, 3).
    """

    curves: tuple[EdgeCurves, ...]
    begin: Ints
    end: Ints
    corners: FloatArray

    def moved(self, place: Callable[[FloatArray], FloatArray]) -> "OpenBorder":
        """The border with its points (N, 3) at other places."""
        # No zero is negative: equal points have equal bits.
        curves = (
            replace(c, points=(place(c.points.reshape(-1, 3)) + 0.0).reshape(c.points.shape))
            for c in self.curves
        )
        return replace(self, curves=tuple(curves), corners=place(self.corners) + 0.0)


def open_border(seams: Seams) -> OpenBorder:
    """The open edges of a model."""
    found = _open_edges(seams)
    curves = (
        EdgeCurves(number, g.points[rows], None if g.weights is None else g.weights[rows])
        for g, rows, number in _groups(found)
    )
    used, ends = np.unique(np.concatenate([found.begin, found.end]), return_inverse=True)
    begin, end = ends.reshape(2, -1)
    return OpenBorder(tuple(curves), begin, end, found.corners[used])


def corners_on_edges(borders: Sequence[OpenBorder], reach: float) -> Ints:
    """Pairs (n, 2) of borders, the first with an edge on which the second has a corner.

    None of them if there were too many to be looked at.
    """
    edges = np.cumsum([0, *(len(border.begin) for border in borders)])
    corners = np.cumsum([0, *(len(border.corners) for border in borders)])
    forms: dict[tuple[int, bool], list[EdgeCurves]] = {}
    begin, end = [], []
    for border, first, before in zip(borders, edges, corners, strict=False):
        begin.append(border.begin + before)
        end.append(border.end + before)
        for curve in border.curves:
            form = curve.points.shape[1], curve.weights is None
            forms.setdefault(form, []).append(replace(curve, ids=curve.ids + first))
    number = np.arange(edges[-1])
    found = _Open(
        tuple(_together(some) for some in forms.values()),
        *(number, number, np.concatenate(begin), np.concatenate(end)),
        np.concatenate([border.corners for border in borders]),
    )
    edge, corner = _corners_in_boxes(found, reach)
    owners = [np.searchsorted(edges, edge, side="right") - 1]
    owners.append(np.searchsorted(corners, corner, side="right") - 1)
    pairs: Ints = np.stack(owners, axis=1)
    apart = owners[0] != owners[1]
    edge, corner, pairs = edge[apart], corner[apart], pairs[apart]
    if not 0 < len(edge) <= MAX_PAIRS:
        return pairs[:0]
    _, _, lies = _places(found, edge, found.corners[corner], reach)
    pairs = pairs[lies]
    return pairs


def _together(curves: Sequence[EdgeCurves]) -> EdgeCurves:
    """Curves of one form as one."""
    weights = [curve.weights for curve in curves if curve.weights is not None]
    return EdgeCurves(
        np.concatenate([curve.ids for curve in curves]),
        np.concatenate([curve.points for curve in curves]),
        np.concatenate(weights) if weights else None,
    )


def _groups(found: _Open) -> Iterator[tuple[EdgeCurves, Ints, Ints]]:
    """Curves of one degree, the rows of them that are open, and their numbers among these."""
    for group in found.curves:
        number = found.row[group.ids]
        rows = np.flatnonzero(number >= 0)
        if len(rows):
            yield group, rows, number[rows]


def _corners_in_boxes(found: _Open, reach: float) -> tuple[Ints, Ints]:
    """Pairs of an open edge and of a corner of others that is between the bounds of its net."""
    count = len(found.side)
    low, high = np.empty((count, len(DIRECTIONS))), np.empty((count, len(DIRECTIONS)))
    for group, rows, number in _groups(found):
        along = group.points[rows] @ DIRECTIONS.T
        low[number], high[number] = along.min(axis=1), along.max(axis=1)
    margin = 2 * reach + 2.0**-48 * float(np.abs(low).max() + np.abs(high).max())
    low -= margin
    high += margin
    corners = np.unique(np.concatenate([found.begin, found.end]))
    along = found.corners[corners] @ DIRECTIONS.T
    if count * len(corners) <= FEW_PAIRS:
        inside = ((along >= low[:, None]) & (along <= high[:, None])).all(axis=2)
        inside &= (corners != found.begin[:, None]) & (corners != found.end[:, None])
        edge, place = inside.nonzero()
        return edge, corners[place]
    axis = int(np.ptp(along[:, :3], axis=0).argmax())
    order = np.argsort(along[:, axis], kind="stable")
    corners, along = corners[order], along[order]
    first = np.searchsorted(along[:, axis], low[:, axis])
    last = np.searchsorted(along[:, axis], high[:, axis], side="right")
    if (last - first).sum() > 16 * MAX_PAIRS:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    pairs = []
    for some in _runs(last - first, CHUNK):
        counts = (last - first)[some]
        edge = np.repeat(np.arange(some.start, some.stop), counts)
        place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        place += np.repeat(first[some], counts)
        inside = (corners[place] != found.begin[edge]) & (corners[place] != found.end[edge])
        for k in range(len(DIRECTIONS)):
            edge, place = edge[inside], place[inside]
            inside = (along[place, k] >= low[edge, k]) & (along[place, k] <= high[edge, k])
        pairs.append((edge[inside], corners[place[inside]]))
        checkpoint()
    return np.concatenate([e for e, _ in pairs]), np.concatenate([c for _, c in pairs])


def _runs(counts: Ints, most: int) -> Iterator[slice]:
    """Slices of items of which each has so many: together about `most`."""
    group = np.cumsum(counts) // most
    starts = run_starts(group)
    for start, stop in zip(starts.tolist(), [*starts[1:].tolist(), len(counts)], strict=True):
        yield slice(start, stop)


def _places(
    found: _Open, edge: Ints, points: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray, Bools]:
    """Parameters on edges that are nearest to points (K, 3), their slack, and which are on it."""
    at, slack = np.zeros(len(edge)), np.zeros(len(edge))
    lies = np.zeros(len(edge), dtype=bool)
    for group, rows, number in _groups(found):
        of = np.full(len(found.side), -1)
        of[number] = rows
        mine = np.flatnonzero(of[edge] >= 0)
        degree = group.points.shape[1] - 1
        samples = np.linspace(0, 1, 8 * degree + 1)
        for part in row_slices(len(mine), 3 * len(samples), CHUNK):
            here = mine[part]
            own, target = of[edge[here]], points[here]
            nets = group.points[own] - target[:, None]
            weights = None if group.weights is None else group.weights[own]
            away = np.square(_at(nets, weights, samples)).sum(axis=2)
            if weights is None:
                # Half a step from a sample the curve is at most this far away from it.
                speed = degree * np.sqrt(np.square(np.diff(nets, axis=1)).sum(axis=2).max(axis=1))
                close = np.sqrt(away.min(axis=1)) <= speed * (samples[1] / 2) + reach
                here, nets, away = here[close], nets[close], away[close]
                if not len(here):
                    continue
            t = samples[away.argmin(axis=1)]
            for _ in range(STEPS):
                value, slope = _with_slope(nets, weights, t)
                square = np.square(slope).sum(axis=1)
                step = (value * slope).sum(axis=1) / np.where(square > 0, square, 1.0)
                t = (t - step).clip(0, 1)
            value, slope = _with_slope(nets, weights, t)
            near = np.square(value).sum(axis=1) <= reach**2
            ends = np.minimum(np.square(nets[:, 0]).sum(axis=1), np.square(nets[:, -1]).sum(axis=1))
            at[here], lies[here] = t, near & (ends > (APART * reach) ** 2) & (t > 0) & (t < 1)
            speed = np.sqrt(np.square(slope).sum(axis=1))
            slack[here] = np.minimum(4 * reach / np.maximum(speed, reach), MAX_SLACK)
    return at, slack, lies


def _beside_shared(found: _Open, edge: Ints, corner: Ints, at: FloatArray, reach: float) -> Bools:
    """Which cuts (K,) of edges, in order, have a piece beside them that two edges have."""
    cut = np.concatenate([edge, np.arange(len(found.side))])
    order = np.lexsort((np.concatenate([at, np.zeros(len(found.side))]), cut))
    owner = cut[order]
    # Every cut, and every beginning of an edge, begins a piece.
    start = np.concatenate([at, np.zeros(len(found.side))])[order]
    begin = np.concatenate([corner, found.begin])[order]
    ends = np.append(owner[1:] != owner[:-1], True)
    stop = np.where(ends, 1.0, np.roll(start, -1))
    end = np.where(ends, found.end[owner], np.roll(begin, -1))
    degree = max(group.points.shape[1] - 1 for group, _, _ in _groups(found))
    shares = np.arange(1, 2 * degree + 2) / (2 * degree + 2)
    back = begin > end
    places = np.where(
        back[:, None],
        stop[:, None] + (start - stop)[:, None] * shares,
        start[:, None] + (stop - start)[:, None] * shares,
    )
    values = np.empty((len(owner), len(shares), 3))
    for group, rows, number in _groups(found):
        of = np.full(len(found.side), -1)
        of[number] = rows
        mine = np.flatnonzero(of[owner] >= 0)
        for part in row_slices(len(mine), 4 * len(shares) * (degree + 1), CHUNK):
            here = mine[part]
            own = of[owner[here]]
            weights = None if group.weights is None else group.weights[own]
            values[here] = _at(group.points[own], weights, places[here])
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    _, first, pair = np.unique(
        low * len(found.corners) + high, return_index=True, return_inverse=True
    )
    far = reach * len(shares) ** 0.5
    leader = leaders(first[pair.ravel()], values.reshape(len(owner), -1), far)
    shared = np.bincount(leader, minlength=len(leader))[leader] > 1
    # Pieces before and after a cut.
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    mine = place[: len(edge)]
    kept: Bools = shared[mine] | shared[mine - 1]
    return kept


def _at(nets: FloatArray, weights: FloatArray | None, places: FloatArray) -> FloatArray:
    """Points (m, K, 3) of curves (m, n+1, 3) at parameters (K,), or (m, K) for each its own."""
    degree = nets.shape[1] - 1
    basis = bernstein(degree, places.ravel()).reshape(*places.shape, degree + 1)
    if weights is None:
        value: FloatArray = basis @ nets
        return value
    shares = basis * weights[:, None]
    value = shares @ nets
    value /= shares.sum(axis=2, keepdims=True)
    return value


def _with_slope(
    nets: FloatArray, weights: FloatArray | None, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points and derivatives of curves (m, n+1, 3), each at its own parameter (m,): (m, 3)."""
    degree = nets.shape[1] - 1
    basis, below = bernstein(degree, t)[:, None], bernstein(degree - 1, t)[:, None]
    if weights is None:
        return (basis @ nets)[:, 0], degree * (below @ np.diff(nets, axis=1))[:, 0]
    heavy = nets * weights[..., None]
    total, change = (basis @ weights[..., None])[:, 0], degree * np.diff(weights, axis=1)
    value = (basis @ heavy)[:, 0] / total
    slope = degree * (below @ np.diff(heavy, axis=1))[:, 0]
    return value, (slope - (below @ change[..., None])[:, 0] * value) / total
