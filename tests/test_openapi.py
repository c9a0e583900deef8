"""The OpenAPI document: valid, committed as it is, complete, and true."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]
from openapi_spec_validator import OpenAPIV31SpecValidator
from pydantic import SecretStr
from starlette.routing import Route

from service.api.app import create_app
from service.api.guard.keys import entry_line, new_key
from service.api.openapi.codes import CODES
from service.api.openapi.document import document
from service.decoders.registry import DECODERS
from service.encoders.curves.registry import CURVE_FORMATS
from service.encoders.format import COMPACT
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.mesh import render
from service.pipeline.points import PointsWork, plan_points
from service.schemas.convert import OPERATIONS, ConvertRequest
from service.schemas.options import MeshOptionFields
from service.schemas.points import PointsRequest
from service.schemas.request import MeshRequest
from service.schemas.surface_query import FIELDS, document_from_query
from service.schemas.surfaces import KINDS
from service.schemas.validation import validate_document
from service.settings.values import Settings
from service.surface.examples import find
from tests.api.client import Client, client_of
from tests.api.hostile import HOSTILE, QUERIES

COMMITTED = Path(__file__).parents[1] / "openapi" / "openapi.json"
UNDOCUMENTED = {"/", "/page/{file}", "/docs", "/docs/{asset}", "/openapi.json"}
RATES = {"RateLimit", "RateLimit-Policy"}
DOCUMENT: dict[str, Any] = json.loads(json.dumps(document()))


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with client_of(create_app(Settings())) as client:
        yield client


def operations() -> Iterator[tuple[str, dict[str, Any]]]:
    for path, item in DOCUMENT["paths"].items():
        for operation in item.values():
            yield path, operation


def validator(name: str) -> Draft202012Validator:
    """A validator of one component schema, its references resolved within the document."""
    return Draft202012Validator(DOCUMENT | {"$ref": f"#/components/schemas/{name}"})


def errors(name: str, value: Any) -> list[str]:
    return [error.message for error in validator(name).iter_errors(value)]


def test_committed_document_is_that_of_the_code() -> None:
    committed = COMMITTED.read_text(encoding="utf-8")
    assert committed == json.dumps(document(), indent=2, ensure_ascii=False) + "\n", (
        "run `make openapi`"
    )


def test_document_is_valid_and_served(client: Client) -> None:
    OpenAPIV31SpecValidator(DOCUMENT).validate()
    assert client.get("/openapi.json").json() == DOCUMENT


def test_every_reference_leads_somewhere() -> None:
    for found in references(DOCUMENT):
        at: Any = DOCUMENT
        for part in found.removeprefix("#/").split("/"):
            at = at[part.replace("~1", "/").replace("~0", "~")]


def references(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        if isinstance(value.get("$ref"), str):
            yield value["$ref"]
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from references(each)


def test_every_route_is_described_and_nothing_else() -> None:
    settings = Settings(
        allow_delete=True,
        api_keys=(entry_line("all", new_key()),),
        signing_keys=(SecretStr("0123456789abcdef" * 2),),
    )
    app = create_app(settings)
    routes = {
        (route.path, method.lower())
        for route in app.routes
        if isinstance(route, Route) and route.path not in UNDOCUMENTED
        for method in (route.methods or set()) - {"HEAD"}
    }
    described = {(path, method) for path, item in DOCUMENT["paths"].items() for method in item}
    assert described == routes


def test_operations_are_named_once_tagged_and_explained() -> None:
    names = [operation["operationId"] for _, operation in operations()]
    assert len(set(names)) == len(names)
    tags = {tag["name"] for tag in DOCUMENT["tags"]}
    for _, operation in operations():
        assert set(operation["tags"]) <= tags
        assert operation["summary"]
        for parameter in operation.get("parameters", []):
            assert parameter["description"]


def answered(operation: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The answers that are no problems, and written in full."""
    for answer in operation["responses"].values():
        if "$ref" not in answer:
            yield answer


def test_what_the_guard_may_answer_is_told_wherever_it_may() -> None:
    for path, item in DOCUMENT["paths"].items():
        for method, operation in item.items():
            found = operation["responses"].keys() & {"401", "403", "429"}
            if path.startswith("/health") or path == "/metrics":
                watched = path == "/metrics"  # which may need a key
                assert found == ({"401"} if watched else set())
                assert ("security" in operation) is watched
                continue
            closed = method != "get" or path.startswith("/v1/surfaces/")
            signed = method == "get" and closed
            assert found == {"429"} | ({"401"} if closed else set()) | (
                {"403"} if signed else set()
            )
            assert all(answer["headers"].keys() >= RATES for answer in answered(operation))
            assert operation.get("security") == ([{}, {"key": []}] if closed else None)
            names = {parameter["name"] for parameter in operation.get("parameters", [])}
            assert ({"expires", "signature"} <= names) is signed
    assert DOCUMENT["components"]["securitySchemes"]["key"]["scheme"] == "bearer"


