"""The surfaces of all faces as patches of one model, evaluated at parameters of their own domains.

A plane (a bilinear surface that is affine) is one patch, whose domain is moved to wherever the
parameter curves of its face are.
"""

from dataclasses import dataclass

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.faces import Faces
from service.engine.nets.patch_nets import PatchNets
from service.surface.lowered import PatchModel
from service.surface.spline_tables import SurfaceTable


@dataclass(frozen=True, eq=False)
class FaceSurfaces:
    """The surfaces of F faces.

    Attributes
    ----------
    model : PatchModel
        A tensor patch for each pair of spans: one batch for each degree.
    nets : PatchNets
    faces : Faces
        Span (k, l) of face f is patch `first[f] + k stride[f] + l`.
    first_break : ndarray of int, shape (2, F)
        The knots between spans along axis a of face f are the `faces.spans[a, f]` + 1 numbers of
        `breaks` from this row on.
    breaks : ndarray of float64, shape (B,)
    is_planar : ndarray of bool, shape (F,)
        Whether a surface is affine in its parameters, up to `errors`.
    errors : ndarray of float64, shape (F,)
        Bounds of the distances between the patches and the surfaces of the request.
    """

    model: PatchModel
    nets: PatchNets
    faces: Faces
    first_break: Ints
    breaks: FloatArray
    is_planar: Bools
    errors: FloatArray

    @classmethod
    def of(cls, table: SurfaceTable, name: str = "brep") -> "FaceSurfaces":
        """All surfaces of a table, lowered to Bézier patches."""
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self.is_planar)

    @property
    def low(self) -> FloatArray:
        """The least parameters (F, 2) of the domains."""
        raise NotImplementedError

    @property
    def high(self) -> FloatArray:
        """The greatest parameters (F, 2) of the domains."""
        raise NotImplementedError

    def move_planes(self, low: FloatArray, high: FloatArray) -> "FaceSurfaces":
        """The surfaces after the domains of planes have become [low, high], (F, 2) each."""
        raise NotImplementedError

    def evaluate(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Points (m, 3) of faces (m,) at parameters (m, 2) of their own domains.

        Parameters are clamped to the domain, but those of planes, which have no ends.
        """
        raise NotImplementedError

    def evaluate_partials(self, face: Ints, parameters: FloatArray, order: int = 1) -> FloatArray:
        """S, S_u, S_v and, if `order` is 2, S_uu, S_uv, S_vv: shape (3 or 6, m, 3).

        Partials are with respect to the parameters of the surface.
        """
        raise NotImplementedError
