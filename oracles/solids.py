"""The 27 solids with which breps are tested, in the JSON language of the service.

They are models of our own, made by `tools.benchmarks.solid_models` and converted to B-splines:
plates with holes, fillets, threads, cut tori. Many of their parameter curves are wrong by up to a
hundredth of the diagonal, as they are in files from elsewhere. All solids are closed and valid but
one, `shelled`: a failed operation left some of its edges far from their surfaces. `MEASURES` has
the volume and the area of each, as Open CASCADE computed them.
"""

import gzip
import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "tests" / "solids"

MEASURES: dict[str, dict[str, float]] = json.loads((FOLDER / "measures.json").read_text())
"""`volume` and `area` by name."""

INVALID = "shelled"
"""The solid whose edges are far from its surfaces."""

VALID = tuple(name for name in MEASURES if name != INVALID)


def read_solid(name: str) -> dict[str, Any]:
    """The document of a solid, a new one for each call."""
    document: dict[str, Any] = json.loads(
        gzip.decompress((FOLDER / f"{name}.json.gz").read_bytes())
    )
    return document
