"""The lists of formats and of examples; links; parameters that calls refuse; HEAD requests."""

import pytest

from service.api.app import create_app
from service.encoders.registry import FORMATS
from service.settings.values import Settings
from service.surface.examples.catalogue import EXAMPLES
from tests.forms import PATCH
from tools.client import Client, start_client
from tools.examples import PARTS


@pytest.mark.slow
def test_examples_are_listed_with_links_that_work(client: Client) -> None:
    surfaces = client.get("/v1/surfaces").json()["surfaces"]
    assert [surface["id"] for surface in surfaces] == list(EXAMPLES)
    for surface in surfaces:
        assert client.get(surface["links"]["self"]).status_code == 200
        assert list(surface["links"]["mesh"]) == [fmt.suffix for fmt in FORMATS]
        picture = client.get(surface["links"]["image"] + "?width=20&height=20")
        assert picture.headers["content-type"] == "image/png"
        query = "?relative_tolerance=0.01" if surface["id"] in PARTS else "?resolution=1"
        mesh = client.get(surface["links"]["mesh"]["json"] + query).json()
        # The closed surfaces of some faces are continued over their seams before they are meshed.
        assert mesh["report"]["patches"] >= surface["patches"]
        assert surface["id"] in PARTS or mesh["report"]["patches"] == surface["patches"]


def test_links_begin_with_the_path_at_which_the_service_is_mounted() -> None:
    app = create_app(Settings())
    app.root_path = "/shapes"
    with start_client(app) as client:
        surfaces = client.get("/v1/surfaces").json()["surfaces"]
        assert surfaces[0]["links"]["self"] == "/shapes/v1/surfaces/utah-teapot"
        response = client.post("/v1/surfaces", {"surface": PATCH})
        links = response.json()["links"]
        pages = links["self"], links["image"], surfaces[0]["links"]["image"]
        urls = [response.headers["location"], *pages, *links["mesh"].values()]
        assert all(url.startswith("/shapes/v1/surfaces/") for url in urls)
        assert client.get(links["self"]).status_code == 200
        for _ in range(2):  # the second response is from the cache
            canonical = client.get("/v1/surfaces/saddle/mesh.glb?resolution=2").headers["link"]
            assert canonical.startswith("</shapes/v1/surfaces/saddle/mesh.glb?resolution=2&engine=")


def test_formats_are_those_of_the_registry(client: Client) -> None:
    formats = client.get("/v1/formats").json()["formats"]
    assert [(each["name"], each["media_type"], each["suffix"]) for each in formats] == [
        (fmt.name, fmt.media_type, fmt.suffix) for fmt in FORMATS
    ]


@pytest.mark.parametrize(
    ("method", "url"),
    [
        ("GET", "/v1/surfaces?page=2"),
        ("GET", "/v1/surfaces/saddle?page=2"),
        ("GET", "/v1/formats?page=2"),
        ("GET", "/metrics?name=a"),
        ("DELETE", f"/v1/surfaces/{'0' * 64}?engine=4"),
        ("POST", "/v1/mesh?resolution=2"),
        ("POST", "/v1/mesh?type=bspline"),
        ("POST", "/v1/points?format=glb"),
        ("POST", "/v1/convert?format=glb"),
        ("POST", "/v1/surfaces?engine=4"),
    ],
)
def test_unknown_parameters_of_the_query_are_refused(method: str, url: str) -> None:
    """If the body is JSON, the query may only have `format`, and only for calls with formats."""
    headers = {"Content-Type": "application/json"}
    with start_client(create_app(Settings(allow_delete=True))) as client:
        response = client.request(method, url, b'{"surface":{}}', headers)
    assert response.status_code == 422
    name = url.partition("?")[2].partition("=")[0]
    assert response.json()["errors"][0]["parameter"] == name


@pytest.mark.parametrize(
    "url",
    [
        "/health",
        "/v1/formats",
        "/v1/surfaces",
        "/v1/surfaces/saddle",
        "/v1/surfaces/saddle/mesh.glb?resolution=2",
        "/openapi.json",
    ],
)
def test_head_gives_the_headers_of_get_without_a_body(client: Client, url: str) -> None:
    get, head = client.get(url), client.request("HEAD", url)
    assert head.status_code == get.status_code == 200
    assert head.content == b""
    # `Server-Timing` is left out, because two requests take different times.
    headers = [{**response.headers, "server-timing": ""} for response in (get, head)]
    assert headers[0] == headers[1]