def test_every_field_of_a_request_is_described() -> None:
    for name in (
        "SignRequest",
        "CurveRequest",
        "BezierCurveDefinition",
        "BsplineCurveDefinition",
        "MeshRequest",
        "PointsRequest",
        "BezierDefinition",
        "BsplineDefinition",
        "PatchesDefinition",
        "GroupDefinition",
        "MemberDefinition",
    ):
        for field, schema in DOCUMENT["components"]["schemas"][name]["properties"].items():
            assert schema["description"], f"{name}.{field}"


def test_every_media_type_is_listed() -> None:
    for path in ("/v1/mesh", "/v1/surfaces/{id}/mesh.{suffix}"):
        for operation in DOCUMENT["paths"][path].values():
            assert set(operation["responses"]["200"]["content"]) == {f.media_type for f in FORMATS}


def test_every_problem_has_true_examples() -> None:
    for name, response in DOCUMENT["components"]["responses"].items():
        examples = response["content"]["application/problem+json"]["examples"]
        assert examples, name
        for example in examples.values():
            assert errors("Problem", example["value"]) == []


def test_request_examples_are_valid_and_answered(client: Client) -> None:
    body = DOCUMENT["paths"]["/v1/mesh"]["post"]["requestBody"]["content"]["application/json"]
    for example in body["examples"].values():
        assert errors("MeshRequest", example["value"]) == []
        if COMPACT & example["value"].keys():  # JSON has no compact form
            answer = client.post("/v1/mesh?format=glb", example["value"])
            assert answer.status_code == 200
            assert answer.content.startswith(b"glTF")
        else:
            answer = client.post("/v1/mesh", example["value"])
            assert answer.status_code == 200
            assert errors("Mesh", answer.json()) == []


def test_files_are_taken_with_their_examples(client: Client) -> None:
    for path in ("/v1/mesh", "/v1/estimate"):
        operation = DOCUMENT["paths"][path]["post"]
        content = operation["requestBody"]["content"]
        assert set(content) == {"application/json", *(d.media_type for d in DECODERS)}
        for decoder in DECODERS:
            about = content[decoder.media_type]
            assert about["schema"]["description"]
            assert (about["schema"].get("format") == "binary") == decoder.binary
            assert decoder.binary or about["examples"]
            for example in about.get("examples", {}).values():
                body, headers = example["value"].encode(), {"Content-Type": decoder.media_type}
                assert client.request("POST", path, body, headers).status_code == 200


def test_what_stands_beside_a_file_is_listed_with_examples_that_are_taken() -> None:
    parameters = DOCUMENT["paths"]["/v1/mesh"]["post"]["parameters"]
    beside = {parameter["name"]: parameter for parameter in parameters}
    assert beside.keys() == {"format"} | set(FIELDS) | set(MeshOptionFields.model_fields)
    # Pages that try calls fill these in, and beside JSON they are refused.
    assert not any("example" in p or "default" in p["schema"] for p in parameters[1:])
    net = np.zeros((4, 4, 3))
    net[..., 0], net[..., 1] = np.indices((4, 4))
    for name in FIELDS:
        for example in beside[name]["schema"]["examples"]:
            text = ",".join(map(str, example)) if isinstance(example, list) else example
            document = document_from_query({"type": "bspline", name: text}.items())
            document["surface"]["control_net"] = net
            validate_document(MeshRequest, document).to_surface()


def test_request_examples_show_every_kind_of_surface_and_every_option() -> None:
    body = DOCUMENT["paths"]["/v1/mesh"]["post"]["requestBody"]["content"]["application/json"]
    values = [example["value"] for example in body["examples"].values()]
    assert {value["surface"].get("type", KINDS[0]) for value in values} == set(KINDS)
    assert set().union(*values) == set(
        DOCUMENT["components"]["schemas"]["MeshRequest"]["properties"]
    )


def test_examples_of_conversions_are_true(client: Client) -> None:
    operation = DOCUMENT["paths"]["/v1/convert"]["post"]
    requests = operation["requestBody"]["content"]["application/json"]["examples"]
    answers = operation["responses"]["200"]["content"]["application/json"]["examples"]
    used = {op["op"] for example in requests.values() for op in example["value"]["operations"]}
    assert used == set(OPERATIONS)
    for name, example in requests.items():
        assert errors("ConvertRequest", example["value"]) == []
        answer = client.post("/v1/convert", example["value"]).json()
        assert answer == answers[name]["value"]
        assert errors("SurfaceDocument", answer) == []


