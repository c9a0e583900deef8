"""The operation that signs addresses, in the OpenAPI document; its examples are computed."""

from functools import cache

from service.api.guard.moments import signed_address
from service.api.guard.signatures import MIN_SECRET, Signer
from service.api.openapi.operations import post_operation, problems
from service.api.openapi.references import Json, ref
from service.schemas.request import SignRequest
from service.schemas.validation import validate_document

_DESCRIPTION = """\
Where surfaces and meshes are not public (`SURFACE_PUBLIC_READS=false`), an address with a signature
may be read without a key by whoever has it, until it expires: by a viewer on a page, say. The
signature holds for that path and those parameters, in any order, for `GET` and `HEAD`. Nothing is
looked up or computed. Only addresses of this service can be signed, for seven days at most; and
only where it is set up for that (`SURFACE_SIGNING_KEYS`), else there is no such call.
"""

_NOW = 1_799_996_400
"""Some moment, an hour before that of the examples."""


def post_sign() -> Json:
    """POST /v1/sign."""
    requests = {name: {"summary": s, "value": value} for name, (s, value, _) in _examples().items()}
    answers = {name: {"summary": s, "value": value} for name, (s, _, value) in _examples().items()}
    content = {"schema": ref("SignedAddress"), "examples": answers}
    operation = post_operation(
        "signAddress",
        "surfaces",
        "Signs an address of a private surface",
        _DESCRIPTION,
        request=("SignRequest", requests),
        answer={"description": "The address.", "content": {"application/json": content}},
    )
    operation["responses"] |= problems("NotFound")
    return operation


def signed_schema() -> Json:
    """What signing answers."""
    return {
        "type": "object",
        "properties": {
            "url": {
                "type": "string",
                "description": "The address, with `expires` and `signature` at its end.",
            },
            "expires": {"type": "integer", "description": "Until when, in Unix time."},
        },
        "required": ["url", "expires"],
        "description": "An address that may be read by whoever has it.",
    }


@cache
def _examples() -> dict[str, tuple[str, Json, Json]]:
    """Summary, request and answer of each example, signed with a secret that is none."""
    signer = Signer(["-" * MIN_SECRET])
    found: dict[str, tuple[str, Json, Json]] = {}
    mesh = "/v1/surfaces/utah-teapot/mesh.glb?resolution=16"
    for name, summary, request in (
        ("until", "A mesh, until a moment", {"url": mesh, "expires": 1_800_000_000}),
        ("for", "A definition, for an hour", {"url": "/v1/surfaces/saddle", "seconds": 3600}),
    ):
        url, expires = signed_address(signer, validate_document(SignRequest, request), "", _NOW)
        found[name] = summary, request, {"url": url, "expires": expires}
    return found
