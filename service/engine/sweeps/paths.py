"""Paths of sweeps: the frames of curves, their directions, and mitred or rounded corners.

A frame is a place on a curve where a tube has a ring, or a ribbon has a crossbar (the line across
it). A smooth curve has a frame at every sample. A corner, where the tangent turns by more than
the crease angle or more than 22.5°, has two frames, one for each direction. Up to a turn of 90° a
corner is *mitred*: both frames are in the plane that halves the corner, with equal points and
without faces between them. A sharper corner, or a cusp, is *rounded*: more frames between the two
turn from one direction to the other in steps of at most 22.5°.
"""

from dataclasses import dataclass
from math import ceil, pi, radians

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.curves.arc_length import Speeds, arc_lengths
from service.engine.curves.evaluation import CurveSamples, evaluate_positions, evaluate_tangents
from service.engine.sweeps.frames import find_perpendicular
from service.engine.vectors import dot, length
from service.surface.curve_model import CurvePieces, to_space

MAX_MITRE_TURN = radians(90)
"""The largest turn at a mitred corner. In the plane of the corner a tube is 1 / cos(half the turn)
times as wide as elsewhere: at this turn 1.41 times."""

ROUND_STEP = radians(22.5)
"""The largest turn from one frame to the next at a rounded corner."""


@dataclass(frozen=True, eq=False)
class Paths:
    """K curves of m frames each.

    Attributes
    ----------
    points, tangents : ndarray of float64, shape (K, m, 3)
        The last frame of a closed curve has the point of the first frame.
    fractions : ndarray of float64, shape (K, m)
        The length of the curve up to each frame, divided by the whole length: 0 to 1.
    closed : bool
        Whether the curves are closed.
    parameters : ndarray of float64, shape (m,)
        The parameters of the frames in the functions of radii and widths, 0 to 1.
    is_mitred : ndarray of bool, shape (m,)
        Whether each frame is the second frame of a mitred corner: it has the point of the
        frame before, without faces between them.
    mitres : ndarray of float64, shape (K, m, 3), or None
        The unit normals of the planes of the frames; None if the tangents are these normals.
    speeds : ndarray of float64, shape (K, m), or None
        The derivatives of the length by the parameters.
    """

    points: FloatArray
    tangents: FloatArray
    fractions: FloatArray
    closed: bool
    parameters: FloatArray
    is_mitred: Bools
    mitres: FloatArray | None = None
    speeds: FloatArray | None = None

    @staticmethod
    def from_smooth_curves(
        points: FloatArray, tangents: FloatArray, *, closed: bool = False
    ) -> "Paths":
        """Smooth curves from their samples and unit tangents, (K, m, 3) each.

        Lengths are the lengths of the polylines. Points may repeat; if all steps of a curve are so
        short that their squares are 0, its frames count as evenly spaced.
        """
        steps = length(np.diff(points, axis=1), -1)
        lengths = np.cumsum(np.pad(steps, ((0, 0), (1, 0))), axis=1)
        even_fractions = np.linspace(0.0, 1.0, points.shape[1])
        total_length = lengths[:, -1:]
        fractions = np.where(
            total_length > 0,
            lengths / np.where(total_length > 0, total_length, 1.0),
            even_fractions,
        )
        is_mitred = np.zeros(points.shape[1], dtype=bool)
        return Paths(points, tangents, fractions, closed, even_fractions, is_mitred)


