"""The sides of trimmed faces: curves in space, each with its curve of parameters.

References
----------
IGES 5.3, sections 4.32 (141) and 4.33 (142).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import (
    evaluate,
    evaluate_surface,
    find_domain,
    find_ends,
    reverse,
    transform,
)

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
    ends = np.array([find_ends(curve) for curve in curves])
    if len(curves) < 2 or _are_chained(ends):
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
    ends = np.concatenate([find_ends(curve) for curve in curves])
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
    sides: list[Side] = []
    rest = iter(curves)
    for pcurve, image, pole in zip(pcurves, images, is_pole, strict=True):
        if pole:
            sides.append(Side(None, pcurve))
            continue
        curve = next(rest)
        is_opposite, gap = _compare(curve, image)
        if gap > near:
            return plain
        sides.append(Side(curve, reverse(pcurve) if is_opposite else pcurve, gap=gap))
    return sides


def _sample_images(surface: Surface, pcurves: Sequence[Curve]) -> FloatArray:
    """Points (k, SAMPLES, 3) of curves of parameters, at equal steps of their own parameters."""
    parameters = np.concatenate(
        [evaluate(curve, np.linspace(*find_domain(curve), SAMPLES)) for curve in pcurves]
    )
    points = evaluate_surface(surface, parameters[:, 0], parameters[:, 1])
    return points.reshape(-1, SAMPLES, 3)


def _compare(curve: Curve, image: FloatArray) -> tuple[bool, float]:
    """Whether a curve runs against the image of its curve of parameters; the gap at their ends.

    Between the ends their parameters may differ.
    """
    points = evaluate(curve, np.linspace(*find_domain(curve), SAMPLES))
    same, opposite = (np.linalg.norm(points - other, axis=1) for other in (image, image[::-1]))
    is_opposite = bool(opposite.sum() < same.sum())
    nearer = opposite if is_opposite else same
    return is_opposite, float(nearer[[0, -1]].max())
