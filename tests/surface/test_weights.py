"""Very small and very large weights, for every kind of surface and curve that has weights."""

from typing import Any

import numpy as np
import pytest

from service.encoders.polylines.registry import CURVES_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.curves.polyline import CurveOptions
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.pipeline.polylines import plan_curve
from service.schemas.curves import CurveRequest
from service.schemas.document import DocumentLimits
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document

LIMITS = DocumentLimits()
NET = [[[i, j, (i * j) % 3] for j in range(4)] for i in range(4)]
ROWS = [[[0, 0, 0], [2, 0, 2], [4, 0, 0]], [[0, 2, 2], [2, 2, 0]], [[0, 4, 0]]]
POLYGON = [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]

POWERS = [-1070, -500, 500, 1020]
"""Powers of 2 that are common factors of weights. The first and the last are near the ends of
float64: the largest weight is 8 times the factor."""


def build_surfaces(w: float) -> dict[str, dict[str, Any]]:
    """A surface of each rational kind, with weights that are w times a small power of two."""
    grid = [[w, 2 * w, w, 8 * w]] * 4
    return {
        "bezier": {"control_net": NET, "weights": grid},
        "bspline": {"type": "bspline", "control_net": NET, "degree": 2, "weights": grid},
        "triangle": {
            "type": "triangle",
            "control_net": ROWS,
            "weights": [[w, 2 * w, w], [8 * w, w], [w]],
        },
        "patches": {
            "type": "patches",
            "vertices": POLYGON,
            "patches": [[[0, 1], [3, 2]]],
            "weights": [w, 2 * w, w, 8 * w],
        },
        "tube": {
            "type": "tube",
            "curve": {"control_points": POLYGON, "weights": [w, 2 * w, w, 8 * w]},
            "radius": 0.1,
        },
    }


@pytest.mark.parametrize("power", POWERS)
@pytest.mark.parametrize("kind", build_surfaces(1.0))
def test_a_common_factor_of_weights_does_not_change_meshes(kind: str, power: int) -> None:
    """Meshes are equal bit for bit, because products with a power of two are exact."""
    meshes = [
        render(
            validate_document(
                MeshRequest, {"surface": build_surfaces(w)[kind]}, LIMITS
            ).to_surface(),
            MeshOptions((5, 4)),
            BY_NAME["json"],
        )
        for w in (1.0, float(np.ldexp(1.0, power)))
    ]
    assert b"null" not in meshes[0]  # JSON has null for NaN and infinity
    assert meshes[0] == meshes[1]


@pytest.mark.parametrize("power", POWERS)
@pytest.mark.parametrize("kind", ["bezier", "bspline"])
@pytest.mark.parametrize("options", [CurveOptions(), CurveOptions(tolerance=1e-3)])
def test_a_common_factor_of_weights_does_not_change_curves(
    kind: str, power: int, options: CurveOptions
) -> None:
    contents = []
    for w in (1.0, float(np.ldexp(1.0, power))):
        curve = {"type": kind, "control_points": POLYGON, "weights": [w, 2 * w, w, 8 * w]}
        request = validate_document(CurveRequest, {"curve": curve}, LIMITS)
        contents.append(plan_curve(request.to_curve(), options, CURVES_BY_NAME["json"]).run())
    assert contents[0] == contents[1]
