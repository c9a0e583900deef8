"""Joins isoparametric curves to the paths of tubes and ribbons.

If exactly two curves end in the same point, bit for bit, and this point is not a corner of a patch,
they are joined. A curve that ends at its first point is closed. At a corner of patches more curves
may meet; there, two curves are joined if they run straight through the corner. A bend of up to 90°
is mitred: it has one frame for each direction, and both frames are in the plane that halves the
bend. At a sharper bend both curves end.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import unique_rows
from service.engine.clustering import find_leaders
from service.engine.points.jets import evaluate_jets
from service.engine.sweeps.frames import fill_gaps
from service.engine.sweeps.paths import Paths
from service.engine.vectors import dot, normalize
from service.engine.wires.isocurves import IsoCurves
from service.surface.lowered import PatchModel

MIN_MITRE_LENGTH = 2.0**-0.5
"""Length of the mean of two unit vectors at an angle of 90°."""

MIN_DERIVATIVE = 1e-9
"""A derivative that is at most this, in units of the largest derivative along the curve, has no
reliable direction."""


@dataclass(frozen=True, eq=False, slots=True)
class WirePaths:
    """Paths, and the unit normals of the surface at their frames, (K, m, 3)."""

    paths: Paths
    normals: FloatArray

    def lift(self, distance: float) -> Paths:
        """The paths at this distance above the surface."""
        return replace(self.paths, points=self.paths.points + distance * self.normals)


@dataclass(frozen=True, eq=False, slots=True)
class _Curve:
    """Samples of one curve, its unit tangents and the surface's unit normals, (m, 3) each."""

    points: FloatArray
    tangents: FloatArray
    normals: FloatArray

    def reverse(self) -> "_Curve":
        """The curve from its end to its beginning."""
        return _Curve(self.points[::-1], -self.tangents[::-1], self.normals[::-1])


def build_wire_paths(
    model: PatchModel, runs: Sequence[IsoCurves], crease_angle: float
) -> Iterator[WirePaths]:
    """Join all curves to paths; paths with the same pattern of frames are yielded together."""
    curves = [curve for run in runs for curve in _build_curves(model, run)]
    groups: dict[tuple[bool, bytes], list[tuple[_Curve, FloatArray, Bools]]] = {}
    for chain, closed in _find_chains(curves, _find_joints(model, curves, crease_angle)):
        curve, tangents_before, is_bend = _join_chain(chain, closed, crease_angle)
        groups.setdefault((closed, is_bend.tobytes()), []).append((curve, tangents_before, is_bend))
    for (closed, _), members in groups.items():
        yield _build_paths(members, closed)


def _build_curves(model: PatchModel, run: IsoCurves) -> Iterator[_Curve]:
    """The curves of a run with their tangents and normals."""
    count, samples, _ = run.points.shape
    along = np.arange(samples)[:, None] / (samples - 1)
    parameters = (1 - along) * run.first[:, None] + along * run.last[:, None]
    directions = run.last - run.first  # of the curves, in the parameters
    slopes, normals = np.empty(run.points.shape), np.empty(run.points.shape)
    first = 0
    for batch in model.batches:
        rows = np.flatnonzero((run.patch >= first) & (run.patch < first + batch.count))
        if len(rows):
            index = np.repeat(run.patch[rows] - first, samples)
            u, v = parameters[rows].reshape(-1, 2).T
            jets = evaluate_jets(batch, index, u, v, 1)
            steps = np.repeat(directions[rows], samples, axis=0)
            # S_u du + S_v dv
            slope = jets.partials[1] * steps[:, :1] + jets.partials[2] * steps[:, 1:]
            slopes[rows] = slope.reshape(len(rows), samples, 3)
            if jets.normals is not None:
                normals[rows] = jets.normals.reshape(len(rows), samples, 3)
        first += batch.count
    tangents = _unit(slopes, run.points)
    return (_Curve(run.points[k], tangents[k], normals[k]) for k in range(count))


