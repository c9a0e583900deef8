"""A tensor-product Bézier surface: one patch of any degree, polynomial or rational."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.batches import Channel, TensorPatches
from service.surface.channels import NO_CHANNELS, Channels
from service.surface.checks import Up, check_grid, check_up, validate_points, validate_weights
from service.surface.lowered import Domain, Part, PatchModel
from service.surface.sizes import NetSurface, SurfaceSize, tensor_size

ENDS = np.array([0.0, 1.0])
ENDS.flags.writeable = False
UNIT_SQUARE = Domain(ENDS, ENDS)


@dataclass(frozen=True, eq=False, slots=True)
class BezierSurface(NetSurface):
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

    control_net: FloatArray
    weights: FloatArray | None = None
    up: Up = "y"
    name: str = "surface"
    channels: Channels = NO_CHANNELS

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

    def lower(self) -> PatchModel:
        """The surface as a batch of one patch."""
        weights = None if self.weights is None else self.weights[np.newaxis]
        channels: tuple[Channel, ...] = ()
        if self.channels is not NO_CHANNELS:
            channels = self.channels.lower(lambda net: net[np.newaxis])
        batch = TensorPatches(self.control_net[np.newaxis], weights, channels)
        return PatchModel(self.name, (batch,), (Part(self.name, 0, 1),), self.up, (UNIT_SQUARE,))
