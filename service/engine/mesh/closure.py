"""Whether the last side of a surface is its first side, and the continuity of that seam.

A surface closes along u if its last line of Bézier points equals its first line bit for bit, and
the weights are equal up to a common factor. The seam is then

- C1 if the partial across it, in the parameters of the surface's domain, is the same on both sides;
- else G1 if the tangent planes are the same, and the surface does not turn back;
- else C0.

With t the tangent of the seam, a and b the partials across it, C1 says that a − b vanishes and G1
that det(a, b, t) does. Times powers of the seam's weight these are polynomials of the parameter
along the seam, of degree 2q and 4q − 1 at most (q and 3q − 1 without weights) on each patch. So a
polynomial that vanishes at the 4q + 1 parameters where it is computed vanishes everywhere; a
computed value counts as zero within the tolerances below. Places without a tangent plane, such as
poles, do not count.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein, sample_parameters
from service.engine.mesh.connectivity import SAME_WEIGHT, Connectivity
from service.engine.vectors import cross
from service.surface.batches import TensorPatches
from service.surface.lowered import PatchModel
from service.surface.sides import take_side

Continuity: TypeAlias = Literal["C0", "G1", "C1"]

SAME_PARTIAL = 1e-6
"""Largest difference of partials, in units of the longest on the seam: nets are often written with
six digits."""

SAME_PLANE = 1e-6
"""Largest difference of unit normals: an angle in radians."""

NO_PLANE = 1e-9
"""Sine of the angle, or length in units of the longest, below which two tangents span no plane."""

CHUNK_PATCHES = 1024
"""Number of patches along a seam in one chunk."""


@dataclass(frozen=True, slots=True)
class Closure:
    """The continuity of the seams along u and along v; None where the surface is open."""

    u: Continuity | None
    v: Continuity | None


OPEN = Closure(None, None)
"""The closure of a surface whose sides are all different edges."""


def find_closure(model: PatchModel, connectivity: Connectivity | None = None) -> Closure | None:
    """The closure of the surface; None for patches that are not pieces of one surface.

    A surface whose first and last sides are different edges in the connectivity is open.
    """
    if model.domain is None:
        return None
    (batch,) = model.batches
    if not isinstance(batch, TensorPatches):
        return None
    edge = None if connectivity is None else connectivity.edge
    (p, q), u, v = batch.degree, model.domain.u, model.domain.v
    number = np.arange(batch.count).reshape(len(u) - 1, len(v) - 1)
    continuities: list[Continuity | None] = []
    ends = (number[0], number[-1]), (number[:, 0], number[:, -1])
    for side, (first, last), degree, knots in zip((0, 2), ends, (p, q), (u, v), strict=True):
        # Most surfaces are open, and comparing their corners is fast.
        if edge is not None and (edge[first, side] != edge[last, side + 1]).any():
            continuities.append(None)
        else:
            continuities.append(_find_continuity(batch, first, last, side, degree / np.diff(knots)))
    return Closure(*continuities)


def _find_continuity(
    batch: TensorPatches, first: Ints, last: Ints, side: int, factors: FloatArray
) -> Continuity | None:
    """Continuity of the seam of this side of the first patches and the next side of the last."""
    begin, end = take_side(batch.points, side)[first], take_side(batch.points, side + 1)[last]
    if not np.array_equal(begin, end):
        return None
    return _compare_borders(
        _build_border(batch, first, side, factors[0]),
        _build_border(batch, last, side + 1, factors[-1]),
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Border:
    """A side of the patches along one border of the surface.

    `line` (M, n+1, 3) has the Bézier points on the side, `next` (M, n+1, 3) those of the next line;
    `factor` times their difference is the partial across the border.
    """

    line: FloatArray
    next: FloatArray
    line_weights: FloatArray
    next_weights: FloatArray
    factor: float

    def across(self, place: FloatArray, basis: FloatArray) -> FloatArray:
        """The partial across the border at points S of it, (M, K, 3).

        S_u = p/h Σ_j B_j w_1j (P_1j − S) / Σ_j B_j w_0j
        """
        total = self.line_weights @ basis.T
        shares = basis * self.next_weights[:, np.newaxis]
        difference: FloatArray = shares @ self.next - shares.sum(axis=-1)[..., np.newaxis] * place
        difference *= (self.factor / total)[..., np.newaxis]
        return difference

    def along(self, place: FloatArray, basis: FloatArray) -> FloatArray:
        """A tangent of the border at its points S, (M, K, 3), of any length.

        W S' ~ Σ_j B_j^{n−1} (w_{j+1} (P_{j+1} − S) − w_j (P_j − S))
        """
        change = np.diff(self.line * self.line_weights[..., np.newaxis], axis=1)
        tangent: FloatArray = basis @ change
        tangent -= (np.diff(self.line_weights, axis=1) @ basis.T)[..., np.newaxis] * place
        return tangent

    def points(self, basis: FloatArray) -> FloatArray:
        """The points S of the border, (M, K, 3)."""
        shares = basis * self.line_weights[:, np.newaxis]
        place: FloatArray = shares @ self.line / shares.sum(axis=-1)[..., np.newaxis]
        return place

    def take(self, run: slice) -> "_Border":
        """The border of the patches of a run."""
        return _Border(
            self.line[run],
            self.next[run],
            self.line_weights[run],
            self.next_weights[run],
            self.factor,
        )

    @property
    def longest(self) -> float:
        """Upper bound of the partials across the border, without the effect of weights."""
        return abs(self.factor) * float(np.linalg.norm(self.next - self.line, axis=-1).max())


def _build_border(batch: TensorPatches, patches: Ints, side: int, factor: float) -> _Border:
    """One side of patches as a border, with points relative to the middle of the batch."""
    line, beside = (take_side(batch.points, side, k)[patches] - batch.middle for k in range(2))
    weights = np.ones(batch.points.shape[:-1]) if batch.weights is None else batch.weights
    line_weights, weights_beside = (take_side(weights, side, k)[patches] for k in range(2))
    return _Border(line, beside, line_weights, weights_beside, -factor if side % 2 else factor)


def _compare_borders(first: _Border, last: _Border) -> Continuity | None:
    """The continuity of the seam of two borders with equal points; None if their weights differ."""
    if not _has_equal_weights(first, last):
        return None
    degree = first.line.shape[1] - 1
    places = sample_parameters(4 * degree)
    basis, below = bernstein(degree, places), bernstein(degree - 1, places)
    longest = max(first.longest, last.longest)
    distance, planes, smooth = 0.0, 0, True
    for start in range(0, len(first.line), CHUNK_PATCHES):
        ours, theirs = (
            border.take(slice(start, start + CHUNK_PATCHES)) for border in (first, last)
        )
        seam = ours.points(basis)
        a, b, t = ours.across(seam, basis), theirs.across(seam, basis), ours.along(seam, below)
        distance = max(distance, float(np.linalg.norm(a - b, axis=-1).max()))
        normal, is_plane = _find_normals(a, t, longest)
        other, is_other_plane = _find_normals(b, t, longest)
        both = is_plane & is_other_plane
        planes += int(both.sum())
        has_turned = np.linalg.norm(normal - other, axis=-1) > SAME_PLANE
        smooth = (
            smooth and not (has_turned & both).any() and bool((is_plane == is_other_plane).all())
        )
    if distance <= SAME_PARTIAL * longest and longest > 0:
        return "C1"
    return "G1" if smooth and planes else "C0"


def _find_normals(
    across: FloatArray, along: FloatArray, longest: float
) -> tuple[FloatArray, Bools]:
    """Unit normals of the planes of pairs of tangents, and whether each pair spans a plane."""
    normal = cross(across, along)
    size, length, other = (np.linalg.norm(rows, axis=-1) for rows in (normal, across, along))
    is_plane = (size > NO_PLANE * length * other) & (length > NO_PLANE * longest)
    unit = np.divide(normal, size[..., np.newaxis], where=is_plane[..., np.newaxis], out=normal)
    return unit, is_plane


def _has_equal_weights(first: _Border, last: _Border) -> bool:
    """Whether the weights of two borders are the same up to a common factor."""
    ours, theirs = (b.line_weights / b.line_weights.max() for b in (first, last))
    return bool((np.abs(ours - theirs) <= SAME_WEIGHT).all())
