"""Curvatures at and near poles and cusps. The formulas fail there, so each curvature is a limit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_runs
from service.engine.points.evaluate import SERIES_COST, find_near_poles
from service.engine.points.jets import evaluate_jets
from service.errors import Issue, TooLarge
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import PatchModel

CHUNK_SAMPLES = 16_384
"""The most samples that are evaluated before the cost is compared with its limit again."""

MAX_MULTIPLICATIONS = 10_000_000_000
"""The most multiplications for the limits of one mesh: about 100,000 limits, which take seconds."""


@dataclass(slots=True)
class LimitCurvatures:
    """The limits of curvature of one mesh, and the multiplications spent on them."""

    spent: int = 0

    def curvatures(self, patches: Patches, index: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """Gaussian and mean curvature, (2, m), of patch `index[k]` at (u[k], v[k]).

        For triangles, u and v are the parameters s and t. A curvature is NaN where its limit is
        infinite or does not exist.

        Raises
        ------
        TooLarge
            `too_costly` if too many samples are at poles or cusps.
        """
        values = np.empty((2, len(index)))
        for first, last in row_runs(len(index), CHUNK_SAMPLES):
            rows = slice(first, last)
            samples = index[rows], u[rows], v[rows]
            jets = evaluate_jets(patches, *samples, 2)
            if jets.curvatures is None or jets.degenerate is None:
                raise ValueError("Jets of order 2 have curvatures.")
            values[:, rows] = jets.curvatures[:2]
            parameters = np.stack([u[rows], v[rows]], axis=1)
            is_near_pole = find_near_poles(patches, index[rows], parameters)
            count = int((is_near_pole | jets.degenerate).sum())
            self.refuse_if_too_costly(count, patches)
            self.spent += count * count_limit_multiplications(patches)
        return values

    def refuse_if_too_costly(self, count: int, patches: Patches) -> None:
        """Raise `TooLarge` if `count` more limits on these patches would take too long."""
        if self.spent + count * count_limit_multiplications(patches) > MAX_MULTIPLICATIONS:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "Curvatures at poles and cusps are limits, and the mesh has too many of them.",
                    "/curvatures",
                    f"more than {MAX_MULTIPLICATIONS:.3g} multiplications",
                    "fewer divisions, or no curvatures",
                )
            )


def count_limit_multiplications(patches: Patches) -> int:
    """A lower bound of the number of multiplications for the limit at one sample.

    Each control point adds at least 100 to `SERIES_COST`; homogeneous coordinates double the sum.
    """
    degrees = patches.degree if isinstance(patches, TensorPatches) else (patches.degree,) * 2
    control_points = (degrees[0] + 1) * (degrees[1] + 1)
    return (SERIES_COST + 100 * control_points) * (1 if patches.weights is None else 2)


def is_affordable(models: Sequence[PatchModel], samples: int) -> bool:
    """Whether a mesh with this number of samples stays below the limit even if all are at poles."""
    max_multiplications = max(
        count_limit_multiplications(b) for model in models for b in model.batches
    )
    return samples * max_multiplications <= MAX_MULTIPLICATIONS
