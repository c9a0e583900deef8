"""The OpenAPI document is valid and complete, and agrees with the code and with the responses.

The file that is committed is the document that the code writes.
"""

import ast
import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest
from fastapi.routing import APIRoute, iter_route_contexts
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]
from openapi_spec_validator import OpenAPIV31SpecValidator

from service.api import problems
from service.api.app import create_app
from service.api.guard.keys import SCOPES, format_entry, make_key
from service.api.models.meshes import ResponseModel
from service.api.openapi.document import build_full_settings
from service.decoders.registry import BY_NAME as DECODERS_BY_NAME
from service.decoders.registry import DECODERS
from service.encoders.format import FileFormat
from service.encoders.polylines.registry import CURVE_FORMATS, SECTION_FORMATS
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import InvalidRequest
from service.pipeline.calls import CALLS
from service.pipeline.files import check_beside
from service.pipeline.mesh import render
from service.pipeline.queries import plan_points
from service.schemas.convert import OPERATIONS, ConvertRequest
from service.schemas.fields import RequestModel
from service.schemas.file_fields import FIELDS, document_from_query
from service.schemas.kinds import KINDS
from service.schemas.options import MeshOptionFields
from service.schemas.queries import PointsRequest
from service.schemas.query import LIST_NAMES
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from service.surface.kinds import Surface
from tests.api.fake_jobs import FakeJobs
from tools.client import Client, start_client
from tools.hostile.calls import QUERIES
from tools.hostile.requests import HOSTILE, HostileBody

SERVICE = Path(__file__).parents[1] / "service"
COMMITTED_FILE = SERVICE.parent / "openapi" / "openapi.json"
UNDOCUMENTED_PATHS = {"/", "/embed", "/page/{file}", "/docs", "/docs/{asset}", "/openapi.json"}
UNDOCUMENTED_PATHS |= {"/favicon.ico", "/robots.txt"}
RATE_HEADERS = {"RateLimit", "RateLimit-Policy"}


@cache
def build_document(settings: Settings) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json.dumps(create_app(settings).openapi()))
    return document


DOCUMENT: dict[str, Any] = json.loads(COMMITTED_FILE.read_text(encoding="utf-8"))
"""The committed document; the first test below checks that the code writes the same document."""
SCHEMAS = DOCUMENT["components"]["schemas"]
SETTINGS = {
    "everything": build_full_settings(),
    "defaults": Settings(memory_bytes=1 << 44),  # not the memory of this machine
    "no metrics": Settings(metrics="off", rate_limit=60),
}
"""Settings by name. The document depends on the settings, so each of these has its own document."""
COMPUTING_PATHS = [
    path
    for path, item in DOCUMENT["paths"].items()
    if "post" in item and path not in ("/v1/surfaces", "/v1/sign", "/v1/jobs", "/v1/files")
]
"""Paths to which clients POST a body and get a computed response, and which store nothing."""


@pytest.fixture(scope="module")
def jobs() -> FakeJobs:
    """The jobs of the service of `client`."""
    return FakeJobs()


@pytest.fixture(scope="module")
def client(jobs: FakeJobs) -> Iterator[Client]:
    """A client of a service whose estimates do not depend on the memory of this machine."""
    app = create_app(SETTINGS["defaults"])
    app.state.services = replace(app.state.services, jobs=jobs)
    with start_client(app) as client:
        yield client


