"""Meshes by a budget: as near to the surface as so many triangles, or bytes, allow."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TypeAlias

from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.budget import Attempt, nearest_within
from service.engine.adaptive.limits import Effort
from service.errors import InvalidRequest, Issue, TooLarge
from service.pipeline.certified import Made, Make

Write: TypeAlias = Callable[[Made], bytes]

ANY = 2**62
"""More triangles than there are."""

ATTEMPTS = 3
"""Meshes as costly as can be that a search may make; nearly all that it makes cost less."""


def within_budget(
    make: Make, write: Write, accuracy: Accuracy, least: float, effort: Effort
) -> tuple[Made, bytes]:
    """The mesh of the least certified deviation that the budget allows, and its file.

    A finer tolerance than `least`, in model units, is not tried. Of the `effort`, all of which the
    search may take, a mesh takes a third at most: one more budget that is kept to.

    Raises
    ------
    InvalidRequest
        `budget_too_small`, saying what the least would be.
    TooLarge
        If even the coarsest mesh is beyond what is computed at all.
    """
    most = effort.whole / ATTEMPTS

    def tried(allowed: Accuracy, tolerance: float) -> Attempt[tuple[Made, bytes]]:
        before = effort.spent
        made = make(allowed, tolerance)
        content = write(made)
        cost = _cost(made, content, accuracy)
        taken = (effort.spent - before) / most
        return Attempt(max(cost, taken), made.report.deviation_bound or 0.0, (made, content))

    # The coarsest is made whatever the budget, to say what it would need.
    unlimited = accuracy if accuracy.max_triangles is None else replace(accuracy, max_triangles=ANY)
    coarsest = tried(unlimited, inf)
    made, content = coarsest.result
    _check("/max_triangles", "triangles", made.report.triangles, accuracy.max_triangles)
    _check("/max_bytes", "bytes", len(content), accuracy.max_bytes)

    def attempt(tolerance: float) -> Attempt[tuple[Made, bytes]] | None:
        effort.allow(most)
        try:
            return tried(accuracy, tolerance)
        except TooLarge:
            return None
        except InvalidRequest as error:
            # The surface is met already, as near as its numbers allow.
            if any(issue.code != "tolerance_too_small" for issue in error.issues):
                raise
            return None

    return nearest_within(attempt, coarsest, least).result


def _cost(made: Made, content: bytes, budget: Accuracy) -> float:
    """The larger share of what a budget allows."""
    counts = (made.report.triangles, budget.max_triangles), (len(content), budget.max_bytes)
    return max(count / most for count, most in counts if most is not None)


def _check(where: str, unit: str, least: int, most: int | None) -> None:
    """Refuses a budget that not even the coarsest mesh keeps to."""
    if most is not None and least > most:
        raise InvalidRequest(
            Issue(
                "budget_too_small",
                "No mesh of the surface is so small.",
                where,
                f"{most} {unit}",
                f"at least {least} {unit}",
            )
        )
