"""Places: whole numbers from 0 to 2^30 over the box of the parameter curves of each face.

A small face on a large surface keeps its digits, because the box is that of the face. Knots are
places too; between them a place x has the local parameter (x − K_0) / (K_1 − K_0) in its patch.

Proof in docs/proofs.md: "Places of trimmed faces".
"""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, Ints
from service.engine.bounds.faces import Faces
from service.engine.trims.surfaces import FaceSurfaces

BITS = 30
SIZE = 1 << BITS
"""The box of the parameter curves is this many units long and wide."""


@dataclass(frozen=True, eq=False)
class Places:
    """Places of F faces, and the knots of their surfaces among them.

    Attributes
    ----------
    surfaces : FaceSurfaces
    origin, extent : ndarray of float64, shape (F, 2)
        Place x stands for the parameter origin + x / SIZE · extent.
    faces : Faces
        The spans that the box touches: span (k, l) is patch `first[f] + k stride[f] + l`.
    first_knot : ndarray of int, shape (2, F)
        The knots along axis a of face f are the `faces.spans[a, f]` + 1 numbers of `knots` from
        this row on.
    knots : ndarray of int, shape (K,)
        Strictly increasing for each axis of a face. The first is at most 0, the last at least SIZE.
    """

    surfaces: FaceSurfaces
    origin: FloatArray
    extent: FloatArray
    faces: Faces
    first_knot: Ints
    knots: Ints

    @classmethod
    def of(cls, surfaces: FaceSurfaces, low: FloatArray, high: FloatArray) -> "Places":
        """The places over boxes [low, high], (F, 2) each, of parameters.

        Boxes are made a little larger where they are very thin, and clipped to the domains.
        """
        raise NotImplementedError

    def to_places(self, face: Ints, parameters: FloatArray) -> FloatArray:
        """Places (m, 2), not rounded, of parameters (m, 2)."""
        raise NotImplementedError

    def to_parameters(self, face: Ints, places: FloatArray | Ints) -> FloatArray:
        """Parameters (m, 2) of places (m, 2)."""
        raise NotImplementedError

    def find_spans(
        self, face: Ints, axis: int, low: FloatArray | Ints, high: FloatArray | Ints
    ) -> tuple[Ints, Ints]:
        """The first and the last span (m,) along an axis that intervals [low, high] touch.

        `low` and `high` (m,) are places. A knot belongs to the span after it as `low`, and to the
        span before it as `high`.
        """
        raise NotImplementedError

    def knots_at(self, face: Ints, axis: int, span: Ints) -> tuple[Ints, Ints]:
        """The knots (m,) at which spans begin and end."""
        raise NotImplementedError

    def locate(self, face: Ints, places: FloatArray | Ints) -> tuple[Ints, FloatArray, FloatArray]:
        """Patches (m,), their parameters (2, m) at places (m, 2), and widths (2, m) of spans."""
        raise NotImplementedError

    def evaluate(self, face: Ints, places: FloatArray | Ints) -> FloatArray:
        """Points (m, 3) of the surfaces at places (m, 2)."""
        raise NotImplementedError

    def evaluate_partials(
        self, face: Ints, places: FloatArray | Ints, order: int = 1
    ) -> FloatArray:
        """S, S_u, S_v and, if `order` is 2, S_uu, S_uv, S_vv: shape (3 or 6, m, 3).

        Partials are with respect to places, that is, for each unit.
        """
        raise NotImplementedError
