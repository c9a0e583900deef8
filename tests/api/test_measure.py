"""POST /v1/measure: closed and open surfaces, examples, and refused requests."""

from math import pi
from typing import Any

import numpy as np
import orjson
import pytest

from service.api.app import create_app
from service.api.models.queries import SurfaceMeasures
from service.api.threads import Turn
from service.engine.measures.values import MeasureQuery
from service.errors import TooLarge
from service.pipeline.limits import Limits
from service.pipeline.measure import plan_measure
from service.settings.values import Settings
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import EXAMPLES
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
CORNERS = [[x, 2 * y, 3 * z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
FACES = [
    [[0, 1], [2, 3]], [[4, 6], [5, 7]], [[0, 4], [1, 5]],
    [[2, 3], [6, 7]], [[0, 2], [4, 6]], [[1, 5], [3, 7]],
]  # fmt: skip
SLOW = {"tea-service", "swept-wing"}  # examples that take seconds


def build_brick(faces: Any) -> dict[str, Any]:
    """A brick of 1 × 2 × 3 with these faces, lists of vertex indices."""
    return {"type": "patches", "vertices": CORNERS, "patches": faces}


def measure(client: Client, **fields: Any) -> Any:
    """The valid response to a request with these fields."""
    response = client.post("/v1/measure", fields)
    assert response.status_code == 200, response.text
    SurfaceMeasures.model_validate_json(response.content)
    return response.json()


def is_about(interval: dict[str, float], value: float, width: float = 1e-6) -> bool:
    """True if the interval contains the value and is narrow.

    Narrow is at most `width`, relative to the value, or to 1 for small values.
    """
    low, high = interval["low"], interval["high"]
    return low <= value <= high and high - low <= width * max(abs(value), 1)


def test_a_closed_brick_has_area_volume_and_centroid(client: Client) -> None:
    result = measure(client, surface=build_brick(FACES))
    assert is_about(result["area"], 22)
    assert is_about(result["volume"], 6, 1e-12)
    assert all(is_about(*each) for each in zip(result["centroid"], (0.5, 1, 1.5), strict=True))
    assert result["closed"]
    assert result["reached"]
    assert result["parts"][0]["volume"] == result["volume"]


def test_sides_on_open_and_on_inconsistent_edges_are_listed(client: Client) -> None:
    result = measure(client, surface=build_brick(FACES[:5]))
    assert "volume" not in result
    # The faces 0 to 3 have an edge with the missing face; face 4 is opposite.
    assert [edge["patch"] for edge in result["faulty_edges"]] == [0, 1, 2, 3]
    assert all(edge["open"] for edge in result["faulty_edges"])
    (border,) = result["boundaries"]
    assert is_about(border["length"], 10)
    assert border["first_edge"] == {"patch": 0, "side": "v=1", "uv": [[0, 1], [1, 1]]}
    faces_with_one_reversed = [*FACES[:5], [list(row) for row in zip(*FACES[5], strict=True)]]
    result = measure(client, surface=build_brick(faces_with_one_reversed))
    # Both sides of the four edges of the reversed face count.
    assert (result["open_edges"], result["inconsistent_edges"]) == (0, 8)
    assert not any(edge["open"] for edge in result["faulty_edges"])


@pytest.mark.slow
# Every second example, to save time.
@pytest.mark.parametrize("name", sorted(set(EXAMPLES) - SLOW)[::2])
def test_a_measure_of_an_example_has_a_volume_if_it_is_closed(client: Client, name: str) -> None:
    surface = client.get(f"/v1/surfaces/{name}").json()["surface"]
    response = client.post("/v1/measure", {"surface": surface, "tolerance": 1e-2})
    if response.status_code == 422:
        issue = response.json()["errors"][0]
        assert (issue["code"], issue["pointer"]) == ("not_parametric", "/surface")
        return
    result = response.json()
    assert result["reached"]
    assert result["closed"] == (result["open_edges"] + result["inconsistent_edges"] == 0)
    assert ("volume" in result) == result["closed"]
    if name == "sphere":
        assert is_about(result["volume"], 4 / 3 * pi, 1e-2)


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({}, "missing_field", "/surface"),
        ({"surface": {"control_net": NET}, "tolerance": 0}, "out_of_range", "/tolerance"),
        ({"surface": {"control_net": NET}, "weld_tolerance": 1}, "out_of_range", "/weld_tolerance"),
        ({"surface": {"control_net": NET}, "points": []}, "unknown_field", "/points"),
    ],
)
def test_invalid_requests_are_refused(client: Client, fields: Any, code: str, pointer: str) -> None:
    response = client.post("/v1/measure", fields)
    assert response.status_code == 422, response.text
    issue = response.json()["errors"][0]
    assert (issue["code"], issue["pointer"]) == (code, pointer)


