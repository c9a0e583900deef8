"""Singular cells in which no arc is: the surface may touch the plane there.

Mostly such a cell is near a polyline. Otherwise points are added for it.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.nets.partials import net_partials
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.parts.sections.paths import measure_to_lines
from service.engine.sections.arc_search import ArcNodes
from service.engine.sections.borders import ONE
from service.engine.sections.cells import SINGULAR
from service.engine.sections.flatness import bound_sizes
from service.engine.trims.inside import OUTSIDE

SPACING = 0.5
"""Points are this far apart, in tolerances."""


@dataclass(frozen=True, eq=False, slots=True)
class UnclearCells:
    """Singular cells without arcs that are not outside of the regions of their faces.

    Attributes
    ----------
    column : ndarray of int, shape (n,)
        The number of the plane of each cell among those of the call.
    middles : ndarray of float64, shape (n, 3)
    sizes : ndarray of float64, shape (n,)
        Bounds of the diameters of the surface over cells.
    """

    column: Ints
    middles: FloatArray
    sizes: FloatArray

    @classmethod
    def of(cls, faces: FaceNets, found: ArcNodes, first: int) -> "UnclearCells":
        """The cells of a search; `first` is the number of the first plane of the call."""
        cells = found.cells
        is_unclear = cells.kind == SINGULAR
        is_unclear[found.arcs.cell] = False
        row = is_unclear.nonzero()[0]
        rectangle = cells.rectangle[:, row] / ONE
        middle = (rectangle[::2] + rectangle[1::2]) / 2
        is_outside = faces.trims.classify(cells.net[row], rectangle) == OUTSIDE
        row, middle = row[~is_outside], middle[:, ~is_outside]
        rectangle, net = rectangle[:, ~is_outside], cells.net[row]
        sizes = np.empty(len(row))
        for group, own in faces.nets.split(net):
            sizes[own] = bound_sizes(group, net[own], rectangle[:, own])
        middles = net_partials(faces.nets, net, middle, 1)[0].T
        return cls(cells.plane[row] - first, middles, sizes)

    def has(self, column: int) -> bool:
        """Whether a plane has such cells."""
        return bool((self.column == column).any())

    def cover(
        self, column: int, lines: list[FloatArray], tolerance: float
    ) -> tuple[FloatArray, float]:
        """Points (m, 3) to be added, and the largest distance of a cell from them and the lines."""
        rows = (self.column == column).nonzero()[0]
        middles, sizes = self.middles[rows], self.sizes[rows]
        distance = measure_to_lines(middles, [line for line in lines if len(line)])
        is_far = distance + sizes > tolerance
        deviation = float((distance + sizes)[~is_far].max(initial=0.0))
        far = middles[is_far]
        grid = np.rint(far / (SPACING * tolerance)).astype(np.int64)
        chosen = np.sort(np.unique(grid, axis=0, return_index=True)[1])
        reach = SPACING * tolerance * np.sqrt(3.0) + sizes[is_far]
        return far[chosen], max(deviation, float(reach.max(initial=0.0)))
