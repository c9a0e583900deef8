"""The service believes the `X-Forwarded-…` headers of trusted proxies only."""

from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.guard.proxies import Proxies, parse_address
from service.errors import InvalidSettings
from service.settings.values import Settings
from tools.client import start_client

PROXY, EDGE, CLIENT = "10.0.0.1", "10.1.2.3", "203.0.113.7"
TRUSTED = ("10.0.0.0/8", "fd00::/8")


def find_client(
    *lines: str,
    peer: tuple[str, int] | None = (PROXY, 4711),
    trusted: Sequence[str] = TRUSTED,
    proto: Sequence[str] = (),
) -> tuple[str | None, str]:
    """The address of the client and the scheme, for a connection from `peer` with these headers.

    `lines` are headers `X-Forwarded-For`, `proto` are headers `X-Forwarded-Proto`.
    """
    headers = [(b"x-forwarded-for", line.encode("latin-1")) for line in lines]
    headers += [(b"x-forwarded-proto", value.encode()) for value in proto]
    scope: dict[str, Any] = {"client": peer, "scheme": "http", "headers": headers}
    Proxies(trusted).set_client(scope)
    client = scope["client"]
    return (client[0] if client else None), scope["scheme"]


@pytest.mark.parametrize(
    ("lines", "client"),
    [
        ([], PROXY),
        ([CLIENT], CLIENT),
        ([f"{CLIENT}, {EDGE}"], CLIENT),
        ([f"198.51.100.9, {CLIENT}, {EDGE}"], CLIENT),
        ([f"198.51.100.9, {CLIENT}", EDGE], CLIENT),
        ([f"{EDGE},{EDGE}"], EDGE),
        ([f"{CLIENT}:50000"], CLIENT),
        (["[2001:db8::7]:50000"], "2001:db8::7"),
        (["[2001:db8::7]"], "2001:db8::7"),
        (["2001:db8::7, fd00::1"], "2001:db8::7"),
        (['fe80::7%" 200'], "fe80::7"),  # without its zone, in which a client may write anything
        ([f"::ffff:{CLIENT}"], CLIENT),
        ([f"{CLIENT}, unknown"], PROXY),
        ([f"{CLIENT}, unknown, {EDGE}"], EDGE),
        ([f"{CLIENT}, "], PROXY),
        (["<script>"], PROXY),
        (["\xe9"], PROXY),
        (["10.0.0.256"], PROXY),
        (["," * 50_000], PROXY),
        ([CLIENT + f",{EDGE}" * 5_000], EDGE),  # the service follows at most 32 proxies
    ],
)
def test_the_client_is_the_farthest_address_that_trusted_proxies_saw(
    lines: list[str], client: str
) -> None:
    assert find_client(*lines)[0] == client


@pytest.mark.parametrize("peer", [CLIENT, "11.0.0.1", "::ffff:203.0.113.7", "testclient", "::1"])
def test_headers_of_other_peers_are_ignored(peer: str) -> None:
    result = find_client("198.51.100.9", peer=(peer, 1), proto=["https"])
    assert result == (peer, "http")


@given(st.lists(st.text("0123456789.:[], abcdef\x00", max_size=30), max_size=3))
def test_addresses_that_a_client_writes_are_not_trusted(
    forged_lines: list[str],
) -> None:
    """The proxy appends the address of its client, to the same line or in another line."""
    assert find_client(*forged_lines, CLIENT)[0] == CLIENT
    if forged_lines:
        assert find_client(*forged_lines[:-1], f"{forged_lines[-1]}, {CLIENT}")[0] == CLIENT


def test_an_ipv4_address_in_ipv6_form_is_trusted() -> None:
    assert find_client(CLIENT, peer=("::ffff:10.0.0.1", 1))[0] == CLIENT


def test_unix_sockets_are_trusted_by_their_name() -> None:
    assert find_client(CLIENT, peer=None)[0] is None
    assert find_client(CLIENT, peer=None, trusted=["unix"])[0] == CLIENT
    assert find_client(peer=None, trusted=["unix"])[0] is None
    assert find_client(CLIENT, peer=("203.0.113.1", 1), trusted=["unix"])[0] == "203.0.113.1"


@pytest.mark.parametrize(
    ("lines", "scheme"),
    [
        (["https"], "https"),
        (["HTTPS"], "https"),
        (["http"], "http"),
        (["http, https"], "https"),
        (["https", "http"], "http"),
        (["ftp"], "http"),
        ([""], "http"),
    ],
)
def test_the_scheme_is_that_of_the_nearest_proxy(lines: list[str], scheme: str) -> None:
    assert find_client(CLIENT, proto=lines)[1] == scheme


@pytest.mark.parametrize("text", ["", "1.2.3", "1.2.3.4.5", "fe80::1%", "[", "[]", ":80", "a:b"])
def test_texts_that_are_not_addresses_are_ignored(text: str) -> None:
    assert parse_address(text.encode()) is None


@pytest.mark.parametrize("trusted", [["proxy.local"], ["10.0.0.1/8"], ["*"], ["10.0.0.0/33"]])
def test_invalid_proxies_are_refused_at_the_start(trusted: list[str]) -> None:
    with pytest.raises(InvalidSettings, match=r"^SURFACE_TRUSTED_PROXIES: needed addresses"):
        create_app(Settings(trusted_proxies=tuple(trusted)))


def test_forged_addresses_do_not_avoid_the_rate_limit() -> None:
    """The test client has the address 127.0.0.1; only in the last case it is a trusted proxy."""
    for proxies, status in (((), 429), (("192.0.2.1",), 429), (("127.0.0.1",), 200)):
        settings = Settings(rate_limit=1, trusted_proxies=proxies)
        with start_client(create_app(settings)) as client:
            client.get("/v1/formats", {"X-Forwarded-For": "198.51.100.1"})
            response = client.get("/v1/formats", {"X-Forwarded-For": "198.51.100.2"})
            assert response.status_code == status
            refusal = client.get("/v1/formats", {"X-Forwarded-For": "1.1.1.1, 198.51.100.1"})
            assert refusal.status_code == 429


def test_responses_have_strict_transport_security_if_a_proxy_reports_https() -> None:
    https_header = {"X-Forwarded-Proto": "https"}
    with start_client(create_app(Settings(trusted_proxies=("127.0.0.1",)))) as client:
        for path in ("/v1/formats", "/docs", "/nothing"):
            response = client.get(path, https_header)
            assert response.headers["strict-transport-security"] == "max-age=31536000"
            assert "strict-transport-security" not in client.get(path).headers
    with start_client(create_app(Settings())) as client:
        assert "strict-transport-security" not in client.get("/v1/formats", https_header).headers
