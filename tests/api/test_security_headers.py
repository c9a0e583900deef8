"""Headers that restrict how browsers may use responses."""

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tools.client import Client, start_client

MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
PAGES = ("/", "/docs")
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
            *(client.get(path) for path in (MESH, url, *PAGES, "/page/saddle.webp", "/health")),
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
