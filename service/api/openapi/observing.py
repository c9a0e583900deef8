"""GET /metrics in the OpenAPI document."""

from service.api.observing.metrics import OPEN, TEXT
from service.api.openapi.operations import problems
from service.api.openapi.references import Json

_EXAMPLE = """\
# HELP surface_cache_hits_total Answers sent again.
# TYPE surface_cache_hits_total counter
surface_cache_hits_total 1204.0
"""


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
