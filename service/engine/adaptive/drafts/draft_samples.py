"""The samples of a draft: places of faces, and the vertices that they are.

Samples are only added. A sample keeps its number as long as some leaf or the border uses it; one
that was not used in a round gets a new number when it is needed again.
"""

from collections.abc import Callable

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.adaptive.cutting.cells import Task
from service.engine.adaptive.polygons.cell_boundaries import CellBoundaries

Store = Callable[[FloatArray], FloatArray]
"""Rounds positions (V, 3) as a format stores them, and returns them as float64."""


class DraftSamples:
    """N samples and V vertices.

    Attributes
    ----------
    face, u, v, vertex : ndarray of int, shape (N,)
        A sample is a vertex as one face sees it, at the place (u, v) of the face.
    entry : ndarray of int, shape (M,)
        The sample of each entry of the border.
    points, positions : ndarray of float64, shape (V, 3)
        Vertices as they were evaluated, and as they are stored; those of the border first.
    """

    def __init__(self, task: Task, border: Border, store: Store) -> None:
        self._task, self._store = task, store
        self._border_count = len(border.points)
        self.face = self.u = self.v = self.vertex = self.entry = np.empty(0, dtype=np.intp)
        self.points, self.positions = border.points, store(border.points)

    def __len__(self) -> int:
        return len(self.face)

    def number(self, boundaries: CellBoundaries, is_used: Bools) -> Ints:
        """The numbers of the samples of boundaries; new samples are added.

        Parameters
        ----------
        is_used : ndarray of bool, shape (N,)
            Samples that leaves of the boundaries may have; those of the border are always tried.
        """
        number = np.full(len(boundaries.face), -1)
        if len(self.face):
            is_used[self.entry] = True
            old = is_used.nonzero()[0]
            columns = [
                np.concatenate(pair)
                for pair in (
                    (boundaries.face, self.face[old]),
                    (boundaries.u, self.u[old]),
                    (boundaries.v, self.v[old]),
                )
            ]
            order = np.lexsort(columns[::-1])
            same = np.logical_and.reduce([c[order[1:]] == c[order[:-1]] for c in columns])
            hits = same.nonzero()[0]
            number[order[hits]] = old[order[hits + 1] - len(number)]
        fresh = (number < 0).nonzero()[0]
        number[fresh] = len(self.face) + np.arange(len(fresh))
        self._add(boundaries, fresh)
        self.entry = number[boundaries.entry]
        return number

    def _add(self, boundaries: CellBoundaries, fresh: Ints) -> None:
        """Append these samples of boundaries, and their vertices unless these are on the border."""
        vertex = boundaries.vertex[fresh]
        inner = (vertex >= self._border_count).nonzero()[0]
        vertex[inner] = len(self.points) + np.arange(len(inner))
        row = fresh[inner]
        if len(row):
            points = self._task.evaluate_points(
                boundaries.face[row], boundaries.u[row], boundaries.v[row]
            )
            self.points = np.concatenate([self.points, points])
            self.positions = np.concatenate([self.positions, self._store(points)])
        self.face = np.concatenate([self.face, boundaries.face[fresh]])
        self.u = np.concatenate([self.u, boundaries.u[fresh]])
        self.v = np.concatenate([self.v, boundaries.v[fresh]])
        self.vertex = np.concatenate([self.vertex, vertex])

    def sort(self, is_used: Bools) -> tuple[Ints, Ints, FloatArray]:
        """Samples in use, in the order of face, u, v, with their vertices numbered anew.

        Returns
        -------
        samples : ndarray of int, shape (n,)
        vertex : ndarray of int, shape (n,)
        points : ndarray of float64, shape (v, 3)
            The vertices, those of the border first.
        """
        is_used[self.entry] = True
        samples = is_used.nonzero()[0]
        samples = samples[np.lexsort((self.v[samples], self.u[samples], self.face[samples]))]
        vertex, count = self.vertex[samples], self._border_count
        inner = (vertex >= count).nonzero()[0]
        points = np.concatenate([self.points[:count], self.points[vertex[inner]]])
        vertex[inner] = count + np.arange(len(inner))
        return samples, vertex, points
