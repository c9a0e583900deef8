"""The waist of the house: every kind of surface lowers to batches of Bézier patches.

What stands above (kinds of surface) and below (engine, encoders) meets only here.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.surface.sides import side_of

Up: TypeAlias = Literal["y", "z"]
ChannelKind: TypeAlias = Literal["colors", "uvs", "attribute"]


@dataclass(frozen=True, eq=False, slots=True)
class Channel:
    """A function of the parameters that is evaluated beside the points: polynomial Bézier nets.

    Attributes
    ----------
    name : str
        "colors" (RGB or RGBA, sRGB, 0 … 1), "uvs" (texture coordinates), or an attribute's name.
    kind : "colors", "uvs" or "attribute"
    nets : ndarray of float64, shape (P, a+1, b+1, d), or (P, (a+1)(a+2)/2, d) beside triangles
        One net a patch, of a degree of its own, over the patch's own parameters. Read-only.
    """

    name: str
    kind: ChannelKind
    nets: FloatArray

    def __post_init__(self) -> None:
        self.nets.flags.writeable = False

    @property
    def dimension(self) -> int:
        """Numbers at each parameter, d."""
        return int(self.nets.shape[-1])


@dataclass(frozen=True, eq=False, slots=True)
class Poles:
    """Patches of which one side is one point, and how the patch leaves that point.

    Attributes
    ----------
    side : int
        0 … 3, see `service.surface.sides`.
    patches : ndarray of int, shape (m,)
    cones : ndarray of float64, shape (m, n+1, 3)
        The next row of control points, seen from the pole and times their weights: a Bézier curve
        over which the patch is, to first order, a cone.
    """

    side: int
    patches: NDArray[np.intp]
    cones: FloatArray


@dataclass(frozen=True, eq=False)
class TensorPatches:
    """A batch of P tensor-product Bézier patches of one degree (p, q).

        S_k(u, v) = Σ_ij B_i^p(u) B_j^q(v) w_kij P_kij / Σ_ij B_i^p(u) B_j^q(v) w_kij

    The weights stand beside the points instead of inside homogeneous ones, so that a local
    origin can be subtracted from the points without losing their last digits, and so that a
    corner of a rational patch is its control point, bit for bit.

    Attributes
    ----------
    points : ndarray of float64, shape (P, p+1, q+1, 3)
        Control points; axis 1 runs along u, axis 2 along v. Model units. Read-only.
    weights : ndarray of float64, shape (P, p+1, q+1), or None
        Positive weights; None for a polynomial batch. Read-only.
    channels : tuple of Channel
        All batches of a model have the same names, kinds and dimensions, in the same order.
    """

    points: FloatArray
    weights: FloatArray | None = None
    channels: tuple[Channel, ...] = ()

    def __post_init__(self) -> None:
        self.points.flags.writeable = False
        if self.weights is not None:
            self.weights.flags.writeable = False

    @property
    def count(self) -> int:
        """Number of patches, P."""
        return int(self.points.shape[0])

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return int(self.points.shape[1]) - 1, int(self.points.shape[2]) - 1

    def take(self, index: NDArray[np.intp]) -> "TensorPatches":
        """Some of the patches."""
        weights = None if self.weights is None else self.weights[index]
        channels = tuple(replace(c, nets=c.nets[index]) for c in self.channels)
        return TensorPatches(self.points[index], weights, channels)

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates of the control points: they enclose the patches."""
        flat = self.points.reshape(-1, 3)
        return flat.min(axis=0), flat.max(axis=0)

    @cached_property
    def middle(self) -> FloatArray:
        """Middle of the bounds, shape (3,)."""
        low, high = self.bounds
        return low + (high - low) / 2

    @cached_property
    def extent(self) -> float:
        """Longest side of the bounds."""
        low, high = self.bounds
        return float((high - low).max())

    @cached_property
    def collapsed(self) -> NDArray[np.bool_]:
        """Which sides are one point, shape (P, 4)."""
        sides = (side_of(self.points, side) for side in range(4))
        return np.stack([(s == s[:, :1]).all(axis=(1, 2)) for s in sides], axis=1)

    @cached_property
    def poles(self) -> tuple["Poles", ...]:
        """Sides that are one point, with what is next to them."""
        found = ((side, np.flatnonzero(self.collapsed[:, side])) for side in range(4))
        return tuple(self._poles(side, index) for side, index in found if len(index))

    def _poles(self, side: int, index: NDArray[np.intp]) -> "Poles":
        cones = side_of(self.points, side, 1)[index] - side_of(self.points, side)[index, :1]
        if self.weights is not None:
            cones *= side_of(self.weights, side, 1)[index, :, np.newaxis]
        return Poles(side, index, cones)


@dataclass(frozen=True, slots=True)
class Part:
    """A named run of patches, [first, last) in the numbering across all batches of a model."""

    name: str
    first: int
    last: int


@dataclass(frozen=True, eq=False, slots=True)
class Domain:
    """The rectangle of parameters that the patches of a surface divide among themselves.

    Patch (k, l) covers [u_k, u_{k+1}] × [v_l, v_{l+1}] and has number k M_v + l.

    Attributes
    ----------
    u, v : ndarray of float64, shapes (M_u+1,) and (M_v+1,)
        Strictly increasing: the distinct knots of a B-spline's domain, (0, 1) for one patch.
    """

    u: FloatArray
    v: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class PatchModel:
    """A surface lowered to Bézier patches: all that the engine and the encoders need to know.

    The parts cover the patches without gap or overlap, in order; a surface without parts of its
    own is one part of the surface's name. `up` is the model's vertical axis. `domain` is there if
    the patches, all in one batch, are pieces of one parametric surface; else the parameters of
    every patch are its own, in [0, 1].
    """

    name: str
    batches: tuple[TensorPatches, ...]
    parts: tuple[Part, ...]
    up: Up = "y"
    domain: Domain | None = None

    @property
    def patch_count(self) -> int:
        """Number of patches in all batches."""
        return sum(batch.count for batch in self.batches)
