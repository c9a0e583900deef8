"""Polygons of places for tests."""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import Ints
from service.engine.brep.borders.border import Polygons

Loop = Sequence[tuple[int, int]]


def build_polygons(
    *faces: Sequence[Loop], vertices: Sequence[Sequence[int]] | None = None
) -> Polygons:
    """Loops of faces as polygons; corners at one place have one vertex, or the given `vertices`.

    `vertices` has those of each loop, the loops of all faces one after the other.
    """
    loops = [loop for face in faces for loop in face]
    face_of = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    counts = [len(loop) for loop in loops]
    begins = np.array([place for loop in loops for place in loop], np.int64).reshape(-1, 2)
    number = np.arange(len(begins))
    starts = np.cumsum(counts) - counts
    nexts = number + 1
    for start, count in zip(starts, counts, strict=True):
        nexts[start + count - 1] = start
    numbers: Ints
    if vertices is None:
        numbers = np.unique(begins, axis=0, return_inverse=True)[1].reshape(-1)
    else:
        numbers = np.array([vertex for loop in vertices for vertex in loop])
    loop = np.repeat(np.arange(len(loops)), counts)
    return Polygons(face_of[loop], loop, nexts, begins, begins[nexts], numbers, numbers[nexts])
