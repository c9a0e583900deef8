"""The frames of a divided path: rings at the ends of cells, and what corners need.

Where the direction turns between two pieces, the frames are those of a corner:

- up to 10⁻⁶ radians: one frame, perpendicular to the mean direction;
- up to 90°: a mitre, two frames in the plane that halves the corner. A sweep that is not ruled has
  its last ring before the mitre, perpendicular to its own direction, and its first after it;
- more: frames that turn about the corner in equal steps.
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.curves.arc_length import Speeds, arc_lengths
from service.engine.curves.evaluation import CurveSamples, evaluate_positions
from service.engine.round_sweeps.division import Leaves
from service.engine.round_sweeps.slants import find_slants
from service.engine.sweeps.paths import (
    MAX_MITRE_TURN,
    ROUND_STEP,
    Paths,
    find_mean_directions,
    interpolate_directions,
    measure_angles,
)
from service.engine.sweeps.sweep import evaluate_spread
from service.engine.vectors import dot
from service.surface.curve_model import CurvePieces, SweepModel, to_space

SMOOTH_TURN = 1e-6
"""A larger turn between two pieces, in radians, is a corner."""

BEFORE, MITRE_BEFORE, MITRE_AFTER, AFTER = range(4)
"""The frames of a mitred corner, in order."""


@dataclass(frozen=True, eq=False, slots=True)
class CellFrames:
    """The frames of one path, and the cells or turns between each and the next.

    Attributes
    ----------
    paths : Paths
    leaf : ndarray of int, shape (m−1,)
        The cell between each frame and the next, −1 if both are at one sample.
    turn : ndarray of float64, shape (m−1,)
        The angle between frames of a rounded corner; else 0.
    tilt : ndarray of float64, shape (m,)
        How far the direction of each frame is from that of the cells beside it: half of a turn that
        is no corner.
    sample : ndarray of int, shape (m,)
        The number of the cell that begins at each frame; the number of cells at the end.
    is_corner, is_after : ndarray of bool, shape (m,)
        Whether each frame is one of a corner, and has the direction after it.
    """

    paths: Paths
    leaf: Ints
    turn: FloatArray
    tilt: FloatArray
    sample: Ints
    is_corner: Bools
    is_after: Bools


def build_frames(
    model: SweepModel, leaves: Leaves, *, round_step: float = ROUND_STEP
) -> CellFrames:
    """The frames at the ends of all cells, and at corners.

    Parameters
    ----------
    model : SweepModel
    leaves : Leaves
        The cells of its path.
    round_step : float
        The largest turn between frames of a rounded corner, radians.
    """
    pieces, closed = model.pieces, model.closed
    samples = CurveSamples(np.append(leaves.piece, pieces.count - 1), np.append(leaves.first, 1.0))
    before, after, is_curved = _find_sides(leaves, closed=closed)
    turn = measure_angles(before, after)
    mean = find_mean_directions(before, after)
    is_smooth, is_mitred = turn <= SMOOTH_TURN, (turn > SMOOTH_TURN) & (turn <= MAX_MITRE_TURN)
    is_round = turn > MAX_MITRE_TURN
    steps = np.ceil(turn / min(round_step, ROUND_STEP)).astype(np.intp)
    counts = np.where(is_round, steps + 1, 1)
    counts[is_mitred] = 2 + is_curved[:, is_mitred].sum(axis=0)
    # The number of the first frame of each mitre that is there.
    first = np.where(is_mitred & ~is_curved[0], MITRE_BEFORE, BEFORE)
    if closed:
        # Of the corner at the ends, frames before are at the end, frames after at the begin.
        counts[0], counts[-1] = (
            (1 + is_curved[1, 0], 1 + is_curved[0, -1]) if is_mitred[0] else (1, counts[-1])
        )
        if is_mitred[0]:
            first[0] = MITRE_AFTER
    sample, number = expand_runs(counts)
    role = np.where(is_mitred[sample], first[sample] + number, -1)
    fraction = np.where(is_round[sample], number / np.maximum(counts - 1, 1)[sample], 0.0)
    if closed and is_round[0]:
        fraction[0] = 1.0  # the first frame has the direction after the corner
    is_after = (role >= MITRE_AFTER) | (is_round[sample] & (fraction == 1.0))
    directions = interpolate_directions(before[sample], after[sample], turn[sample], fraction)
    directions[role >= MITRE_AFTER] = after[sample[role >= MITRE_AFTER]]
    directions[is_smooth[sample]] = mean[sample[is_smooth[sample]]]
    in_plane = (role == MITRE_BEFORE) | (role == MITRE_AFTER)
    planes = np.where(in_plane[:, None], mean[sample], directions)
    lengths, parameters = arc_lengths(pieces, samples), samples.parameters(pieces.breaks)
    is_before = ~is_after & ~is_smooth[sample] & (sample > 0)
    paths = Paths(
        points=to_space(evaluate_positions(pieces, samples))[np.newaxis, sample],
        tangents=directions[np.newaxis],
        fractions=(lengths / lengths[-1])[np.newaxis, sample],
        closed=closed,
        parameters=((parameters - parameters[0]) / (parameters[-1] - parameters[0]))[sample],
        is_mitred=(role == MITRE_AFTER) & (np.arange(len(role)) > 0),
        mitres=planes[np.newaxis] if in_plane.any() else None,
        speeds=_find_speeds(pieces, samples, sample, is_before)[np.newaxis],
    )
    is_same = sample[1:] == sample[:-1]
    return CellFrames(
        _divide_ruled(paths, leaves, sample, model.profile.spread),
        leaf=np.where(is_same, -1, sample[:-1]),
        turn=np.where(is_same & is_round[sample[1:]], np.diff(fraction) * turn[sample[1:]], 0.0),
        tilt=np.where(is_smooth, turn / 2, 0.0)[sample],
        sample=sample,
        is_corner=~is_smooth[sample],
        is_after=is_after,
    )


def bound_row_count(leaves: Leaves, *, closed: bool, round_step: float) -> int:
    """An upper bound of the number of frames."""
    before, after, _ = _find_sides(leaves, closed=closed)
    turn = measure_angles(before, after)
    step = min(round_step, ROUND_STEP)
    extra = np.where(turn > MAX_MITRE_TURN, np.ceil(turn / step), 3 * (turn > SMOOTH_TURN))
    return len(turn) + int(extra.sum())


def find_round_step(tolerance: float, radius: float, angle: float) -> float:
    """The largest turn of frames at a rounded corner: r τ² / 8 is within the tolerance."""
    if not radius:
        return ROUND_STEP
    step = min(ROUND_STEP, angle, float(np.sqrt(8 * tolerance / radius)))
    return ROUND_STEP / ceil(ROUND_STEP / max(step, 1e-9))


def _find_sides(leaves: Leaves, *, closed: bool) -> tuple[FloatArray, FloatArray, Bools]:
    """Unit tangents before and after each sample, (M+1, 3), and whether the sweeps there curve.

    The last has the shape (2, M+1).
    """
    begin, end = leaves.bends.begin.T, leaves.bends.end.T
    if closed:
        before, after = np.vstack([end[-1:], end]), np.vstack([begin, begin[:1]])
    else:
        before, after = np.vstack([begin[:1], end]), np.vstack([begin, end[-1:]])
    curved = ~leaves.is_ruled
    is_curved = np.array([np.append(curved[-1], curved), np.append(curved, curved[0])])
    return before, after, is_curved


def _find_speeds(
    pieces: CurvePieces, samples: CurveSamples, sample: Ints, is_before: Bools
) -> FloatArray:
    """Derivatives of the length by the parameter of the domain, from 0 to 1, at each frame (m,)."""
    is_joint = (samples.t == 0.0) & (samples.piece > 0)
    piece = samples.piece[sample] - (is_joint[sample] & is_before)
    t = np.where(is_joint[sample] & is_before, 1.0, samples.t[sample])
    widths = np.diff(pieces.breaks) / (pieces.breaks[-1] - pieces.breaks[0])
    speeds: FloatArray = Speeds(pieces).evaluate(piece, t[:, None])[:, 0] / widths[piece]
    return speeds


def _divide_ruled(paths: Paths, leaves: Leaves, sample: Ints, spread: FloatArray) -> Paths:
    """The paths, with planes inside ruled pieces that divide all lines of the sweep alike.

    A ring in the plane with the normal M has the points r (e − (e · g) T), with g = M/(T · M) − T.
    Between rings at both ends of a piece r g is linear.
    """
    is_inside = np.append(False, leaves.piece[1:] == leaves.piece[:-1]) & leaves.is_ruled
    is_inner = np.append(is_inside, False)[sample]  # the last sample is an end
    rows = np.flatnonzero(is_inner)
    if paths.mitres is None or not len(rows):
        return paths
    tangents, mitres, points = paths.tangents[0], paths.mitres[0].copy(), paths.points[0]
    radii = evaluate_spread(spread, paths.parameters)[:, None]
    slides = radii * find_slants(paths)
    # The last frame before each inner frame, and the first after it, that are not inside.
    numbers = np.arange(len(sample))
    low = np.maximum.accumulate(np.where(is_inner, 0, numbers))[rows]
    high = np.minimum.accumulate(np.where(is_inner, len(sample), numbers)[::-1])[::-1][rows]
    chord = points[high] - points[low]
    share = (dot(points[rows] - points[low], chord, -1) / dot(chord, chord, -1))[:, None]
    slide = (1 - share) * slides[low] + share * slides[high]
    mitres[rows] = tangents[rows] + slide / np.where(radii[rows] > 0, radii[rows], 1.0)
    return replace(paths, mitres=mitres[np.newaxis])
