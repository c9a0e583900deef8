"""The requests to other makers: the tolerance, or what stands for it in the maker's own terms.

Makers without a tolerance take a number of elements, or of divisions. Two rules find them:

- Sizes from curvature: a chord of a circle of radius r, of which n make a full turn, is
  r (1 − cos(π/n)) from the circle. The circle is as wide as the diagonal of the surface, because
  smaller circles are met more closely with the same n.
- Grids: a triangle with sides 1/n of parameters is within (Duu + 2 Duv + Dvv) / (8 n²) of the
  surface, where D are the largest second derivatives (Filip, Magedson and Markot, Surface
  algorithms using bounds on derivatives, CAGD 3, 1986). They are sampled here, as users do.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import acos, ceil, pi, sqrt
from typing import Any

from tools.judge_peers.cases import Case


@dataclass(frozen=True)
class Wish:
    """A request to a maker: fields of its request, and the words of the table."""

    fields: dict[str, Any]
    text: str


def ask_tolerance(case: Case, tolerance: float, triangles: int) -> Wish | None:
    """The tolerance itself, for makers that read CAD files."""
    del triangles
    if case.step is None:
        return None
    return Wish({"file": str(case.step), "tolerance": tolerance}, "the tolerance")


def ask_turns(case: Case, tolerance: float, triangles: int) -> Wish | None:
    """Elements for a full turn."""
    del triangles
    if case.step is None:
        return None
    elements = ceil(pi / acos(1 - 2 * tolerance / case.diagonal))
    return Wish({"file": str(case.step), "elements": elements}, f"{elements} elements a turn")


def ask_radii(case: Case, tolerance: float, triangles: int) -> Wish | None:
    """Elements for a radius: a full turn has 2π radii."""
    turn = ask_turns(case, tolerance, triangles)
    if turn is None:
        return None
    elements = turn.fields["elements"] / (2 * pi)
    fields = {"elements": elements, "largest": case.diagonal}
    return Wish(turn.fields | fields, f"{elements:.1f} elements a radius")


def ask_grid_by_formula(case: Case, tolerance: float, triangles: int) -> Wish | None:
    """The divisions of the estimate by second derivatives."""
    del triangles
    if case.nets is None:
        return None
    divisions = max(1, ceil(sqrt(case.bends / (8 * tolerance))))
    return Wish({"file": str(case.nets), "divisions": divisions}, "divisions by the estimate")


def ask_grid_by_count(case: Case, tolerance: float, triangles: int) -> Wish | None:
    """The divisions with which a grid has about as many triangles as the mesh of the service."""
    del tolerance
    if case.nets is None:
        return None
    divisions = max(1, round(sqrt(triangles / (2 * case.patches))))
    return Wish({"file": str(case.nets), "divisions": divisions}, "our number of triangles")


Ask = Callable[[Case, float, int], Wish | None]
"""The wish for a case, an absolute tolerance, and the number of our triangles; None if the maker
has no such surfaces."""
