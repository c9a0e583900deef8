"""Bézier surfaces of one patch of any degree, tensor-product or triangular, rational or not."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray
from service.surface.batches import Channel, TensorPatches, TrianglePatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import (
    Up,
    check_grid,
    check_triangle,
    check_up,
    validate_points,
    validate_weights,
)
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.sizes import NetSurface, SurfaceSize, tensor_size

ENDS = np.array([0.0, 1.0])
ENDS.flags.writeable = False
UNIT_SQUARE = Domain(ENDS, ENDS)


@dataclass(frozen=True, eq=False, slots=True)
class _OnePatch(NetSurface):
    """The base of both forms of one patch: its fields and its lowering to a batch of this form."""

    form: ClassVar[type[TensorPatches | TrianglePatches]]
    domains: ClassVar[tuple[Domain, ...]] = ()

    control_net: FloatArray
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS

    def lower(self) -> PatchModel:
        """The surface as a batch of one patch."""
        weights = None if self.weights is None else self.weights[np.newaxis]
        channels: tuple[Channel, ...] = ()
        if self.channels is not NO_CHANNELS:
            channels = self.channels.lower(lambda net: net[np.newaxis])
        batch = self.form(self.control_net[np.newaxis], weights, channels)
        return PatchModel(self.name, (batch,), (Part(self.name, 0, 1),), self.up, self.domains)


@dataclass(frozen=True, eq=False, slots=True)
class BezierSurface(_OnePatch):
    """S(u, v) = Σ_ij B_i^p(u) B_j^q(v) P_ij over u, v ∈ [0, 1]; rational if weights are given.

    Attributes
    ----------
    control_net : ndarray of float64, shape (p+1, q+1, 3)
        Control points; axis 0 runs along u, axis 1 along v. Model units.
    weights : ndarray of float64, shape (p+1, q+1), or None
        Positive weights.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the part and of its glTF node.
    channels : Channels
        Colours, texture coordinates and attributes: nets of any degree over the same u and v.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., sections 1.4 and 1.5.
    """

    form: ClassVar = TensorPatches
    domains: ClassVar = (UNIT_SQUARE,)

    def __post_init__(self) -> None:
        points = validate_points(self.control_net, "control_net", axes=3)
        rows, columns, _ = points.shape
        check_grid(rows, columns, "control_net")
        object.__setattr__(self, "control_net", points)
        object.__setattr__(self, "weights", validate_weights(self.weights, (rows, columns)))
        if self.channels is not NO_CHANNELS:
            self.channels.check_spans()
        check_up(self.up)

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return self.control_net.shape[0] - 1, self.control_net.shape[1] - 1

    def size(self) -> SurfaceSize:
        """The size of one tensor-product patch."""
        return tensor_size(1, self.degree, self.weights, self.channels, name=self.name)


@dataclass(frozen=True, eq=False, slots=True)
class TriangleSurface(_OnePatch):
    """S(r, s, t) = Σ B_ijk^n(r, s, t) b_ijk over r + s + t = 1; rational if weights are given.

        B_ijk^n(r, s, t) = n!/(i! j! k!) r^i s^j t^k,  i + j + k = n

    Attributes
    ----------
    control_net : ndarray of float64, shape ((n+1)(n+2)/2, 3)
        Control points in rows of constant k, in each of which j ascends (`service.bases.triangle`).
        Model units.
    weights : ndarray of float64, shape ((n+1)(n+2)/2,), or None
        Positive weights.
    up : "y" or "z"
        The model's vertical axis.
    name : str
        Name of the part and of its glTF node.
    channels : Channels
        Colours, texture coordinates and attributes: nets of any degree over the same triangle, in
        the same order.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the surface.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., chapters 17 and 18.
    """

    form: ClassVar = TrianglePatches

    def __post_init__(self) -> None:
        points = validate_points(self.control_net, "control_net", axes=2)
        check_triangle(len(points), "control_net")
        object.__setattr__(self, "control_net", points)
        object.__setattr__(self, "weights", validate_weights(self.weights, (len(points),)))
        self.channels.check_triangles()
        check_up(self.up)

    @property
    def degree(self) -> int:
        """Degree n."""
        return triangle.degree_of(len(self.control_net))

    def size(self) -> SurfaceSize:
        """The size of one triangular patch."""
        n, name = self.degree, self.name
        return tensor_size(1, (n, n), self.weights, self.channels, name=name, is_triangular=True)
