"""Groups of the nets of a model: all nets of one degree in one array."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.triangle import degree_of, row_starts
from service.engine.nets.subdivision import elevate
from service.engine.vectors import length, project


@dataclass(frozen=True, eq=False)
class Nets:
    """k tensor-product nets of one degree (p, q), all polynomial or all rational.

    Attributes
    ----------
    patches : ndarray of int, shape (k,)
        For each net, the number of its patch in the model.
    values : ndarray of float64, shape (p+1, q+1, D, k)
        Points, D = 3; or, if rational, (w x, w y, w z, w), D = 4. Elementwise arithmetic is fastest
        with the nets as last axis.
    first : int
        The number of the first net of the group among all nets of the model.
    """

    patches: Ints
    values: FloatArray
    first: int = 0

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return self.values.shape[0] - 1, self.values.shape[1] - 1

    @property
    def is_rational(self) -> bool:
        """Whether the nets have weights."""
        return bool(self.values.shape[2] == 4)

    @cached_property
    def nets(self) -> FloatArray:
        """One net after another, (k, p+1, q+1, D), for products with a matrix along u, then v."""
        return np.ascontiguousarray(self.values.transpose(3, 0, 1, 2))

    @cached_property
    def items(self) -> FloatArray:
        """Coordinates of one net after another, (k, D, p+1, q+1), for products along v, then u."""
        return np.ascontiguousarray(self.values.transpose(3, 2, 0, 1))

    @cached_property
    def partial_bounds(self) -> FloatArray:
        """Bounds (2, k) of |S_u| and |S_v| over whole patches, whose parameters are from 0 to 1.

        They are n max |P_{i+1} − P_i| for polynomial patches. A rational patch X / w has
        S_u = (X_u − w_u S) / w. With the radius r ≥ |S| about the middle of the patch, |S_u| is at
        most n max (|X_{i+1} − X_i| + r |w_{i+1} − w_i|) / min w.
        """
        values, bounds = self.values, np.empty((2, len(self.patches)))
        if self.is_rational:
            radius = length(project(values)).max(axis=(0, 1))
            least = values[:, :, 3].min(axis=(0, 1))
        for axis, degree in enumerate(self.degree):
            steps = values[:, 1:] - values[:, :-1] if axis else values[1:] - values[:-1]
            longest = length(steps[:, :, :3])
            if self.is_rational:
                longest = (longest + radius * np.abs(steps[:, :, 3])) / least
            bounds[axis] = degree * longest.max(axis=(0, 1))
        return bounds


def group_nets(parts: Iterable[tuple[Ints, FloatArray]]) -> tuple[Nets, ...]:
    """Nets of equal degree and kind as one group each, from `patches` and `values` of `Nets`."""
    parts_by_shape: dict[tuple[int, ...], list[tuple[Ints, FloatArray]]] = {}
    for part in parts:
        parts_by_shape.setdefault(part[1].shape[:3], []).append(part)
    groups, first = [], 0
    for members in parts_by_shape.values():
        patches, values = zip(*members, strict=True)
        joined = np.ascontiguousarray(np.concatenate(values, axis=3))
        groups.append(Nets(np.concatenate(patches), joined, first))
        first += len(groups[-1].patches)
    return tuple(groups)


def split_by_group(groups: tuple[Nets, ...], number: Ints) -> Iterator[tuple[Nets, Ints]]:
    """The groups that occur in `number` (m,), each with the indices at which it occurs."""
    for k, group in enumerate(groups):
        indices = (number == k).nonzero()[0]
        if len(indices):
            yield group, indices


def build_tensor_nets(nets: FloatArray) -> FloatArray:
    """Triangular nets (K, D, k) as tensor nets (n+1, n+1, D, k), with s = u (1 − v) and t = v.

    Each of the k nets has K points. Row j of a triangle is a curve of degree n − j. Elevated to
    degree n, it is column j of the tensor net.
    """
    n = degree_of(len(nets))
    starts = row_starts(n)
    square = np.empty((n + 1, n + 1, *nets.shape[1:]))
    for j in range(n + 1):
        row = nets[starts[j] : starts[j + 1]]
        while len(row) <= n:
            row = elevate(row)
        square[:, j] = row
    return square
