"""The pages of docs/ agree with the code."""

import json
import re
from pathlib import Path
from typing import get_args

import numpy as np

from service.api.openapi.parameters import REQUESTS
from service.engine.evaluation.forward_difference import MAX_DEGREE
from service.engine.options import Method
from service.pipeline.limits import Limits
from service.schemas.document import MAX_FACES, STRINGS_PER_OBJECT, VALUES_PER_OBJECT
from service.schemas.options import MeshOptionFields
from service.surface.examples.catalogue import EXAMPLES
from tests.breps import PLATE
from tools.picture import CURVE_EXAMPLES, write_examples_page

DOCS = Path(__file__).parents[1] / "docs"
METHODS = (DOCS / "methods.md").read_text(encoding="utf-8")


def test_the_page_of_examples_lists_all_examples() -> None:
    assert (DOCS / "examples.md").read_text(encoding="utf-8") == write_examples_page()


def test_each_example_has_one_picture() -> None:
    for folder, names in (("examples", EXAMPLES), ("curves", CURVE_EXAMPLES)):
        pictures = [path.read_bytes()[:4] for path in (DOCS / folder).iterdir()]
        assert pictures == [b"\x89PNG"] * len(names)
        assert {path.stem for path in (DOCS / folder).iterdir()} == set(names)


def test_the_example_of_a_brep_is_that_of_the_interface() -> None:
    """The example in docs/surfaces.md, which `test_readme.py` sends to a service."""
    section = (DOCS / "surfaces.md").read_text(encoding="utf-8").split("## Whole parts: breps")[1]
    surface = json.loads(section.split("-d '")[1].split("'\n```")[0])["surface"]
    assert surface == REQUESTS["createMesh"]["brep"]["value"]["surface"] == PLATE
    codes = set(re.findall(r"`(\w+)`", section.split("**What is wrong.**")[1].split("With `")[0]))
    description = (DOCS.parent / "service/api/openapi/description.md").read_text(encoding="utf-8")
    for code in codes - {"gap_bound", "closed"}:
        assert f"- `{code}`: " in description
    assert f"{MAX_FACES:,} faces (`SURFACE_MAX_FACES`)" in " ".join(section.split())
    more = f"{STRINGS_PER_OBJECT} more strings and {VALUES_PER_OBJECT} more values"
    assert more in " ".join(section.split())


def test_the_table_of_methods_lists_all_methods() -> None:
    introduction = METHODS.split("\n## ")[0]
    rows = [line for line in introduction.splitlines() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows] == ["method", *get_args(Method)]


def test_limits_of_methods_are_those_of_the_code() -> None:
    float32_degree, float64_degree = MAX_DEGREE[np.float32], MAX_DEGREE[np.float64]
    limits = (
        f"beyond degree {float32_degree} for these formats, "
        f"and beyond degree {float64_degree} for formats"
    )
    assert limits in " ".join(METHODS.split())
    assert Limits().max_multiplications == 5 * 10**9
    assert "5 · 10⁹ multiplications" in METHODS
    description = MeshOptionFields.model_fields["method"].description or ""
    assert (
        f"degrees up to {float32_degree} ({float64_degree} if the format stores float64)"
        in description
    )
    assert "docs/methods.md" in description
