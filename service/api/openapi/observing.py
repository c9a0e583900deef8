"""GET /health/ready and GET /metrics in the OpenAPI document."""

from service.api.observing.metrics import OPEN, TEXT
from service.api.observing.middleware import ID_HEADER
from service.api.openapi.operations import get_operation, problems
from service.api.openapi.references import Json, ref

_EXAMPLE = """\
# HELP surface_cache_hits_total Answers sent again.
# TYPE surface_cache_hits_total counter
surface_cache_hits_total 1204.0
"""


REQUEST_ID: Json = {
    "description": "Id of the request, for the log and for whoever is asked about it: random, "
    "unless the request has such a header itself, of at most 128 letters, digits and `._:/+=@-`.",
    "required": True,
    "schema": {"type": "string", "minLength": 1, "maxLength": 128},
    "example": "0af7651916cd43dd8448eb211c80319c",
}


def add_ids(whole: Json) -> None:
    """Says of every answer in a document that it has an id."""
    components = whole["components"]
    components["headers"] = components.get("headers", {}) | {"RequestId": REQUEST_ID}
    operations = [one for path in whole["paths"].values() for one in path.values()]
    answers = [one for each in operations for one in each["responses"].values()]
    for answer in (*answers, *components["responses"].values()):
        if "$ref" not in answer:
            named = {ID_HEADER: {"$ref": "#/components/headers/RequestId"}}
            answer["headers"] = answer.get("headers", {}) | named


def ready_operation() -> Json:
    """The operation; why the service is not ready stands in the body."""
    operation = get_operation(
        "getReadiness",
        "operations",
        "200 as long as new requests are welcome",
        "Health",
    )
    operation["description"] = (
        "Ready means that a tiny mesh, made every few seconds at most, came out right, that the "
        "place where surfaces are kept has answered in the last seconds, and that the service is "
        "not about to stop."
    )
    answer = operation["responses"]["200"]["content"]["application/json"]
    answer["example"] = {"status": "ready", "computing": "ready", "store": "ready"}
    failing = {"status": "unready", "computing": "ready", "store": "unavailable"}
    operation["responses"]["503"] = {
        "description": "No new requests should come here, for what does not work, or since the "
        "service is about to stop.",
        "content": {
            "application/json": {
                "schema": ref("Health"),
                "examples": {
                    "store": {"value": failing},
                    "draining": {"value": {"status": "draining"}},
                },
            }
        },
    }
    return operation


def metrics_operation() -> Json:
    """The operation; the service may be set to have none, which is 404, or to ask for a key."""
    text = {"type": "string"}
    return {
        "operationId": "getMetrics",
        "tags": ["operations"],
        "summary": "Numbers of what the service does, as Prometheus reads them",
        "description": "In the text format of Prometheus, or as OpenMetrics where `Accept` names "
        "it. Whether it is there, and open, is for the operator to say.",
        "responses": {
            "200": {
                "description": "Every number that is counted.",
                "content": {
                    TEXT.split(";")[0]: {"schema": text, "example": _EXAMPLE},
                    OPEN.split(";")[0]: {
                        "schema": text,
                        "example": _EXAMPLE.replace("hits_total ", "hits ", 1).replace(
                            "TYPE surface_cache_hits_total", "TYPE surface_cache_hits"
                        )
                        + "# EOF\n",
                    },
                },
            },
            **problems("NotFound", "InvalidQuery", "InternalError"),
        },
    }
