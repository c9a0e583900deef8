"""Small examples for the recipes of CONTRIBUTING.md: an endpoint and a command."""

from tools.recipes.steps import Recipe, Step

ENDPOINT = Recipe(
    max_files=5,
    steps=(
        Step(
            "service/schemas/crate.py",
            '''"""The request of a crate for a surface."""

from pydantic import Field

from service.schemas.request import SurfaceRequest


class CrateRequest(SurfaceRequest):
    """A surface, and the margin on every side of its crate."""

    margin: float = Field(default=0.0, ge=0, le=1e6, description="The margin on every side.")
''',
        ),
        Step(
            "service/pipeline/crate.py",
            '''"""Computes the crate (an axis-aligned box with a margin) that contains a surface."""

from functools import partial

from service.encoders.text import json_text
from service.measuring import Measured
from service.pipeline.checks import check_surface
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.query_costs import points_cost
from service.surface.sizes import SurfaceKind


def plan_crate(
    surface: SurfaceKind, margin: float, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan a crate: estimate its cost from shapes, and check the limits."""
    size = check_surface(surface.stored_size(), limits)
    return Work(points_cost(size, count=1, order=0), partial(_pack, surface, margin))


def _pack(surface: SurfaceKind, margin: float) -> bytes:
    """The corners of the crate as JSON."""
    with Measured("crate"):
        low, high = surface.lower().bounds
        return json_text({"low": low - margin, "high": high + margin})
''',
        ),
        Step(
            "service/api/models/crate.py",
            '''"""The response to the request of a crate."""

from service.api.models.meshes import ResponseModel, Vector


class Crate(ResponseModel):
    """A box that contains the surface."""

    low: Vector
    """Least coordinates."""
    high: Vector
    """Greatest coordinates."""
''',
        ),
        Step(
            "service/api/routes/evaluation.py",
            insertions=(
                (
                    "from service.api.body import BodyRoute\n",
                    """from service.api.models.crate import Crate
from service.pipeline.crate import plan_crate
from service.schemas.crate import CrateRequest
""",
                ),
                (
                    "points = APIRouter(route_class=BodyRoute)\n",
                    '''
_CRATES: Json = {
    "square": {
        "summary": "A square",
        "value": {"surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}},
    }
}
show_responses(
    "packSurface",
    _CRATES,
    CrateRequest,
    lambda document: plan_crate(document.to_surface(), document.margin).run(),
)


@points.post(
    "/v1/crate",
    operation_id="packSurface",
    tags=["queries"],
    summary="A crate for a surface",
    response_model=Crate,
    response_description="The crate.",
    responses={200: success(), **POST_ERRORS},
    openapi_extra=json_body(_CRATES),
)
async def pack_surface(body: CrateRequest, context: ContextDep) -> Response:
    """Computes a box that contains the surface."""
    services, job, *_ = context
    work = plan_crate(body.to_surface(), body.margin, services.limits)
    return bytes_response(await job.run(work, "crate"), job)

''',
                ),
            ),
        ),
        Step(
            "tests/api/test_crate.py",
            """from tools.client import Client


def test_a_square_has_a_flat_crate(client: Client) -> None:
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
    response = client.post("/v1/crate", {"surface": {"control_net": net}, "margin": 1})
    assert response.json() == {"low": [-1, -1, -1], "high": [2, 2, 1]}
""",
        ),
    ),
    tests=(
        "tests/api/test_crate.py",
        "tests/api/test_hostile.py::test_every_call_refuses_invalid_fields",
        "tests/api/observing/test_middleware.py",
    ),
)

COMMAND = Recipe(
    max_files=3,
    steps=(
        Step(
            "service/cli/lists.py",
            insertions=(
                (
                    'FORMATS = Command("formats", "list the formats", _formats)\n',
                    """

def _kinds(_: argparse.Namespace) -> int:
    from service.schemas.kinds import KINDS

    print_lines(KINDS)
    return OK


KINDS = Command("kinds", "list the kinds of surfaces", _kinds)
""",
                ),
            ),
        ),
        Step(
            "service/cli/main.py",
            insertions=(
                (
                    "from service.cli.lists import EXAMPLES, FORMATS, OPENAPI\n",
                    "from service.cli.lists import KINDS\n",
                ),
                ("COMMANDS = (\n", "    KINDS,\n"),
            ),
        ),
        Step(
            "tests/cli/test_kinds.py",
            """import pytest

from service.cli.main import main


def test_kinds_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["kinds"]) == 0
    assert "bspline" in capsys.readouterr().out.split()
""",
        ),
    ),
    tests=("tests/cli/test_kinds.py", "tests/cli/test_main.py"),
)
