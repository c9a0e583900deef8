"""Conic arcs: pieces of ellipses, parabolas and hyperbolas, given by an equation and two ends.

The conic is A x² + B x y + C y² + D x + E y + F = 0 in a plane z = constant. Its axes are the
eigenvectors of the matrix [[A, B/2], [B/2, C]].

References
----------
IGES 5.3, section 4.5 (104).
"""

from math import hypot, sqrt, tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import Ellipse, Hyperbola, Parabola
from service.decoders.cad.content import Curve
from service.decoders.cad.frames import Frame, Vector
from service.decoders.cad.splines import reverse
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import Fault

_ELLIPSE, _HYPERBOLA, _PARABOLA = 1, 2, 3

FLAT = 1e-9
"""If one eigenvalue is smaller than this share of the other, the conic is a parabola."""

OFF = 1e-2
"""At an end of the arc the equation may miss 0 by this share of the sum of its terms' sizes."""

SAME_POINT = 1e-9
"""An arc whose ends are this close, as a share of the longer semi-axis, is a whole ellipse."""


def read_conic_arc(entity: Entity) -> Curve:
    """The arc from its start to its end; an ellipse is run through counter-clockwise."""
    values = entity.parameters.numbers(0, 11)
    z, ends = float(values[6]), values[7:].reshape(2, 2)
    size = float(np.abs(values[:3]).max())
    if not size > 0:
        raise Fault("a conic has no terms of degree 2")
    equation = values[:6] / size
    a, b, c = equation[:3].tolist()
    _check_ends(equation, ends)
    eigenvalues, axes = np.linalg.eigh(np.array([[a, b / 2], [b / 2, c]]))
    is_flat = bool(np.abs(eigenvalues).min() <= FLAT * np.abs(eigenvalues).max())
    form = entity.form
    if form not in (_ELLIPSE, _HYPERBOLA, _PARABOLA):
        form = _PARABOLA if is_flat else _ELLIPSE if eigenvalues.prod() > 0 else _HYPERBOLA
    if form == _PARABOLA:
        return _cut_parabola(eigenvalues, axes, equation[3:], ends, z)
    if is_flat or (eigenvalues.prod() > 0) != (form == _ELLIPSE):
        raise Fault("a conic is not of the kind that its form says")
    matrix = (axes * eigenvalues) @ axes.T
    center = np.linalg.solve(matrix, -equation[3:5] / 2)
    rest = float(equation[5] + equation[3:5] @ center / 2)
    squares = -rest / eigenvalues
    if form == _ELLIPSE:
        return _cut_ellipse(squares, axes, center, ends, z)
    return _cut_hyperbola(squares, axes, center, ends, z)


def _check_ends(equation: FloatArray, ends: FloatArray) -> None:
    """Refuse ends that do not fulfil the equation: its terms do not cancel out there."""
    x, y = ends.T
    terms = equation * np.stack([x * x, x * y, y * y, x, y, np.ones(2)], axis=1)
    if not (np.abs(terms.sum(axis=1)) <= OFF * np.abs(terms).sum(axis=1)).all():
        raise Fault("an end of a conic arc is not on the conic")


def _cut_ellipse(
    squares: FloatArray, axes: FloatArray, center: FloatArray, ends: FloatArray, z: float
) -> Curve:
    if not (squares > 0).all():
        raise Fault("an ellipse has no points")
    a, b = np.sqrt(squares).tolist()
    ellipse = Ellipse(_build_frame(center, axes[:, 0], z), a, b)
    first, last = (ellipse.find_parameter((x, y, z)) for x, y in ends.tolist())
    if hypot(*(ends[1] - ends[0]).tolist()) <= SAME_POINT * max(a, b):
        last = first + tau
    return ellipse.cut(first, last)


def _cut_hyperbola(
    squares: FloatArray, axes: FloatArray, center: FloatArray, ends: FloatArray, z: float
) -> Curve:
    """The arc on the branch of its start."""
    real = int(squares.argmax())
    if not squares[real] > 0 > squares[1 - real]:
        raise Fault("a hyperbola has no points")
    direction = axes[:, real]
    if (ends[0] - center) @ direction < 0:
        direction = -direction
    a, b = sqrt(squares[real]), sqrt(-squares[1 - real])
    hyperbola = Hyperbola(_build_frame(center, direction, z), a, b)
    first, last = (hyperbola.find_parameter((x, y, z)) for x, y in ends.tolist())
    if first < last:
        return hyperbola.cut(first, last)
    return reverse(hyperbola.cut(last, first))


def _cut_parabola(
    eigenvalues: FloatArray, axes: FloatArray, linear: FloatArray, ends: FloatArray, z: float
) -> Curve:
    """The arc of λ p² + d p + e q + F = 0, with p along one eigenvector and q along the other."""
    curved = int(np.abs(eigenvalues).argmax())
    value = float(eigenvalues[curved])
    across, along = axes[:, curved], axes[:, 1 - curved]
    d, e = float(linear[:2] @ across), float(linear[:2] @ along)
    if not abs(e) > 0:
        raise Fault("a parabola is a pair of lines")
    p = -d / (2 * value)
    q = -(linear[2] - value * p * p) / e
    focal = -e / value / 4
    frame = _build_frame(p * across + q * along, along if focal > 0 else -along, z)
    parabola = Parabola(frame, abs(focal))
    first, last = (parabola.find_parameter((x, y, z)) for x, y in ends.tolist())
    if first < last:
        return parabola.cut(first, last)
    return reverse(parabola.cut(last, first))


def _build_frame(origin: FloatArray, x: FloatArray, z: float) -> Frame:
    """The frame in the plane at the height z, with the axis x."""
    along = float(x[0]), float(x[1])
    center: Vector = (float(origin[0]), float(origin[1]), z)
    return Frame(center, (*along, 0.0), (-along[1], along[0], 0.0), (0.0, 0.0, 1.0))
