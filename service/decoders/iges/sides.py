"""The sides of trimmed faces: curves in space, each with its curve of parameters.

References
----------
IGES 5.3, sections 4.32 (141) and 4.33 (142).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import evaluate_surface, reverse, transform
from service.decoders.iges.shapes import find_all_ends, sample_all

SAMPLES = 5
"""Points at which a curve in space and a curve of parameters are compared."""

NEAR = 1e-2
"""A curve of parameters belongs to a curve of space if their ends are nearer to each other than
this share of the size of the loop."""

POINT = 1e-7
"""Curves that are smaller than this share of the loop are points."""


@dataclass(frozen=True, eq=False, slots=True)
class Side:
    """A side of a loop, in the direction of the loop.

    Attributes
    ----------
    curve : Curve or None
        In space; None at a pole, where the surface is one point.
    pcurve : Curve or None
        In the parameters of the surface.
    deviation : float
        How far the curve in space may be from the true one.
    gap : float
        The largest distance of the curve in space from the surface that was found.
    """

    curve: Curve | None
    pcurve: Curve | None = None
    deviation: float = 0.0
    gap: float = 0.0

    def turn(self) -> "Side":
        """The side in the other direction."""
        return replace(
            self,
            curve=None if self.curve is None else reverse(self.curve),
            pcurve=None if self.pcurve is None else reverse(self.pcurve),
        )

    def move(self, matrix: FloatArray) -> "Side":
        """The side after an affine map (4, 4) of space."""
        return self if self.curve is None else replace(self, curve=transform(self.curve, matrix))


def chain_curves(curves: Sequence[Curve]) -> list[Curve]:
    """Curves that follow each other; if they do not meet as they are, some are turned around."""
    if len(curves) < 2:
        return list(curves)
    ends = find_all_ends(curves)
    if _are_chained(ends):
        return list(curves)
    # The first curve ends where the second one has an end.
    away = np.linalg.norm(ends[0][:, np.newaxis] - ends[1][np.newaxis], axis=2).min(axis=1)
    is_turned = bool(away[0] < away[1])
    chained = [reverse(curves[0]) if is_turned else curves[0]]
    last = ends[0, 0 if is_turned else 1]
    for curve, (start, end) in zip(curves[1:], ends[1:], strict=True):
        is_turned = bool(np.linalg.norm(end - last) < np.linalg.norm(start - last))
        chained.append(reverse(curve) if is_turned else curve)
        last = start if is_turned else end
    return chained


def _are_chained(ends: FloatArray) -> bool:
    """Whether each of curves with these ends (n, 2, D) begins near the end of the one before."""
    gaps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    size = float(np.ptp(ends.reshape(-1, ends.shape[2]), axis=0).max())
    return bool(gaps.max() <= NEAR * size)


def pair_curves(surface: Surface, curves: Sequence[Curve], pcurves: Sequence[Curve]) -> list[Side]:
    """Sides of curves of space and of the curves of parameters that belong to them.

    Both follow each other around the loop. Where a curve of parameters is one point in space, at a
    pole, a side without a curve of space is put in. If the curves do not fit each other, the sides
    have no curves of parameters.
    """
    ends = find_all_ends(curves).reshape(-1, 3)
    images = _sample_images(surface, pcurves)
    sizes = np.ptp(images, axis=1).max(axis=1)
    size = max(float(np.ptp(ends, axis=0).max()), float(sizes.max()))
    near = NEAR * size
    is_pole = (sizes <= POINT * size).tolist()
    if len(curves) != len(pcurves) - sum(is_pole):
        is_pole = [False] * len(pcurves)
    plain = [Side(curve) for curve in curves]
    if len(curves) != len(pcurves) - sum(is_pole):
        return plain
    rows = np.flatnonzero(~np.array(is_pole))
    flags, gaps = _compare(sample_all(curves, SAMPLES), images[rows])
    if gaps.max() > near:
        return plain
    sides = [Side(None, pcurve) for pcurve in pcurves]
    triples = zip(rows.tolist(), curves, flags.tolist(), gaps.tolist(), strict=True)
    for row, curve, is_opposite, gap in triples:
        pcurve = reverse(pcurves[row]) if is_opposite else pcurves[row]
        sides[row] = Side(curve, pcurve, gap=gap)
    return sides


def _sample_images(surface: Surface, pcurves: Sequence[Curve]) -> FloatArray:
    """Points (k, SAMPLES, 3) of curves of parameters, at equal steps of their own parameters."""
    u, v = sample_all(pcurves, SAMPLES).reshape(-1, 2).T
    return evaluate_surface(surface, u, v).reshape(-1, SAMPLES, 3)


def _compare(points: FloatArray, images: FloatArray) -> tuple[Bools, FloatArray]:
    """Whether curves run against the images of their curves of parameters; the gaps at their ends.

    Parameters
    ----------
    points, images : ndarray of float64, shape (n, SAMPLES, 3)
        Between the ends their parameters may differ.
    """
    same = np.sqrt(np.square(points - images).sum(axis=2))
    opposite = np.sqrt(np.square(points - images[:, ::-1]).sum(axis=2))
    is_opposite = opposite.sum(axis=1) < same.sum(axis=1)
    nearer = np.where(is_opposite[:, np.newaxis], opposite, same)
    return is_opposite, nearer[:, [0, -1]].max(axis=1)
