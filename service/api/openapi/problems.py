"""The error responses of the OpenAPI document; their examples are raised by the service's code."""

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from service.api import problems
from service.api.errors import compute_limited
from service.api.guard.policy import REALM, key_needed, key_unknown, rate_limited, scope_needed
from service.api.guard.signatures import MIN_SECRET, Signer
from service.api.intake import no_parts
from service.api.media_types import decoder_of_body
from service.api.negotiation import (
    check_engine,
    codings_by_header,
    format_by_accept,
    format_by_name,
    format_by_suffix,
)
from service.api.openapi.parameters import Json
from service.api.openapi.responses import header
from service.api.problems import MEDIA_TYPE, LocationKind, ProblemKind, problem_document, problem_of
from service.api.receiving import body_too_large, body_too_slow
from service.api.stored import content_id
from service.api.threads import MAX_RETRY_AFTER
from service.cancellation import OutOfTime
from service.decoders import teapot
from service.decoders.registry import DECODERS
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh.mesh import ENGINE
from service.engine.options import MeshOptions
from service.engine.points.places import PointsQuery
from service.errors import (
    Busy,
    DamagedObject,
    InvalidRequest,
    Issue,
    JobQuotaFull,
    StoreFailed,
    SurfaceError,
    TooManyJobs,
)
from service.jobs.checks import check_part
from service.jobs.reading import unknown_job, unknown_result
from service.pipeline.calls import CallLimits
from service.pipeline.documents import plan_conversion
from service.pipeline.mesh import render
from service.pipeline.queries import plan_points
from service.schemas.document import DEFAULT_LIMITS
from service.schemas.query import parse_mesh_query
from service.schemas.request import MeshRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings
from service.storage.failures import disk_full
from service.storage.quota import quota_exceeded
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Split
from service.surface.examples.catalogue import find

FailingCall: TypeAlias = Callable[[], object]
Example: TypeAlias = ProblemKind | SurfaceError | FailingCall
"""A problem, an error, or a call that raises an error."""

_INSIDE = PointsQuery(np.array([[0.5, 0.5]]), patch=None, order=0)
_OUTSIDE = PointsQuery(np.array([[0.5, 1.5]]), patch=None, order=0)
_NO_FACE = PointsQuery(np.array([[0.5, 0.5]]), patch=np.array(99), order=0)
"""One parameter pair inside the domain [0, 1]², one outside of it, and one on a face with a number
that the built-in parts do not have."""
_RAGGED = (
    b'{"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, true]], [[2, 0, 0], [2, 1]]]}}'
)
_KNOTS = (
    b'{"surface": {"type": "bspline", "control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], '
    b'[1, 1, 0]]], "degree": 1, "knots": [[0, 0, 1, 1], [0, 1, 0.5, 1]]}}'
)
_MESH_PATH, _EXPIRY = "/v1/surfaces/saddle/mesh.glb", 1_800_000_000


def error_responses(settings: Settings) -> dict[str, Json]:
    """The error responses of a service with these settings, by name."""
    responses = {
        name: _error_response(name, examples) for name, examples in _examples(settings).items()
    }
    for name, headers in _list_headers(settings).items():
        if name in responses:
            responses[name]["headers"] = headers
    return responses


def has_limits(settings: Settings) -> bool:
    """Whether responses have the headers of rate limits."""
    return bool(settings.rate_limit or settings.compute_limit)


