"""Who may do what, in the OpenAPI document: told by the rules that the guard keeps."""

from service.api.guard.policy import Policy
from service.api.openapi.operations import problems
from service.api.openapi.references import Json
from service.settings.values import Settings

_KEY = "key"

SECURITY_SCHEMES: Json = {
    _KEY: {
        "type": "http",
        "scheme": "bearer",
        "bearerFormat": "sfk_ and 64 hexadecimal digits",
        "description": "A key of the operator's, where the service is set up to need one: for "
        "whatever computes or stores (`SURFACE_API_KEYS`), and with `SURFACE_PUBLIC_READS=false` "
        "for surfaces and meshes by URL too. Never in an address.",
    }
}

_CLOSED = Policy(Settings(api_keys=("all",), public_reads=False))
"""The rules where everything is closed that can be."""


def guarded(paths: Json) -> Json:
    """The paths, each operation with what the guard may answer in its place."""
    return {
        path: {method: _operation(each, method, path) for method, each in item.items()}
        for path, item in paths.items()
    }


def _operation(operation: Json, method: str, path: str) -> Json:
    added: Json = {}
    responses = dict(operation["responses"])
    if _CLOSED.need(method.upper(), path) != "nothing":
        # A key is optional: not every service needs one.
        added["security"] = [{}, {_KEY: []}]
        responses |= problems("KeyNeeded")
    return operation | added | {"responses": dict(sorted(responses.items()))}
