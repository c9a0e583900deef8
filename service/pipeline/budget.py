"""Meshes by a budget: as near to the surface as so many triangles, or bytes, allow."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TypeAlias

from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.budget import Attempt, nearest_within
from service.errors import InvalidRequest, Issue, TooLarge
from service.pipeline.certified import Made, Make

Write: TypeAlias = Callable[[Made], bytes]


def within_budget(make: Make, write: Write, accuracy: Accuracy, least: float) -> tuple[Made, bytes]:
    """The mesh of the least certified deviation that the budget allows, and its file.

    A finer tolerance than `least`, in model units, is not tried.

    Raises
    ------
    InvalidRequest
        `budget_too_small`, saying what the least would be.
    TooLarge
        If even the coarsest mesh is beyond what is computed at all.
    """
    # The coarsest is made whatever the budget, to say what it would need.
    coarsest = _made(make, write, replace(accuracy, max_triangles=None), accuracy, inf)
    made, content = coarsest.result
    _check("/max_triangles", "triangles", made.report.triangles, accuracy.max_triangles)
    _check("/max_bytes", "bytes", len(content), accuracy.max_bytes)

    def attempt(tolerance: float) -> Attempt[tuple[Made, bytes]] | None:
        try:
            return _made(make, write, accuracy, accuracy, tolerance)
        except TooLarge:
            return None
        except InvalidRequest as error:
            # The surface is met already, as near as its numbers allow.
            if any(issue.code != "tolerance_too_small" for issue in error.issues):
                raise
            return None

    return nearest_within(attempt, coarsest, least).result


def _made(
    make: Make, write: Write, allowed: Accuracy, budget: Accuracy, tolerance: float
) -> Attempt[tuple[Made, bytes]]:
    """What one tolerance comes to, in shares of the budget."""
    made = make(allowed, tolerance)
    content = write(made)
    shares = [
        count / most
        for count, most in (
            (made.report.triangles, budget.max_triangles),
            (len(content), budget.max_bytes),
        )
        if most is not None
    ]
    return Attempt(max(shares), made.report.deviation_bound or 0.0, (made, content))


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
