"""Batches of Bézier patches of one degree, tensor-product or triangular, and their channels."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import hypot
from typing import Literal, Self, TypeAlias

import numpy as np

from service.bases import triangle
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle import exchange_order, tensor_net
from service.surface.sides import along_sides, take_side

SideNumbers: TypeAlias = tuple[int, int, int, int]
"""A whole number for each side."""

ChannelKind: TypeAlias = Literal["colors", "uvs", "attribute"]

PATCHES_IN_ROW = 16
"""To find least and greatest coordinates, the control points of this number of patches are taken as
one long row: NumPy reduces long rows faster."""


@dataclass(frozen=True, eq=False, slots=True)
class Channel:
    """A polynomial function of the parameters, for example a colour.

    Attributes
    ----------
    name : str
        "colors" (RGB or RGBA, sRGB, 0 … 1), "uvs" (texture coordinates), or an attribute's name.
    kind : "colors", "uvs" or "attribute"
    nets : ndarray of float64, shape (P, a+1, b+1, d), or (P, (a+1)(a+2)/2, d) for triangles
        One net of degree (a, b), or a, for each patch, over the parameters of the patch; values
        have d numbers. The degree of a net may differ from that of the points. Read-only.
    """

    name: str
    kind: ChannelKind
    nets: FloatArray

    def __post_init__(self) -> None:
        self.nets.flags.writeable = False

    @property
    def dimension(self) -> int:
        """How many numbers each value has, d."""
        return int(self.nets.shape[-1])


class _Box:
    """A box parallel to the axes: least and greatest coordinates, middle, extent and diagonal."""

    __slots__ = ("diagonal", "extent", "high", "low", "middle")

    def __init__(self, low: list[float], high: list[float]) -> None:
        self.low, self.high = low, high
        (low_x, low_y, low_z), (high_x, high_y, high_z) = low, high
        sides = high_x - low_x, high_y - low_y, high_z - low_z
        self.extent, self.diagonal = max(sides), hypot(*sides)
        self.middle = np.array([low_x + sides[0] / 2, low_y + sides[1] / 2, low_z + sides[2] / 2])


@dataclass(frozen=True, eq=False)
class _Batch(ABC):
    """The base of both forms of patches. Each patch has four sides (`service.surface.sides`).

    `count` is the number of patches, P.
    """

    points: FloatArray
    weights: FloatArray | None = None
    channels: tuple[Channel, ...] = ()

    count: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", len(self.points))
        self.points.flags.writeable = False
        if self.weights is not None:
            self.weights.flags.writeable = False

    @abstractmethod
    def side(self, number: int) -> tuple[FloatArray, FloatArray | None]:
        """One side, of degree n, of all patches: points (P, n+1, 3), weights (P, n+1) or None."""

    def take(self, index: Ints) -> Self:
        """A batch of the patches with these numbers."""
        weights = None if self.weights is None else self.weights[index]
        channels = tuple(replace(c, nets=c.nets[index]) for c in self.channels)
        return replace(self, points=self.points[index], weights=weights, channels=channels)

    def exchange_parameters(self) -> Self:
        """The patches with u and v exchanged, triangles with s and t."""
        weights = None if self.weights is None else self._exchange(self.weights)
        channels = tuple(replace(c, nets=self._exchange(c.nets)) for c in self.channels)
        return replace(self, points=self._exchange(self.points), weights=weights, channels=channels)

    @staticmethod
    @abstractmethod
    def _exchange(nets: FloatArray) -> FloatArray:
        """Nets of points, weights or channels with both parameters exchanged."""

    @property
    @abstractmethod
    def collapsed(self) -> Bools:
        """Which sides are one point, shape (P, 4); the last side of a triangle always is."""

    @cached_property
    def _box(self) -> "_Box":
        """The box of the control points."""
        rows = self.points.reshape(self.count, -1)
        low = high = rows[0]
        if self.count > 1:
            # Reducing long rows is ten times faster than reducing rows of three numbers. The last
            # patches are taken separately, in case the count is not a multiple of `PATCHES_IN_ROW`.
            patches_in_row = PATCHES_IN_ROW if self.count >= 4 * PATCHES_IN_ROW else 1
            long_rows = rows[: self.count // patches_in_row * patches_in_row].reshape(
                -1, patches_in_row * rows.shape[1]
            )
            last_row = rows[-patches_in_row:].reshape(-1)
            low = np.minimum(np.minimum.reduce(long_rows), last_row)
            high = np.maximum(np.maximum.reduce(long_rows), last_row)
        return _Box(
            np.minimum.reduce(low.reshape(-1, 3)).tolist(),
            np.maximum.reduce(high.reshape(-1, 3)).tolist(),
        )

    @property
    def box(self) -> tuple[list[float], list[float]]:
        """Least and greatest coordinates of the control points; the box contains the patches."""
        return self._box.low, self._box.high

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates of the control points, as arrays (3,)."""
        return np.array(self._box.low), np.array(self._box.high)

    @property
    def middle(self) -> FloatArray:
        """Middle of the box, shape (3,)."""
        return self._box.middle

    @property
    def extent(self) -> float:
        """Longest side of the box."""
        return self._box.extent

    @property
    def diagonal(self) -> float:
        """Diagonal of the box."""
        return self._box.diagonal


