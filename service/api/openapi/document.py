"""Builds the OpenAPI document of a service, for its settings.

FastAPI makes the document from the routes that the settings switch on. This module adds computed
examples, and the responses and headers of the middleware, which the routes do not declare.
"""

from collections.abc import Sequence, Set
from pathlib import Path

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import SecretStr

from service.api.guard.keys import SCOPES, format_entry, make_key
from service.api.guard.policy import EXEMPT, Policy
from service.api.guard.signatures import MIN_SECRET
from service.api.models.surfaces import Problem
from service.api.openapi.jobs import EVENTS, add_preference
from service.api.openapi.parameters import SIGNED, Json
from service.api.openapi.problems import error_responses, has_limits
from service.api.openapi.responses import EXAMPLE_RESPONSES, error, header
from service.api.record import ID_HEADER
from service.pipeline.calls import CALLS
from service.settings.values import Settings

DESCRIPTION = Path(__file__).with_name("description.md").read_text(encoding="utf-8").strip()
"""The text about all operations. It lists all error codes, which a test checks."""

_TAGS = {
    "meshes": "Surfaces to meshes.",
    "pictures": "Surfaces to pictures.",
    "points": "Points of surfaces, one by one.",
    "queries": "Queries to surfaces and curves, with proved results.",
    "surfaces": "Stored and built-in surfaces, and conversions.",
    "curves": "Curves to points and lines.",
    "jobs": "Long work in the background: many requests, or one that takes long.",
    "catalogue": "Formats and built-in surfaces.",
    "operations": "Health and metrics.",
}

_LICENSE = {"name": "Apache License 2.0", "identifier": "Apache-2.0"}

_SERVER = {"url": "/", "description": "The service that this document comes from."}

_SECURITY_SCHEME = {
    "type": "http",
    "scheme": "bearer",
    "bearerFormat": "sfk_ and 64 hexadecimal digits",
    "description": "A key from the operator, for calls that compute or store "
    "(`SURFACE_API_KEYS`), within its scopes; with `SURFACE_PUBLIC_READS=false` also for surfaces "
    "and meshes by URL. Never send it in a URL.",
}

_RATES: Json = {
    "RateLimit-Policy": header(
        "Sent if requests or their computing time are limited (`SURFACE_RATE_LIMIT`, "
        "`SURFACE_COMPUTE_LIMIT`): with one key, or from one address, `q` requests, or thread "
        "seconds, are allowed in `w` seconds (draft-ietf-httpapi-ratelimit-headers).",
        '"requests";q=60;w=60, "compute";q=30;w=60;qu="thread-seconds"',
        is_required=False,
    ),
    "RateLimit": header(
        "Sent with `RateLimit-Policy`: `r`, how many requests or thread seconds may follow at "
        "once, and `t`, the seconds until all `q` may.",
        '"requests";r=57;t=3, "compute";r=29;t=1',
        is_required=False,
    ),
}

_ID: Json = {
    "RequestId": header(
        "Id of the request. The operator finds it in the log, so quote it in a question. A client "
        "may send its own in this header, of at most 128 letters, digits and `._:/+=@-`; otherwise "
        "the service makes a random one.",
        "0af7651916cd43dd8448eb211c80319c",
        minLength=1,
        maxLength=128,
    )
}

_RATE_REFERENCES: Json = {name: {"$ref": f"#/components/headers/{name}"} for name in _RATES}
_ID_REFERENCE: Json = {ID_HEADER: {"$ref": "#/components/headers/RequestId"}}
_LIMITED = frozenset({"Busy", "TooManyJobs", "TooManyRequests"})
"""Names of the error responses with status 429, which have the headers of the rate limit."""


def build_full_settings() -> Settings:
    """Settings that switch on all optional features."""
    return Settings(
        api_keys=(format_entry("all", make_key(), frozenset(SCOPES)),),
        signing_keys=(SecretStr("-" * MIN_SECRET),),
        public_reads=False,
        allow_delete=True,
        rate_limit=60,
        compute_limit=30,
        metrics="key",
    )


