"""The error answers of the OpenAPI document; the code that raises errors makes the examples."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from service.api import problems
from service.api.admission.admission import LONGEST
from service.api.admission.busy import Busy
from service.api.body import body_too_large, body_too_slow, body_type
from service.api.caching.requested import check_codings
from service.api.guard.refusals import REALM, key_needed, key_unknown, rate_limited
from service.api.guard.signatures import MIN_SECRET, Signer
from service.api.mesh_by_url import check_engine
from service.api.negotiation import by_accept, by_suffix
from service.api.openapi.headers import RATE_REFERENCES
from service.api.openapi.references import Json, ref
from service.api.parameters import only_format
from service.api.problems import MEDIA_TYPE, Place, problem_document, problem_of
from service.api.stored import content_id
from service.decoders import teapot
from service.decoders.registry import DECODERS
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh import ENGINE
from service.engine.options import MeshOptions
from service.engine.points.places import Query
from service.errors import DamagedObject, StoreFailed, SurfaceError
from service.pipeline.conversion import converted
from service.pipeline.mesh import render
from service.pipeline.points import plan_points
from service.schemas.document import DEFAULT_LIMITS
from service.schemas.query import mesh_query
from service.schemas.request import MeshRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings
from service.stopping import OutOfTime
from service.storage.failures import disk_full
from service.storage.usage import no_room
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import Split
from service.surface.examples import find


def _refused(call: Callable[[], object], place: Place | None = None) -> Json:
    """The problem that a call runs into."""
    try:
        call()
    except SurfaceError as error:
        return problem_document(problem_of(error), error.issues, place)
    raise AssertionError("an example of an error is no error")


def _raised(error: SurfaceError) -> Json:
    """The problem of an error that is at hand."""
    return problem_document(problem_of(error), error.issues)


def _post(text: bytes) -> Callable[[], object]:
    return lambda: parse_request(MeshRequest, text, DEFAULT_LIMITS).to_surface()


def _render(fmt: str, options: MeshOptions) -> Callable[[], object]:
    return lambda: render(find("saddle").surface(), options, BY_NAME[fmt])


def _outside() -> object:
    query = Query(np.array([[0.5, 1.5]]), None, 0)
    return plan_points(find("saddle").surface(), query).run()


def _without_parameters() -> object:
    query = Query(np.array([[0.5, 0.5]]), None, 0)
    return plan_points(find("trefoil-tube").surface(), query).run()


def _no_common_parameters() -> object:
    return converted(find("sphere").surface(), (Split(u=0.5),), Allowed())


_RAGGED = (
    b'{"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, true]], [[2, 0, 0], [2, 1]]]}}'
)
_KNOTS = (
    b'{"surface": {"type": "bspline", "control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], '
    b'[1, 1, 0]]], "degree": 1, "knots": [[0, 0, 1, 1], [0, 1, 0.5, 1]]}}'
)
_SETTINGS = Settings()
_SIGNER = Signer(["-" * MIN_SECRET])
_MESH = "/v1/surfaces/saddle/mesh.glb"
_SIGNED = _SIGNER.signed(_MESH, "", 1_800_000_000).encode()

_EXAMPLES: Mapping[str, Mapping[str, Callable[[], Json]]] = MappingProxyType(
    {
        "MalformedJson": {
            "truncated": lambda: _refused(_post(b'{"surface": {')),
            "file": lambda: _refused(lambda: teapot.decode(b"1\n1,2,3,4\n3\n", None, 4)),
        },
        "KeyNeeded": {
            "none": lambda: _raised(key_needed()),
            "unknown": lambda: _raised(key_unknown()),
        },
        "SignatureInvalid": {
            "changed": lambda: _refused(lambda: _SIGNER.check("/v1/surfaces/saddle", _SIGNED, 0)),
            "expired": lambda: _refused(lambda: _SIGNER.check(_MESH, _SIGNED, 1_800_000_000)),
        },
        "TooManyRequests": {"rate": lambda: _raised(rate_limited(60, 3))},
        "NotFound": {"no such path": lambda: problem_document(problems.NOT_FOUND)},
        "UnknownSurface": {
            "id": lambda: _refused(lambda: content_id("teapot")),
            "suffix": lambda: _refused(lambda: by_suffix("fbx")),
        },
        "MethodNotAllowed": {"method": lambda: problem_document(problems.METHOD_NOT_ALLOWED)},
        "NotAcceptable": {"pictures": lambda: _refused(lambda: by_accept("image/png", FORMATS))},
        "CodingNotAcceptable": {
            "coding": lambda: _refused(lambda: check_codings(b"br, identity;q=0")),
        },
        "EngineGone": {"numbers": lambda: _refused(lambda: check_engine(ENGINE + 1))},
        "BodyTooSlow": {"stalled": lambda: _raised(body_too_slow(0, _SETTINGS))},
        "BodyTooLarge": {"body": lambda: _raised(body_too_large(_SETTINGS))},
        "UnsupportedMediaType": {
            "form": lambda: _refused(lambda: body_type("text/plain", DECODERS))
        },
        "InvalidRequest": {
            "net": lambda: _refused(_post(_RAGGED)),
            "options": lambda: _refused(_post(b'{"resolution": 0, "faces": null, "colour": 1}')),
            "format": lambda: _refused(lambda: only_format([("format", "fbx")], FORMATS)),
            "quads": lambda: _refused(_render("stl", MeshOptions(faces="quads"))),
            "size": lambda: _refused(_render("glb", MeshOptions((9000, 9000)))),
            "points": lambda: _refused(_outside),
            "knots": lambda: _refused(_post(_KNOTS)),
            "parameters": lambda: _refused(_without_parameters),
            "conversion": lambda: _refused(_no_common_parameters),
        },
        "InvalidQuery": {
            "options": lambda: _refused(
                lambda: mesh_query([("resolution", "0"), ("weld", "1")]), "parameter"
            ),
            "quads": lambda: _refused(_render("stl", MeshOptions(faces="quads")), "parameter"),
        },
        "DamagedObject": {
            "hash": lambda: _raised(DamagedObject()),
            "ours": lambda: problem_document(problems.INTERNAL_ERROR),
        },
        "Busy": {
            "queue": lambda: _raised(Busy()),
            "rate": lambda: _raised(rate_limited(60, 3)),
        },
        "OutOfTime": {"deadline": lambda: _raised(OutOfTime())},
        "StoreFailed": {"bucket": lambda: _raised(StoreFailed())},
        "Unavailable": {
            "deadline": lambda: _raised(OutOfTime()),
            "bucket": lambda: _raised(StoreFailed()),
        },
        "StoreFull": {
            "quota": lambda: _raised(no_room(left=3_000, growth=14_000)),
            "disk": lambda: _raised(disk_full()),
        },
        "InternalError": {"ours": lambda: problem_document(problems.INTERNAL_ERROR)},
    }
)


def _retry_after(*, is_sure: bool) -> Json:
    return {
        "Retry-After": {
            "required": is_sure,
            "description": "Seconds after which coming again makes sense.",
            "schema": {"type": "integer", "minimum": 1, "maximum": LONGEST},
            "example": 3,
        }
    }


_HEADERS: Mapping[str, Json] = MappingProxyType(
    {
        "KeyNeeded": {
            "WWW-Authenticate": {
                "required": True,
                "description": "How to come back (RFC 6750).",
                "schema": {"type": "string"},
                "example": REALM,
            }
        },
        "TooManyRequests": _retry_after(is_sure=True) | RATE_REFERENCES,
        "Busy": _retry_after(is_sure=True) | RATE_REFERENCES,
        "OutOfTime": _retry_after(is_sure=True),
        "Unavailable": _retry_after(is_sure=False),
    }
)


@cache
def responses() -> dict[str, Json]:
    """The error answers by name."""
    found = {name: _response(examples) for name, examples in _EXAMPLES.items()}
    for name, headers in _HEADERS.items():
        found[name]["headers"] = headers
    return found


@cache
def status_of(name: str) -> str:
    """The status of an error answer, as OpenAPI writes it."""
    examples = responses()[name]["content"][MEDIA_TYPE]["examples"]
    return str(next(iter(examples.values()))["value"]["status"])


def _response(examples: Mapping[str, Callable[[], Json]]) -> Json:
    values = {name: make() for name, make in examples.items()}
    return {
        "description": " ".join(dict.fromkeys(value["detail"] for value in values.values())),
        "content": {
            MEDIA_TYPE: {
                "schema": ref("Problem"),
                "examples": {name: {"value": value} for name, value in values.items()},
            }
        },
    }
