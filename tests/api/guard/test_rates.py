"""Rate limits for keys and for addresses, and their headers."""

import re

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.callers import caller_name, caller_of
from service.api.guard.keys import format_entry, make_key
from service.api.guard.rates import MAX_CALLERS, Rates
from service.api.record import NO_ROUTE, SCOPE_ITEM, RequestRecord
from service.settings.values import Settings
from tests.clock import Clock, stop_clock
from tools.client import start_client

KEY = make_key()
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"


def test_a_caller_may_send_a_minutes_requests_at_once_and_then_one_each_second(
    clock: Clock,
) -> None:
    limiter = Rates(60)
    assert [limiter.count("a").remaining for _ in range(60)] == list(range(59, -1, -1))
    refusal = limiter.count("a")
    assert (refusal.is_allowed, refusal.remaining, refusal.reset, refusal.retry_after) == (
        False,
        0,
        60,
        1,
    )
    assert limiter.count("b").is_allowed
    clock.now += refusal.retry_after
    assert limiter.count("a").is_allowed
    assert not limiter.count("a").is_allowed
    clock.now += 60
    assert limiter.count("a").remaining == 59


def test_rounding_of_the_clock_adds_no_second(clock: Clock) -> None:
    clock.now = 8181.259782658885  # this number plus 15, less this number, is above 15
    assert Rates(4).count("a").reset == 15


@given(
    st.integers(1, 100),
    st.lists(st.sampled_from([0.0, 0.01, 0.5, 1.0, 7.0, 61.0]), min_size=1, max_size=150),
)
def test_no_more_than_twice_the_limit_passes_in_any_minute(limit: int, pauses: list[float]) -> None:
    """`limit` requests may be sent at once, and in one minute as many become allowed again.

    A refused caller may send a request after the reported time.
    """
    limiter = Rates(limit)
    allowed_times: list[float] = []
    with stop_clock() as clock:
        for pause in pauses:
            clock.now += pause
            rate = limiter.count("a")
            assert rate.is_allowed is (rate.retry_after == 0)
            assert 0 <= rate.remaining < limit
            assert 0 < rate.reset <= 60
            if not rate.is_allowed:
                clock.now += rate.retry_after
                assert limiter.count("a").is_allowed
            allowed_times.append(clock.now)
    for end in allowed_times:
        assert sum(end - 60 < time <= end for time in allowed_times) <= 2 * limit


def test_the_number_of_remembered_callers_is_limited() -> None:
    limiter = Rates(2)
    for i in range(MAX_CALLERS + 100):
        limiter.count(f"10.0.{i >> 8}.{i & 255}")
        limiter.count("frequent")
    assert len(limiter) == MAX_CALLERS
    # A caller that was forgotten would be allowed; this one was never the least recent.
    assert not limiter.count("frequent").is_allowed


