"""Tubes about lines and circular arcs as rational patches, which are these tubes exactly.

A ring is a circle as four quarters, each a rational quadratic with the weights 1, √½, 1. About a
straight piece of the curve, lines join both of its rings: cylinders, cones, and cylinders that
mitres cut. About a circular arc each point of the ring runs on an arc of its own: a part of a
torus. An arc is a rational quadratic with |P_1 − P_0| = |P_2 − P_1| and w_1² = w_0 w_2 cos²γ, where
γ is half the angle through which it turns.

Source: Piegl and Tiller, The NURBS Book, 2nd ed., sections 7.3, 8.3 and 8.5.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.errors import InvalidRequest, Issue
from service.surface.batches import TensorPatches
from service.surface.channels import NO_CHANNELS
from service.surface.checks import Up
from service.surface.curve_model import CurvePieces, Tube, to_space
from service.surface.lowered import Part, PatchModel
from service.surface.placement import Box, find_box
from service.surface.sizes import SurfaceKind, SurfaceSize, tensor_size

EQUAL = 2.0**-40
"""Directions, lengths and weights that differ by at most this share are equal, and the patches are
within 16 times this share of the reach of the curve and of the radius of the tube."""

CORNERS = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0.0]])
"""The control points of a circle of radius 1."""

QUARTERS = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 8]])
WEIGHTS = np.array([1.0, np.sqrt(0.5), 1.0])

MAX_PIECES = 1000
"""The most pieces of the curve of a tube that becomes patches, which takes 0.1 ms for each."""

NEEDED = (
    "a constant radius about straight lines and circular arcs (rational quadratics), with corners "
    "up to 90° between lines alone; or a linear radius about one line; or a surface of patches"
)


@dataclass(frozen=True, eq=False, slots=True)
class ExactPatches(SurfaceKind):
    """Rational patches of one degree, to which another surface is equal.

    Attributes
    ----------
    control_nets : ndarray of float64, shape (K, p+1, q+1, 3)
    weights : ndarray of float64, shape (K, p+1, q+1)
    """

    control_nets: FloatArray
    weights: FloatArray
    up: Up
    name: str

    def lower(self) -> PatchModel:
        """The patches, as one part."""
        batch = TensorPatches(self.control_nets, self.weights)
        parts = (Part(self.name, 0, len(self.control_nets)),)
        return PatchModel(self.name, (batch,), parts, self.up)

    def size(self) -> SurfaceSize:
        """The size of the patches."""
        count, rows, columns, _ = self.control_nets.shape
        degree = rows - 1, columns - 1
        return tensor_size(count, degree, self.weights, NO_CHANNELS, name=self.name)

    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points."""
        return find_box(self.control_nets)


@dataclass(frozen=True, eq=False, slots=True)
class _Legs:
    """The pieces of a path, each a line or an arc.

    Attributes
    ----------
    points : ndarray of float64, shape (S, 2, 3)
        The ends of each piece.
    tangents : ndarray of float64, shape (S, 2, 3)
        Unit tangents at the ends.
    cosines : ndarray of float64, shape (S,)
        cos γ of arcs; 1 for lines.
    centres, axes : ndarray of float64, shape (S, 3)
        Centre and axis of each arc; 0 for lines.
    """

    points: FloatArray
    tangents: FloatArray
    cosines: FloatArray
    centres: FloatArray
    axes: FloatArray