def describe(app: FastAPI, settings: Settings) -> Json:
    """The OpenAPI document of an application with these settings."""
    document = get_openapi(
        title=app.title,
        version=app.version,
        description=DESCRIPTION,
        routes=app.routes,
        tags=[{"name": name, "description": text} for name, text in _TAGS.items()],
        servers=[_SERVER],
        license_info=_LICENSE,
        separate_input_output_schemas=False,
    )
    # Every operation that needs a key says so.
    document["security"] = []
    for path, item in document["paths"].items():
        if path in CALLS and settings.jobs:
            add_preference(item["post"])
        for method, operation in item.items():
            _add_guard(operation, method, path, settings)
    operations = [operation for item in document["paths"].values() for operation in item.values()]
    operation_ids = {operation["operationId"] for operation in operations}
    for operation in operations:
        for status, response in operation["responses"].items():
            # All responses 202 have the state of a job.
            examples = "createJob" if status == "202" else operation["operationId"]
            operation["responses"][status] = _finish_response(response, examples, operation_ids)
    components = document["components"]
    components["schemas"] |= _problem_schemas()
    components["headers"] = _ID | (_RATES if has_limits(settings) else {})
    components["responses"] = _error_components(operations, settings)
    if Policy(settings).has_keys:
        components["securitySchemes"] = {"key": _SECURITY_SCHEME}
    return document


def _add_guard(operation: Json, method: str, path: str, settings: Settings) -> None:
    """Adds to an operation the key that it needs, and the responses of the guard."""
    policy = Policy(settings)
    need = policy.need(method.upper(), path)
    responses = operation["responses"]
    if need != "nothing":
        responses["401"] = error("KeyNeeded")
        # A service without keys may need a signature alone.
        if policy.has_keys:
            # The empty alternative: a signature in the URL replaces a key.
            operation["security"] = [{"key": []}, *([{}] if need == "key or signature" else [])]
            responses["403"] = error("ScopeNeeded")
    if settings.signing_keys and need != "key" and path.startswith("/v1/surfaces/"):
        responses["403"] = error("Forbidden" if "403" in responses else "SignatureInvalid")
        operation["parameters"] = operation["parameters"] + SIGNED
    if has_limits(settings) and (need != "nothing" or path not in EXEMPT):
        if settings.rate_limit:
            responses.setdefault("429", error("TooManyRequests"))
        for response in responses.values():
            response["headers"] = response.get("headers", {}) | _RATE_REFERENCES
    operation["responses"] = dict(sorted(responses.items()))


def _finish_response(response: Json, examples: str, operation_ids: Set[str]) -> Json:
    """A response with the id header, and only links to operations that exist.

    `examples` is the operation whose examples it has.
    """
    if "$ref" in response:
        # FastAPI adds a description, which would replace the description of the component.
        return {"$ref": response["$ref"]}
    content = response.get("content", {})
    if examples in EXAMPLE_RESPONSES and "application/json" in content:
        content["application/json"]["examples"] = EXAMPLE_RESPONSES[examples]()
    if "text/event-stream" in content:
        # FastAPI describes the events with `itemSchema`, which only OpenAPI 3.2 has.
        content["text/event-stream"] = EVENTS
    links = response.get("links", {})
    for name in [name for name in links if links[name]["operationId"] not in operation_ids]:
        del links[name]
    return response | {"headers": response.get("headers", {}) | _ID_REFERENCE}


def _error_components(operations: Sequence[Json], settings: Settings) -> Json:
    """The error responses that operations refer to, with the headers that every response has."""
    responses = [r for operation in operations for r in operation["responses"].values()]
    names = {r["$ref"].rpartition("/")[2] for r in responses if "$ref" in r}
    errors = {name: r for name, r in error_responses(settings).items() if name in names}
    for name, response in errors.items():
        rates = _RATE_REFERENCES if has_limits(settings) and name in _LIMITED else {}
        response["headers"] = response.get("headers", {}) | rates | _ID_REFERENCE
    return errors


def _problem_schemas() -> Json:
    """The schemas of errors: no route names them as its response."""
    schema = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas: Json = schema.pop("$defs") | {"Problem": schema}
    for field in schemas["Issue"]["properties"].values():
        field.pop("default", None)  # pydantic's default null: these fields are never null
    return schemas
