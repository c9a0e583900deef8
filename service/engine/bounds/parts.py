"""Parts of a surface and their proved bounds: the input and the result of the certificate."""

from dataclasses import dataclass

from service.bases.arrays import Bools, FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Parts:
    """m triangles of places, and the triangles of the mesh that their surface is measured against.

    Attributes
    ----------
    face : ndarray of int, shape (m,)
    corners : ndarray of int, shape (m, 3, 2)
        Places of the face. Neighbouring parts share whole edges.
    host : ndarray of int, shape (m, 3)
        The vertices of the triangle of the mesh: those at the corners, in their order, if the part
        is its own.
    across : ndarray of int, shape (m, 3)
        The vertex opposite edge (k, k + 1) of the host in the triangle beyond it; -1 if there is
        none or it is not known.
    is_own : ndarray of bool, shape (m,), or None
        Whether the host is the image of the part; None if all are.
    """

    face: Ints
    corners: Ints
    host: Ints
    across: Ints
    is_own: Bools | None = None

    def take(self, rows: slice) -> "Parts":
        """A run of the parts."""
        is_own = None if self.is_own is None else self.is_own[rows]
        return Parts(
            self.face[rows], self.corners[rows], self.host[rows], self.across[rows], is_own
        )


@dataclass(frozen=True, eq=False, slots=True)
class PartBounds:
    """Proved bounds of m parts, in model units; see `Triangulation` for how a mesh keeps them.

    Attributes
    ----------
    deviation : ndarray of float64, shape (m,)
        No point of the part is further than this from the mesh.
    mesh : ndarray of float64, shape (m,), or None
        No point of the host is further than this from the surface; 0 where the host is not the
        part's own.
    allowed : ndarray of float64, shape (m,)
        The deviation that the goal allows at the part's distance from the eye.
    """

    deviation: FloatArray
    mesh: FloatArray | None
    allowed: FloatArray

    @property
    def passed(self) -> Bools:
        """Which parts meet the goal."""
        passed: Bools = self.deviation <= self.allowed
        if self.mesh is not None:
            passed &= self.mesh <= 2 * self.allowed
        return passed
