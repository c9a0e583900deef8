"""Least and greatest curvatures: the ends of a scale of colours."""

from collections.abc import Iterable

import numpy as np

from service.bases.arrays import RealArray
from service.engine.mesh.mesh import Ranges

NAMES = ("gaussian_curvature", "mean_curvature")
"""The names of the attributes with Gaussian and mean curvature, in this order."""


def find_ranges(attributes: Iterable[tuple[str, RealArray]]) -> Ranges | None:
    """The ranges of the curvatures of a mesh; None without curvatures or vertices."""
    curvatures = [rows for name, rows in attributes if name in NAMES and len(rows)]
    if len(curvatures) < len(NAMES):
        return None
    gaussian, mean = ((float(rows.min()), float(rows.max())) for rows in curvatures)
    return gaussian, mean


def merge_ranges(ranges_of_meshes: Iterable[Ranges | None]) -> Ranges | None:
    """The ranges over all meshes together; None if no mesh has ranges."""
    present = [ranges for ranges in ranges_of_meshes if ranges is not None]
    if not present:
        return None
    gaussian, mean = (
        (min(low for low, _ in pairs), max(high for _, high in pairs))
        for pairs in zip(*present, strict=True)
    )
    return gaussian, mean


def round_ranges(ranges: Ranges | None) -> Ranges | None:
    """The ranges with their ends rounded to float32."""
    if ranges is None:
        return None
    gaussian, mean = ((float(np.float32(low)), float(np.float32(high))) for low, high in ranges)
    return gaussian, mean
