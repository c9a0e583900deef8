"""Whether the material is on the left of loops: exact winding numbers beside sides of polygons.

The plane around polygons that are not in conflict is divided into regions; just left of a side is
one of them. Its winding number about all polygons of the face is 1, or a loop is wrong. It is the
same along a chain of sides between places that are corners of several sides, so one side of each
chain is tested, with a ray.

Proof in docs/proofs.md: "The polygon of a trimmed face".
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import row_slices
from service.engine.brep.border import Polygons
from service.engine.brep.box_pairs import BoxTree
from service.engine.brep.predicates import orient
from service.engine.trims.places import SIZE

CHUNK = 1 << 12
"""Rays that are followed together: it limits memory."""


def count_windings(polygons: Polygons, sides: Ints) -> Ints:
    """The winding numbers (k,) of all polygons of a face just left of the middles of sides (k,).

    The sides must have a length.
    """
    along = np.abs(polygons.ends[sides] - polygons.begins[sides])
    is_steep = along[:, 1] >= along[:, 0]
    windings = np.zeros(len(sides), np.intp)
    for rows, begins, ends in (
        (is_steep, polygons.begins, polygons.ends),
        (~is_steep, _turn(polygons.begins), _turn(polygons.ends)),
    ):
        chosen = rows.nonzero()[0]
        if len(chosen):
            windings[chosen] = _count_windings(polygons.faces, begins, ends, sides[chosen])
    return windings


def choose_sides(polygons: Polygons) -> Ints:
    """The longest side of each chain of sides between places that several sides share.

    If no sides are in conflict, the winding number just left of all sides of a chain is the same. A
    chain without a length has no side here.
    """
    count = len(polygons.faces)
    places = polygons.number_places()
    has_length = (polygons.begins != polygons.ends).any(axis=1)
    shared = np.bincount(places[has_length], minlength=count)[places] > 1
    # Sides are sorted by loop, and along each loop, so a chain is a run; the last run of a loop,
    # and the first, are parts of one chain, which is tested twice.
    starts = np.append(True, np.diff(polygons.loops) != 0)
    chain = np.cumsum(starts | shared)
    lengths = np.abs(polygons.ends - polygons.begins).max(axis=1)
    order = np.lexsort((-lengths, chain))
    first = order[np.append(True, np.diff(chain[order]) != 0)] if count else order
    chosen: Ints = np.sort(first[lengths[first] > 0])
    return chosen


def _turn(places: Ints) -> Ints:
    """Places turned by a right angle inside the square of places: (x, y) becomes (y, SIZE − x)."""
    return np.stack([places[:, 1], SIZE - places[:, 0]], axis=1)


def _count_windings(faces: Ints, begins: Ints, ends: Ints, sides: Ints) -> Ints:
    """Winding numbers (k,) just left of the middles of sides (k,) that are not horizontal.

    A ray runs from there along x, a little above all places of this height. Twice the places are
    used, so that middles are whole numbers: areas of triangles in a square of 2^31 fit into int64.
    """
    tree = BoxTree.of(faces, np.minimum(begins, ends), np.maximum(begins, ends))
    windings = np.zeros(len(sides), np.intp)
    for rows in row_slices(len(sides), 1, CHUNK):
        own = sides[rows]
        middle = begins[own] + ends[own]
        high = np.stack([np.full(len(own), SIZE), (middle[:, 1] + 1) >> 1], axis=1)
        ray, side = tree.find_pairs(faces[own], middle >> 1, high)
        a, b, point = 2 * begins[side], 2 * ends[side], middle[ray]
        rises = (a[:, 1] <= point[:, 1]) & (point[:, 1] < b[:, 1])
        falls = (b[:, 1] <= point[:, 1]) & (point[:, 1] < a[:, 1])
        # Left of a side that rises is towards smaller x. A side through the point itself counts as
        # if the point were moved there.
        own_rises = (ends[own, 1] > begins[own, 1])[ray]
        area = orient(a, b, point)
        is_left = (area > 0) | (area == 0) & own_rises
        is_right = (area < 0) | (area == 0) & own_rises
        steps = (rises & is_left).astype(np.intp) - (falls & is_right)
        np.add.at(windings[rows], ray, steps)
    return windings


def find_reversed_loops(polygons: Polygons) -> tuple[Ints, Bools]:
    """Loops that do not have the material on their left everywhere.

    Returns
    -------
    sides : ndarray of int, shape (k,)
        A wrong side of each such loop, in the order of loops.
    is_whole : ndarray of bool, shape (k,)
        Whether all of the loop is wrong.
    """
    sides = choose_sides(polygons)
    windings = count_windings(polygons, sides)
    loops, is_wrong = polygons.loops[sides], windings != 1
    wrong = sides[is_wrong]
    first = np.diff(polygons.loops[wrong], prepend=-1).nonzero()[0]
    number = polygons.loops[wrong[first]]
    size = int(loops.max(initial=-1)) + 1
    counts = np.bincount(loops[is_wrong], minlength=size)
    return wrong[first], (counts == np.bincount(loops, minlength=size))[number]
