"""Finds whether the first and last sides of a surface are one seam, and the seam's continuity.

A surface closes along u if its last line of Bézier points equals its first line bit for bit, and
the weights are equal up to a common factor. The seam is then

- C1 if the partial across it, in the parameters of the surface's domain, is the same on both sides;
- else G1 if the tangent planes are the same, and the surface does not turn back;
- else C0.

Let t be the tangent of the seam, and a and b the partials across the seam on its two sides. C1
means that a − b vanishes, G1 that det(a, b, t) vanishes. Multiplied by powers of the weight of the
seam, both are polynomials of the parameter along the seam. On each patch, which has degree q along
the seam, their degrees are at most 2q and 4q − 1 (q and 3q − 1 without weights). They are computed
at 4q + 1 parameters: a polynomial that vanishes there vanishes everywhere. A computed value counts
as zero within the tolerances below. Points at which neither side has a tangent plane, such as
poles, are not compared; if only one side has one, the seam is not G1.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein, sample_parameters
from service.engine.connectivity.incidence import SAME_WEIGHT, Connectivity
from service.engine.vectors import cross
from service.surface.batches import TensorPatches
from service.surface.lowered import PatchModel
from service.surface.sides import take_side

Continuity: TypeAlias = Literal["C0", "G1", "C1"]

SAME_PARTIAL = 1e-6
"""The largest difference of two partials that count as equal, in units of the longest partial on
the seam. Nets are often written with six digits."""

SAME_PLANE = 1e-6
"""The largest difference of two unit normals that count as equal: an angle in radians."""

NO_PLANE = 1e-9
"""Two tangents span no plane if the sine of their angle is smaller than this, or if the length of
the partial is smaller than this fraction of the longest partial."""

CHUNK_PATCHES = 1024
"""The number of patches along a seam that are compared together, which limits the memory."""


@dataclass(frozen=True, slots=True)
class Closure:
    """The continuity of the seams where the surface closes along u and v; None where it is open."""

    u: Continuity | None
    v: Continuity | None


OPEN = Closure(None, None)
"""The closure of a surface that is open along u and along v."""


def find_closure(model: PatchModel, connectivity: Connectivity) -> Closure | None:
    """The closure of the surface; None for patches that are not pieces of one surface.

    A surface whose first and last sides are different edges in the connectivity is open.
    """
    if model.domain is None:
        return None
    (batch,) = model.batches
    if not isinstance(batch, TensorPatches):
        return None
    (p, q), u, v, edge = batch.degree, model.domain.u, model.domain.v, connectivity.edge
    patch_numbers = np.arange(batch.count).reshape(len(u) - 1, len(v) - 1)
    continuities: list[Continuity | None] = []
    ends = (patch_numbers[0], patch_numbers[-1]), (patch_numbers[:, 0], patch_numbers[:, -1])
    for side, (first_patches, last_patches), degree, knots in zip(
        (0, 2), ends, (p, q), (u, v), strict=True
    ):
        # Most surfaces are open, and comparing the numbers of edges is fast.
        if (edge[first_patches, side] != edge[last_patches, side + 1]).any():
            continuities.append(None)
        else:
            continuities.append(
                _find_continuity(batch, first_patches, last_patches, side, degree / np.diff(knots))
            )
    return Closure(*continuities)


def _find_continuity(
    batch: TensorPatches, first_patches: Ints, last_patches: Ints, side: int, factors: FloatArray
) -> Continuity | None:
    """The continuity of the seam of two opposite borders of a surface.

    The borders are the sides `side` of the first patches, and the sides `side` + 1 of the last
    patches. None if their control points differ. `factors` are the degree across the seam, divided
    by the widths of the spans from the first to the last patches.
    """
    begin, end = (
        take_side(batch.points, side)[first_patches],
        take_side(batch.points, side + 1)[last_patches],
    )
    if not np.array_equal(begin, end):
        return None
    return _compare_borders(
        _build_border(batch, first_patches, side, factors[0]),
        _build_border(batch, last_patches, side + 1, factors[-1]),
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Border:
    """A side of the patches along one border of the surface.

    `line` (M, n+1, 3) are the control points on the side; `next` (M, n+1, 3) are the control points
    of the next line. `factor` times the difference of both is the net of the partial across the
    border. In the methods, `basis` has the Bernstein polynomials at K parameters along the side.
    """

    line: FloatArray
    next: FloatArray
    line_weights: FloatArray
    next_weights: FloatArray
    factor: float

    def across(self, point: FloatArray, basis: FloatArray) -> FloatArray:
        """The partial across the border at its points S, (M, K, 3).

        S_u = p/h Σ_j B_j w_1j (P_1j − S) / Σ_j B_j w_0j

        where p/h is `factor`, and row 0 of the net is `line`, row 1 `next`.
        """
        total = self.line_weights @ basis.T
        weighted_basis = basis * self.next_weights[:, np.newaxis]
        difference: FloatArray = (
            weighted_basis @ self.next - weighted_basis.sum(axis=-1)[..., np.newaxis] * point
        )
        difference *= (self.factor / total)[..., np.newaxis]
        return difference

    def along(self, point: FloatArray, basis: FloatArray) -> FloatArray:
        """A tangent of the border at its points S, (M, K, 3), of any length.

        (Σ_j B_j^n w_j) S' / n = Σ_j B_j^{n−1} (w_{j+1} (P_{j+1} − S) − w_j (P_j − S))

        The result is the right side.
        """
        change = np.diff(self.line * self.line_weights[..., np.newaxis], axis=1)
        tangent: FloatArray = basis @ change
        tangent -= (np.diff(self.line_weights, axis=1) @ basis.T)[..., np.newaxis] * point
        return tangent

    def points(self, basis: FloatArray) -> FloatArray:
        """The points S of the border, (M, K, 3)."""
        weighted_basis = basis * self.line_weights[:, np.newaxis]
        point: FloatArray = (
            weighted_basis @ self.line / weighted_basis.sum(axis=-1)[..., np.newaxis]
        )
        return point

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
        """The length of the longest vector in the nets of the partial across the border."""
        return abs(self.factor) * float(np.linalg.norm(self.next - self.line, axis=-1).max())


def _build_border(batch: TensorPatches, patches: Ints, side: int, factor: float) -> _Border:
    """One side of patches as a border, with points relative to the middle of the batch."""
    line, next_line = (take_side(batch.points, side, k)[patches] - batch.middle for k in range(2))
    weights = np.ones(batch.points.shape[:-1]) if batch.weights is None else batch.weights
    line_weights, next_weights = (take_side(weights, side, k)[patches] for k in range(2))
    # On the sides u = 1 and v = 1, the partial points from the next line to the side.
    return _Border(line, next_line, line_weights, next_weights, -factor if side % 2 else factor)


def _compare_borders(first: _Border, last: _Border) -> Continuity | None:
    """The continuity of the seam of two borders with equal control points.

    None if their weights differ by more than a common factor.
    """
    first_shares, last_shares = (b.line_weights / b.line_weights.max() for b in (first, last))
    if not (np.abs(first_shares - last_shares) <= SAME_WEIGHT).all():
        return None
    degree = first.line.shape[1] - 1
    parameters = sample_parameters(4 * degree)
    basis, lower_basis = bernstein(degree, parameters), bernstein(degree - 1, parameters)
    longest = max(first.longest, last.longest)
    # Over all points: the largest |a − b|, how many have planes on both sides, whether all are G1.
    distance, plane_count, is_smooth = 0.0, 0, True
    for start in range(0, len(first.line), CHUNK_PATCHES):
        first_run, last_run = (
            border.take(slice(start, start + CHUNK_PATCHES)) for border in (first, last)
        )
        seam = first_run.points(basis)
        a, b, t = (
            first_run.across(seam, basis),
            last_run.across(seam, basis),
            first_run.along(seam, lower_basis),
        )
        distance = max(distance, float(np.linalg.norm(a - b, axis=-1).max()))
        normal, is_plane = _find_normals(a, t, longest)
        other_normal, is_other_plane = _find_normals(b, t, longest)
        have_planes = is_plane & is_other_plane
        plane_count += int(have_planes.sum())
        differs = np.linalg.norm(normal - other_normal, axis=-1) > SAME_PLANE
        is_smooth = (
            is_smooth
            and not (differs & have_planes).any()
            and bool((is_plane == is_other_plane).all())
        )
    if distance <= SAME_PARTIAL * longest and longest > 0:
        return "C1"
    return "G1" if is_smooth and plane_count else "C0"


def _find_normals(
    across: FloatArray, along: FloatArray, longest: float
) -> tuple[FloatArray, Bools]:
    """Unit normals of the planes of pairs of tangents, and whether each pair spans a plane."""
    normal = cross(across, along, -1)
    normal_length, across_length, along_length = (
        np.linalg.norm(rows, axis=-1) for rows in (normal, across, along)
    )
    is_plane = (normal_length > NO_PLANE * across_length * along_length) & (
        across_length > NO_PLANE * longest
    )
    unit = np.divide(
        normal, normal_length[..., np.newaxis], where=is_plane[..., np.newaxis], out=normal
    )
    return unit, is_plane
