"""Curvatures where formulas do not do: at poles, cusps and beside them, one by one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_runs
from service.engine.points.differential import evaluate_jets
from service.engine.points.evaluate import SERIES, find_near_poles
from service.engine.points.triangle_differential import evaluate_triangle_jets
from service.errors import Issue, TooLarge
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

CHUNK_SAMPLES = 16_384
"""Samples after which it is asked whether this takes too long."""

MOST = 10_000_000_000
"""Multiplications that the limits of one mesh may take: some seconds, at 100 000 places."""


@dataclass(slots=True)
class LimitCurvatures:
    """The limits of curvature of one mesh, and the multiplications spent on them."""

    spent: int = 0

    def curvatures(self, patches: Patches, index: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """K and H (2, m) of patch `index[k]` at (u[k], v[k]); of triangles, (s[k], t[k]).

        NaN where a limit is infinite or there is none.

        Raises
        ------
        TooLarge
            `too_costly`, where there are too many poles.
        """
        values = np.empty((2, len(index)))
        for first, last in row_runs(len(index), CHUNK_SAMPLES):
            block = slice(first, last)
            places = index[block], u[block], v[block]
            if isinstance(patches, TrianglePatches):
                known = evaluate_triangle_jets(patches, *places, 2)
            else:
                known = evaluate_jets(patches, *places, 2)
            if known.curvatures is None or known.degenerate is None:
                raise ValueError("second partials come with curvatures")
            values[0, block], values[1, block] = known.curvatures.gaussian, known.curvatures.mean
            near = find_near_poles(patches, places[0], np.stack(places[1:], axis=1))
            count = int((near | known.degenerate).sum())
            self.check(count, patches)
            self.spent += count * cost_of_limit(patches)
        return values

    def check(self, count: int, patches: Patches) -> None:
        """Refuse `count` more limits if they would take too long."""
        if self.spent + count * cost_of_limit(patches) > MOST:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "Curvatures at poles and cusps are limits, and the mesh has too many of them.",
                    "/curvatures",
                    f"more than {MOST:.3g} multiplications",
                    "fewer divisions, or no curvatures",
                )
            )


def cost_of_limit(patches: Patches) -> int:
    """Multiplications that a limit takes at least."""
    degrees = patches.degree if isinstance(patches, TensorPatches) else (patches.degree,) * 2
    size = (degrees[0] + 1) * (degrees[1] + 1)
    return (SERIES + 100 * size) * (1 if patches.weights is None else 2)


def is_affordable(models: Sequence[PatchModel], samples: int) -> bool:
    """Whether all samples can be computed even if every one of them is a pole."""
    return (
        samples * max(cost_of_limit(batch) for model in models for batch in model.batches) <= MOST
    )
