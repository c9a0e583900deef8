"""Sends the work of a command to a service at a URL (`--url`)."""

import os
import re
import time
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import httpx
import orjson

from service.encoders.format import FileFormat, Format
from service.encoders.text import json_text
from service.errors import BadAddress, InvalidRequest, Issue, ServiceFailed, pointer

TIMEOUT = 600.0
"""Seconds to wait for a response."""

RETRIES, MAX_WAIT = 3, 30.0
"""The number of retries while a service is busy, and the most seconds to wait before each."""

_BUSY = frozenset({httpx.codes.TOO_MANY_REQUESTS, httpx.codes.SERVICE_UNAVAILABLE})
"""Statuses of a busy service. Every request may be sent again, even if the service had begun to
compute: to store a surface twice changes nothing."""

KEY = "SURFACE_KEY"
"""The environment variable with the caller's API key, for services that need one."""


def fetch_mesh(url: str, id: str, options: Mapping[str, str], fmt: Format) -> bytes:
    """The mesh file of an example or of a stored surface; raises the errors of `post`.

    `options` are the options by name, as text.
    """
    path = f"/v1/surfaces/{id}/mesh.{fmt.suffix}"
    return _request(url, fmt.media_type, "GET", path, params=dict(options))


def post(
    url: str,
    path: str,
    body: dict[str, Any] | bytes,
    fmt: FileFormat | None = None,
    query: Mapping[str, str] = MappingProxyType({}),
    *,
    media_type: str = "application/json",
) -> bytes:
    """The response to a document or a file that is posted to a path of the service at `url`.

    Parameters
    ----------
    body : dict or bytes
        The document, or the content of the file, which is sent unchanged.
    fmt : FileFormat, optional
        The format of the response; default: JSON.
    query : Mapping
        Further parameters of the URL.
    media_type : str
        That of the body.

    Raises
    ------
    InvalidRequest
        The service reports an error of the request; the issues are from the response.
    BadAddress, ServiceFailed
    """
    expected_type, params = "application/json", dict(query)
    if fmt is not None:
        expected_type, params["format"] = fmt.media_type, fmt.name
    content = body if isinstance(body, bytes) else json_text(body)
    headers = {"Content-Type": media_type}
    return _request(
        url, expected_type, "POST", path, params=params, content=content, headers=headers
    )


def store(url: str, document: dict[str, Any]) -> dict[str, str]:
    """Stores a surface; returns its `id`, and URLs of it and its meshes.

    Raises the errors of `post`.
    """
    response = orjson.loads(post(url, "/v1/surfaces", document))
    links = {"self": response["links"]["self"], **response["links"]["mesh"]}
    return {"id": response["id"]} | {k: str(httpx.URL(url).join(v)) for k, v in links.items()}


def list_stored(url: str) -> Iterator[dict[str, Any]]:
    """The stored surfaces of a service, in the order of their ids: `id`, `bytes` and `time` each.

    Raises the errors of `post`.
    """
    query: dict[str, str] = {"limit": "1000"}
    absent = "This service has no list of stored surfaces: it needs API keys (SURFACE_API_KEYS)."
    while query:
        page = orjson.loads(
            _request(url, "application/json", "GET", "/v1/stored", absent=absent, params=query)
        )
        yield from page["surfaces"]
        query = dict(httpx.URL(page["links"].get("next", "")).params)


def delete(url: str, id: str) -> None:
    """Removes a stored surface; raises the errors of `post`."""
    absent = "This service deletes no surfaces (SURFACE_ALLOW_DELETE), or this is an example."
    _request(url, "", "DELETE", f"/v1/surfaces/{id}", absent=absent)


def _request(
    url: str, expected_type: str, method: str, path: str, absent: str = "", **request: Any
) -> bytes:
    """Sends a request, again while the service is busy; returns the body of the response.

    `absent` is the text of the error if the service may be one that does not have this call.

    Raises
    ------
    InvalidRequest
        The service reports an error of the request.
    BadAddress, ServiceFailed
        `ServiceFailed` also if the response has another media type than `expected_type`.
    """
    request["headers"] = {**request.get("headers", {}), **_authorization()}
    try:
        with httpx.Client(base_url=url, timeout=httpx.Timeout(TIMEOUT, connect=10)) as client:
            response = client.request(method, path, **request)
            for _ in range(RETRIES):
                if response.status_code not in _BUSY or "retry-after" not in response.headers:
                    break
                time.sleep(_retry_seconds(response.headers["retry-after"]))
                response = client.request(method, path, **request)
    except (httpx.InvalidURL, httpx.UnsupportedProtocol) as error:
        raise BadAddress(f"--url: {error}") from None
    except httpx.TransportError as error:
        raise ServiceFailed(f"{url} does not answer: {type(error).__name__}") from None
    media_type = response.headers.get("content-type", "").partition(";")[0]
    if response.is_success and media_type == expected_type.partition(";")[0]:
        return response.content
    problem = _problem_document(response) if media_type == "application/problem+json" else {}
    if problem.get("code") in _ABSENT and absent:
        raise InvalidRequest(Issue(problem["code"], absent))
    if not problem or problem["code"] in _ABSENT:
        raise ServiceFailed(f"{url}: not a surface service ({response.status_code} {response.url})")
    if response.status_code in _BUSY:
        raise ServiceFailed(f"{url} is busy: {problem['detail']}")
    if response.is_server_error:
        raise ServiceFailed(f"{url} failed: {problem['detail']}")
    if response.status_code == httpx.codes.UNAUTHORIZED:
        raise InvalidRequest(Issue(problem["code"], problem["detail"], needed=f"a key in {KEY}"))
    raise InvalidRequest(*_issues(problem))


_ABSENT = frozenset({"not_found", "method_not_allowed"})
"""Codes of a service that does not have a call. Every surface service has all calls of this module
except those that its settings switch on, so usually another server responded."""


def _retry_seconds(header: str) -> float:
    """Seconds to wait, from a Retry-After header; `MAX_WAIT` if the header is a date."""
    return min(float(header), MAX_WAIT) if header.isdecimal() else MAX_WAIT


def _authorization() -> dict[str, str]:
    """The Authorization header with the key in the environment; no header without a key."""
    key = os.environ.get(KEY, "")
    if not key:
        return {}
    if not re.fullmatch("[!-~]+", key):
        raise BadAddress(f"{KEY}: needed a key of ASCII characters without spaces")
    return {"Authorization": f"Bearer {key}"}


def _problem_document(response: httpx.Response) -> dict[str, Any]:
    """The problem document (RFC 9457) in a response; empty if no surface service wrote it."""
    try:
        problem = response.json()
    except ValueError:
        return {}
    is_problem = isinstance(problem, dict) and {"code", "detail", "errors"} <= problem.keys()
    return dict(problem) if is_problem else {}


def _issues(problem: Mapping[str, Any]) -> list[Issue]:
    """The errors of a problem document, as the service itself would raise them; at least one."""
    issues = [
        Issue(
            error["code"],
            error["detail"],
            error.get("pointer")
            or pointer(error[k] for k in ("parameter", "header") if k in error),
            error.get("got", ""),
            error.get("needed", ""),
        )
        for error in problem["errors"]
    ]
    return issues or [Issue(problem["code"], problem["detail"])]