def build_path(
    pieces: CurvePieces, divisions: int, crease_angle: float, *, closed: bool | None = None
) -> Paths:
    """The frames of one curve at R divisions of every piece, with mitred or rounded corners.

    By default, a curve that ends at its first point is closed; `closed` overrides this. A piece
    that is a single point has all its frames there.
    """
    closed = pieces.closed if closed is None else closed
    samples = CurveSamples.uniform(pieces.count, divisions)
    samples_before = _move_joints_to_ends(samples)
    tangents_before, tangents_after = _directions(pieces, samples, samples_before, closed)
    turn = measure_angles(tangents_before, tangents_after)
    counts = _count_frames_at_samples(pieces, samples, turn, crease_angle)
    mean_tangents = find_mean_directions(tangents_before, tangents_after)
    has_mitre, is_smooth = counts == 2, counts == 1
    tangents_before[is_smooth] = tangents_after[is_smooth] = mean_tangents[is_smooth]
    if closed:
        # The first and the last sample are one corner. If it is mitred, its first frame is at the
        # end of the curve and its second at the beginning. If it is rounded, all of its frames
        # are at the end, and the last is repeated at the beginning.
        counts[0] = 1
        counts[-1] -= has_mitre[-1]
    lengths = arc_lengths(pieces, samples)
    parameters = samples.parameters(pieces.breaks)

    # For each frame: its sample, and its number among the frames of this sample.
    sample, number = expand_runs(counts)
    turned_fraction = number / np.maximum(counts - 1, 1)[sample]
    if closed:
        turned_fraction[0] = 1.0  # the first frame has the direction after the corner
    directions = interpolate_directions(
        tangents_before[sample], tangents_after[sample], turn[sample], turned_fraction
    )
    plane_normals = np.where(has_mitre[sample, None], mean_tangents[sample], directions)
    is_before_corner = (counts[sample] > 1) & (turned_fraction == 0)
    speeds = np.where(
        is_before_corner, _speeds(pieces, samples_before)[sample], _speeds(pieces, samples)[sample]
    )
    return Paths(
        points=_evaluate_points(pieces, samples)[np.newaxis, sample],
        tangents=directions[np.newaxis],
        fractions=(lengths / lengths[-1])[np.newaxis, sample],
        closed=closed,
        parameters=((parameters - parameters[0]) / (parameters[-1] - parameters[0]))[sample],
        mitres=plane_normals[np.newaxis] if has_mitre.any() else None,
        is_mitred=has_mitre[sample] & (number == 1),
        speeds=speeds[np.newaxis],
    )


def bound_frame_count(pieces: CurvePieces, divisions: int, crease_angle: float) -> int:
    """An upper bound of the number of frames.

    It is exact, unless a piece may have a cusp, or a closed curve has a corner at its ends.
    """
    joints = CurveSamples.uniform(pieces.count, 1)
    turn = measure_angles(*_directions(pieces, joints, _move_joints_to_ends(joints), pieces.closed))
    corners = int((_count_frames(turn, crease_angle) - 1).sum())
    cusps = int(np.minimum(_bound_cusps(pieces), divisions - 1).sum())
    return pieces.count * divisions + 1 + corners + cusps * ceil(pi / ROUND_STEP)


def _count_frames_at_samples(
    pieces: CurvePieces, samples: CurveSamples, turn: FloatArray, crease_angle: float
) -> Ints:
    """The number of frames at every sample.

    If a piece seems to have more corners than it can have cusps, these turns are the effect of
    rounding, and none of them counts as a corner.
    """
    counts = _count_frames(turn, crease_angle)
    has_corner = (counts > 1) & (samples.t > 0) & (samples.t < 1)
    corner_counts = np.bincount(samples.piece[has_corner], minlength=pieces.count)
    counts[has_corner & (corner_counts > _bound_cusps(pieces))[samples.piece]] = 1
    return counts


def _bound_cusps(pieces: CurvePieces) -> Ints:
    """Upper bounds of the number of cusps of each piece.

    A piece has no cusp if all steps of its control polygon have a positive component along the
    chord. This is true for rational pieces, too, because C′ is a sum of P_j − P_i with i < j, times
    positive functions.
    """
    steps = np.diff(pieces.points, axis=1)
    chord = pieces.points[:, -1] - pieces.points[:, 0]
    size = np.abs(steps).max(axis=(1, 2))
    unit = np.where(size > 0, size, 1.0)
    forwards = np.einsum("sid,sd->si", steps / unit[:, None, None], chord / unit[:, None])
    return np.where((size > 0) & (forwards.min(axis=1) <= 0), pieces.degree - 1, 0)