def list_operations(
    document: dict[str, Any] = DOCUMENT,
) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Path, method and description of each operation."""
    for path, item in document["paths"].items():
        for method, operation in item.items():
            yield path, method, operation


def list_errors(name: str, value: Any) -> list[str]:
    """Messages that say where the value violates the component schema `name`."""
    return [error.message for error in build_validator(name).iter_errors(value)]


LONG_BODY = 1 << 15
"""Bytes. For longer bodies, jsonschema would take seconds to compare them with a schema."""


def shorten(value: Any) -> Any:
    """The value with at most 30 elements of each list, to save time: all have the same schema."""
    if isinstance(value, dict):
        return {name: shorten(each) for name, each in value.items()}
    return [shorten(each) for each in value[:30]] if isinstance(value, list) else value


@cache
def build_validator(name: str) -> Draft202012Validator:
    """A validator of the component schema `name`, which finds other components of the document."""
    return Draft202012Validator(DOCUMENT | {"$ref": f"#/components/schemas/{name}"})


def test_the_code_writes_the_committed_document() -> None:
    text = json.dumps(build_document(SETTINGS["everything"]), indent=2, ensure_ascii=False) + "\n"
    assert COMMITTED_FILE.read_text(encoding="utf-8") == text, "run `make openapi`"


def test_a_service_serves_its_document(client: Client) -> None:
    assert client.get("/openapi.json").json() == build_document(SETTINGS["defaults"])


@pytest.mark.parametrize("name", SETTINGS)
def test_document_is_valid(name: str) -> None:
    document = DOCUMENT if name == "everything" else build_document(SETTINGS[name])
    # The other documents have only parts of this one, so it is enough to validate this one.
    if name == "everything":
        OpenAPIV31SpecValidator(document).validate()
        for schema in document["components"]["schemas"].values():
            Draft202012Validator.check_schema(schema)
    for reference in list_references(document):
        # If what it refers to is missing, this raises KeyError.
        value: Any = document
        for key in reference.removeprefix("#/").split("/"):
            value = value[key.replace("~1", "/").replace("~0", "~")]
    ids = {operation["operationId"] for _, _, operation in list_operations(document)}
    assert len(ids) == len(list(list_operations(document)))
    for _, _, operation in list_operations(document):
        for status, response in operation["responses"].items():
            if "$ref" in response:
                error = document["components"]["responses"][response["$ref"].rpartition("/")[2]]
                for example in error["content"]["application/problem+json"]["examples"].values():
                    assert str(example["value"]["status"]) == status
            for link in response.get("links", {}).values():
                assert link["operationId"] in ids


def list_references(value: Any) -> Iterator[str]:
    """The values of all `$ref` in a JSON value."""
    if isinstance(value, dict):
        if isinstance(value.get("$ref"), str):
            yield value["$ref"]
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from list_references(each)


@pytest.mark.parametrize("name", SETTINGS)
def test_document_has_the_methods_that_the_service_allows(name: str) -> None:
    key = make_key()
    settings, headers = SETTINGS[name], {}
    if settings.api_keys:
        entry = format_entry("all", key, frozenset(SCOPES))
        settings = settings.model_copy(update={"api_keys": (entry,)})
        headers = {"Authorization": f"Bearer {key}"}
    app = create_app(settings)
    paths = build_document(SETTINGS[name])["paths"]
    assert ("delete" in paths["/v1/surfaces/{id}"]) == settings.allow_delete
    assert ("/metrics" in paths) == (settings.metrics != "off")
    assert ("/v1/sign" in paths) == bool(settings.signing_keys)
    with start_client(app) as client:
        for path, item in paths.items():
            url = path.replace("{id}", "0" * 64).replace("{suffix}", "glb").replace("{part}", "0")
            response = client.request("PATCH", url, b"", headers)
            assert response.status_code == 405, path
            allowed_methods = set(response.headers["allow"].lower().split(", "))
            assert allowed_methods - {"head"} == item.keys()
        assert client.request("GET", "/metrics", b"", headers).status_code == (
            404 if settings.metrics == "off" else 200
        )


def test_every_model_has_a_route() -> None:
    """The document names each model of a request or a response, so a route uses it."""
    names = {reference.rpartition("/")[2] for reference in list_references(DOCUMENT)}
    routes = sorted(file.name for file in (SERVICE / "api" / "routes").glob("[a-z]*.py"))
    for folder, base in (("schemas", RequestModel), ("api.models", ResponseModel)):
        for file in (SERVICE / folder.replace(".", "/")).glob("[a-z]*.py"):
            for name, model in vars(import_module(f"service.{folder}.{file.stem}")).items():
                if isinstance(model, type) and issubclass(model, base) and model is not base:
                    assert name in names, f"{name} has no route in service/api/routes/: {routes}"


def test_every_route_is_described() -> None:
    routes = iter_route_contexts(create_app(build_full_settings()).routes)
    paths = {context.path for context in routes if isinstance(context.original_route, APIRoute)}
    assert paths - UNDOCUMENTED_PATHS == DOCUMENT["paths"].keys()


def test_operations_are_tagged_and_explained() -> None:
    tags = {tag["name"] for tag in DOCUMENT["tags"]}
    for _, _, operation in list_operations():
        assert set(operation["tags"]) <= tags
        assert operation["summary"]
        assert operation["description"]
        for parameter in operation.get("parameters", []):
            assert parameter["description"]


def test_every_operation_names_the_responses_of_the_guard() -> None:
    for path, method, operation in list_operations():
        statuses = operation["responses"].keys() & {"401", "403", "429"}
        if path.startswith("/health"):
            assert not statuses
            assert "security" not in operation
            continue
        needs_key = method != "get" or path.startswith(
            ("/v1/surfaces/", "/v1/stored", "/v1/jobs", "/metrics")
        )
        is_signable = method == "get" and path.startswith("/v1/surfaces/")
        expected = {"429"}
        if needs_key:
            expected |= {"401", "403"}
        assert statuses == expected
        if needs_key:
            name = operation["responses"]["403"]["$ref"].rpartition("/")[2]
            assert name == ("Forbidden" if is_signable else "ScopeNeeded")
        for response in operation["responses"].values():
            assert "$ref" in response or response["headers"].keys() >= RATE_HEADERS
        security: list[dict[str, list[str]]] = [{"key": []}]
        if is_signable:
            # The empty object means that the key is optional.
            security.append({})
        assert operation.get("security") == (security if needs_key else None)
        names = {parameter["name"] for parameter in operation.get("parameters", [])}
        assert ({"expires", "signature"} <= names) is is_signable
    assert DOCUMENT["components"]["securitySchemes"]["key"]["scheme"] == "bearer"


def test_the_document_of_a_service_without_keys_requires_no_keys() -> None:
    document = build_document(SETTINGS["defaults"])
    components = document["components"]
    assert "securitySchemes" not in components
    assert not RATE_HEADERS & components["headers"].keys()
    assert not {"KeyNeeded", "SignatureInvalid", "TooManyRequests"} & components["responses"].keys()
    assert components["responses"]["Busy"]["headers"].keys() == {"Retry-After", "X-Request-Id"}
    for _, _, operation in list_operations(document):
        assert "security" not in operation


@pytest.mark.parametrize(
    ("path", "formats"),
    [
        ("/v1/mesh", FORMATS),
        ("/v1/surfaces/{id}/mesh.{suffix}", FORMATS),
        ("/v1/curve", CURVE_FORMATS),
        ("/v1/intersect", SECTION_FORMATS),
    ],
)
def test_every_media_type_is_listed(path: str, formats: Sequence[FileFormat]) -> None:
    for operation in DOCUMENT["paths"][path].values():
        content = operation["responses"]["200"]["content"]
        assert set(content) == {fmt.media_type for fmt in formats}


def test_every_problem_has_valid_examples() -> None:
    for name, response in DOCUMENT["components"]["responses"].items():
        examples = response["content"]["application/problem+json"]["examples"]
        assert examples, name
        for example in examples.values():
            assert list_errors("Problem", example["value"]) == []


def list_examples(path: str, status: str = "") -> dict[str, Any]:
    """JSON examples by name: of the response with this status; of the request if it is empty."""
    operation = DOCUMENT["paths"][path]["post"]
    body = operation["responses"][status] if status else operation["requestBody"]
    examples: dict[str, Any] = body["content"]["application/json"]["examples"]
    return {name: example["value"] for name, example in examples.items()}


def find_schema(body: dict[str, Any]) -> str:
    """The name of the component that is the schema of the JSON body of a request or response."""
    reference: str = body["content"]["application/json"]["schema"]["$ref"]
    return reference.rpartition("/")[2]


@pytest.mark.parametrize("path", COMPUTING_PATHS)
def test_examples_are_valid_and_give_the_responses_shown(client: Client, path: str) -> None:
    operation = DOCUMENT["paths"][path]["post"]
    request_schema = find_schema(operation["requestBody"])
    requests = list_examples(path)
    if path == "/v1/image":
        for request in requests.values():
            assert list_errors(request_schema, request) == []
            assert client.post(path, request).headers["content-type"] == "image/png"
        return
    response_schema = find_schema(operation["responses"]["200"])
    response_examples = list_examples(path, "200")
    assert response_examples, (
        f"call `show_responses` beside the route of {path} in service/api/routes/"
    )
    # Swagger UI would add the example or default of a parameter to every example of a body.
    for parameter in operation.get("parameters", []):
        assert "example" not in parameter
        assert "default" not in parameter["schema"]
    for name, request in requests.items():
        assert list_errors(request_schema, request) == []
        response = client.post(path, request)
        assert response.status_code == 200
        assert list_errors(response_schema, shorten(response.json())) == []
        if path != "/v1/mesh" and name in response_examples:
            assert response.json() == response_examples[name]
    assert path == "/v1/mesh" or response_examples.keys() <= requests.keys()


def test_examples_of_storing_are_valid_and_give_the_responses_shown(client: Client) -> None:
    requests = list_examples("/v1/surfaces")
    # The first request stores the surface (201); for the second the service has it already (200).
    for status in ("201", "200"):
        response_examples = list_examples("/v1/surfaces", status)
        description = DOCUMENT["paths"]["/v1/surfaces"]["post"]["responses"][status]
        assert set(description["headers"]) - RATE_HEADERS == {
            "Location",
            "Server-Timing",
            "Surface-Reading",
            "X-Request-Id",
        }
        assert response_examples.keys() == requests.keys()
        for name, request in requests.items():
            assert list_errors("SurfaceRequest", request) == []
            response = client.post("/v1/surfaces", request)
            assert response.status_code == int(status)
            assert response.json() == response_examples[name]
            assert list_errors("StoredSurface", response.json()) == []
            assert (
                list_errors("SurfaceDocument", client.get(response.headers["location"]).json())
                == []
            )


def test_files_are_documented_and_their_examples_accepted(client: Client) -> None:
    for path in ("/v1/mesh", "/v1/estimate", "/v1/surfaces", "/v1/measure", "/v1/convert"):
        operation = DOCUMENT["paths"][path]["post"]
        content = operation["requestBody"]["content"]
        assert set(content) == {"application/json", *(each.media_type for each in DECODERS)}
        for decoder in DECODERS:
            description = content[decoder.media_type]
            assert description["schema"]["description"]
            assert (description["schema"].get("format") == "binary") == decoder.is_binary
            assert decoder.is_binary or description["examples"]
            for example in description.get("examples", {}).values():
                body, headers = example["value"].encode(), {"Content-Type": decoder.media_type}
                assert client.request("POST", path, body, headers).status_code in (200, 201)


def test_examples_of_jobs_are_valid_and_accepted(client: Client, jobs: FakeJobs) -> None:
    content = DOCUMENT["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]
    for name, request in list_examples("/v1/jobs").items():
        assert list_errors("JobRequest", request) == []
        response = client.post("/v1/jobs", request)
        assert response.status_code == 202, name
        assert list_errors("Job", response.json()) == []
    lines = content["application/x-ndjson"]["examples"]["meshes"]["value"].encode()
    response = client.request("POST", "/v1/jobs", lines, {"Content-Type": "application/x-ndjson"})
    assert response.status_code == 202
    assert len(jobs.states) == 2  # the lines are the parts of the first example
    for path, name in (
        ("/v1/jobs", "JobList"),
        ("/v1/jobs/{id}", "Job"),
        ("/v1/jobs/{id}/results", "JobResults"),
    ):
        body = DOCUMENT["paths"][path]["get"]["responses"]["200"]
        for example in body["content"]["application/json"]["examples"].values():
            assert list_errors(name, example["value"]) == []
    assert (
        list_errors("JobResults", client.get(f"{response.json()['links']['results']}").json()) == []
    )


def test_every_call_that_jobs_can_make_has_the_preference_for_a_job() -> None:
    for path, item in DOCUMENT["paths"].items():
        operation = item.get("post", {})
        names = {parameter["name"] for parameter in operation.get("parameters", [])}
        assert ("Prefer" in names) == (path in CALLS)
        # `Prefer` describes its response: as a response, it would change the type of every result.
        assert ("202" in operation.get("responses", {})) == (path == "/v1/jobs")


def test_get_requests_with_all_examples_and_defaults_succeed(
    client: Client, jobs: FakeJobs
) -> None:
    """Swagger UI prefills requests with the examples and defaults of all parameters."""
    # The example of the id of a job is that of the first example of a job.
    job = client.post("/v1/jobs", list_examples("/v1/jobs")["meshes"]).json()
    for part in range(job["parts"]["total"]):
        jobs.end_part(job["id"], part, b"a file")
    # The example of the id of a stored surface is the id of the saddle.
    assert client.post("/v1/surfaces", client.get("/v1/surfaces/saddle").json()).is_success
    for path, item in DOCUMENT["paths"].items():
        query: dict[str, Any] = {}
        url, headers = path, {}
        for parameter in item.get("get", {}).get("parameters", []):
            name, examples = parameter["name"], list(parameter.get("examples", {}).values())
            value = parameter.get("example", parameter["schema"].get("default"))
            if parameter["in"] == "path":
                url = url.replace(f"{{{name}}}", str(examples[0]["value"]))
            elif value is not None and parameter["in"] == "query":
                query[name] = value
            elif value is not None:
                headers[name] = value
        if "get" in item and path != "/v1/stored":  # a service without keys does not have it
            # In lower case, because True must be `true`.
            response = client.get(f"{url}?{urlencode(query, doseq=True).lower()}", headers)
            assert response.status_code == 200, (path, query, response.text)


def test_lists_in_queries_are_described_as_repeated_parameters(client: Client) -> None:
    """Generated clients repeat a parameter for each item, so the service must accept it."""
    for _, _, operation in list_operations():
        for parameter in operation.get("parameters", []):
            schemas = [parameter["schema"], *parameter["schema"].get("oneOf", [])]
            is_list = any(schema.get("type") == "array" for schema in schemas)
            assert (parameter.get("style"), parameter.get("explode")) == (
                ("form", True) if is_list else (None, None)
            )
            assert not is_list or parameter["name"] in LIST_NAMES
    url = "/v1/surfaces/saddle/mesh.json"
    repeated = "resolution=2&resolution=3&overlays=control_net&isocurves=0&overlays=boundary"
    mesh = client.get(f"{url}?{repeated}")
    assert mesh.status_code == 200
    assert (
        mesh.content
        == client.get(f"{url}?resolution=2,3&overlays=control_net,boundary&isocurves=0,0").content
    )


def list_nodes(value: Any) -> Iterator[dict[str, Any]]:
    """All objects in a JSON value."""
    if isinstance(value, dict):
        yield value
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from list_nodes(each)


def test_generators_find_what_they_read() -> None:
    """`make test-generators` uses clients that generators make from this document."""
    for node in list_nodes(DOCUMENT["components"]["schemas"] | DOCUMENT["paths"]):
        # Beside `items`, some generators take `prefixItems` for further elements.
        assert "prefixItems" not in node
        assert node.get("type") != "array" or "items" in node
    assert DOCUMENT["servers"][0]["url"] == "/"
    assert DOCUMENT["security"] == []
    assert DOCUMENT["info"]["license"]["identifier"] == "Apache-2.0"
    point = SCHEMAS["Mesh"]["properties"]["vertices"]["items"]
    number = {"type": "number"}
    assert point == {"type": "array", "items": number, "minItems": 3, "maxItems": 3}


def test_query_parameters_beside_a_file_have_valid_examples() -> None:
    parameter_list = DOCUMENT["paths"]["/v1/mesh"]["post"]["parameters"]
    parameters = {p["name"]: p for p in parameter_list if p["in"] == "query"}
    assert parameters.keys() == {"format"} | set(FIELDS) | set(MeshOptionFields.model_fields)
    net = np.zeros((4, 4, 3))
    net[..., 0], net[..., 1] = np.indices((4, 4))
    for name in FIELDS:
        for example in parameters[name]["schema"]["examples"]:
            text = ",".join(map(str, example)) if isinstance(example, list) else str(example)
            text = text.lower() if isinstance(example, bool) else text
            step, npy = DECODERS_BY_NAME["step"], DECODERS_BY_NAME["npy"]
            if name in step.fields:
                document = document_from_query([(name, text)], step.fields)
                check_beside(MeshRequest, step, document)
            if name in npy.fields:
                query = {"type": "bspline", name: text}
                document = document_from_query(query.items(), npy.fields)
                document["surface"]["control_net"] = net
                if name == "homogeneous":
                    document["surface"]["control_net"] = np.insert(net, 3, 1, axis=2)
                validate_document(MeshRequest, document).to_surface()


def test_request_examples_show_every_kind_of_surface_every_option_and_every_operation() -> None:
    meshes, conversions = (list_examples(path).values() for path in ("/v1/mesh", "/v1/convert"))
    # Without `type` the kind is the first of `KINDS`.
    kinds = {mesh["surface"].get("type", KINDS[0]) for mesh in meshes}
    assert kinds == set(KINDS), "show the kind in service/api/openapi/requests.json"
    options = SCHEMAS["MeshRequest"]["properties"]
    options_with_examples = {name for name, schema in options.items() if "examples" in schema}
    assert set().union(*meshes) | options_with_examples == set(options)
    assert {op["op"] for each in conversions for op in each["operations"]} == set(OPERATIONS)


def test_operations_are_described_and_their_examples_accepted() -> None:
    surface = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}
    for reference in SCHEMAS["OperationDefinition"]["oneOf"]:
        schema = SCHEMAS[reference["$ref"].rpartition("/")[2]]
        fields = schema["properties"]
        op = fields["op"]["const"]
        required_fields = {
            name: fields[name]["examples"][0] for name in schema["required"] if name != "op"
        }
        for name, field in fields.items():
            assert field["description"], f"{op}.{name}"
            for example in field.get("examples", []):
                operation = {"op": op} | required_fields | {name: example}
                request = {"surface": surface, "operations": [operation]}
                try:
                    validate_document(ConvertRequest, request).to_operations()
                except InvalidRequest:
                    # The field may need another one, such as the first of the operation.
                    first = next(each for each in fields if each not in (name, "op"))
                    operation[first] = fields[first]["examples"][0]
                    validate_document(ConvertRequest, request).to_operations()


def test_a_request_with_all_defaults_written_out_may_have_a_tolerance(client: Client) -> None:
    """The defaults of resolution do not conflict with a tolerance."""
    properties = SCHEMAS["MeshRequest"]["properties"]
    defaults = {name: field["default"] for name, field in properties.items() if "default" in field}
    assert {"faces", "two_sided"} <= defaults.keys()
    surface = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
    response = client.post("/v1/mesh", defaults | {"surface": surface, "tolerance": 0.1})
    assert response.status_code == 200


def test_null_curvatures_at_a_pole_agree_with_the_schema(client: Client) -> None:
    cone = client.get("/v1/surfaces/cone").json()["surface"]
    query = {"surface": cone, "uv": [[0.5, 1]], "patch": 0, "derivatives": 2}
    response = client.post("/v1/points", query).json()
    assert response["mean_curvature"] == [None]
    assert list_errors("Points", response) == []


def test_examples_of_meshes_show_both_kinds_of_normals() -> None:
    patch, crease = list_examples("/v1/mesh", "200").values()
    assert list_errors("Mesh", patch) == list_errors("Mesh", crease) == []
    assert "attribute_faces" not in patch
    assert len(patch["normals"]) == len(patch["vertices"]) == 4
    # Two quads meet at a crease: its two vertices have two normals each.
    assert (len(crease["vertices"]), len(crease["normals"])) == (6, 8)
    corners = [len(face) for face in crease["attribute_faces"]]
    assert corners == [len(face) for face in crease["faces"]] == [4, 4]


def test_field_examples_are_accepted() -> None:
    for name in ("BezierDefinition", "BsplineDefinition", "PatchesDefinition", "GroupDefinition"):
        fields = SCHEMAS[name]["properties"].items()
        value = {field: schema["examples"][0] for field, schema in fields if "examples" in schema}
        value["type"] = SCHEMAS[name]["properties"]["type"]["const"]
        value.pop("homogeneous", None)  # the points of the example have weights beside them
        validate_document(MeshRequest, {"surface": value}).to_surface()
    surface = {
        "control_net": SCHEMAS["BezierDefinition"]["properties"]["control_net"]["examples"][0]
    }
    for field, schema in SCHEMAS["MeshRequest"]["properties"].items():
        for example in schema.get("examples", []):
            validate_document(MeshRequest, {"surface": surface, field: example})


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("/v1/surfaces", "SurfaceList"),
        ("/v1/surfaces/utah-teapot", "SurfaceDocument"),
        ("/v1/surfaces/sphere", "SurfaceDocument"),
        ("/v1/surfaces/tea-service", "SurfaceDocument"),
        ("/v1/surfaces/tea-service/mesh.json?resolution=1&overlays=boundary", "Mesh"),
        # The document of a surface is also a request for its mesh.
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
def test_responses_agree_with_their_schemas(client: Client, url: str, name: str) -> None:
    response = client.get(url).json()
    assert list_errors(name, response) == []
    assert set(response) <= set(SCHEMAS[name]["properties"])


def compute_points(value: Any) -> bytes:
    request = validate_document(PointsRequest, value)
    return plan_points(request.to_surface(), request.to_query()).run()


def parse_surface(value: Any) -> Surface:
    return validate_document(MeshRequest, value).to_surface()


@pytest.mark.parametrize(
    ("name", "cases", "parse", "min_refused"),
    [
        ("MeshRequest", HOSTILE[::4], parse_surface, 50),  # every fourth, to save time
        ("PointsRequest", QUERIES, compute_points, 20),
    ],
)
def test_schemas_of_requests_are_no_stricter_than_the_code(
    name: str, cases: tuple[HostileBody, ...], parse: Callable[[Any], object], min_refused: int
) -> None:
    """The code refuses every body that the schema refuses, so clients may check by the schema.

    The schema must refuse more than `min_refused` bodies, or the test would show nothing.
    """
    refused_bodies = 0
    for case in cases:
        body = case.build()
        try:
            value = json.loads(body) if len(body) < LONG_BODY else None
        except (ValueError, RecursionError):
            continue
        if value is not None and list_errors(name, value):
            refused_bodies += 1
            with pytest.raises(InvalidRequest):
                parse(value)
    assert refused_bodies > min_refused


def test_schemas_accept_the_shortest_knot_vectors() -> None:
    """Two points of degree 1, with knots of which the first and the last are left out."""
    knots = [0, 1]
    net = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]
    surface = {"type": "bspline", "control_net": net, "degree": 1, "knots": [knots, knots]}
    curve = {"type": "bspline", "control_points": net[0], "degree": 1, "knots": knots}
    for body in ({"surface": surface}, {"surface": {"type": "tube", "curve": curve, "radius": 1}}):
        assert list_errors("MeshRequest", body) == []
        parse_surface(body)


def list_schemas(name: str, schema: Any) -> Iterator[tuple[str, Any]]:
    """A schema and the schemas of all properties in it, each with its path, as `Mesh.report`.

    The elements of an array have no path of their own, only their properties have.
    """
    yield name, schema
    for field, inner in schema.get("properties", {}).items():
        yield from list_schemas(f"{name}.{field}", inner)
    if isinstance(schema.get("items"), dict):
        yield from (pair for pair in list_schemas(name, schema["items"]) if pair[0] != name)


def test_every_schema_and_every_property_is_described() -> None:
    for name, schema in SCHEMAS.items():
        for path, inner in list_schemas(name, schema):
            assert inner.get("description") or "$ref" in inner, path


def test_binary_formats_are_documented_as_binary() -> None:
    descriptions = DOCUMENT["paths"]["/v1/mesh"]["post"]["responses"]["200"]["content"]
    for fmt in FORMATS:
        content = render(find("saddle").surface(), MeshOptions((1, 1)), fmt)
        try:
            content.decode()
            is_binary = False
        except UnicodeDecodeError:
            is_binary = True
        assert (descriptions[fmt.media_type]["schema"].get("format") == "binary") == is_binary


FUNCTIONS = {"Issue", "_refusal", "check_items"}
"""Functions whose first argument is the code of an issue."""


def _find_value(target: ast.expr, value: ast.expr) -> ast.expr | None:
    """The value that an assignment gives to `code`, alone or as one of several variables."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        pairs = zip(target.elts, value.elts, strict=True)
        return next((v for t, v in pairs if getattr(t, "id", "") == "code"), None)
    return value if getattr(target, "id", "") == "code" else None


