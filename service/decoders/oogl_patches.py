"""Turns the Bézier patches of an OOGL file into surfaces, one for each degree and form.

Control points run u fastest. Points with 4 numbers are homogeneous, (wx, wy, wz, w). Texture
coordinates and colours belong to the corners (0, 0) (1, 0) (0, 1) (1, 1) of a patch and are
interpolated bilinearly.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import Tree


@dataclass(frozen=True, slots=True)
class Form:
    """The degrees of the patches of an object, and the numbers that each patch has."""

    degree: tuple[int, int]
    dimension: int
    textured: bool
    colored: bool

    @property
    def points(self) -> int:
        """Number of control points of a patch."""
        return (self.degree[0] + 1) * (self.degree[1] + 1)

    @property
    def numbers(self) -> int:
        """Numbers of a patch: control points, texture coordinates, colours."""
        return self.points * self.dimension + 8 * self.textured + 16 * self.colored

    def weight_numbers(self) -> range:
        """Indices of the weights among a patch's numbers."""
        size = self.points * self.dimension
        return range(3, size, 4) if self.dimension == 4 else range(0)


class Patches:
    """The patches of a file, grouped by form."""

    def __init__(self) -> None:
        self._batches: dict[tuple[tuple[int, int], bool, bool], _Batch] = {}

    def add(self, form: Form, numbers: FloatArray) -> None:
        """Adds patches of one form, with positive weights; `numbers` has shape (P, numbers)."""
        key = form.degree, form.textured, form.colored
        batch = self._batches.setdefault(key, _Batch())
        size = form.points * form.dimension
        points = numbers[:, :size].reshape(-1, form.points, form.dimension)
        weights = np.ones(points.shape[:2])
        if form.dimension == 4:
            batch.rational = True
            points, weights = points[..., :3], points[..., 3]
            # The check of the surface refuses values that become too large.
            with np.errstate(over="ignore"):
                points = points / weights[..., None]
        batch.points.append(points)
        batch.weights.append(weights)
        if form.textured:
            batch.uvs.append(numbers[:, size : size + 8].reshape(-1, 4, 2))
        if form.colored:
            batch.colors.append(numbers[:, -16:].reshape(-1, 4, 4))

    def surfaces(self) -> Iterator[Tree]:
        """One surface for each form: degree, texture coordinates, colours."""
        for (degree, _, _), batch in self._batches.items():
            yield _surface(degree, batch)


@dataclass(slots=True)
class _Batch:
    """Arrays of patches of one form: points, weights, corners; one array for each object."""

    points: list[FloatArray] = field(default_factory=list)
    weights: list[FloatArray] = field(default_factory=list)
    uvs: list[FloatArray] = field(default_factory=list)
    colors: list[FloatArray] = field(default_factory=list)
    rational: bool = False


def _surface(degree: tuple[int, int], batch: _Batch) -> Tree:
    """A surface of patches of one degree, each with its own vertices."""
    p, q = degree
    points = np.concatenate(batch.points)
    indices = np.arange(points.shape[0] * points.shape[1]).reshape(-1, q + 1, p + 1)
    tree: Tree = {"type": "patches", "vertices": points.reshape(-1, 3)}
    tree["patches"] = indices.swapaxes(1, 2)
    if batch.rational:
        tree["weights"] = np.concatenate(batch.weights).ravel()
    for name, corners in (("uvs", batch.uvs), ("colors", batch.colors)):
        if corners:
            tree[name] = _blend_corners(np.concatenate(corners), degree)
    return tree


def _blend_corners(corners: FloatArray, degree: tuple[int, int]) -> FloatArray:
    """Bilinear interpolants of corner values, as values at the control points, u fastest.

    The Bézier coefficients of a function of degree (1, 1) in degree (p, q) are its values at (i/p,
    j/q).

    Parameters
    ----------
    corners : ndarray, shape (P, 4, d)

    Returns
    -------
    ndarray, shape (P (q+1) (p+1), d)
    """
    s, t = (np.arange(n + 1) / n for n in degree)
    along_u, along_v = (np.stack((1 - x, x)) for x in (s, t))
    count, _, width = corners.shape
    square = corners.reshape(count, 2, 2, width)
    blended = np.einsum("kbad,ai,bj->kjid", square, along_u, along_v)
    # A rounded mean may lie outside of its numbers.
    low, high = (limit(corners, axis=1)[:, None, None] for limit in (np.min, np.max))
    values: FloatArray = np.clip(blended, low, high).reshape(-1, width)
    return values
