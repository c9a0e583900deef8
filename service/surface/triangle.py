"""A triangular Bézier surface: one patch of any degree, polynomial or rational."""

from dataclasses import dataclass

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray
from service.surface.batches import TrianglePatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import Up, check_triangle, check_up, validate_points, validate_weights
from service.surface.lowered import Part, PatchModel
from service.surface.sizes import NetSurface, SurfaceSize, tensor_size


@dataclass(frozen=True, eq=False, slots=True)
class TriangleSurface(NetSurface):
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

    control_net: FloatArray
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS

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

    def lower(self) -> PatchModel:
        """The surface as a batch of one patch."""
        weights = None if self.weights is None else self.weights[np.newaxis]
        channels = self.channels.lower(lambda net: net[np.newaxis])
        batch = TrianglePatches(self.control_net[np.newaxis], weights, channels)
        return PatchModel(self.name, (batch,), (Part(self.name, 0, 1),), self.up)