def _move_joints_to_ends(samples: CurveSamples) -> CurveSamples:
    """The samples, with joints of two pieces at t = 1 of the first, not at t = 0 of the second."""
    is_joint = (samples.t == 0.0) & (samples.piece > 0)
    return CurveSamples(samples.piece - is_joint, np.where(is_joint, 1.0, samples.t))


def _evaluate_points(pieces: CurvePieces, samples: CurveSamples) -> FloatArray:
    """Points (N, 3) of the curve; a piece that is a single point has exactly this point."""
    points = to_space(evaluate_positions(pieces, samples))
    is_single = pieces.is_single[samples.piece]
    points[is_single] = to_space(pieces.points[samples.piece[is_single], 0])
    return points


def _directions(
    pieces: CurvePieces, samples: CurveSamples, samples_before: CurveSamples, closed: bool
) -> tuple[FloatArray, FloatArray]:
    """Unit tangents of the curve before and after each sample."""
    tangents_after = to_space(evaluate_tangents(pieces, samples))
    tangents_before = to_space(evaluate_tangents(pieces, samples_before, before=True))
    if closed:
        # The corner between end and beginning belongs to both.
        tangents_after[-1], tangents_before[0] = tangents_after[0], tangents_before[-1]
    else:
        # The ends of an open curve are not corners.
        tangents_after[-1], tangents_before[0] = tangents_before[-1], tangents_after[0]
    return tangents_before, tangents_after


def _speeds(pieces: CurvePieces, samples: CurveSamples) -> FloatArray:
    """Derivative of the length by the parameter, which runs from 0 to 1 along the curve."""
    widths = np.diff(pieces.breaks) / (pieces.breaks[-1] - pieces.breaks[0])
    speeds: FloatArray = (
        Speeds(pieces).evaluate(samples.piece, samples.t[:, None])[:, 0] / widths[samples.piece]
    )
    return speeds


def measure_angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Angles between unit vectors (N, 3), precise near 0 and near π."""
    angle: FloatArray = 2 * np.arctan2(
        np.sqrt(np.square(a - b).sum(axis=1)), np.sqrt(np.square(a + b).sum(axis=1))
    )
    return angle


def find_mean_directions(a: FloatArray, b: FloatArray) -> FloatArray:
    """Unit vectors half way between a and b, (N, 3); b where they are opposite."""
    mean = a + b
    length = np.sqrt(np.square(mean).sum(axis=1))
    is_opposite = length < 1e-6
    mean[is_opposite], length[is_opposite] = b[is_opposite], 1.0
    mean /= length[:, None]
    return mean


def _count_frames(turn: FloatArray, crease_angle: float) -> Ints:
    """Numbers of frames at every sample: 1 on a smooth curve, 2 at a mitred corner, else more."""
    steps = np.ceil(turn / ROUND_STEP).astype(np.intp)
    corner_frames = np.where(turn <= MAX_MITRE_TURN, 2, steps + 1)
    # A turn below 1e-6 is rounding; a turn above `ROUND_STEP` is too large for one frame, even if
    # the crease angle is larger.
    max_smooth_turn = min(max(crease_angle, 1e-6), ROUND_STEP)
    return np.where(turn <= max_smooth_turn, 1, corner_frames)


def interpolate_directions(
    a: FloatArray, b: FloatArray, turn: FloatArray, fraction: FloatArray
) -> FloatArray:
    """Unit vectors at fractions of the arc from a to b, (N, 3); from a to −a it is a half circle.

    `turn` has the angles between a and b.
    """
    across = b - dot(a, b, -1)[:, None] * a
    length = np.sqrt(np.square(across).sum(axis=1))
    # The length is near 0 if a and b are equal, and if they are opposite: turns tell them apart.
    is_reversal = (length <= 1e-6) & (turn > 1)
    across[is_reversal], length[is_reversal] = find_perpendicular(a[is_reversal]), 1.0
    across /= np.where(length > 0, length, 1.0)[:, None]
    angle = (fraction * turn)[:, None]
    directions: FloatArray = np.cos(angle) * a + np.sin(angle) * across
    is_end = fraction == 1.0
    directions[is_end] = b[is_end]
    return directions