def find_codes() -> set[str]:
    """All codes of issues in the source of the service: the first arguments of `Issue(…)`.

    Codes that only the command line has are left out.

    Some are arguments of `check_items` or of a local function `_refusal`, or the value of a
    variable `code`.
    """
    codes: set[str] = set()
    files = (f for f in SERVICE.rglob("*.py") if f.parent.name != "cli" and f.name != "bake.py")
    texts = (file.read_text(encoding="utf-8") for file in files)
    for text in filter(
        re.compile(r"\bIssue\(|\b_refusal\(|\bcheck_items\(|\bcode\b.* = ").search, texts
    ):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in FUNCTIONS:
                code = node.args[0] if node.args else None
            elif isinstance(node, ast.Assign):
                code = _find_value(node.targets[0], node.value)
            else:
                continue
            choices = [code.body, code.orelse] if isinstance(code, ast.IfExp) else [code]
            codes |= {str(choice.value) for choice in choices if isinstance(choice, ast.Constant)}
    return codes


def test_the_description_explains_exactly_the_codes_of_the_service() -> None:
    # If the server refuses a connection, the issue has the same code as the problem.
    server_problems = {
        problems.MALFORMED_REQUEST,
        problems.HEAD_TOO_SLOW,
        problems.HEAD_TOO_LARGE,
        problems.TOO_MANY_CONNECTIONS,
        problems.DRAINING,
    }
    text = DOCUMENT["info"]["description"]
    explained_codes = set(re.findall(r"^- `(\w+)`: ", text, re.MULTILINE))
    assert find_codes() | {problem.code for problem in server_problems} == explained_codes