def build_exact_tube(
    pieces: CurvePieces, tube: Tube, *, closed: bool, up: Up, name: str
) -> ExactPatches:
    """The tube as patches: four for each piece of the curve, in its order, and four for each cap.

    Their u runs along the curve: outwards on the first cap, inwards on the last. Their v runs
    around the curve.

    Raises
    ------
    InvalidRequest
        `not_parametric`, with the reason; the pointer is relative to the surface.
    """
    if pieces.count > MAX_PIECES:
        raise _refuse(f"Its curve has more than {MAX_PIECES} Bézier pieces.")
    is_constant = bool((tube.spread == tube.spread[0]).all())
    if is_constant:
        pieces = pieces.drop_single()
    legs = _find_legs(pieces)
    is_line = legs.cosines == 1.0
    is_linear = len(tube.spread) == 2 and pieces.degree == 1 and pieces.weights is None
    if not (is_constant or (is_linear and pieces.count == 1)):
        raise _refuse("Its radius changes, and not linearly along one line.")
    radii = np.linspace(tube.spread[0], tube.spread[-1], pieces.count + 1)
    slants = _find_slants(legs, is_line, closed=closed)
    rings = _place_rings(legs, radii, slants, closed=closed)
    lengths = np.sqrt(np.square(legs.points[:, 1] - legs.points[:, 0]).sum(axis=1))
    leans = np.sqrt(np.square(slants).sum(axis=2)) * np.stack([radii[:-1], radii[1:]], axis=1)
    if (is_line & (lengths <= leans.sum(axis=1))).any():
        raise _refuse("A line is so short that the mitres at its ends overlap.")
    reach = np.sqrt(np.square(legs.points[:, 0] - legs.centres).sum(axis=1))
    if (~is_line & (reach <= radii[0])).any():
        raise _refuse("Its radius is not below the radius of an arc: it meets itself.")
    nets, weights = _join_rings(legs, rings, rows=2 if is_line.all() else 3)
    caps = []
    if tube.caps and not closed:
        for ring, centre, is_last in ((rings[0, 0], legs.points[0, 0], False),
                                      (rings[-1, 1], legs.points[-1, 1], True)):  # fmt: skip
            if (ring != ring[0]).any():
                caps.append(_build_cap(ring, centre, nets.shape[1], is_last=is_last))
    nets = np.concatenate([nets, *caps])
    weights = np.concatenate([weights, *[np.broadcast_to(WEIGHTS, cap.shape[:3]) for cap in caps]])
    return ExactPatches(nets, np.ascontiguousarray(weights), up, name)


def _find_legs(pieces: CurvePieces) -> _Legs:
    """The pieces as lines and arcs; refuses others."""
    points, weights = to_space(pieces.points), pieces.weights
    steps = np.diff(points, axis=1)
    first, last = points[:, 0], points[:, -1]
    chord = last - first
    size = _measure(chord)
    unit = chord / np.where(size > 0, size, 1.0)[:, None]
    along = (steps * unit[:, None]).sum(axis=2)
    across = _measure(steps - along[..., None] * unit[:, None])
    is_line = ((across <= EQUAL * along) & (along >= 0)).all(axis=1) & (size > 0)
    tangents = np.repeat(unit[:, None], 2, axis=1)
    cosines, centres, axes = (
        np.ones(len(points)),
        np.zeros((len(points), 3)),
        np.zeros((len(points), 3)),
    )
    rows = np.flatnonzero(~is_line)
    if len(rows):
        is_quadratic = pieces.degree == 2 and weights is not None
        if (
            not is_quadratic
            or weights is None
            or not _are_arcs(steps[rows], size[rows], weights[rows])
        ):
            message = "Its curve has a piece that is neither straight nor a circular arc."
            raise _refuse(message)
        legs = _measure(steps[rows])
        tangents[rows] = steps[rows] / legs[..., None]
        cosines[rows] = cosine = size[rows] / (2 * legs[:, 0])
        middle = first[rows] + chord[rows] / 2
        tangent_squared = (1 - cosine**2) / cosine**2
        centres[rows] = middle - (points[rows, 1] - middle) / tangent_squared[:, None]
        normal = np.cross(tangents[rows, 0], tangents[rows, 1])
        axes[rows] = normal / _measure(normal)[:, None]
    return _Legs(np.stack([first, last], axis=1), tangents, cosines, centres, axes)


def _are_arcs(steps: FloatArray, chords: FloatArray, weights: FloatArray) -> bool:
    """Whether rational quadratics with these steps (K, 2, 3) are circular arcs."""
    lengths = _measure(steps)
    is_equal = np.abs(lengths[:, 0] - lengths[:, 1]) <= EQUAL * lengths[:, 0]
    cosine = chords / (2 * np.where(lengths[:, 0] > 0, lengths[:, 0], np.inf))
    by_weights = weights[:, 1] / np.sqrt(weights[:, 0] * weights[:, 2])
    are_arcs: Bools = is_equal & (np.abs(cosine - by_weights) <= EQUAL) & (cosine > EQUAL)
    return bool(are_arcs.all())


def _find_slants(legs: _Legs, is_line: Bools, *, closed: bool) -> FloatArray:
    """Vectors g (S, 2, 3) at the ends of pieces: rings there have the points r (e − (e · g) T)."""
    slants = np.zeros_like(legs.tangents)
    count = len(is_line)
    for k in range(0 if closed else 1, count):
        before, after = legs.tangents[k - 1, 1], legs.tangents[k, 0]
        if float(_measure(after - before)) <= 4 * EQUAL:
            continue
        if not (is_line[k - 1] and is_line[k]):
            raise _refuse("Its curve has a corner at an arc.")
        if float(before @ after) < 0:
            raise _refuse("Its curve has a corner sharper than 90°.")
        plane = before + after
        slants[k - 1, 1] = plane / (before @ plane) - before
        slants[k, 0] = plane / (after @ plane) - after
    return slants


