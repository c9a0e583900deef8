"""Parametric splines: pieces of polynomials in powers of the parameter.

On a piece of length h the polynomial a + b s + c s² + d s³, 0 ≤ s ≤ h, is the Bézier curve with the
control points

    a,  a + h b/3,  a + 2 h b/3 + h² c/3,  a + h b + h² c + h³ d.

References
----------
IGES 5.3, sections 4.14 (112) and 4.16 (114); Farin, Curves and Surfaces for CAGD, 5th ed., section
6.6: monomial and Bézier form.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import build_curve, build_surface
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import Fault

GAP = 1e-4
"""Pieces whose ends are further apart than this share of the spline's size do not meet."""

_TO_BEZIER = np.array([[1, 0, 0, 0], [1, 1 / 3, 0, 0], [1, 2 / 3, 1 / 3, 0], [1, 1, 1, 1]])


def read_power_curve(entity: Entity) -> Curve:
    """A parametric spline curve (112)."""
    parameters = entity.parameters
    count = parameters.count(3, 12)
    if not count:
        raise Fault("a parametric spline has no pieces")
    breaks = parameters.numbers(4, count + 1)
    powers = parameters.numbers(5 + count, 12 * count).reshape(count, 3, 4)
    nets = _to_bezier(powers, breaks).swapaxes(1, 2)  # (pieces, 4, 3)
    return build_curve(3, _repeat(breaks), _chain(nets))


def read_power_surface(entity: Entity) -> Surface:
    """A parametric spline surface (114); behind each row of pieces stands one without a meaning."""
    parameters = entity.parameters
    rows, columns = parameters.count(2), parameters.count(3)
    if not rows or not columns or 48 * rows * columns > len(parameters):
        raise Fault("it has fewer parameters than it says")
    u, v = parameters.numbers(4, rows + 1), parameters.numbers(5 + rows, columns + 1)
    start, stride = 6 + rows + columns, 48 * (columns + 1)
    powers = np.stack(
        [parameters.numbers(start + stride * row, 48 * columns) for row in range(rows)]
    ).reshape(rows, columns, 3, 4, 4)  # the last axis is that of the powers of u
    along_u = _to_bezier(powers, u)
    along_v = _to_bezier(np.moveaxis(along_u, (1, 3), (0, 4)), v)
    # From the axes column, row, coordinate, u, v to row, u, column, v, coordinate.
    nets = along_v.transpose(1, 3, 0, 4, 2)
    half = _chain(nets.reshape(rows, 4, -1)).reshape(3 * rows + 1, columns, 4, 3)
    whole = _chain(half.transpose(1, 2, 0, 3).reshape(columns, 4, -1))
    net = whole.reshape(3 * columns + 1, 3 * rows + 1, 3).swapaxes(0, 1)
    return build_surface((3, 3), (_repeat(u), _repeat(v)), net)


def _to_bezier(powers: FloatArray, breaks: FloatArray) -> FloatArray:
    """Bézier points of powers (pieces, …, 4), the pieces being those between the breaks."""
    lengths = np.diff(breaks)
    if not (lengths > 0).all():
        raise Fault("the breaks of a parametric spline do not increase")
    scaled = powers * (lengths[:, np.newaxis] ** np.arange(4)).reshape(
        -1, *[1] * (powers.ndim - 2), 4
    )
    points: FloatArray = scaled @ _TO_BEZIER.T
    return points


def _repeat(breaks: FloatArray) -> FloatArray:
    """Knots of degree 3, the inner ones three times."""
    return np.concatenate([breaks[:1], np.repeat(breaks, 3), breaks[-1:]])


def _chain(nets: FloatArray) -> FloatArray:
    """Rows (3 n + 1, k) of the pieces (n, 4, k); where two pieces meet, the mean of their ends.

    Raises
    ------
    Fault
        Two pieces do not meet.
    """
    ends, starts = nets[:-1, 3], nets[1:, 0]
    size = float(np.ptp(nets.reshape(-1, nets.shape[-1]), axis=0).max(initial=0.0))
    if len(ends) and not np.abs(ends - starts).max() <= GAP * size:
        raise Fault("the pieces of a parametric spline do not meet")
    rows = np.concatenate([nets[0, :1], nets[:, 1:].reshape(-1, nets.shape[-1])])
    rows[3:-1:3] = (ends + starts) / 2
    return rows
