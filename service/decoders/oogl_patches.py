"""Converts the Bézier patches of an OOGL file to surfaces, grouped by degree, uvs and colours.

Among control points, u varies fastest. Points with 4 numbers are homogeneous, (wx, wy, wz, w), and
w may be 0 where it is not a corner.
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

    def corner_weights(self) -> list[int]:
        """The indices of the weights of corners among the numbers of a patch, if it has any."""
        if self.dimension == 3:
            return []
        p, q = self.degree
        return [4 * (j * (p + 1) + i) + 3 for j in (0, q) for i in (0, p)]


Group: TypeAlias = list[tuple[Form, FloatArray]]
"""Patches of one degree, all with or without uvs, and colours: for each object of a file its form,
and the numbers (P, form.number_count) of its patches. Some may have weights."""


def build_surface(group: Group) -> Tree:
    """The document of a surface of patches of one degree; each patch has vertices of its own."""
    form, _ = group[0]
    p, q = form.degree
    dimension = max(form.dimension for form, _ in group)
    points = np.concatenate([_take_points(*item, dimension) for item in group])
    indices = np.arange(len(points)).reshape(-1, q + 1, p + 1)
    tree: Tree = {"type": "patches", "vertices": points, "patches": indices.swapaxes(1, 2)}
    if dimension == 4:
        tree["homogeneous"] = True
    if form.has_uvs:
        corners = [n[:, f.coordinate_count :][:, :8].reshape(-1, 4, 2) for f, n in group]
        tree["uvs"] = _blend_corners(np.concatenate(corners), form.degree)
    if form.has_colors:
        corners = [numbers[:, -16:].reshape(-1, 4, 4) for _, numbers in group]
        tree["colors"] = _blend_corners(np.concatenate(corners), form.degree)
    return tree


def _take_points(form: Form, numbers: FloatArray, dimension: int) -> FloatArray:
    """The control points (N, dimension) of patches of one form; points without a weight have 1."""
    points = numbers[:, : form.coordinate_count].reshape(-1, form.dimension)
    if form.dimension == dimension:
        return points
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)


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