def _examples(settings: Settings) -> Mapping[str, Mapping[str, Example]]:
    signer = Signer(["-" * MIN_SECRET])
    signed = signer.sign(_MESH_PATH, "", _EXPIRY).encode()
    max_json_bytes = min(settings.max_json_bytes, settings.max_body_bytes)
    invalid_signatures: Mapping[str, Example] = {
        "changed": lambda: signer.verify("/v1/surfaces/saddle", signed, now=0),
        "expired": lambda: signer.verify(_MESH_PATH, signed, now=_EXPIRY),
    }
    too_many_requests = {"rate": rate_limited(limit=60, seconds=3)} if settings.rate_limit else {}
    compute = {"compute": compute_limited(30, retry_after=4)} if settings.compute_limit else {}
    return {
        "MalformedJson": {
            "truncated": _post_mesh(b'{"surface": {'),
            # One patch of the vertices 1 to 4, then the number 3 of vertices, and no vertex.
            "file": lambda: teapot.decode(b"1\n1,2,3,4\n3\n", kind=None, max_points=4),
        },
        "KeyNeeded": {"none": key_needed(), "unknown": key_unknown()},
        "ScopeNeeded": {"scope": scope_needed("compute")},
        "SignatureInvalid": invalid_signatures,
        "Forbidden": {"scope": scope_needed("read"), **invalid_signatures},
        **({"TooManyRequests": too_many_requests} if too_many_requests else {}),
        "NotFound": {"no such path": problems.NOT_FOUND},
        "UnknownSurface": {
            "id": lambda: content_id("teapot"),  # its id is `utah-teapot`
            "suffix": lambda: format_by_suffix("fbx"),
        },
        "MethodNotAllowed": {"method": problems.METHOD_NOT_ALLOWED},
        "NotAcceptable": {"pictures": lambda: format_by_accept("image/png", FORMATS)},
        "CodingNotAcceptable": {"coding": lambda: codings_by_header(b"br, identity;q=0")},
        "EngineGone": {"numbers": lambda: check_engine(ENGINE + 1)},
        "BodyTooSlow": {"stalled": body_too_slow(received_bytes=0, settings=settings)},
        "BodyTooLarge": {"body": body_too_large(max_json_bytes, settings)},
        "UnsupportedMediaType": {
            "text": lambda: decoder_of_body("text/plain", DECODERS),
            "format": lambda: decoder_of_body("model/brep", DECODERS),
        },
        "InvalidRequest": {
            "net": _post_mesh(_RAGGED),
            "options": _post_mesh(b'{"resolution": 0, "faces": null, "colour": 1}'),
            "format": lambda: format_by_name("fbx", FORMATS),
            "quads": _render("stl", MeshOptions(faces="quads")),
            "size": _render("glb", MeshOptions((9000, 9000))),
            "points": lambda: plan_points(find("saddle").surface(), _OUTSIDE).run(),
            "knots": _post_mesh(_KNOTS),
            "face": lambda: plan_points(find("gear").surface(), _NO_FACE).run(),
            "parameters": lambda: plan_points(find("trefoil-tube").surface(), _INSIDE).run(),
            "conversion": lambda: plan_conversion(
                find("sphere").surface(), (Split(u=0.5),), SizeLimits()
            ).run(),
        },
        "InvalidQuery": {
            "options": lambda: parse_mesh_query([("resolution", "0"), ("weld", "1")]),
            "quads": _render("stl", MeshOptions(faces="quads")),
        },
        "DamagedObject": {"hash": DamagedObject(), "ours": problems.INTERNAL_ERROR},
        "Busy": {"queue": Busy(), **too_many_requests, **compute},
        "OutOfTime": {"deadline": OutOfTime()},
        "StoreFailed": {"bucket": StoreFailed()},
        "Unavailable": {"deadline": OutOfTime(), "bucket": StoreFailed()},
        "InvalidJob": {
            "part": lambda: _check_part({"path": "/v1/mesh", "body": {"surface": {}}}),
            "path": lambda: _check_part({"path": "/v1/estimate", "body": {}}),
            "surface": InvalidRequest(
                Issue(
                    "unknown_surface",
                    "No surface is stored under this id.",
                    "/parts/3/path",
                )
            ),
            "none": no_parts(),
        },
        "UnknownJob": {"job": unknown_job()},
        "UnknownResult": {"running": unknown_result("This part has no result yet.")},
        "TooManyJobs": {
            "jobs": TooManyJobs(
                Issue("too_many_jobs", "You have the largest number of jobs that have not ended.")
            ),
            "queue": Busy(),
            **(too_many_requests if settings.rate_limit else {}),
        },
        "JobQuotaFull": {
            "quota": JobQuotaFull(Issue("job_quota_full", "The quota of jobs is used up.")),
            "disk": disk_full(),
        },
        "StoreFull": {
            "quota": quota_exceeded(free_bytes=3_000, growth=14_000),
            "disk": disk_full(),
        },
        "InternalError": {"ours": problems.INTERNAL_ERROR},
    }


def _post_mesh(text: bytes) -> FailingCall:
    return lambda: parse_request(MeshRequest, text, DEFAULT_LIMITS).to_surface()


def _check_part(document: Json) -> None:
    try:
        check_part(document, CallLimits(), find_surface=lambda _: find("saddle").surface())
    except SurfaceError as error:
        raise error.within("/parts/3") from None


def _render(fmt: str, options: MeshOptions) -> FailingCall:
    return lambda: render(find("saddle").surface(), options, BY_NAME[fmt])


def _problem(example: Example, location: LocationKind | None) -> Json:
    """The body of an error response."""
    if isinstance(example, ProblemKind):
        return problem_document(example)
    if not isinstance(example, SurfaceError):
        try:
            example()
        except SurfaceError as error:
            example = error
        else:
            raise AssertionError("an example of an error did not raise")
    return problem_document(problem_of(example), example.issues, location)


def _error_response(name: str, examples: Mapping[str, Example]) -> Json:
    location: LocationKind | None = "parameter" if name == "InvalidQuery" else None
    values = {key: _problem(example, location) for key, example in examples.items()}
    content = {
        "schema": {"$ref": "#/components/schemas/Problem"},
        "examples": {key: {"value": value} for key, value in values.items()},
    }
    about = " ".join(dict.fromkeys(value["detail"] for value in values.values()))
    return {"description": about, "content": {MEDIA_TYPE: content}}


def _retry_after(*, is_bounded: bool = True) -> Json:
    text = "Seconds after which to try again."
    schema: Json = {"type": "integer", "minimum": 1}
    if is_bounded:
        schema["maximum"] = MAX_RETRY_AFTER
    return {"Retry-After": header(text, 3, **schema)}


def _list_headers(settings: Settings) -> Mapping[str, Json]:
    """The headers of error responses, by name."""
    return {
        "KeyNeeded": {"WWW-Authenticate": header("How to send a key (RFC 6750).", REALM)},
        "TooManyRequests": _retry_after(),
        # A caller may have used the thread seconds of many minutes.
        "Busy": _retry_after(is_bounded=not settings.compute_limit),
        "TooManyJobs": _retry_after(is_bounded=not settings.compute_limit),
        "OutOfTime": _retry_after(),
        "StoreFailed": _retry_after(),
        "Unavailable": _retry_after(),
    }
