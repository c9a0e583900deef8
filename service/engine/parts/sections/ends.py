"""The ends of the sections of faces: where the images of coedges pass through planes.

Seen along a loop, with the material of the face on the left, the height of the image over the plane
rises or falls at an end. A section that has the positive side on its left enters the region where
it falls, and leaves it where it rises. Between two coedges, and between two pieces of one, there is
an end where the last and the first height have different signs; so along each loop, ends at which
sections enter and leave take turns.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.parts.sections.borders import Borders, clear_heights, measure_heights
from service.engine.parts.sections.sign_changes import SignChanges, find_changes
from service.engine.sections.cells import LocalPlanes
from service.engine.vectors import Items


@dataclass(frozen=True, eq=False, slots=True)
class Ends(Items):
    """k ends of sections of faces.

    Attributes
    ----------
    coedge, column : ndarray of int, shape (k,)
        The coedge, and the number of the plane among those of the call.
    t : ndarray of float64, shape (k,)
        The parameter of the coedge.
    piece : ndarray of int, shape (k,)
        The piece of the image.
    enters : ndarray of bool, shape (k,)
        Whether a section with the positive side on its left enters the region here.
    """

    coedge: Ints
    column: Ints
    t: FloatArray
    piece: Ints
    enters: Bools

    def __len__(self) -> int:
        return len(self.t)


def find_ends(borders: Borders, planes: LocalPlanes, numbers: Ints) -> tuple[Ends, Bools]:
    """The ends on all coedges, and whether each loop begins below each plane (L, m)."""
    images, count = borders.images, len(numbers)
    begins, ends = np.empty((2, len(images.curve), count), bool)
    found: list[SignChanges] = []
    for rows, values in images.groups:
        heights, weights = measure_heights(values[..., np.newaxis], planes, numbers)
        clear_heights(heights, weights)
        begins[rows], ends[rows] = heights[0] < 0, heights[-1] < 0
        found.append(find_changes(images, rows, heights, weights))
    changes = SignChanges.join(found)
    coedge = images.curve[changes.piece]
    # The heights fall against a reversed coedge where they rise along the piece.
    enters = changes.from_negative == borders.coedge_reversed[coedge]
    inner = Ends(coedge, changes.column, changes.t, changes.piece, enters)
    # The pieces in the order of loops: those of reversed coedges backwards.
    reversed_piece = borders.coedge_reversed[images.curve]
    place = np.where(reversed_piece, -1.0, 1.0) * np.arange(len(images.curve))
    order = np.lexsort((place, images.curve))
    is_back = reversed_piece[order]
    start = np.where(is_back[:, np.newaxis], ends[order], begins[order])
    stop = np.where(is_back[:, np.newaxis], begins[order], ends[order])
    first = find_begins(borders.coedge_loops[images.curve[order]])
    following = np.arange(1, len(order) + 1)
    following[np.append(first[1:], len(order)) - 1] = first
    row, column = (stop != start[following]).nonzero()
    piece = order[row]
    last = np.where(reversed_piece[piece], images.low[piece], images.high[piece])
    between = Ends(images.curve[piece], column, last, piece, ~stop[row, column])
    return Ends.join([inner, between]), start[first]
