"""The first random breps of the fuzzer cause no findings; each depends on its number alone."""

import numpy as np
import orjson

from service.api.app import create_app
from service.schemas.document import DEFAULT_LIMITS
from service.schemas.request import SurfaceRequest
from service.schemas.validation import parse_request
from tools.client import start_client
from tools.fuzz.breps import SEED, SETTINGS, draw_request, send
from tools.fuzz.mutations import draw_brep


def test_the_first_breps_cause_no_findings() -> None:
    with start_client(create_app(SETTINGS)) as client:
        responses = [send(client, number) for number in range(12)]
    assert [fault for _, fault in responses if fault] == []
    kinds = {kind for kind, _ in responses}
    assert "/v1/mesh" in kinds
    assert any(kind.startswith("422") for kind in kinds)


def test_a_request_depends_on_its_number_alone() -> None:
    first, second = (draw_request(np.random.default_rng([SEED, 7])) for _ in range(2))
    assert orjson.dumps(first) == orjson.dumps(second)


def test_breps_are_valid_before_they_are_changed() -> None:
    for number in range(15):
        document = draw_brep(np.random.default_rng([SEED, 1, number]))
        body = orjson.dumps({"surface": document})
        parse_request(SurfaceRequest, body, DEFAULT_LIMITS).to_surface()
