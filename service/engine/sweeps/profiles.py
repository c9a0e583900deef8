"""Tubes and ribbons along curves, as grids of samples: rings or crossbars at every frame.

A tube of radius r about a curve C with a rotation-minimising frame n, b = n × C′/|C′|:

    S(u, φ) = C(u) + r(u) e(φ),  e = cos φ n + sin φ b,  φ from 0 to 2π

The normal du × dφ points outwards, in the direction e − r′/|C′| · C′/|C′|; it is tilted where the
radius changes. Where r times the curvature of C exceeds 1, the tube intersects itself on the inner
side of the bend, but it remains closed.

A ribbon of width w about C that faces a direction f:

    S(u, v) = C(u) + (v − ½) w(u) s(u),  s = f × C′ normalised,  v from 0 to 1

The vector s has the direction of the crossbar, the line across the ribbon. The normal of the ribbon
is the part of f that is perpendicular to the curve. Where C′ has the direction of f, s is not
defined; there the last crossbar before is repeated, or else the first crossbar after.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.options import Faces
from service.engine.sweeps.frames import compute_frames, fill_gaps
from service.engine.sweeps.paths import Paths
from service.engine.sweeps.rows import Rows, SweptGrids, join_rows
from service.engine.vectors import cross, dot, length, normalize

MIN_SINE = 1e-9
"""If the sine of the angle between the curve and the direction `facing` is at most this, the
crossbar is not defined."""

EQUAL_OFFSETS = 2.0**-40
"""Offsets from one point of the curve count as equal if they differ by at most this part of their
lengths."""

ROUNDING = 2.0**-46
"""Steps of at most this part of the coordinates, 64 units in the last place, may be rounding. They
count as rounding if they are also short (`SHORT_STEP`)."""

SHORT_STEP = 2.0**-20
"""A step is short if it is at most this part of the longest step between the same two frames, or at
a corner of the profile's size."""

MAX_SHARE = 1.25
"""If the point of the curve moves further than the steps of two columns of offsets, times this
number, no sample repeats (`_find_narrow_bands`)."""


def build_tubes(
    paths: Paths,
    radii: FloatArray | float,
    sides: int,
    *,
    slopes: FloatArray | None = None,
    caps: bool = True,
    faces: Faces = "triangles",
) -> SweptGrids:
    """Tubes about K curves; see `arrange_tubes` for the parameters."""
    return join_rows(arrange_tubes(paths, radii, sides, slopes=slopes, caps=caps), faces)


def arrange_tubes(
    paths: Paths,
    radii: FloatArray | float,
    sides: int,
    *,
    slopes: FloatArray | None = None,
    caps: bool = True,
) -> Rows:
    """The rings of tubes about K curves, with those of their caps.

    Parameters
    ----------
    radii : float, or ndarray of float64, shape (m,)
        The radius at every frame, not negative; where it is 0, the tube is pointed.
    sides : int
        At least 3.
    slopes : ndarray of float64, shape (K, m), optional
        Change of the radius with the length of the curve, dr/ds.
    caps : bool
        Whether open ends that are not pointed get a flat disc.
    """
    count, frames = paths.points.shape[:2]
    radius = np.broadcast_to(np.asarray(radii, dtype=np.float64), frames)
    normals = compute_frames(paths.points, paths.tangents, paths.fractions, closed=paths.closed)
    tangents = paths.tangents[:, :, None]
    ring = _build_ring(normals, cross(normals, paths.tangents, -1), sides)
    checkpoint()
    offsets = radius[:, None, None] * _move_to_planes(ring, paths)
    positions = paths.points[:, :, None] + offsets
    ring_normals = ring
    if slopes is not None and slopes.any():
        ring_normals = ring - slopes[:, :, None, None] * tangents
        ring_normals = ring_normals / np.sqrt(1.0 + slopes**2)[:, :, None, None]
    checkpoint()
    uvs = np.empty((count, frames, sides + 1, 2))
    uvs[..., 0], uvs[..., 1] = paths.fractions[:, :, None], np.arange(sides + 1) / sides
    rows = Rows(
        positions=positions,
        normals=ring_normals,
        uvs=uvs,
        has_faces=~paths.is_mitred[1:],
        is_point=radius == 0,
        is_repeated=_find_repeats(paths, offsets),
        equal_row=_find_equal_rows(paths),
        is_ring=True,
    )
    if caps and not paths.closed:
        rows = _add_caps(rows, paths, (bool(radius[0] > 0), bool(radius[-1] > 0)))
    return rows


def build_ribbons(
    paths: Paths,
    widths: FloatArray | float,
    *,
    facing: FloatArray | None = None,
    camera: FloatArray | None = None,
    faces: Faces = "triangles",
) -> SweptGrids:
    """Ribbons along K curves.

    Parameters
    ----------
    widths : float, or ndarray of float64, shape (m,)
        The width at every frame, not negative; where it is 0, the ribbon is pointed.
    facing : ndarray of float64, shape (3,) or (K, m, 3), optional
        The direction that the ribbons face, everywhere or at every frame.
    camera : ndarray of float64, shape (3,), optional
        The point that the ribbons face, instead of a direction. Without both, any direction across
        the curve is a crossbar.
    """
    if camera is not None:
        directions = camera - paths.points
    else:
        directions = np.broadcast_to(np.zeros(3) if facing is None else facing, paths.points.shape)
    return join_rows(arrange_ribbons(paths, widths, _find_crossbars(paths, directions)), faces)