def test_examples_of_storing_are_true(client: Client) -> None:
    operation = DOCUMENT["paths"]["/v1/surfaces"]["post"]
    requests = operation["requestBody"]["content"]["application/json"]["examples"]
    for status in ("201", "200"):
        response = operation["responses"][status]
        shown = response["content"]["application/json"]["examples"]
        assert set(shown) == set(requests)
        for name, example in requests.items():
            assert errors("SurfaceRequest", example["value"]) == []
            answer = client.post("/v1/surfaces", example["value"])
            assert answer.status_code == int(status)
            assert answer.json() == shown[name]["value"]
            assert errors("StoredSurface", answer.json()) == []
            always = {"Server-Timing", "X-Request-Id"}
            assert set(response["headers"]) - RATES == {"Location", *always}
            assert errors("SurfaceDocument", client.get(answer.headers["location"]).json()) == []


def test_operations_are_described_and_their_examples_taken() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    items = schemas["OperationDefinition"]["oneOf"]
    surface = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}
    for reference in items:
        fields = schemas[reference["$ref"].rpartition("/")[2]]["properties"]
        op = fields["op"]["const"]
        required = {
            name: fields[name]["examples"][0]
            for name in schemas[reference["$ref"].rpartition("/")[2]]["required"]
            if name != "op"
        }
        for name, schema in fields.items():
            assert schema["description"], f"{op}.{name}"
            for example in schema.get("examples", []):
                operation = {"op": op} | required | {name: example}
                request = {"surface": surface, "operations": [operation]}
                validate_document(ConvertRequest, request).to_operations()


def test_examples_of_curves_are_valid_and_answered(client: Client) -> None:
    operation = DOCUMENT["paths"]["/v1/curve"]["post"]
    for example in operation["requestBody"]["content"]["application/json"]["examples"].values():
        assert errors("CurveRequest", example["value"]) == []
        answer = client.post("/v1/curve", example["value"])
        assert answer.status_code == 200
        assert errors("Curve", answer.json()) == []
    content = operation["responses"]["200"]["content"]
    assert set(content) == {f.media_type for f in CURVE_FORMATS}
    example = content["application/json"]["examples"]["quarter"]["value"]
    assert errors("Curve", example) == []
    assert len(example["points"]) == 3


def test_examples_of_queries_are_valid_and_answered(client: Client) -> None:
    operation = DOCUMENT["paths"]["/v1/points"]["post"]
    examples = operation["requestBody"]["content"]["application/json"]["examples"]
    shown = operation["responses"]["200"]["content"]["application/json"]["examples"]
    for name, example in examples.items():
        assert errors("PointsRequest", example["value"]) == []
        answer = client.post("/v1/points", example["value"])
        assert answer.status_code == 200
        assert errors("Points", answer.json()) == []
        if name in shown:
            assert shown[name]["value"] == answer.json()
    assert set(shown) <= set(examples)


def test_a_client_that_writes_out_all_defaults_may_ask_for_a_tolerance(client: Client) -> None:
    properties = DOCUMENT["components"]["schemas"]["MeshRequest"]["properties"]
    defaults = {name: field["default"] for name, field in properties.items() if "default" in field}
    assert {"faces", "two_sided"} <= defaults.keys()
    surface = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
    answer = client.post("/v1/mesh", defaults | {"surface": surface, "tolerance": 0.1})
    assert answer.status_code == 200


def test_examples_of_estimates_are_true(client: Client) -> None:
    operation = DOCUMENT["paths"]["/v1/estimate"]["post"]
    examples = operation["requestBody"]["content"]["application/json"]["examples"]
    shown = operation["responses"]["200"]["content"]["application/json"]["examples"]
    assert set(shown) == set(examples)
    for name, example in examples.items():
        assert errors("MeshRequest", example["value"]) == []
        answer = client.post("/v1/estimate", example["value"]).json()
        assert answer == shown[name]["value"]
        assert errors("Estimate", answer) == []
    assert not shown["huge"]["value"]["accepted"]


def test_poles_without_curvature_are_as_described(client: Client) -> None:
    cone = client.get("/v1/surfaces/cone").json()["surface"]
    query = {"surface": cone, "uv": [[0.5, 1]], "patch": 0, "derivatives": 2}
    answer = client.post("/v1/points", query).json()
    assert answer["mean_curvature"] == [None]
    assert errors("Points", answer) == []


def test_schema_of_queries_is_no_stricter_than_the_code() -> None:
    checked = 0
    for case in QUERIES:
        try:
            value = json.loads(case.build()) if not case.name.startswith("long") else None
        except ValueError:
            continue
        if value is not None and errors("PointsRequest", value):
            checked += 1
            with pytest.raises(InvalidRequest):
                planned(value).run()
    assert checked > 20


def planned(value: Any) -> PointsWork:
    wanted = validate_document(PointsRequest, value)
    return plan_points(wanted.to_surface(), wanted.to_query())


