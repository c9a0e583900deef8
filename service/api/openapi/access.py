"""Who may do what, in the OpenAPI document: told by the rules that the guard keeps."""

from service.api.guard.policy import EXEMPT, Policy
from service.api.guard.signatures import EXPIRES, SIGNATURE
from service.api.openapi.headers import RATE_REFERENCES
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

_SIGNED = [
    {
        "name": name,
        "in": "query",
        "required": False,
        "description": description,
        "schema": schema,
    }
    for name, description, schema in (
        (
            EXPIRES,
            "Of a signed address: until when it is good, in Unix time.",
            {"type": "integer", "minimum": 0, "examples": [1800000000]},
        ),
        (
            SIGNATURE,
            "Of a signed address, as `POST /v1/sign` makes it: its last parameter.",
            {"type": "string", "pattern": "^[A-Za-z0-9_-]{43}$"},
        ),
    )
]

_CLOSED = Policy(Settings(api_keys=("all",), public_reads=False, metrics="key"))
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
    need = _CLOSED.need(method.upper(), path)
    if need != "nothing":
        # A key is optional: not every service needs one.
        added["security"] = [{}, {_KEY: []}]
        responses |= problems("KeyNeeded")
    if need == "key or signature":
        added["parameters"] = [*operation["parameters"], *_SIGNED]
        responses |= problems("SignatureInvalid")
    if path not in EXEMPT:
        responses = {status: _with_rates(each) for status, each in responses.items()}
        responses = problems("TooManyRequests") | responses
    return operation | added | {"responses": dict(sorted(responses.items()))}


def _with_rates(answer: Json) -> Json:
    """An answer that is written in full here, with the headers that tell of rates."""
    if "$ref" in answer:
        return answer
    return answer | {"headers": answer.get("headers", {}) | RATE_REFERENCES}
