"""The lists of edges and of faces in the document of a brep, as columns."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.surface.spline_tables import CurveTable, SurfaceTable


@dataclass(frozen=True, eq=False)
class EdgeColumns:
    """The edges of a brep, as columns of `BrepSurface`.

    `uncertainties` is NaN where an edge has none of its own.
    """

    vertices: Ints
    curve_numbers: Ints
    uncertainties: FloatArray
    is_degenerate: Bools
    curves: CurveTable

    def __len__(self) -> int:
        return len(self.vertices)


@dataclass(frozen=True, eq=False)
class FaceColumns:
    """The faces of a brep with their loops, as columns of `BrepSurface`."""

    names: tuple[str, ...]
    palette: FloatArray
    colors: Ints
    is_reversed: Bools
    surfaces: SurfaceTable
    loop_faces: Ints
    loop_counts: Ints
    coedge_edges: Ints
    coedge_reversed: Bools
    coedge_pcurves: Ints
    pcurves: CurveTable

    def __len__(self) -> int:
        return len(self.names)


def number_given(is_given: Bools) -> Ints:
    """0, 1, 2, … where `is_given`, −1 elsewhere; (n,)."""
    numbers: Ints = np.where(is_given, np.cumsum(is_given) - 1, -1)
    return numbers


def number_colors(colors: FloatArray) -> tuple[FloatArray, Ints]:
    """The distinct colours in the order of first use, and the number of each colour.

    Parameters
    ----------
    colors : ndarray of float64, shape (n, 4)
        Red, green, blue, opacity.

    Returns
    -------
    palette : ndarray of float64, shape (K, 4)
    numbers : ndarray of int, shape (n,)
    """
    number_of: dict[tuple[float, ...], int] = {}
    numbers = [number_of.setdefault(color, len(number_of)) for color in map(tuple, colors.tolist())]
    # −0 becomes 0, so that equal colours have equal bytes.
    return np.array([*number_of], np.float64).reshape(-1, 4) + 0.0, np.array(numbers, np.intp)