def _unit(slopes: FloatArray, points: FloatArray) -> FloatArray:
    """Unit tangents from derivatives; where a derivative vanishes, the direction of a chord."""
    chords = np.empty_like(points)
    chords[:, 1:-1] = points[:, 2:] - points[:, :-2]
    chords[:, 0], chords[:, -1] = points[:, 1] - points[:, 0], points[:, -1] - points[:, -2]
    size = np.abs(slopes).max(axis=2)
    is_slow = size <= MIN_DERIVATIVE * size.max(axis=1, keepdims=True)
    vectors = np.where(is_slow[:, :, None], chords, slopes)
    size = np.abs(vectors).max(axis=2)
    # If points repeat, too, the last direction before is taken, or the first after.
    vectors = fill_gaps(vectors, size > 0)
    return normalize(vectors / np.abs(vectors).max(axis=2, keepdims=True), -1)


def _find_joints(model: PatchModel, curves: Sequence[_Curve], crease_angle: float) -> Ints:
    """For each end of a curve, the end with which it is joined, or −1.

    The ends of curve k are 2 k and 2 k + 1.
    """
    ends = np.array([curve.points[end] for curve in curves for end in (0, -1)]).reshape(-1, 3)
    corners = np.concatenate([batch.corners.reshape(-1, 3) for batch in model.batches])
    # Equal points get one number. Adding 0.0 makes 0 of −0.
    _, number = unique_rows(np.concatenate([ends, corners]) + 0.0)
    is_at_corner = np.zeros(number.max() + 1, dtype=bool)
    is_at_corner[number[len(ends) :]] = True
    number = number[: len(ends)]
    ends_outside_corners = np.flatnonzero(~is_at_corner[number])
    ends_at_corners = np.flatnonzero(is_at_corner[number])
    tangents = [t for curve in curves for t in (curve.tangents[0], -curve.tangents[-1])]
    continuations = _find_continuations(
        number[ends_at_corners], np.array(tangents).reshape(-1, 3)[ends_at_corners], crease_angle
    )
    joined_end = np.full(len(ends), -1, dtype=np.intp)
    for pairs in (
        ends_outside_corners[_find_pairs(number[ends_outside_corners])],
        ends_at_corners[continuations],
    ):
        joined_end[pairs[:, 0]], joined_end[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    # A curve that ends at its first point is closed, even if other curves end there.
    begins_of_closed = 2 * np.flatnonzero(number[::2] == number[1::2])
    partners = joined_end[np.concatenate([begins_of_closed, begins_of_closed + 1])]
    joined_end[partners[partners >= 0]] = -1
    joined_end[begins_of_closed], joined_end[begins_of_closed + 1] = (
        begins_of_closed + 1,
        begins_of_closed,
    )
    return joined_end


def _find_pairs(number: Ints) -> Ints:
    """Pairs (n, 2) of rows that have the same number, which no third row has."""
    _, row_number, use_counts = np.unique(number, return_inverse=True, return_counts=True)
    order = np.argsort(row_number, kind="stable")
    pairs: Ints = order[use_counts[row_number[order]] == 2].reshape(-1, 2)
    return pairs


def _find_continuations(number: Ints, outwards: FloatArray, angle: float) -> Ints:
    """Pairs (n, 2) of ends that meet in one point and run straight through it.

    `number` has the number of the point of each end, and `outwards` the unit tangent of its curve,
    away from the point. The matrix d dᵀ represents the line along d, in both directions; for two
    lines at a small angle, the distance of their matrices is √2 times the angle.
    """
    lines = (outwards[:, :, None] * outwards[:, None]).reshape(-1, 9)
    _, first, row_number = np.unique(number, return_index=True, return_inverse=True)
    # Ends at one point and on nearly one line get one number, that of their leader.
    pairs = _find_pairs(find_leaders(first[row_number], lines, 2.0**0.5 * angle))
    first_tangents, second_tangents = outwards[pairs[:, 0]], outwards[pairs[:, 1]]
    return pairs[dot(first_tangents, second_tangents, -1) < 0]


def _find_chains(curves: Sequence[_Curve], joined_end: Ints) -> Iterator[tuple[list[_Curve], bool]]:
    """The chains of joined curves, with every curve once; and whether each chain is closed."""
    joined_ends = joined_end.tolist()
    is_waiting = [True] * len(curves)
    # Open chains begin at an end; the remaining chains are closed.
    ends = [end for end in range(len(joined_ends)) if joined_ends[end] < 0]
    for begin in (*ends, *range(0, len(joined_ends), 2)):
        if not is_waiting[begin // 2]:
            continue
        chain, end = [], begin
        while end >= 0 and is_waiting[end // 2]:
            is_waiting[end // 2] = False
            curve = curves[end // 2]
            chain.append(curve.reverse() if end % 2 else curve)
            end = joined_ends[end ^ 1]  # from the other end of this curve
        yield from _split_at_bends(chain, closed=end == begin)


def _split_at_bends(chain: list[_Curve], *, closed: bool) -> Iterator[tuple[list[_Curve], bool]]:
    """The pieces of the chain between sharp bends."""
    breaks = [
        k
        for k in range(0 if closed else 1, len(chain))
        if _mean_length(chain[k - 1].tangents[-1], chain[k].tangents[0]) < MIN_MITRE_LENGTH
    ]
    if not breaks:
        yield chain, closed
        return
    if closed:
        chain = chain[breaks[0] :] + chain[: breaks[0]]
        breaks = [k - breaks[0] for k in breaks[1:]]
    for first, last in zip([0, *breaks], [*breaks, len(chain)], strict=True):
        yield chain[first:last], False


def _mean_length(a: FloatArray, b: FloatArray) -> float:
    """The length of the mean of two unit vectors: 1 if they are equal, less at a bend."""
    return float(np.sqrt(np.square((a + b) / 2).sum()))


def _join_chain(
    chain: list[_Curve], closed: bool, crease_angle: float
) -> tuple[_Curve, FloatArray, Bools]:
    """One curve of a chain, its tangents before each sample, and which samples are bends."""
    # The first sample of each later curve is the last of the curve before, and is omitted.
    tangents_after = np.concatenate([curve.tangents[bool(k) :] for k, curve in enumerate(chain)])
    tangents_before = tangents_after.copy()
    joints = np.cumsum([len(curve.tangents) - 1 for curve in chain])
    for joint, next_curve in zip(joints[:-1], chain[1:], strict=True):
        tangents_after[joint] = next_curve.tangents[0]
    if closed:
        tangents_after[-1] = tangents_after[0]
        tangents_before[0] = tangents_before[-1]
    chain_curve = _Curve(
        np.concatenate([curve.points[bool(k) :] for k, curve in enumerate(chain)]),
        tangents_after,
        np.concatenate([curve.normals[bool(k) :] for k, curve in enumerate(chain)]),
    )
    is_bend = (
        np.square((tangents_before + tangents_after) / 2).sum(axis=1)
        < np.cos(max(crease_angle, 1e-6) / 2) ** 2
    )
    return chain_curve, tangents_before, is_bend


def _build_paths(members: list[tuple[_Curve, FloatArray, Bools]], closed: bool) -> WirePaths:
    """Paths with one pattern of frames: one at every sample, two at every bend."""
    points = np.stack([curve.points for curve, _, _ in members])
    tangents_after = np.stack([curve.tangents for curve, _, _ in members])
    normals = np.stack([curve.normals for curve, _, _ in members])
    tangents_before = np.stack([tangents for _, tangents, _ in members])
    is_bend = members[0][2]
    plane_normals = tangents_before + tangents_after
    plane_normals /= np.sqrt(np.square(plane_normals).sum(axis=2, keepdims=True))
    has_two_frames = is_bend.copy()
    if closed:
        # The first and the last frame are at one point: together they are the two of a bend.
        has_two_frames[[0, -1]] = False
    sample = np.repeat(np.arange(len(is_bend)), 1 + has_two_frames)
    is_second = np.zeros(len(sample), dtype=bool)
    is_second[1:] = sample[1:] == sample[:-1]
    # Also the first frame: where a closed curve bends at its ends, it is the second of the two.
    is_after_bend = is_second.copy()
    is_after_bend[0] = True
    tangents = np.where(
        is_after_bend[:, None], tangents_after[:, sample], tangents_before[:, sample]
    )
    tangents = np.where(is_bend[sample, None], tangents, plane_normals[:, sample])
    smooth_paths = Paths.from_smooth_curves(points[:, sample], tangents, closed=closed)
    mitres = plane_normals[:, sample] if is_bend.any() else None
    paths = replace(smooth_paths, mitres=mitres, is_mitred=is_second)
    return WirePaths(paths, normals[:, sample])