@dataclass(frozen=True, eq=False)
class TensorPatches(_Batch):
    """A batch of P tensor-product Bézier patches of one degree (p, q).

        S_k(u, v) = Σ_ij B_i^p(u) B_j^q(v) w_kij P_kij / Σ_ij B_i^p(u) B_j^q(v) w_kij

    Points and weights are stored separately, not as homogeneous coordinates. So a local origin can
    be subtracted from the points without loss of digits, and a corner of a rational patch equals
    its control point, bit for bit.

    Attributes
    ----------
    points : ndarray of float64, shape (P, p+1, q+1, 3)
        Control points; axis 1 runs along u, axis 2 along v. Model units. Read-only.
    weights : ndarray of float64, shape (P, p+1, q+1), or None
        Positive weights; None for a polynomial batch. Read-only.
    channels : tuple of Channel
        All batches of a model have the same names, kinds and dimensions, in the same order.
    degree : (int, int)
        (p, q).
    """

    degree: tuple[int, int] = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        _, rows, columns, _ = self.points.shape
        object.__setattr__(self, "degree", (rows - 1, columns - 1))

    @property
    def side_degrees(self) -> SideNumbers:
        """Degree of each side."""
        return along_sides(*self.degree)

    @property
    def corners(self) -> FloatArray:
        """Corner points at (u, v) = (0, 0), (0, 1), (1, 0) and (1, 1), shape (P, 4, 3)."""
        p, q = self.degree
        # The steps p and q take the first and the last row and column.
        return self.points[:, ::p, ::q].reshape(-1, 4, 3)

    def side(self, number: int) -> tuple[FloatArray, FloatArray | None]:
        """One side, of degree n, of all patches: points (P, n+1, 3), weights (P, n+1) or None."""
        weights = None if self.weights is None else take_side(self.weights, number)
        return take_side(self.points, number), weights

    @staticmethod
    def _exchange(nets: FloatArray) -> FloatArray:
        return np.ascontiguousarray(nets.swapaxes(1, 2))

    def set_collapsed(self, collapsed: Bools) -> None:
        """Store the value of the property `collapsed`, if the caller has already computed it."""
        self.__dict__["collapsed"] = collapsed

    @cached_property
    def collapsed(self) -> Bools:
        """Which sides are one point, shape (P, 4)."""
        p, q = self.degree
        # Axes: coordinate, u = 0 or 1, v = 0 or 1, patch. Long rows of patches are compared faster.
        corners = self.points[:, ::p, ::q].transpose(3, 1, 2, 0).copy()
        # Only sides whose two ends are equal can be one point; only these are compared in full.
        # `is_equal[:, 0]` compares the ends of the sides u = 0 and u = 1, `is_equal[:, 1]` those of
        # v = 0 and v = 1; `collapsed` gets the axes patch, u or v, and 0 or 1.
        is_equal = np.empty(corners.shape, bool)
        np.equal(corners[:, :, 0], corners[:, :, 1], out=is_equal[:, 0])
        np.equal(corners[:, 0], corners[:, 1], out=is_equal[:, 1])
        collapsed: Bools = np.logical_and.reduce(is_equal).transpose(2, 0, 1).copy()
        if not np.count_nonzero(collapsed):
            return collapsed.reshape(-1, 4)
        for axis, sides in enumerate((self.points[:, ::p], self.points.swapaxes(1, 2)[:, ::q])):
            patch, end = collapsed[:, axis].nonzero()
            if len(patch):
                # The control points of the sides in question, compared with the first of each side.
                side_points = sides[patch, end]
                equals_first = side_points == side_points[:, :1]
                collapsed[patch, axis, end] = equals_first.reshape(len(patch), -1).all(axis=1)
        return collapsed.reshape(-1, 4)