def arrange_ribbons(paths: Paths, widths: FloatArray | float, crossbars: FloatArray) -> Rows:
    """The crossbars of ribbons along K curves.

    Parameters
    ----------
    widths : float, or ndarray of float64, shape (m,)
        The width at every frame, not negative; where it is 0, the ribbon is pointed.
    crossbars : ndarray of float64, shape (K, m, 3)
        Unit vectors across the curves.
    """
    width = np.broadcast_to(np.asarray(widths, dtype=np.float64), paths.points.shape[1])
    normals = cross(paths.tangents, crossbars, -1)
    across = np.array([-0.5, 0.5])
    offsets = (width[:, None] * across)[:, :, None] * _move_to_planes(crossbars[:, :, None], paths)
    positions = paths.points[:, :, None] + offsets
    uvs = np.empty((*positions.shape[:3], 2))
    uvs[..., 0], uvs[..., 1] = paths.fractions[:, :, None], across + 0.5
    return Rows(
        positions=positions,
        normals=np.broadcast_to(normals[:, :, None], positions.shape),
        uvs=uvs,
        has_faces=~(paths.is_mitred[1:] | _find_lines(paths, offsets)),
        is_point=width == 0,
        is_repeated=_find_repeats(paths, offsets),
        equal_row=_find_equal_rows(paths),
        is_ring=False,
    )


def _build_ring(normals: FloatArray, binormals: FloatArray, sides: int) -> FloatArray:
    """The vectors e at φ = 2π j / sides, j = 0 … sides, (K, m, sides+1, 3)."""
    angle = 2 * np.pi * np.arange(sides) / sides
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    ring = cosine * normals[:, :, None] + sine * binormals[:, :, None]
    return np.concatenate([ring, ring[:, :, :1]], axis=2)


def _find_crossbars(paths: Paths, directions: FloatArray) -> FloatArray:
    """Unit vectors (K, m, 3) perpendicular to the curve and to the direction it faces there."""
    size = np.abs(directions).max(axis=2, keepdims=True)
    products = cross(directions / np.where(size > 0, size, 1.0), paths.tangents, -1)
    has_direction = length(products, -1) > MIN_SINE
    crossbars = fill_gaps(products, has_direction)
    is_undefined = ~has_direction.any(axis=1)
    if is_undefined.any():
        # A straight line in the facing direction: any crossbar is valid.
        closed, fractions = paths.closed, paths.fractions[is_undefined]
        crossbars[is_undefined] = compute_frames(
            paths.points[is_undefined], paths.tangents[is_undefined], fractions, closed=closed
        )
    along = dot(crossbars, paths.tangents, -1)[..., None] * paths.tangents
    return normalize(crossbars - along, -1)


def _move_to_planes(vectors: FloatArray, paths: Paths) -> FloatArray:
    """Vectors (K, m, n, 3) across the curves, moved along the tangents to the frames' planes."""
    if paths.mitres is None:
        return vectors
    tangents, plane_normals = paths.tangents[:, :, None], paths.mitres[:, :, None]
    slide = -(vectors * plane_normals).sum(axis=-1) / (tangents * plane_normals).sum(axis=-1)
    moved: FloatArray = vectors + slide[..., None] * tangents
    return moved


def _find_repeats(paths: Paths, offsets: FloatArray) -> Bools:
    """Whether samples have the position of the sample of the frame before: (K, m−1, columns).

    At a rounded corner they do so if they are on the axis about which the frames turn: then their
    offsets from the point of the curve, shape (K, m, columns, 3), are equal up to rounding.
    Elsewhere they do so where the radius of a tube is the radius of the curve's bend, and the
    surface itself is singular: the step to the next sample is rounding, and short beside other
    steps between the two frames.
    """
    repeats = np.zeros((len(offsets), offsets.shape[1] - 1, offsets.shape[2]), dtype=bool)
    bands = _find_narrow_bands(paths, offsets)
    if not len(bands):
        return repeats
    before, after = offsets[:, bands], offsets[:, bands + 1]
    points, next_points = (paths.points[:, row, None] for row in (bands, bands + 1))
    is_at_axis = length(after - before, -1) <= _bound_offset_rounding(before, after, points)
    step = length((next_points + after) - (points + before), -1)
    coordinate = np.maximum(np.abs(points + before), np.abs(next_points + after)).max(axis=(2, 3))
    max_step = step.max(axis=2, keepdims=True)
    is_short = step <= np.minimum(ROUNDING * coordinate[..., None], SHORT_STEP * max_step)
    repeats[:, bands] = np.where((points == next_points).all(axis=-1), is_at_axis, is_short)
    return repeats


