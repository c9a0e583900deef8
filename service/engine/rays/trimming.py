"""Which hits are inside of trims, given the places where their rays pass edges.

A border of a region is at most the gap from its edge. So where a ray does not pass an edge within
the gap and the thickness, points of a surface that are that near to the ray are all inside of the
trims, or all outside.

Proof in docs/proofs.md: "Hits on trimmed faces".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells.tree import CellTree
from service.engine.rays.bounds import Rays
from service.engine.rays.edge_search import EdgePasses
from service.engine.rays.hits import Hits
from service.engine.rays.intervals import ApartIntervals
from service.engine.rays.newton import Roots
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED
from service.engine.trims.trimmed_nets import NetTrims


@dataclass(frozen=True, eq=False, slots=True)
class RayTrims:
    """The trims of nets, and where m rays pass edges.

    Attributes
    ----------
    trims : NetTrims
    passes : ApartIntervals
        The intervals of t in which rays are near edges.
    """

    trims: NetTrims
    passes: ApartIntervals

    @classmethod
    def of(cls, trims: NetTrims, passes: EdgePasses) -> "RayTrims":
        """The trims for rays with these passes."""
        return cls(trims, ApartIntervals.of(passes.ray, passes.low, passes.high))

    def find_ends(self, near: FloatArray) -> FloatArray:
        """The end (m,) of the first pass of each ray that is not before `near`, or infinity."""
        passes, ends = self.passes, np.full(len(near), np.inf)
        ahead = np.flatnonzero(passes.high >= near[passes.group])
        np.minimum.at(ends, passes.group[ahead], passes.high[ahead])
        return ends

    def find_inside(self, hits: Hits, is_cut: Bools) -> Ints:
        """Whether hits (n,) are inside; `is_cut` says whether a border may cut their cells."""
        inside = np.full(len(is_cut), INSIDE)
        rows = np.flatnonzero(is_cut)
        if len(rows):
            parameters = np.ascontiguousarray(hits.parameters[:, rows])
            inside[rows] = self.trims.find_inside(hits.net[rows], parameters)
        return inside

    def trim_roots(
        self, cells: CellTree, rays: Rays, roots: Roots, cell: Ints
    ) -> tuple[Hits, Bools, Bools]:
        """The roots (n,) in cells (n,) that are not outside.

        Returns
        -------
        hits : Hits
        is_certain : ndarray of bool, shape (n,)
            Which of the hits are inside, without an edge near.
        is_unclear : ndarray of bool, shape (n,)
            Of which of the hits this does not hold for the point where the ray meets the surface,
            because it may be further away than the thickness, and beyond a border.
        """
        hits, is_cut = roots.hits, cells.is_cut[cell]
        inside = self.find_inside(hits, is_cut)
        reach = (hits.high - hits.low) / 2 + hits.residual
        wide = np.flatnonzero(is_cut & (reach > rays.thickness[hits.ray]))
        is_unclear = np.zeros(len(cell), bool)
        if len(wide):
            ends = cells.rectangle[:, cell[wide]]
            margin = roots.radius[wide] * (ends[1::2] - ends[::2]) / 2
            least, most = hits.parameters[:, wide] - margin, hits.parameters[:, wide] + margin
            sides = np.clip(np.stack([least[0], most[0], least[1], most[1]]), 0.0, 1.0)
            answers = self.trims.classify(hits.net[wide], sides)
            is_unclear[wide] = answers == UNDECIDED
            inside[wide] = np.where(answers == UNDECIDED, inside[wide], answers)
        kept = inside != OUTSIDE
        hits = hits.take(kept)
        is_near = self.passes.find(hits.ray, hits.low, hits.high)[0] > 0
        return hits, (inside[kept] == INSIDE) & ~is_near & ~is_unclear[kept], is_unclear[kept]

    def trim_strips(self, strips: Hits, is_cut: Bools) -> tuple[Hits, Bools]:
        """The parts of strips that are not outside, and whether each strip is decided.

        `strips` are the n first ends, then the n second ends; `is_cut` (n,) says whether a border
        may cut their cells. A strip that passes one edge is two parts, one before it and one after
        it. Strips that pass more are not decided.
        """
        count = len(is_cut)
        passes, number = self.passes.find(
            strips.ray[:count], strips.low[:count], strips.high[:count]
        )
        passes[~is_cut] = 0
        is_lower = strips.t[:count] <= strips.t[count:]
        is_lower = np.concatenate([is_lower, ~is_lower])
        inside = self.find_inside(strips, np.tile(is_cut, 2)) != OUTSIDE
        is_one = np.tile(passes == 1, 2)
        which = np.tile(number, 2)[is_one]
        low, high = strips.low.copy(), strips.high.copy()
        begin, end, lower = self.passes.low[which], self.passes.high[which], is_lower[is_one]
        high[is_one] = np.where(lower, np.minimum(high[is_one], begin), high[is_one])
        low[is_one] = np.where(lower, low[is_one], np.maximum(low[is_one], end))
        is_beside = np.where(lower, strips.t[is_one] < begin, strips.t[is_one] > end)
        inside[is_one] &= is_beside
        differs = inside[:count] != inside[count:]
        is_done = (passes < 2) & ~((passes == 0) & differs)
        strips.low[:], strips.high[:] = low, high
        return strips.take(np.tile(is_done, 2) & inside), is_done

    def trim_points(self, hits: Hits, is_cut: Bools) -> Hits:
        """The centres (n,) of small cells that are not outside."""
        return hits.take(self.find_inside(hits, is_cut) != OUTSIDE)
