"""Whether the material is on the left of loops: exact winding numbers beside sides of polygons.

The plane around polygons that are not in conflict is divided into regions; just left of a side is
one of them. Its winding number about all polygons of the face is 1, or a loop is wrong. It is the
same along a chain of sides between places that are corners of several sides, so one side of each
chain is tested, with a ray.

Proof in docs/proofs.md: "The polygon of a trimmed face".
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import find_begins, mark_begins, row_slices
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.box_pairs import BoxTree
from service.engine.brep.borders.predicates import orient
from service.engine.trims.places import SIZE

CHUNK = 1 << 12
"""Rays that are followed together: it limits memory."""


def count_windings(polygons: Polygons, sides: Ints) -> Ints:
    """The winding numbers (k,) of all polygons of a face just left of the middles of sides (k,).

    The sides must have a length. A ray runs from there along x, a little above all places of this
    height, or along y: where it meets fewer sides, but not along the side. Twice the places are
    used, so that middles are whole numbers: areas of triangles in a square of 2^31 fit into int64.
    """
    begins, ends = polygons.begins, polygons.ends
    along_y = _prefer_y(polygons)
    tree = BoxTree.of(polygons.faces, np.minimum(begins, ends), np.maximum(begins, ends))
    windings = np.zeros(len(sides), np.intp)
    for rows in row_slices(len(sides), 1, CHUNK):
        own = sides[rows]
        middle, along = begins[own] + ends[own], ends[own] - begins[own]
        is_flat = np.where(along_y[polygons.faces[own]], along[:, 0] != 0, along[:, 1] == 0)
        high = (middle + 1) >> 1
        high[np.arange(len(own)), is_flat.astype(np.intp)] = SIZE
        ray, side = tree.find_pairs(polygons.faces[own], middle >> 1, high)
        turned = is_flat[ray]
        vectors = np.array([2 * begins[side], 2 * ends[side], middle[ray], along[ray]])
        a, b, point, run = _turn(vectors, turned)
        rises = (a[:, 1] <= point[:, 1]) & (point[:, 1] < b[:, 1])
        falls = (b[:, 1] <= point[:, 1]) & (point[:, 1] < a[:, 1])
        # Left of a side that rises is towards smaller x. A side through the point itself counts as
        # if the point were moved there.
        own_rises = run[:, 1] > 0
        area = orient(a, b, point)
        is_left = (area > 0) | (area == 0) & own_rises
        is_right = (area < 0) | (area == 0) & own_rises
        steps = (rises & is_left).astype(np.intp) - (falls & is_right)
        np.add.at(windings[rows], ray, steps)
    return windings


def choose_sides(polygons: Polygons) -> Ints:
    """A long side of each chain of sides between places that several sides share.

    If no sides are in conflict, the winding number just left of all sides of a chain is the same. A
    chain without a length has no side here.
    """
    count = len(polygons.faces)
    places = polygons.number_places()
    has_length = (polygons.begins != polygons.ends).any(axis=1)
    shared = np.bincount(places[has_length], minlength=count)[places] > 1
    # Sides are sorted by loop, and along each loop, so a chain is a run; the last run of a loop,
    # and the first, are parts of one chain, which is tested twice.
    chain = (mark_begins(polygons.loops) | shared).cumsum()
    # The side that is longest across the rays.
    extents = np.abs(polygons.ends - polygons.begins)
    along_y = _prefer_y(polygons)[polygons.faces]
    across = np.where(along_y, extents[:, 0], extents[:, 1])
    order = np.lexsort((-np.maximum(extents[:, 0], extents[:, 1]), -across, chain))
    first = order[mark_begins(chain[order])]
    chosen: Ints = np.sort(first[has_length[first]])
    return chosen


def _prefer_y(polygons: Polygons) -> Bools:
    """Whether rays along y meet fewer sides of each face (F,) than rays along x, about."""
    extents = np.abs(polygons.ends - polygons.begins)
    along_x, along_y = (np.bincount(polygons.faces, extents[:, axis]) for axis in (1, 0))
    prefer: Bools = along_y < along_x
    return prefer


def _turn(vectors: Ints, turned: Bools) -> Ints:
    """Vectors (…, m, 2), some of them turned by a right angle: (x, y) becomes (y, −x)."""
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([np.where(turned, y, x), np.where(turned, -x, y)], axis=-1)


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
    first = find_begins(polygons.loops[wrong])
    number = polygons.loops[wrong[first]]
    size = int(loops.max(initial=-1)) + 1
    counts = np.bincount(loops[is_wrong], minlength=size)
    return wrong[first], (counts == np.bincount(loops, minlength=size))[number]
