"""The crossbars of ribbons at the frames of a divided path.

Where the path is smooth, both cells beside a frame have the same crossbar there. A cell on which
the path runs in the direction that the ribbon faces has the crossbar before it, or else the first
after it. At mitres, both pieces must have the same crossbar in the plane of the corner.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.round_sweeps.division import SMOOTHER, Leaves
from service.engine.round_sweeps.frames_of_cells import SMOOTH_TURN, CellFrames
from service.engine.round_sweeps.slants import find_slants
from service.engine.sweeps.frames import compute_frames, fill_gaps
from service.engine.sweeps.paths import find_mean_directions, measure_angles
from service.engine.vectors import dot, length
from service.errors import InvalidRequest, Issue


def choose_crossbars(frames: CellFrames, leaves: Leaves) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (m, 3) across the path at frames, and bounds (m,) of their errors.

    Raises
    ------
    InvalidRequest
        `sharp_path`: a ribbon has no bound at corners of other paths than straight lines, at
        corners sharper than 90°, at corners where its pieces have no common crossbar, and where its
        crossbar turns suddenly.
    """
    paths, crossbars = frames.paths, leaves.crossbars
    ends = np.stack([crossbars.begin.T, crossbars.end.T], axis=1).reshape(1, -1, 3)
    is_defined = (ends != 0).any(axis=2)
    if not is_defined.any():
        # A straight line in the facing direction: any crossbar is valid.
        normals = compute_frames(paths.points, paths.tangents, paths.fractions, closed=paths.closed)
        return normals[0], np.zeros(paths.points.shape[1])
    begin, end = np.moveaxis(fill_gaps(ends, is_defined)[0].reshape(-1, 2, 3), 1, 0)
    if paths.closed:
        before, after = np.vstack([end[-1:], end]), np.vstack([begin, begin[:1]])
    else:
        before, after = np.vstack([begin[:1], end]), np.vstack([begin, end[-1:]])
    before, after = before[frames.sample], after[frames.sample]
    is_smooth = ~frames.is_corner
    turn = np.where(is_smooth, measure_angles(before, after), 0.0)
    chosen = np.where(frames.is_after[:, None], after, before)
    chosen[is_smooth] = find_mean_directions(before, after)[is_smooth]
    # In the plane of a mitre, of the normal M, the crossbar s is s − (s · g) T.
    slants = find_slants(paths)
    bars = chosen - dot(chosen, slants, -1)[:, None] * paths.tangents[0]
    is_mitre = np.flatnonzero(paths.is_mitred)
    gap = np.zeros(len(turn))
    pairs = is_mitre - 1
    gap[is_mitre] = length(bars[is_mitre] - bars[pairs], -1)
    if paths.closed and frames.is_corner[0]:
        gap[0] = float(length(bars[0] - bars[-1], -1))
    has_strip = (frames.leaf < 0) & ~paths.is_mitred[1:]
    for is_wrong, message in (
        (has_strip.any(), "The curve has a corner that is not mitred between straight lines."),
        (turn.max() > SMOOTH_TURN, "The crossbar of the ribbon turns suddenly at a joint."),
        (gap.max() > SMOOTH_TURN, "The ribbon has two different crossbars at a corner."),
    ):
        if is_wrong:
            got = "such a corner of the curve of a ribbon"
            raise InvalidRequest(Issue("sharp_path", message, "/tolerance", got, SMOOTHER))
    return chosen, turn / 2 + gap
