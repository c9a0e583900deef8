"""Request records: labels of routes without texts of clients, request ids and trace ids."""

from contextvars import copy_context

import pytest

from service.api.app import create_app
from service.api.observing.middleware import RequestMiddleware
from service.api.record import (
    NO_ROUTE,
    RouteLabel,
    RouteLabels,
    caller_trace_id,
    start_record,
)

HASH = "0123456789abcdef" * 4
MESH = "/v1/surfaces/{id}/mesh.{suffix}"
TRACE, SPAN = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"


@pytest.fixture(scope="module")
def labels() -> RouteLabels:
    middleware = create_app().outermost
    assert isinstance(middleware, RequestMiddleware)
    return middleware.labels


@pytest.mark.parametrize(
    ("path", "label"),
    [
        ("/v1/mesh", RouteLabel(route="/v1/mesh", path="/v1/mesh")),
        (
            f"/v1/surfaces/{HASH}",
            RouteLabel(route="/v1/surfaces/{id}", path=f"/v1/surfaces/{HASH}", surface=HASH),
        ),
        (
            "/v1/surfaces/saddle/mesh.glb",
            RouteLabel(
                route=MESH, path="/v1/surfaces/saddle/mesh.glb", surface="saddle", format="glb"
            ),
        ),
        (
            "/v1/surfaces/secret/mesh.glb",
            RouteLabel(route=MESH, path="/v1/surfaces/{id}/mesh.glb", format="glb"),
        ),
        (f"/v1/surfaces/{HASH.upper()}/mesh.exe", RouteLabel(route=MESH, path=MESH)),
        ("/v1/surfaces/a\nb", RouteLabel(route="/v1/surfaces/{id}", path="/v1/surfaces/{id}")),
        (
            "/v1/surfaces/" + "a" * 500,
            RouteLabel(route="/v1/surfaces/{id}", path="/v1/surfaces/{id}"),
        ),
        ("/v1/surfaces/", NO_ROUTE),
        ("/v1/surfaces/{id}", RouteLabel(route="/v1/surfaces/{id}", path="/v1/surfaces/{id}")),
        ("/v1/mesh/", NO_ROUTE),
        ("/etc/passwd", NO_ROUTE),
        ("", NO_ROUTE),
    ],
)
def test_labels_contain_only_known_ids_and_suffixes(
    labels: RouteLabels, path: str, label: RouteLabel
) -> None:
    assert labels.find(path) == label
    # The second label may come from a cache.
    assert labels.find(path) == label


def test_long_paths_are_not_remembered(labels: RouteLabels) -> None:
    size_before = labels._match_cached.cache_info().currsize
    labels.find("/v1/surfaces/" + "b" * 500)
    assert labels._match_cached.cache_info().currsize == size_before


def test_labels_do_not_include_the_mount_point(labels: RouteLabels) -> None:
    scope = {"method": "GET", "path": "/root/health", "root_path": "/root", "headers": []}
    assert copy_context().run(start_record, scope, labels).label.route == "/health"


@pytest.mark.parametrize(
    ("header", "trace"),
    [
        (f"00-{TRACE}-{SPAN}-00", TRACE),
        # A later version of Trace Context may append fields; version 00 has none.
        (f"cc-{TRACE}-{SPAN}-01-later", TRACE),
        (f"00-{TRACE}-{SPAN}-01-more", ""),
        (f"00-{'0' * 32}-{SPAN}-01", ""),
        ("\xff", ""),
    ],
)
def test_the_trace_id_of_the_caller_is_read_from_traceparent(header: str, trace: str) -> None:
    assert caller_trace_id(header.encode("latin-1")) == trace


@pytest.mark.parametrize("id", ["a", "0", "4bf92f35-77b3", "edge/req:1+a=@b_c.d", "x" * 128])
def test_valid_request_ids_are_used(labels: RouteLabels, id: str) -> None:
    assert choose_id(labels, id.encode()) == id


@pytest.mark.parametrize(
    "id",
    [b"", b"x" * 129, b"a b", b"a\nb", b"\x1b[31m", b'a"b', b"-a", b"\xc3\xa4", b"a\x00", b"<a>"],
)
def test_invalid_request_ids_are_replaced(labels: RouteLabels, id: bytes) -> None:
    new_id = choose_id(labels, id)
    assert len(new_id) == 32
    assert int(new_id, 16)


def test_a_repeated_request_id_is_replaced(labels: RouteLabels) -> None:
    assert len(choose_id(labels, b"a", b"b")) == 32


def test_new_ids_differ(labels: RouteLabels) -> None:
    assert len({choose_id(labels) for _ in range(1000)}) == 1000


def choose_id(labels: RouteLabels, *ids: bytes) -> str:
    """The request id of a record for a request with these headers `X-Request-Id`."""
    headers = [(b"x-request-id", id) for id in ids]
    scope = {"method": "GET", "path": "/", "headers": headers}
    return copy_context().run(start_record, scope, labels).id
