"""Curves and surfaces as the tables that breps check."""

from collections.abc import Sequence

import numpy as np

from service.decoders.cad.content import Curve, Surface
from service.surface.spline_tables import CurveTable, SurfaceTable


def tabulate_curves(curves: Sequence[Curve]) -> CurveTable:
    points = np.concatenate([curve.points for curve in curves])
    weights = [curve.points[:, -1] for curve in curves]
    return CurveTable(
        np.array([curve.degree for curve in curves]),
        np.array([len(curve.points) for curve in curves]),
        points[:, :-1] / points[:, -1:],
        np.concatenate(weights),
        np.array([bool((each != each[0]).any()) for each in weights]),
        np.concatenate([curve.knots for curve in curves]),
    )


def tabulate_surface(surface: Surface) -> SurfaceTable:
    points = surface.points.reshape(-1, 4)
    weights = points[:, 3]
    return SurfaceTable(
        np.array([surface.degrees]),
        np.array([surface.points.shape[:2]]),
        points[:, :3] / points[:, 3:],
        weights,
        np.array([bool((weights != weights[0]).any())]),
        np.concatenate(surface.knots),
    )