@dataclass(frozen=True, eq=False)
class TrianglePatches(_Batch):
    """A batch of P triangular Bézier patches of one degree n.

        S_l(s, t) = Σ B_ijk^n(r, s, t) w_lijk P_lijk / Σ B_ijk^n(r, s, t) w_lijk,  r = 1 − s − t

    A triangle has the sides and corners of a patch over (u, v) with s = u (1 − v) and t = v, whose
    side v = 1 is one point. Corner (0, 0) is P_n00, corner (1, 0) is P_0n0, corners (0, 1) and
    (1, 1) are P_00n. Sides 0, 1 and 2 are s = 0, r = 0 and t = 0. Side 3 is the point P_00n and has
    degree 0.

    Attributes
    ----------
    points : ndarray of float64, shape (P, (n+1)(n+2)/2, 3)
        Control points in the order of `service.bases.triangle`: rows of constant k, in each of
        which j ascends. Model units. Read-only.
    weights : ndarray of float64, shape (P, (n+1)(n+2)/2), or None
        Positive weights; None for a polynomial batch. Read-only.
    channels : tuple of Channel
        All batches of a model have the same names, kinds and dimensions, in the same order.
    """

    @property
    def degree(self) -> int:
        """Degree n."""
        return triangle.degree_of(int(self.points.shape[1]))

    @property
    def side_degrees(self) -> SideNumbers:
        """Degree of each side."""
        return self.degree, self.degree, self.degree, 0

    @cached_property
    def collapsed(self) -> Bools:
        """Which sides are one point, shape (P, 4); the last side always is."""
        sides = (self.side(number)[0] for number in range(4))
        return np.stack([(s == s[:, :1]).all(axis=(1, 2)) for s in sides], axis=1)

    @property
    def corners(self) -> FloatArray:
        """Corner points, shape (P, 4, 3); the last corner occurs twice."""
        # (u, v) = (0, 0), (0, 1), (1, 0) and (1, 1): P_n00, P_00n, P_0n0 and again P_00n.
        return self.points[:, [0, -1, self.degree, -1]]

    def side(self, number: int) -> tuple[FloatArray, FloatArray | None]:
        """One side, of degree n, of all patches: points (P, n+1, 3), weights (P, n+1) or None."""
        rows: Ints | list[int] = triangle.side_rows(self.degree)[number] if number < 3 else [-1]
        return self.points[:, rows], None if self.weights is None else self.weights[:, rows]

    @staticmethod
    def _exchange(nets: FloatArray) -> FloatArray:
        return nets[:, exchange_order(triangle.degree_of(nets.shape[1]), 1, 2)]

    def to_tensor(self) -> TensorPatches:
        """These triangles as tensor-product patches of degree (n, n), whose side v = 1 is a point.

        Points and channels are functions of s = u (1 − v) and t = v. The conversion is exact, up to
        the rounding of degree elevation.
        """
        n = self.degree
        channels = tuple(
            replace(channel, nets=tensor_net(channel.nets)) for channel in self.channels
        )
        points, weights = tensor_net(to_homogeneous(self.points, self.weights)), None
        if self.weights is not None:
            points, weights = points[..., :3] / points[..., 3:], points[..., 3]
        # Elevation changes neither the row t = 0, which already has degree n, nor the corner t = 1:
        # copy these points, so that rounding of homogeneous coordinates does not matter.
        points[:, :, 0] = self.side(2)[0]
        points[:, :, n] = self.points[:, -1:]
        return TensorPatches(points, weights, channels)


Patches: TypeAlias = TensorPatches | TrianglePatches
"""A batch of patches of either form."""
