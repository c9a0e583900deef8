"""docs/tolerance.md agrees with the service: its options, codes, numbers and requests."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from service.api.openapi.document import DESCRIPTION
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.extent import MAX_DISTANCE
from service.engine.options import MeshOptions
from service.pipeline.mesh import plan_mesh
from service.schemas.accuracy import ACCURACY_FIELDS
from service.surface.examples.catalogue import EXAMPLES
from tests.test_readme import SERVED_AT, run_shell
from tools.programs import find_program

PAGE = (Path(__file__).parents[1] / "docs" / "tolerance.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.M | re.S)


def read_first_column(title: str) -> list[str]:
    """The words in backticks that begin the rows of a section's table."""
    return re.findall(r"^\| `(\w+)` \|", PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0], re.M)


def test_the_table_lists_every_option_for_tolerances() -> None:
    assert sorted(read_first_column("Options")) == sorted(ACCURACY_FIELDS)


def test_the_service_has_the_codes_of_the_page() -> None:
    codes = read_first_column("Refusals")
    assert codes, "the page has no table of refusals"
    assert all(f"- `{code}`: " in DESCRIPTION for code in codes)


def test_the_page_says_how_far_a_model_may_be_from_zero() -> None:
    """Beyond this distance, a file has a local origin."""
    assert f"than {MAX_DISTANCE:.0f} times its extent" in " ".join(PAGE.split())


def write_row(tolerance: str) -> str:
    """The row that the table of the teapot must have for this tolerance."""
    options = MeshOptions(accuracy=Accuracy(tolerance=float(tolerance)))
    report = plan_mesh(EXAMPLES["utah-teapot"].surface(), options, BY_NAME["json"]).run().report
    assert report is not None
    cells = (
        tolerance,
        f"{report.triangles:,}".replace(",", " "),
        f"{report.deviation_bound:.3g}",
        str(report.boundary_edges),
    )
    return f"| {' | '.join(cells)} |"


@pytest.mark.parametrize("tolerance", ["0.1", "0.01", "0.001"])
def test_the_table_of_the_teapot_has_the_computed_numbers(tolerance: str) -> None:
    assert write_row(tolerance) in PAGE.splitlines()


@pytest.mark.parametrize("command", COMMANDS, ids=[f"{n}" for n in range(len(COMMANDS))])
def test_the_commands_of_the_page_get_what_the_page_promises(
    command: str, server: str, tmp_path: Path
) -> None:
    """Tolerances and budgets are kept; for pixels, the report has a bound."""
    find_program("curl")
    response = run_shell(command.replace(SERVED_AT, server), tmp_path)
    if "-D -" in command:
        bound = re.search(r"^surface-deviation-bound: (.*)$", response, re.M | re.I)
        assert bound
        assert 0 < float(bound[1]) <= 0.01  # the tolerance in the URL of this command
        assert (tmp_path / "teapot.glb").read_bytes()[:4] == b"glTF"
        return
    document: dict[str, Any] = json.loads(response)
    if "/estimate" in command:
        assert document["accepted"]
        return
    report = document["report"]
    assert report["deviation_bound"] > 0
    request = json.loads(command.split("-d '")[1].rpartition("'")[0])
    if "relative_tolerance" in request:
        diagonal = (1 + 4 + 4) ** 0.5  # of the bounding box, 1 × 2 × 2, of the surface
        assert report["deviation_bound"] <= request["relative_tolerance"] * diagonal
        # `two_sided` allows twice the tolerance for the distance from the mesh to the surface.
        assert report["mesh_deviation_bound"] <= 2 * request["relative_tolerance"] * diagonal
    if "max_triangles" in request:
        assert report["triangles"] <= request["max_triangles"]
