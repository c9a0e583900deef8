"""Converts the Bézier patches of an OOGL file to surfaces, grouped by degree, uvs and colours.

Among control points, u varies fastest. Points with 4 numbers are homogeneous, (wx, wy, wz, w).
Texture coordinates and colours are those of the corners (u, v) = (0, 0), (1, 0), (0, 1) and (1, 1)
of a patch; between the corners they are interpolated bilinearly.
"""

from dataclasses import dataclass
from typing import TypeAlias

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
    def coordinate_count(self) -> int:
        """How many numbers the control points of a patch have."""
        return self.point_count * self.dimension

    @property
    def number_count(self) -> int:
        """How many numbers a patch has: of control points, texture coordinates and colours."""
        # 4 corners with 2 texture coordinates each, and with 4 components of a colour each.
        return self.coordinate_count + 8 * self.has_uvs + 16 * self.has_colors

    def weight_numbers(self) -> range:
        """The indices of the weights among the numbers of a patch; empty without weights."""
        return range(3, self.coordinate_count, 4) if self.dimension == 4 else range(0)


Group: TypeAlias = list[tuple[Form, FloatArray]]
"""Patches of one degree, all with or without uvs, and colours: for each object of a file its form,
and the numbers (P, form.number_count) of its patches. Some may have weights, which are positive."""


def build_surface(group: Group) -> Tree:
    """The document of a surface of patches of one degree; each patch has vertices of its own."""
    form, _ = group[0]
    p, q = form.degree
    nets, weights = zip(*(_split_points(*item) for item in group), strict=True)
    points = np.concatenate(nets)
    indices = np.arange(points.shape[0] * points.shape[1]).reshape(-1, q + 1, p + 1)
    tree: Tree = {"type": "patches", "vertices": points.reshape(-1, 3)}
    tree["patches"] = indices.swapaxes(1, 2)
    if any(form.dimension == 4 for form, _ in group):
        tree["weights"] = np.concatenate(weights).ravel()
    if form.has_uvs:
        corners = [n[:, f.coordinate_count :][:, :8].reshape(-1, 4, 2) for f, n in group]
        tree["uvs"] = _blend_corners(np.concatenate(corners), form.degree)
    if form.has_colors:
        corners = [numbers[:, -16:].reshape(-1, 4, 4) for _, numbers in group]
        tree["colors"] = _blend_corners(np.concatenate(corners), form.degree)
    return tree


def _split_points(form: Form, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The control points (P, K, 3) and weights (P, K) of patches of one form."""
    coordinates = numbers[:, : form.coordinate_count]
    points = coordinates.reshape(-1, form.point_count, form.dimension)
    if form.dimension == 3:
        return points, np.ones(points.shape[:2])
    # Overflow gives infinite values, which the checks of the surface refuse later.
    with np.errstate(over="ignore"):
        return points[..., :3] / points[..., 3:], points[..., 3]


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
    blended = np.einsum("kbad,ai,bj->kjid", corners.reshape(count, 2, 2, width), basis_u, basis_v)
    # Rounding must not move a mean out of the range of the corners.
    low, high = (bound[:, None, None] for bound in (corners.min(axis=1), corners.max(axis=1)))
    return np.asarray(np.clip(blended, low, high)).reshape(-1, width)