FOLDED = [[[0, 0, 0], [1, 0, 0]], [[1, 0.1, 0], [2, 1.1, 0]]]


@pytest.mark.slow
def test_measures_work_with_the_memory_of_a_small_container() -> None:
    """Half of 512 MiB: the memory of the service in the container of docs/runbook.md."""
    app = create_app(Settings(memory_bytes=256 << 20))
    with start_client(app) as client:
        assert is_about(measure(client, surface={"control_net": NET})["area"], 1)
        for name in ("cone", "utah-teapot"):  # these need several trials
            surface = client.get(f"/v1/surfaces/{name}").json()["surface"]
            assert measure(client, surface=surface)["reached"]
        # This one needs more cells than half of the memory can hold.
        assert not measure(client, surface={"control_net": FOLDED}, tolerance=1e-9)["reached"]
        assert app.state.services.threads.used_bytes == 0


def test_a_trial_gives_its_memory_back_before_the_next_one() -> None:
    """Otherwise requests that wait for more memory would hold what each of them waits for."""
    app = create_app(Settings(memory_bytes=256 << 20))
    threads, amounts = app.state.services.threads, list[tuple[int, int]]()
    acquire = threads.acquire

    async def record_and_acquire(turn: Turn, kind: str) -> None:
        amounts.append((turn.memory, threads.used_bytes))
        await acquire(turn, kind)

    threads.acquire = record_and_acquire
    with start_client(app) as client:
        measure(client, surface=client.get("/v1/surfaces/cone").json()["surface"])
    assert len(amounts) > 1
    assert all(used < 1e6 for _, used in amounts)  # the body alone


def test_a_costly_area_has_a_wider_interval_and_nothing_is_refused() -> None:
    """The normal du × dv is (0, 0, u − v − 0.1). Its length has a kink at u − v = 0.1, so the
    interval of the area becomes narrow only slowly. The border is as exact as without the kink.
    """
    limits, surface = Limits(max_multiplications=50_000_000), BezierSurface(np.array(FOLDED, float))
    result = orjson.loads(plan_measure(surface, MeasureQuery(1e-9), limits).run())
    area, length = result["area"], result["boundary_length"]
    assert not result["reached"]
    assert area["low"] < 1 / 3 + 0.1**2 - 0.1**3 / 3 < area["high"]
    assert 1e-9 * area["value"] < area["high"] - area["low"] < 1e-2 * area["value"]
    assert length["high"] - length["low"] < 1e-9 * length["value"]


def test_with_a_low_limit_intervals_are_wide_and_the_tolerance_is_not_reached() -> None:
    surface = BsplineSurface(np.random.default_rng(1).uniform(0, 1, (40, 40, 3)))
    query = MeasureQuery(1e-12)
    # With a limit that is lower still, the surface itself is too large.
    with pytest.raises(TooLarge) as error:
        plan_measure(surface, query, Limits(max_multiplications=1_000_000))
    assert error.value.issues[0].pointer == "/surface"
    result = orjson.loads(plan_measure(surface, query, Limits(max_multiplications=10**8)).run())
    assert not result["reached"]
    assert result["area"]["low"] < result["area"]["value"] < result["area"]["high"]