def _place_rings(legs: _Legs, radii: FloatArray, slants: FloatArray, *, closed: bool) -> FloatArray:
    """The control points (S, 2, 9, 3) of the rings at both ends of each piece.

    Two pieces have equal rings where they meet.
    """
    count = len(radii) - 1
    rings = np.empty((count, 2, 9, 3))
    normal = _find_perpendicular(legs.tangents[0, 0])
    start = normal
    for k in range(count):
        if k:
            normal = _rotate(normal, legs.tangents[k - 1, 1], legs.tangents[k, 0])
        for end in range(2):
            if end:
                normal = _rotate(normal, legs.tangents[k, 0], legs.tangents[k, 1])
            tangent = legs.tangents[k, end]
            frame = np.stack([normal, np.cross(normal, tangent)])
            offsets = CORNERS @ frame
            offsets -= (offsets @ slants[k, end])[:, None] * tangent
            rings[k, end] = legs.points[k, end] + radii[k + end] * offsets
        if k:
            rings[k, 0] = rings[k - 1, 1]
    if closed:
        normal = _rotate(normal, legs.tangents[-1, 1], legs.tangents[0, 0])
        if float(_measure(normal - start)) > 64 * EQUAL:
            message = "Its closed curve leaves its plane, and turns the rings against each other."
            raise _refuse(message)
        rings[-1, 1] = rings[0, 0]
    return rings


def _join_rings(legs: _Legs, rings: FloatArray, rows: int) -> tuple[FloatArray, FloatArray]:
    """The nets (4 S, rows, 3, 3) of patches between rings, and their weights."""
    first, last = rings[:, 0], rings[:, 1]
    middle = first + (last - first) / 2
    inner, weight = middle, np.ones(len(rings))
    is_arc = legs.cosines < 1.0
    if is_arc.any():
        # The control point between two ends X of an arc about the foot A of their mean M on the
        # axis: A + (M − A) / cos²γ, with the weight cos γ.
        centres, axes = legs.centres[:, None], legs.axes[:, None]
        foot = centres + ((middle - centres) * axes).sum(axis=2)[..., None] * axes
        bent = foot + (middle - foot) / np.square(legs.cosines)[:, None, None]
        inner = np.where(is_arc[:, None, None], bent, middle)
        weight = np.where(is_arc, legs.cosines, 1.0)
    levels = [first, last] if rows == 2 else [first, inner, last]
    shares = np.ones((rows, len(rings)))
    if rows == 3:
        shares[1] = weight
    nets = np.stack(levels, axis=1)[:, :, QUARTERS]  # (S, rows, 4, 3, 3)
    nets = np.moveaxis(nets, 2, 1).reshape(-1, rows, 3, 3)
    weights = np.repeat(shares.T[..., None] * WEIGHTS, 4, axis=0)
    return np.ascontiguousarray(nets), weights


def _build_cap(ring: FloatArray, centre: FloatArray, rows: int, *, is_last: bool) -> FloatArray:
    """The nets (4, rows, 3, 3) of a disc: the last from its rim to its centre, the first back."""
    rim = ring[QUARTERS]
    shares = np.linspace(0, 1, rows)[:, None, None, None]
    nets = centre + shares * (rim - centre)
    nets[0], nets[-1] = centre, rim
    return np.moveaxis(nets[::-1] if is_last else nets, 1, 0)


def _rotate(vector: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """A vector perpendicular to `first` after the least rotation of `first` to `second`."""
    turned = vector - (vector @ second) / (1 + first @ second) * (first + second)
    turned -= (turned @ second) * second
    unit: FloatArray = turned / _measure(turned)
    return unit


def _find_perpendicular(vector: FloatArray) -> FloatArray:
    axis = np.eye(3)[np.abs(vector).argmin()]
    across = axis - (axis @ vector) * vector
    unit: FloatArray = across / _measure(across)
    return unit


def _measure(vectors: FloatArray) -> FloatArray:
    """Lengths (…) of vectors (…, 3)."""
    size = np.abs(vectors).max(axis=-1, keepdims=True)
    unit = np.where(size > 0, size, 1.0)
    lengths: FloatArray = unit[..., 0] * np.sqrt(np.square(vectors / unit).sum(axis=-1))
    return lengths


def _refuse(reason: str) -> InvalidRequest:
    message = f"This tube is not made of exact patches. {reason}"
    return InvalidRequest(Issue("not_parametric", message, "", "another tube", NEEDED))
