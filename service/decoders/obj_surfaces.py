"""Makes documents of the curves and surfaces of an OBJ file, which have control points and `parm`.

`parm` is the knot vector of a B-spline; of Bézier pieces, which follow each other and share their
borders, it is the list of parameters at which they meet.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import prod

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import Tree

SAME_RANGE = 1e-6
"""A range that differs by less than this, relative to the domain, is the whole domain: files have
their numbers in some six digits."""


@dataclass(frozen=True, eq=False, slots=True)
class Form:
    """A curve or surface without its control points.

    Attributes
    ----------
    basis : str
        "bezier" or "bspline".
    degrees : tuple of int
        One for each direction.
    parameters : tuple of list of float
        The numbers of `parm`, for each direction.
    """

    basis: str
    degrees: tuple[int, ...]
    parameters: tuple[list[float], ...]

    def counts(self) -> tuple[int, ...]:
        """The number of control points along each direction; below degree + 1 if `parm` is short.

        n points of degree p have n + p + 1 knots; m pieces have m p + 1 points, and m + 1
        parameters.
        """
        pairs = zip(self.degrees, map(len, self.parameters), strict=True)
        if self.basis == "bezier":
            return tuple(degree * (length - 1) + 1 for degree, length in pairs)
        return tuple(length - degree - 1 for degree, length in pairs)

    def count_points(self) -> int:
        """The number of all control points; 0 if a direction has too few parameters."""
        counts = self.counts()
        is_whole = all(n > degree for n, degree in zip(counts, self.degrees, strict=True))
        return prod(counts) if is_whole else 0

    def describe_needed(self) -> str:
        """The number of control points that are needed, for an error."""
        if not self.count_points():
            return "`parm` with more numbers, for each direction"
        return " times ".join(map(str, self.counts()))

    def is_unit(self) -> bool:
        """Whether this is one Bézier piece over the unit interval or the unit square."""
        return self.basis == "bezier" and all(each == [0, 1] for each in self.parameters)

    def domain(self, axis: int) -> tuple[float, float]:
        """The first and last parameter along one direction."""
        skipped = 0 if self.basis == "bezier" else self.degrees[axis]
        parameters = self.parameters[axis]
        return parameters[skipped], parameters[-1 - skipped]

    def knots(self, axis: int) -> FloatArray:
        """The knots along one direction: those of Bézier pieces occur degree times inside."""
        parameters, degree = np.array(self.parameters[axis]), self.degrees[axis]
        if self.basis == "bspline":
            return parameters
        repetitions = np.full(len(parameters), degree)
        repetitions[[0, -1]] += 1
        return np.repeat(parameters, repetitions)


@dataclass(frozen=True, slots=True)
class Loop:
    """The curves of a loop, as documents, in the parameters of a surface."""

    curves: tuple[Tree, ...]
    is_hole: bool


def is_same_range(given: Sequence[float], domain: Sequence[float]) -> bool:
    """Whether two ranges of parameters differ by no more than the digits of files explain."""
    allowed = SAME_RANGE * (domain[1] - domain[0])
    return all(abs(a - b) <= allowed for a, b in zip(given, domain, strict=True))


def build_curve(form: Form, points: FloatArray, weights: FloatArray | None) -> Tree:
    """The document of a curve with these control points, (n, 2)."""
    tree: Tree = {"type": "bezier"}
    if not form.is_unit():
        tree = {"type": "bspline", "degree": form.degrees[0], "knots": form.knots(0)}
    tree["control_points"] = points
    return tree if weights is None else tree | {"weights": weights}


def build_surface(
    form: Form,
    points: FloatArray,
    weights: FloatArray | None,
    ranges: Sequence[float],
    loops: Sequence[Loop],
) -> Tree:
    """The document of a surface; of a part of one, that of a face of a `brep`, with `loops`.

    Parameters
    ----------
    form : Form
    points : ndarray, shape (n, 3)
        Control points; u varies fastest.
    weights : ndarray, shape (n,), or None
    ranges : sequence of 4 numbers
        The first and last parameter u, and those of v.
    loops : sequence of Loop
        If none is an outer one, the ranges are the outer loop.
    """
    columns, rows = form.counts()

    def split(values: FloatArray) -> FloatArray:
        return values.reshape(rows, columns, *values.shape[1:]).swapaxes(0, 1)

    tree: Tree = {"type": "bezier"}
    if not form.is_unit():
        tree = {
            "type": "bspline",
            "degree": list(form.degrees),
            "knots": [form.knots(axis) for axis in range(2)],
        }
    tree["control_net"] = split(points)
    if weights is not None:
        tree["weights"] = split(weights)
    domain = [form.domain(axis) for axis in range(2)]
    given = [tuple(ranges[:2]), tuple(ranges[2:])]
    is_whole = all(map(is_same_range, given, domain))
    if is_whole and not loops:
        return tree
    if all(loop.is_hole for loop in loops):
        loops = [_build_rectangle(*(domain if is_whole else given)), *loops]
    return {"surface": tree, "loops": [{"pcurves": list(loop.curves)} for loop in loops]}


def _build_rectangle(range_u: Sequence[float], range_v: Sequence[float]) -> Loop:
    """The loop around a rectangle of parameters, with the rectangle on its left."""
    (u0, u1), (v0, v1) = range_u, range_v
    corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1], [u0, v0]]
    return Loop(tuple({"control_points": [*side]} for side in pairwise(corners)), is_hole=False)
