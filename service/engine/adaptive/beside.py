"""Normals along the edges of faces: how far they turn from one vertex to the next.

An edge that is straight has no tangents that turn, but the surface beside it may be twisted. So
where an angle is asked for, edges are divided by the normals on all their sides as well.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.chains import Chains
from service.engine.adaptive.faces import SPAN, Faces
from service.engine.adaptive.ground import Ground
from service.engine.adaptive.turning import NONE, apart, chord_of, ends, helpful
from service.engine.adaptive.vectors import Vectors, cross, length


@dataclass(frozen=True, eq=False, slots=True)
class Beside:
    """What lies along C chains: the runs along chain c are rows `start[c]` to `start[c+1]`.

    Attributes
    ----------
    ground : Ground
    angle : float
        Radians that normals may turn between neighbouring vertices.
    start : ndarray of int, shape (C+1,)
    patch, step, side : ndarray of int, shape (R,)
        The patch of a run along the first edge of the chain, what is added for each further edge,
        and which side of the patches the run is.
    backward : ndarray of bool, shape (R,)
        Whether these sides run against the chain.
    """

    ground: Ground
    angle: float
    start: Ints
    patch: Ints
    step: Ints
    side: Ints
    backward: Bools

    @classmethod
    def of(cls, ground: Ground, faces: Faces, chains: Chains, angle: float) -> "Beside":
        """The sides of faces along their chains."""
        begin, step, _ = (values.ravel() for values in faces.sides())
        order = np.argsort(chains.chain, kind="stable")
        side, chain, backward = chains.side[order], chains.chain[order], chains.reversed[order]
        first = chains.first[order] + np.where(backward, chains.length[chain] - 1, 0)
        return cls(
            ground,
            angle,
            np.concatenate([[0], np.cumsum(chains.uses)]).astype(np.intp),
            begin[side] + step[side] * first,
            np.where(backward, -step[side], step[side]),
            side % 4,
            backward,
        )

    def turned(self, chain: Ints, edge: Ints, at: Ints, size: int, extent: FloatArray) -> Bools:
        """Which parts of edges must be cut, from `at` on and of this size: normals turn too far.

        The rule is that of cells: what is short, in places and in space, is cut only where that
        helps.
        """
        most, share = chord_of(self.angle), size / SPAN
        found = np.zeros(len(chain), dtype=bool)
        for rows, run in self._users(chain):
            a, b, c = self._three(run, edge[rows], at[rows], size)
            half = np.maximum(apart(a, b), apart(b, c))
            whole = np.maximum(half, apart(a, c))
            patch = self.patch[run] + edge[rows] * self.step[run]
            helps = helpful((half, whole), share, extent[rows], self.ground.sizes[patch])
            found[rows] |= helps & (whole > most)
        return found

    def turned_together(self, chain: Ints, edge: Ints, begin: Ints) -> Bools:
        """Which runs of whole edges must be cut, `begin` being the first of each.

        No normal may be further than half the angle from one in the middle of the run.
        """
        count = np.diff(np.append(begin, len(chain)))
        middle = np.repeat(begin + count // 2, count)
        greatest = np.zeros(len(chain))
        for rows, run in self._users(chain):
            three = self._three(run, edge[rows], np.zeros_like(rows), SPAN)
            # All edges of a run have as many users: what is in the middle is among the rows.
            own = three[1][:, np.searchsorted(rows, middle[rows])]
            for normal in three:
                greatest[rows] = np.maximum(greatest[rows], apart(normal, own))
        worst: FloatArray = np.maximum.reduceat(greatest, begin) if len(begin) else greatest
        turned: Bools = worst > chord_of(self.angle / 2.0)
        return turned

    def _users(self, chain: Ints) -> list[tuple[Ints, Ints]]:
        """First, second, … users of chains: which of the chains have one, and its run."""
        count = np.diff(self.start)[chain]
        rows = [np.flatnonzero(count > k) for k in range(int(count.max(initial=0)))]
        return [(row, self.start[chain[row]] + k) for k, row in enumerate(rows)]

    def _three(
        self, run: Ints, edge: Ints, at: Ints, size: int
    ) -> tuple[Vectors, Vectors, Vectors]:
        """Normals at the beginning, in the middle and at the end of parts of edges."""
        a, b, c = (self._normals(run, edge, at + step) for step in (0, size // 2, size))
        first, last = ends(a, b, c)
        return first, b, last

    def _normals(self, run: Ints, edge: Ints, at: Ints) -> Vectors:
        """Unit normals (3, m) at places of edges, beside a run; zero where there is none."""
        patch, side = self.patch[run] + edge * self.step[run], self.side[run]
        along = np.where(self.backward[run], SPAN - at, at) / SPAN
        far = (side % 2).astype(np.float64)
        u, v = np.where(side < 2, far, along), np.where(side < 2, along, far)
        slope_u, slope_v = (np.ascontiguousarray(s.T) for s in self.ground.partials(patch, u, v))
        normal = cross(slope_u, slope_v)
        size, long_u, long_v = length(normal), length(slope_u), length(slope_v)
        real = NONE * self.ground.sizes[patch]
        some = (size > NONE * long_u * long_v) & (long_u > real) & (long_v > real)
        return normal * (some / np.where(some, size, 1.0))
