"""Responses to hostile bodies name the location of the error.

Except for keys and parameters in that location, they repeat no text of the body.
"""

import pytest
from orjson import dumps
from pydantic import SecretStr

from service.api.app import create_app
from service.api.guard.keys import format_entry
from service.errors import MAX_ISSUES
from service.settings.values import Settings
from tools.client import Client, start_client
from tools.hostile.calls import CALLS
from tools.hostile.files import FILES
from tools.hostile.requests import HOSTILE, MIB, NOT_TO_REPEAT

JSON = {"Content-Type": "application/json"}


def test_there_are_at_least_two_hundred_cases_and_their_names_differ() -> None:
    assert len(HOSTILE) >= 200
    for cases in CALLS.values():
        assert len({case.name for case in cases}) == len(cases)


@pytest.mark.parametrize("path", CALLS)
def test_hostile_bodies_are_refused(client: Client, path: str) -> None:
    for case in CALLS[path]:
        response = client.request("POST", path, case.chunks(), JSON)
        assert response.status_code == case.status, case.name
        assert response.headers["content-type"] == "application/problem+json"
        problem = response.json()
        assert (problem["status"], problem["type"]) == (case.status, "about:blank")
        errors = problem["errors"]
        assert (errors[0]["code"], errors[0]["pointer"]) == (case.code, case.pointer), case.name
        assert len(errors) <= MAX_ISSUES
        for error in errors:
            assert {"code", "pointer", "detail", "got", "needed"} == set(error), case.name
        assert NOT_TO_REPEAT not in str([error | {"pointer": ""} for error in errors]), case.name
        assert len(response.content) < 20_000, case.name


@pytest.mark.parametrize("call", ["estimate", "points", "convert", "surfaces"])
def test_other_calls_refuse_invalid_surfaces_with_the_errors_of_meshes(
    client: Client, call: str
) -> None:
    fields = {
        "points": ',"uv":[[0,0]],"patch":0',
        "convert": ',"operations":[{"op":"transpose"}]',
    }.get(call, "")
    tested_cases = 0
    for case in HOSTILE[::9]:  # every ninth, to save time
        body = case.build() if not case.name.startswith("long") else b""
        # `fields` are inserted before the last bracket, so the body must be a complete document.
        if case.pointer.startswith("/surface/") and body.endswith(b"}}") and case.status == 422:
            content = body[:-1] + fields.encode() + b"}"
            errors = client.request("POST", f"/v1/{call}", content, JSON).json()["errors"]
            assert (case.code, case.pointer) in [
                (error["code"], error["pointer"]) for error in errors
            ]
            tested_cases += 1
    assert tested_cases > 10


@pytest.mark.slow
def test_every_call_refuses_invalid_fields() -> None:
    """Calls and fields come from the OpenAPI document, so this also tests new calls and fields."""
    key = "sfk_" + "a1" * 32
    settings = Settings(
        max_json_depth=16, api_keys=(format_entry("k", key),), signing_keys=(SecretStr("s" * 32),)
    )
    headers = JSON | {"Authorization": f"Bearer {key}"}
    app = create_app(settings)
    operations = {path: item.get("post", {}) for path, item in app.openapi()["paths"].items()}
    posts = {
        path: operation
        for path, operation in operations.items()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    }
    assert posts.keys() >= CALLS.keys()
    with start_client(app) as client:

        def read_first_error(path: str, body: bytes) -> tuple[str, str]:
            """The code and the pointer of the first error in the response."""
            response = client.request("POST", path, [body], headers)
            assert response.status_code == 422, (path, body, response.text)
            error = response.json()["errors"][0]
            return error["code"], error["pointer"]

        for path, operation in posts.items():
            for levels, is_refused in ((15, False), (16, True)):
                body = b'{"x":' + b"[" * levels + b"]" * levels + b"}"
                assert (read_first_error(path, body)[0] == "too_deep") == is_refused
            examples = operation["requestBody"]["content"]["application/json"]["examples"]
            for example in examples.values():
                value = example["value"]
                with_unknown_field = dumps(value | {NOT_TO_REPEAT: 1})
                error = read_first_error(path, with_unknown_field)
                assert error == ("unknown_field", f"/{NOT_TO_REPEAT}")
                for field in value:
                    error = read_first_error(path, dumps(value | {field: None}))
                    assert error == ("null_value", f"/{field}"), path


def test_cases_of_files_have_different_names() -> None:
    assert len({case.name for case in FILES}) == len(FILES)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/v1/mesh", "/v1/estimate", "/v1/surfaces"])
def test_hostile_files_are_refused(client: Client, path: str) -> None:
    for case in FILES:
        # Many queries have options of a mesh, for which this call has another error.
        if path == "/v1/surfaces" and "=" in case.query:
            continue
        headers, body = {"Content-Type": case.media_type}, case.build()
        # All calls read files with the same code, so only one is tested with long files.
        if path != "/v1/mesh" and len(body) >= MIB:
            continue
        response = client.request("POST", f"{path}?{case.query}", body, headers)
        if path == "/v1/estimate" and response.status_code == 200:
            # Estimates report a mesh that is too large, or a format that cannot store it.
            assert case.code in ("too_many_vertices", "unsupported_by_format"), case.name
            continue
        assert response.status_code == case.status, case.name
        errors = response.json()["errors"]
        assert len(errors) <= MAX_ISSUES
        location = errors[0].get(case.location_key)
        assert (errors[0]["code"], location) == (case.code, case.location), case.name
        assert NOT_TO_REPEAT not in str(
            [error | {"pointer": "", "parameter": ""} for error in errors]
        )


def test_at_most_max_issues_errors_are_reported(client: Client) -> None:
    document = {"surface": {"control_net": [[["x"] * 3] * 20] * 20}}
    errors = client.post("/v1/mesh", document).json()["errors"]
    assert [error["pointer"] for error in errors] == [
        f"/surface/control_net/0/{point}/{axis}" for point in range(7) for axis in range(3)
    ][:MAX_ISSUES]


def test_the_errors_of_several_fields_are_reported_at_once(client: Client) -> None:
    document = {"surface": {"control_net": [[1]], "up": "x"}, "uvs": 1, "size": 2}
    errors = client.post("/v1/mesh", document).json()["errors"]
    assert {error["pointer"]: error["code"] for error in errors} == {
        "/uvs": "wrong_type",
        "/surface/control_net/0/0": "wrong_type",
        "/surface/up": "wrong_value",
        "/size": "unknown_field",
    }
