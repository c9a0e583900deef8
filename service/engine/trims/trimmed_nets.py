"""The trims of nets: which rectangles and which parameters of nets are in the regions of faces.

Proof in docs/proofs.md: "Rectangles of a trimmed region".
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.trims.border_rectangles import INNER, Rectangles, wind_about_rectangles
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED, Regions
from service.engine.trims.places import SIZE

WHOLE, COVER = -1, -2
"""The faces of nets without trims, and of nets that only stand for borders near them."""

NEAR_SIDES = 2 * INNER
"""A parameter that is within this number of margins of a side of a rectangle is tested by itself,
also if the rectangle is inside; and smaller rectangles are not decided."""


@dataclass(frozen=True, eq=False)
class NetTrims:
    """The trims of N nets.

    Attributes
    ----------
    regions : Regions
    face : ndarray of int, shape (N,)
        The face of `regions` to whose surface each net belongs; `WHOLE` for nets without trims, and
        `COVER` for nets that only stand for borders near them: their points are never answers.
    low, high : ndarray of float64, shape (N, 2)
        The parameters of the surface of the face at the corners (0, 0) and (1, 1) of each net.
    gaps : ndarray of float64, shape (N,)
        Borders for which a net stands are no further from it. In the coordinates of the nets.
    reaches : ndarray of float64, shape (N,)
        A point of a net whose parameters are undecided is no further from a point that is inside.
        In the coordinates of the nets; infinite for `COVER`.
    """

    regions: Regions
    face: Ints
    low: FloatArray
    high: FloatArray
    gaps: FloatArray
    reaches: FloatArray

    def classify(self, net: Ints, rectangle: FloatArray) -> Ints:
        """Where rectangles of nets (m,) are: `INSIDE`, `OUTSIDE` or `UNDECIDED`.

        `rectangle` (4, m) has the rows u₀, u₁, v₀, v₁ of parameters of the nets. `OUTSIDE`: no
        point of the region of the face is in the rectangle. `INSIDE`: all of it is in the region,
        but the border may be within some margins of its sides (`needs_test`). Other rectangles
        are undecided: they are cut by borders, seams or poles, or may be. Rectangles of nets
        without trims are `INSIDE`, and those of `COVER` undecided.
        """
        answers = np.where(self.face[net] == COVER, UNDECIDED, INSIDE)
        rows = (self.face[net] >= 0).nonzero()[0]
        if not len(rows):
            return answers
        own = net[rows]
        face = self.face[own]
        corner, side = self._corner.take(own, axis=1), self._side.take(own, axis=1)
        low, high = (corner + side * rectangle[k::2, rows] for k in range(2))
        margins = self.regions.margins[face]
        rectangles = Rectangles(low + (high - low) / 2, (high - low) / 2, margins)
        found = wind_about_rectangles(self.regions.tree, rectangles, *self.regions.list_roots(face))
        is_inside = found.numbers == 1
        is_undecided = found.is_cut | (found.is_met & ~is_inside)
        is_undecided |= (rectangles.halves < NEAR_SIDES * margins).any(axis=0)
        answers[rows] = np.where(is_undecided, UNDECIDED, np.where(is_inside, INSIDE, OUTSIDE))
        return answers

    def find_inside(self, net: Ints, parameters: FloatArray) -> Ints:
        """Where parameters (2, m) of nets (m,) are: `INSIDE`, `OUTSIDE` or `UNDECIDED`.

        `UNDECIDED`: on a border, up to rounding. Seams and poles are inside. Parameters of nets
        without trims are `INSIDE`, and those of `COVER` undecided.
        """
        answers = np.where(self.face[net] == COVER, UNDECIDED, INSIDE)
        rows = (self.face[net] >= 0).nonzero()[0]
        if len(rows):
            # Many points have the same place, such as a corner of a cell: it is tested once.
            place = np.stack([net[rows], *parameters[:, rows]])
            order = np.lexsort(place)
            ordered = place[:, order]
            is_new = np.ones(len(rows), bool)
            is_new[1:] = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)
            one = rows[order[is_new]]
            own = net[one]
            of_face = self.to_face(own, parameters[:, one])
            found = self.regions.find_inside(self.face[own], of_face).inside
            answers[rows[order]] = found[is_new.cumsum() - 1]
        return answers

    def needs_test(self, net: Ints, rectangle: FloatArray, parameters: FloatArray) -> Bools:
        """Whether parameters (2, m) are so near to sides of `INSIDE` rectangles (4, m) of nets.

        Other parameters of these rectangles are inside.
        """
        is_near = np.zeros(len(net), bool)
        rows = (self.face[net] >= 0).nonzero()[0]
        if len(rows):
            own = net[rows]
            reach = NEAR_SIDES * self.regions.margins[self.face[own]]
            distances = [
                np.abs(rectangle[k::2, rows] - parameters[:, rows]) * self._side.take(own, axis=1)
                for k in range(2)
            ]
            is_near[rows] = (np.minimum(*distances) <= reach).any(axis=0)
        return is_near

    def to_face(self, net: Ints, parameters: FloatArray) -> FloatArray:
        """Parameters (m, 2) of the surfaces of faces, from parameters (2, m) of nets (m,)."""
        low, high, share = self.low[net], self.high[net], parameters.T
        of_face: FloatArray = np.where(share == 1.0, high, low + share * (high - low))
        return of_face

    @cached_property
    def _corner(self) -> FloatArray:
        """The places (2, N) of the corners (0, 0) of nets."""
        face = np.maximum(self.face, 0)
        return np.ascontiguousarray(self.regions.places.to_places(face, self.low).T)

    @cached_property
    def _side(self) -> FloatArray:
        """The lengths (2, N) of nets in places."""
        units = (SIZE / self.regions.places.extent)[np.maximum(self.face, 0)]
        return np.ascontiguousarray(((self.high - self.low) * units).T)
