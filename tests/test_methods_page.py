"""docs/methods.md tells of every method, and of the limits that the code has."""

from pathlib import Path
from typing import get_args

import numpy as np

from service.engine.evaluation.forward_difference import MAX_DEGREE
from service.engine.options import Method
from service.pipeline.limits import Limits
from service.schemas.options import MeshOptionFields

PAGE = (Path(__file__).parents[1] / "docs" / "methods.md").read_text(encoding="utf-8")


def test_every_method_is_told_of() -> None:
    first = PAGE.split("\n## ")[0]
    assert [row.split("`")[1] for row in first.splitlines() if row.startswith("| `")] == [
        "method",
        *get_args(Method),
    ]


def test_limits_are_those_of_the_code() -> None:
    single, double = MAX_DEGREE[np.float32], MAX_DEGREE[np.float64]
    assert f"Beyond degree {single} there, and beyond degree {double}" in " ".join(PAGE.split())
    assert Limits().max_multiplications == 5 * 10**9
    assert "5 · 10⁹ multiplications" in PAGE
    description = MeshOptionFields.model_fields["method"].description or ""
    assert f"degrees up to {single} ({double} where the format stores float64)" in description
    assert "docs/methods.md" in description
