"""Headers that restrict how browsers may use responses."""

import pytest

from service.api.app import create_app
from service.errors import InvalidSettings
from service.settings.values import Settings
from tools.client import Client, start_client

MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
PAGES = ("/", "/docs", "/embed")
NET = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}


@pytest.mark.parametrize(
    ("origins", "policy"),
    [(("*",), "cross-origin"), (("https://example.com",), "same-origin"), ((), "same-origin")],
)
def test_every_response_forbids_sniffing_and_says_who_may_embed_it(
    origins: tuple[str, ...], policy: str
) -> None:
    """Also responses from the cache, unchanged ones, pages and their files, and problems."""
    with start_client(create_app(Settings(cors_origins=origins, allow_delete=True))) as client:
        url = client.post("/v1/surfaces", NET).headers["location"]
        tags = {path: client.get(path).headers["etag"] for path in (MESH, url, "/docs/start.js")}
        responses = [
            *(client.get(path) for path in (MESH, url, *PAGES, "/health")),
            *(client.get(path, {"If-None-Match": tag}) for path, tag in tags.items()),
            client.post("/v1/mesh", NET),
            client.post("/v1/mesh", []),
            client.request("DELETE", url),
            *(client.get(path) for path in ("/nothing", "/v1/mesh", "/v1/surfaces/none")),
        ]
    assert {response.status_code for response in responses} >= {200, 204, 304, 404, 405, 422}
    for response in responses:
        assert response.headers.get_list("x-content-type-options") == ["nosniff"]
        assert response.headers.get_list("cross-origin-resource-policy") == [policy]


@pytest.mark.parametrize("path", PAGES)
def test_pages_forbid_frames_openers_and_devices(client: Client, path: str) -> None:
    headers = client.get(path).headers
    assert headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-opener-policy"] == "same-origin"
    assert "camera=()" in headers["permissions-policy"]


def test_only_the_embedded_view_names_the_origins_that_may_frame_it() -> None:
    origins = ("https://a.example", "http://localhost:8080")
    with start_client(create_app(Settings(frame_ancestors=origins))) as client:
        headers = {path: client.get(path).headers for path in PAGES}
    policy = headers["/embed"]["content-security-policy"]
    assert policy.endswith("; frame-ancestors https://a.example http://localhost:8080")
    assert "connect-src 'self'" in policy
    # This older header cannot name an origin, and would forbid all.
    assert "x-frame-options" not in headers["/embed"]
    for path in ("/", "/docs"):
        assert headers[path]["x-frame-options"] == "DENY"
        assert "frame-ancestors 'none'" in headers[path]["content-security-policy"]


@pytest.mark.parametrize(
    "text",
    [
        *("*", "'self'", "null", "a.example", "https://a.example/", "https://A.example"),
        *("https://a.example:443", "https://*.a.example", "https://a.example b"),
        "https://a.example; script-src *",
    ],
)
def test_a_frame_ancestor_that_is_no_origin_is_an_error_at_the_start(text: str) -> None:
    with pytest.raises(InvalidSettings, match=r"SURFACE_FRAME_ANCESTORS: got .*, needed an origin"):
        create_app(Settings(frame_ancestors=("https://b.example", text)))


def test_robots_read_no_meshes_and_the_icon_exists(client: Client) -> None:
    robots = client.get("/robots.txt")
    assert robots.headers["content-type"].startswith("text/plain")
    assert "Disallow: /v1/\n" in robots.text
    # Previews of links need pictures, and the page that names them.
    assert "Allow: /v1/surfaces/*/image.png\n" in robots.text
    assert "/embed" not in robots.text
    icon = client.get("/favicon.ico")
    assert icon.status_code == 200
    assert icon.headers["content-type"] == "image/svg+xml"
