"""A connection to a service: its key, its patience, and its errors."""

import os
import re
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import httpx

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


_ABSENT = frozenset({"not_found", "method_not_allowed"})
"""Codes of a service that does not have a call. Every surface service has all calls that the
commands use except those that its settings switch on, so usually another server responded."""


class Connection:
    """A service at a URL; `connect` makes it.

    Attributes
    ----------
    url : str
    client : httpx.Client
    headers : httpx.Headers
        Those of the last response that was as expected.
    """

    def __init__(self, url: str, client: httpx.Client) -> None:
        self.url = url
        self.client = client
        self.headers = httpx.Headers()

    def send(
        self, method: str, path: str, *, timeout: float = TIMEOUT, **request: Any
    ) -> httpx.Response:
        """Sends a request, again while the service is busy; `path` may be a URL.

        A request that took too much time is not sent again, because it would again.

        Parameters
        ----------
        timeout : float
            Seconds to wait for the response.
        request : dict
            Further arguments of `httpx.Client.request`.

        Raises
        ------
        httpx.ReadTimeout
            There was no response in time.
        """
        request["timeout"] = httpx.Timeout(TIMEOUT, connect=10, read=timeout)
        response = self.client.request(method, path, **request)
        for _ in range(RETRIES):
            if response.status_code not in _BUSY or "retry-after" not in response.headers:
                break
            if find_problem(response).get("code") == "out_of_time":
                break
            time.sleep(_retry_seconds(response.headers["retry-after"]))
            response = self.client.request(method, path, **request)
        return response

    def read(self, response: httpx.Response, expected_type: str, absent: str = "") -> bytes:
        """The body of a response.

        Parameters
        ----------
        expected_type : str
            The media type of the body.
        absent : str
            The text of the error if the service may be one that does not have this call.

        Raises
        ------
        InvalidRequest
            The service reports an error of the request.
        ServiceFailed
            The service failed, or the response has another media type than `expected_type`.
        """
        media_type = response.headers.get("content-type", "").partition(";")[0]
        if response.is_success and media_type == expected_type.partition(";")[0]:
            self.headers = response.headers
            return response.content
        problem = find_problem(response)
        if problem.get("code") in _ABSENT and absent:
            raise InvalidRequest(Issue(problem["code"], absent))
        if not problem or problem["code"] in _ABSENT:
            about = f"{response.status_code} {response.url}"
            raise ServiceFailed(f"{self.url}: not a surface service ({about})")
        raise self.failure(response.status_code, problem)

    def failure(self, status: int, problem: Mapping[str, Any]) -> ServiceFailed | InvalidRequest:
        """The error that a problem document with this status reports."""
        if status in _BUSY:
            return ServiceFailed(f"{self.url} is busy: {problem['detail']}")
        if httpx.codes.is_server_error(status):
            return ServiceFailed(f"{self.url} failed: {problem['detail']}")
        if status == httpx.codes.UNAUTHORIZED:
            issue = Issue(problem["code"], problem["detail"], needed=f"a key in {KEY}")
            return InvalidRequest(issue)
        return InvalidRequest(*_issues(problem))


@contextmanager
def connect(url: str) -> Iterator[Connection]:
    """A connection for a `with` block.

    Raises
    ------
    BadAddress, ServiceFailed
        Also for errors of the connection within the block.
    """
    try:
        with httpx.Client(base_url=url, headers=_authorization()) as client:
            yield Connection(url, client)
    except (httpx.InvalidURL, httpx.UnsupportedProtocol) as error:
        raise BadAddress(f"--url: {error}") from None
    except httpx.TransportError as error:
        raise ServiceFailed(f"{url} does not answer: {type(error).__name__}") from None


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


def find_problem(response: httpx.Response) -> dict[str, Any]:
    """The problem document (RFC 9457) in a response; empty if no surface service wrote it."""
    if not response.headers.get("content-type", "").startswith("application/problem+json"):
        return {}
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