def test_examples_of_meshes_show_both_kinds_of_normals() -> None:
    examples = DOCUMENT["components"]["examples"]
    patch, crease = (examples[name]["value"] for name in ("MeshOfPatch", "MeshWithCrease"))
    assert errors("Mesh", patch) == errors("Mesh", crease) == []
    assert "attribute_faces" not in patch
    assert len(patch["normals"]) == len(patch["vertices"]) == 4
    assert (len(crease["vertices"]), len(crease["normals"])) == (6, 8)
    corners = [len(face) for face in crease["attribute_faces"]]
    assert corners == [len(face) for face in crease["faces"]] == [4, 4]


def test_field_examples_are_taken() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    for name in ("BezierDefinition", "BsplineDefinition", "PatchesDefinition", "GroupDefinition"):
        fields = schemas[name]["properties"].items()
        value = {field: schema["examples"][0] for field, schema in fields if "examples" in schema}
        value["type"] = schemas[name]["properties"]["type"]["const"]
        validate_document(MeshRequest, {"surface": value}).to_surface()
    surface = {
        "control_net": schemas["BezierDefinition"]["properties"]["control_net"]["examples"][0]
    }
    for field, schema in schemas["MeshRequest"]["properties"].items():
        for example in schema.get("examples", []):
            validate_document(MeshRequest, {"surface": surface, field: example})


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("/v1/surfaces", "SurfaceList"),
        ("/v1/surfaces/utah-teapot", "SurfaceDocument"),
        ("/v1/surfaces/sphere", "SurfaceDocument"),
        ("/v1/surfaces/tea-service", "SurfaceDocument"),
        ("/v1/surfaces/tea-service/mesh.json?resolution=1&overlays=boundary", "Mesh"),
        ("/v1/surfaces/utah-teapot", "MeshRequest"),
        ("/v1/surfaces/utah-teapot/mesh.json?resolution=2&uvs=true&overlays=boundary", "Mesh"),
        ("/v1/surfaces/sphere/mesh.json?resolution=2&faces=quads&normals=false", "Mesh"),
        ("/v1/formats", "FormatList"),
        ("/health", "Health"),
        ("/health/live", "Health"),
        ("/health/ready", "Health"),
        ("/v1/surfaces/none", "Problem"),
    ],
)
def test_answers_are_as_described(client: Client, address: str, name: str) -> None:
    answer = client.get(address).json()
    assert errors(name, answer) == []
    assert set(answer) <= set(DOCUMENT["components"]["schemas"][name]["properties"])


def test_schema_of_requests_is_no_stricter_than_the_code() -> None:
    """What the schema refuses, the code refuses: a client may trust it and check beforehand."""
    checked = 0
    for case in HOSTILE:
        try:
            value = json.loads(case.build()) if not case.name.startswith("long") else None
        except (ValueError, RecursionError):
            continue
        if value is not None and errors("MeshRequest", value):
            checked += 1
            with pytest.raises(InvalidRequest):
                validate_document(MeshRequest, value).to_surface()
    assert checked > 100


def described(name: str, schema: Any) -> Iterator[tuple[str, Any]]:
    """A schema and all properties within, with where they are."""
    yield name, schema
    for field, inner in schema.get("properties", {}).items():
        yield from described(f"{name}.{field}", inner)
    if isinstance(schema.get("items"), dict):
        yield from (pair for pair in described(name, schema["items"]) if pair[0] != name)


def test_every_schema_and_every_property_is_described() -> None:
    for name, schema in DOCUMENT["components"]["schemas"].items():
        for where, found in described(name, schema):
            assert found.get("description") or "$ref" in found, where


def test_files_are_texts_or_bytes_as_they_are_said_to_be() -> None:
    path = DOCUMENT["paths"]["/v1/mesh"]["post"]["responses"]["200"]["content"]
    for fmt in FORMATS:
        content = render(find("saddle").surface(), MeshOptions((1, 1)), fmt)
        try:
            content.decode()
            binary = False
        except UnicodeDecodeError:
            binary = True
        assert (path[fmt.media_type]["schema"].get("format") == "binary") == binary


def raised() -> set[str]:
    """Every code that the service gives an issue: the strings that `Issue` is made with."""
    found: set[str] = set()
    for file in (COMMITTED.parents[1] / "service").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in {"Issue", "_refusal"}:
                code = node.args[0] if node.args else None
            elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "code":
                code = node.value
            else:
                continue
            choices = [code.body, code.orelse] if isinstance(code, ast.IfExp) else [code]
            found |= {str(c.value) for c in choices if isinstance(c, ast.Constant)}
    return found


def test_every_code_is_explained_and_nothing_else() -> None:
    assert raised() == set(CODES)
    for code in CODES:
        assert f"- `{code}`: " in DOCUMENT["info"]["description"]