def _find_narrow_bands(paths: Paths, offsets: FloatArray) -> Ints:
    """Each frame after which samples of the next frame may have equal positions, on any curve.

    There the point of the curve moves no further than some offset. The offsets of a frame are sums
    of two of them, at an angle of 60° to 120°, each times at most 1.16.
    """
    quarter = max(1, round((offsets.shape[2] - 1) / 4))
    offset_steps = length(np.diff(offsets[:, :, [0, quarter]], axis=1), -1).sum(axis=-1)
    is_narrow = length(np.diff(paths.points, axis=1), -1) <= MAX_SHARE * offset_steps
    return np.flatnonzero(is_narrow.any(axis=0) & ~paths.is_mitred[1:])


def _find_lines(paths: Paths, offsets: FloatArray) -> Bools:
    """Whether crossbars of all curves are on one line between two frames at one point: (m−1,).

    A face between them would have no area. They turn round at a corner if the direction that the
    ribbon faces is between the directions of the curve; and they have other widths where a control
    point is repeated. Crossbars that are equal are one, and no line in this sense.
    """
    is_corner: Bools = (paths.points[:, :-1] == paths.points[:, 1:]).all(axis=(0, 2))
    if not is_corner.any():
        return is_corner
    before, after = offsets[:, :-1], offsets[:, 1:]
    rounding = _bound_offset_rounding(before, after, paths.points[:, :-1, None])
    first, second = before[:, :, 1], after[:, :, 1]
    longer = np.maximum(length(first, -1), length(second, -1))
    is_line = length(cross(first, second, -1), -1) <= rounding[..., 0] * longer
    is_equal = length(after - before, -1) <= rounding
    has_line: Bools = is_corner & is_line.all(axis=0) & ~is_equal.all(axis=(0, 2))
    return has_line


def _bound_offset_rounding(before: FloatArray, after: FloatArray, points: FloatArray) -> FloatArray:
    """How far equal offsets from one point of the curve differ by rounding: (K, m, 1).

    Far from zero, curves have less precise directions.
    """
    size = np.maximum(length(before, -1), length(after, -1)).max(axis=2, keepdims=True)
    rounding = np.minimum(ROUNDING * np.abs(points).max(axis=-1), SHORT_STEP * size)
    bound: FloatArray = np.maximum(EQUAL_OFFSETS * size, rounding)
    return bound


def _find_equal_rows(paths: Paths) -> Ints:
    """For each frame another frame whose row has the same positions, or itself."""
    equal_row = np.arange(paths.points.shape[1]) - paths.is_mitred
    if paths.closed:
        equal_row[-1] = 0
    return equal_row


def _add_caps(rows: Rows, paths: Paths, has_caps: tuple[bool, bool]) -> Rows:
    """Add discs at the ends; each has two rows: its rim, with other normals, and its centre."""
    for is_at_end in (False, True):
        if not has_caps[is_at_end]:
            continue
        row = -1 if is_at_end else 0
        rim = rows.positions[:, row]
        centre = np.broadcast_to(paths.points[:, row, None], rim.shape)
        normal = paths.tangents[:, row, None, None] * (1.0 if is_at_end else -1.0)
        angle = 2 * np.pi * rows.uvs[:, row, :, 1]
        rim_uvs = 0.5 + 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        rim_uvs[:, -1] = rim_uvs[:, 0]
        cap_rows = [(rim, rim_uvs), (centre, np.full_like(rim_uvs, 0.5))]
        # The rim has the positions of the first or last ring, the centre those of no other row. At
        # the beginning, the centre is row 0, the rim is row 1, and the first ring becomes row 2.
        count = len(rows.equal_row)
        if is_at_end:
            equal_row = [*rows.equal_row.tolist(), rows.equal_row[-1], count + 1]
        else:
            cap_rows.reverse()
            equal_row = [0, 2, *(rows.equal_row + 2).tolist()]
        positions = np.stack([points for points, _ in cap_rows], axis=1)
        cap = replace(
            rows,
            positions=positions,
            normals=np.broadcast_to(normal, positions.shape),
            uvs=np.stack([uv for _, uv in cap_rows], axis=1),
            has_faces=np.array([True]),
            is_point=np.array([False, True] if is_at_end else [True, False]),
            is_repeated=np.zeros((len(positions), 2, positions.shape[2]), dtype=bool),
        )
        first, second = (rows, cap) if is_at_end else (cap, rows)
        rows = Rows(
            np.concatenate([first.positions, second.positions], axis=1),
            np.concatenate([first.normals, second.normals], axis=1),
            np.concatenate([first.uvs, second.uvs], axis=1),
            np.concatenate([first.has_faces, [False], second.has_faces]),
            np.concatenate([first.is_point, second.is_point]),
            np.concatenate(
                [rows.is_repeated, cap.is_repeated]
                if is_at_end
                else [cap.is_repeated, rows.is_repeated],
                axis=1,
            ),
            np.array(equal_row),
            rows.is_ring,
        )
    return rows