@pytest.mark.parametrize(
    ("key", "client", "expected"),
    [
        ("alice", "10.0.0.1", "key alice"),
        (None, "10.0.0.1", "10.0.0.1"),
        (None, "::ffff:10.0.0.1", "10.0.0.1"),
        (None, "2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        (None, "2001:db8:1:2:ffff::", "2001:db8:1:2::"),
        (None, "fe80::1%eth0", "fe80::"),
        (None, None, "unknown"),
        (None, "testclient", "unknown"),
    ],
)
def test_requests_are_counted_by_key_or_by_address(
    key: str | None, client: str | None, expected: str
) -> None:
    assert caller_name(key, client) == expected


def test_a_request_without_a_valid_key_belongs_to_its_address() -> None:
    """The record has an empty text for it, which is not the name of a key."""
    record = RequestRecord("GET", NO_ROUTE, "1", "1", "1")
    scope = {SCOPE_ITEM: record, "client": ("10.0.0.1", 80)}
    assert caller_of(scope) == "10.0.0.1"
    record.key = "alice"
    assert caller_of(scope) == "key alice"


def read_rate(response: httpx.Response) -> tuple[int, int]:
    """Remaining requests, and seconds until more are allowed, from the headers of a response."""
    assert response.headers["ratelimit-policy"] == '"requests";q=4;w=60'
    match = re.fullmatch(r'"requests";r=(\d+);t=(\d+)', response.headers["ratelimit"])
    assert match
    return int(match[1]), int(match[2])


def test_every_response_has_the_rate_and_a_refusal_says_when_to_try_again() -> None:
    with start_client(create_app(Settings(rate_limit=4))) as client:
        first = client.get(MESH)
        assert read_rate(first) == (3, 15)
        assert read_rate(client.get(MESH))[0] == 2  # from the cache
        unchanged = client.get(MESH, {"If-None-Match": first.headers["etag"]})
        assert unchanged.status_code == 304
        assert read_rate(unchanged)[0] == 1
        assert read_rate(client.get("/nothing"))[0] == 0
        response = client.get(MESH)
        assert response.status_code == 429
        assert response.json()["code"] == "rate_limited"
        assert 1 <= int(response.headers["retry-after"]) <= 15
        assert read_rate(response)[0] == 0
        assert response.headers["cache-control"] == "no-store"
        assert response.headers["access-control-allow-origin"] == "*"
        assert "Retry-After" in response.headers["access-control-expose-headers"]


def test_health_checks_and_preflights_are_not_counted() -> None:
    with start_client(create_app(Settings(rate_limit=1))) as client:
        client.get("/v1/formats")
        for path in ("/health", "/health/live", "/health/ready"):
            response = client.get(path)
            assert response.status_code == 200
            assert "ratelimit" not in response.headers
        headers = {"Origin": "https://example.com", "Access-Control-Request-Method": "POST"}
        assert client.request("OPTIONS", "/v1/mesh", headers=headers).status_code == 204
        assert client.get("/v1/formats").status_code == 429


def test_each_name_of_keys_has_its_own_rate_and_invalid_keys_count_for_the_address() -> None:
    """An old and a new key with one name share a rate."""
    new_key = make_key()
    keys = (format_entry("alice", KEY), format_entry("alice", new_key))
    with start_client(create_app(Settings(rate_limit=4, api_keys=keys))) as client:
        for status in (401, 401, 401, 401, 429, 429):
            invalid_key = {"Authorization": f"Bearer {make_key()}"}
            assert client.post("/v1/mesh", {}, invalid_key).status_code == status
        assert client.get(MESH).status_code == 429
        for key, status in ((KEY, 200), (new_key, 200), (KEY, 200), (KEY, 200), (new_key, 429)):
            valid_key = {"Authorization": f"Bearer {key}"}
            assert client.get(MESH, valid_key).status_code == status


def test_without_a_limit_responses_have_no_rate_headers() -> None:
    with start_client(create_app(Settings(api_keys=(format_entry("alice", KEY),)))) as client:
        assert "ratelimit" not in client.get(MESH).headers


def test_computing_time_is_limited_and_cached_responses_are_not_refused() -> None:
    app = create_app(Settings(compute_limit=6, rate_limit=100))
    with start_client(app) as client:
        first = client.get(MESH)
        policy = '"requests";q=100;w=60, "compute";q=6;w=60;qu="thread-seconds"'
        assert first.headers["ratelimit-policy"] == policy
        assert re.fullmatch(
            r'"requests";r=99;t=\d+, "compute";r=[56];t=[01]', first.headers["ratelimit"]
        )
        app.state.services.threads.accounts.charge("127.0.0.1", 6.5)
        for _ in range(2):
            refusal = client.post("/v1/mesh", {"surface": {"control_net": [[[0, 0, 0]]]}})
            assert (refusal.status_code, refusal.json()["code"]) == (429, "compute_limited")
            assert 1 <= int(refusal.headers["retry-after"]) <= 6
        assert '"compute";r=0;t=' in refusal.headers["ratelimit"]
        assert client.get(MESH).status_code == 200, "it is in the cache"
        assert client.get(MESH.replace("=2", "=3")).status_code == 429
        assert client.get("/v1/surfaces/saddle").status_code == 429
        assert client.get("/v1/surfaces").status_code == 200
        assert "ratelimit" not in client.get("/health/live").headers


def test_a_limit_of_computing_time_alone_has_one_item_in_the_headers() -> None:
    app = create_app(Settings(compute_limit=6))
    with start_client(app) as client:
        response = client.post("/v1/mesh", {"surface": {"control_net": NET}, "resolution": 4})
        assert response.status_code == 200
        assert response.headers["ratelimit-policy"] == '"compute";q=6;w=60;qu="thread-seconds"'
        # Short work on the event loop is charged too.
        state = app.state.services.threads.accounts.limit.state("127.0.0.1")
        assert state.reset >= 1
