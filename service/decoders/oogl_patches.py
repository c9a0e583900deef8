"""Converts the Bézier patches of an OOGL file to surfaces, grouped by degree, uvs and colours.

Among control points, u varies fastest. Points with 4 numbers are homogeneous, (wx, wy, wz, w).
Texture coordinates and colours are those of the corners (u, v) = (0, 0), (1, 0), (0, 1) and (1, 1)
of a patch; between the corners they are interpolated bilinearly.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import Tree


@dataclass(frozen=True, slots=True)
class Form:
    """The form of the patches of one object: their degree, and the numbers that each patch has.

    Attributes
    ----------
    degree : (int, int)
    dimension : int
        Numbers of a control point: 3, or 4 with a weight.
    has_uvs, has_colors : bool
        Whether the corners have texture coordinates, and colours.
    """

    degree: tuple[int, int]
    dimension: int
    has_uvs: bool
    has_colors: bool

    @property
    def point_count(self) -> int:
        """The number of control points of a patch."""
        return (self.degree[0] + 1) * (self.degree[1] + 1)

    @property
    def number_count(self) -> int:
        """How many numbers a patch has: of control points, texture coordinates and colours."""
        # 4 corners with 2 texture coordinates each, and with 4 components of a colour each.
        return self.point_count * self.dimension + 8 * self.has_uvs + 16 * self.has_colors

    def weight_numbers(self) -> range:
        """The indices of the weights among the numbers of a patch; empty without weights."""
        size = self.point_count * self.dimension
        return range(3, size, 4) if self.dimension == 4 else range(0)


class Patches:
    """The patches of a file, grouped by degree and by whether they have uvs, and colours.

    Patches with weights and without are in one group.
    """

    def __init__(self) -> None:
        self._batches: dict[tuple[tuple[int, int], bool, bool], _Batch] = {}

    def add(self, form: Form, numbers: FloatArray) -> None:
        """Add P patches of one form: `numbers` (P, form.number_count); the weights are positive."""
        key = form.degree, form.has_uvs, form.has_colors
        batch = self._batches.setdefault(key, _Batch())
        size = form.point_count * form.dimension
        points = numbers[:, :size].reshape(-1, form.point_count, form.dimension)
        weights = np.ones(points.shape[:2])
        if form.dimension == 4:
            batch.is_rational = True
            points, weights = points[..., :3], points[..., 3]
            # Overflow gives infinite values, which the checks of the surface refuse later.
            with np.errstate(over="ignore"):
                points = points / weights[..., None]
        batch.points.append(points)
        batch.weights.append(weights)
        if form.has_uvs:
            batch.uvs.append(numbers[:, size : size + 8].reshape(-1, 4, 2))
        if form.has_colors:
            batch.colors.append(numbers[:, -16:].reshape(-1, 4, 4))

    def surfaces(self) -> Iterator[Tree]:
        """The documents of the surfaces, one for each group of patches."""
        for (degree, _, _), batch in self._batches.items():
            yield _build_surface(degree, batch)


@dataclass(slots=True)
class _Batch:
    """The arrays of one group of patches; each list has one array for each object of the file."""

    points: list[FloatArray] = field(default_factory=list)
    weights: list[FloatArray] = field(default_factory=list)
    uvs: list[FloatArray] = field(default_factory=list)
    colors: list[FloatArray] = field(default_factory=list)
    is_rational: bool = False


def _build_surface(degree: tuple[int, int], batch: _Batch) -> Tree:
    """The document of a surface of patches of one degree; each patch has vertices of its own."""
    p, q = degree
    points = np.concatenate(batch.points)
    indices = np.arange(points.shape[0] * points.shape[1]).reshape(-1, q + 1, p + 1)
    tree: Tree = {"type": "patches", "vertices": points.reshape(-1, 3)}
    tree["patches"] = indices.swapaxes(1, 2)
    if batch.is_rational:
        tree["weights"] = np.concatenate(batch.weights).ravel()
    for name, corners in (("uvs", batch.uvs), ("colors", batch.colors)):
        if corners:
            tree[name] = _blend_corners(np.concatenate(corners), degree)
    return tree


def _blend_corners(corners: FloatArray, degree: tuple[int, int]) -> FloatArray:
    """Bilinear functions with given values at the corners, as Bézier coefficients of degree (p, q).

    The coefficients of a bilinear function are its values at (i/p, j/q).

    Parameters
    ----------
    corners : ndarray, shape (P, 4, d)
        The values at the corners (0, 0), (1, 0), (0, 1) and (1, 1) of P patches.

    Returns
    -------
    ndarray, shape (P (q+1) (p+1), d)
        One row for each control point, in which u varies fastest.
    """
    s, t = (np.arange(n + 1) / n for n in degree)
    basis_u, basis_v = (np.stack((1 - x, x)) for x in (s, t))
    count, _, width = corners.shape
    # The axes are patch, v, u, component; u varies fastest.
    corner_grid = corners.reshape(count, 2, 2, width)
    blended = np.einsum("kbad,ai,bj->kjid", corner_grid, basis_u, basis_v)
    # Rounding must not move a mean out of the range of the corners.
    low, high = (bound[:, None, None] for bound in (corners.min(axis=1), corners.max(axis=1)))
    values: FloatArray = np.clip(blended, low, high).reshape(-1, width)
    return values
