"""Curvatures at and near poles and cusps, where the formulas fail: each is computed as a limit."""

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
"""Samples after which the cost is checked again."""

MOST = 10_000_000_000
"""The most multiplications for the limits of one mesh: some seconds, for 100 000 limits."""


@dataclass(slots=True)
class LimitCurvatures:
    """The limits of curvature of one mesh, and the multiplications spent on them."""

    spent: int = 0

    def curvatures(self, patches: Patches, index: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """K and H (2, m) of patch `index[k]` at (u[k], v[k]); of triangles, (s[k], t[k]).

        NaN where a limit is infinite or does not exist.

        Raises
        ------
        TooLarge
            `too_costly` if there are too many poles.
        """
        values = np.empty((2, len(index)))
        for first, last in row_runs(len(index), CHUNK_SAMPLES):
            block = slice(first, last)
            places = index[block], u[block], v[block]
            if isinstance(patches, TrianglePatches):
                jets = evaluate_triangle_jets(patches, *places, 2)
            else:
                jets = evaluate_jets(patches, *places, 2)
            if jets.curvatures is None or jets.degenerate is None:
                raise ValueError("second partials come with curvatures")
            values[0, block], values[1, block] = (
                jets.curvatures.gaussian,
                jets.curvatures.mean,
            )
            near = find_near_poles(patches, places[0], np.stack(places[1:], axis=1))
            count = int((near | jets.degenerate).sum())
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
    """The least number of multiplications for a limit."""
    degrees = patches.degree if isinstance(patches, TensorPatches) else (patches.degree,) * 2
    size = (degrees[0] + 1) * (degrees[1] + 1)
    return (SERIES + 100 * size) * (1 if patches.weights is None else 2)


def is_affordable(models: Sequence[PatchModel], samples: int) -> bool:
    """Whether the limits are affordable even if every sample is a pole."""
    return (
        samples * max(cost_of_limit(batch) for model in models for batch in model.batches) <= MOST
    )
