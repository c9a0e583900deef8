"""Pictures by POST and by URL: options, errors, caching, signatures and files."""

import subprocess
import sys
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pydantic import SecretStr

from service.api.app import create_app
from service.api.guard.keys import format_entry, make_key
from service.engine.mesh.mesh import ENGINE
from service.settings.values import Settings
from tests.cad import TETRAHEDRON
from tools.client import Client, start_client

SADDLE = "/v1/surfaces/saddle/image.png"
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
SMALL = {"width": 40, "height": 30}


def read_pixels(content: bytes) -> np.ndarray:
    """The pixels of a picture as Pillow reads it, (height, width, 4)."""
    with Image.open(BytesIO(content)) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGBA"))


def test_a_picture_by_url_is_that_of_the_same_options_by_post(client: Client) -> None:
    options = SMALL | {"azimuth": 10.5, "position": [3, 2, 5], "target": [0, 0, 0]}
    query = "width=40&height=30&azimuth=10.5&position=3,2,5&target=0,0,0"
    surface = client.get("/v1/surfaces/saddle").json()["surface"]
    posted = client.post("/v1/image", options | {"surface": surface})
    by_url = client.get(f"{SADDLE}?{query}")
    assert posted.status_code == by_url.status_code == 200
    assert posted.headers["content-type"] == by_url.headers["content-type"] == "image/png"
    assert posted.content == by_url.content
    pixels = read_pixels(posted.content)
    assert pixels.shape == (30, 40, 4)
    assert 0.05 < (pixels[..., 3] > 0).mean() < 0.9


def test_the_url_of_a_picture_is_canonical_and_cached(client: Client) -> None:
    query = "background=%23ffffff&height=30&look=shaded&width=40&target=0,1,0&position=3,4,9.0"
    first = client.get(f"{SADDLE}?{query}")
    canonical = (
        f"{SADDLE}?width=40&height=30&position=3,4,9&target=0,1,0&background=ffffff&engine={ENGINE}"
    )
    assert first.headers["link"] == f'<{canonical}>; rel="canonical"'
    assert "content-encoding" not in first.headers
    again = client.get(canonical)
    assert again.content == first.content
    assert again.headers["etag"] == first.headers["etag"]
    assert again.headers["server-timing"] == "cache;desc=hit"
    unchanged = client.get(canonical, {"If-None-Match": first.headers["etag"]})
    assert (unchanged.status_code, unchanged.content) == (304, b"")
    stored = client.post("/v1/surfaces", {"surface": {"control_net": NET}}).json()["id"]
    permanent = client.get(f"/v1/surfaces/{stored}/image.png?width=20&engine={ENGINE}")
    assert "immutable" in permanent.headers["cache-control"]
    assert client.get(f"{SADDLE}?engine={ENGINE + 1}").status_code == 410


def test_pictures_are_the_same_bytes_in_another_process(client: Client) -> None:
    code = (
        "import sys; from service.engine.pictures.options import *;"
        "from service.pipeline.picture import plan_picture;"
        "from service.surface.examples.catalogue import find;"
        "options = PictureOptions(Viewpoint(60, 50));"
        "sys.stdout.buffer.write(plan_picture(find('pipe-tee').surface(), options).run())"
    )
    by_url = client.get("/v1/surfaces/pipe-tee/image.png?width=60&height=50")
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert process.stdout == by_url.content


@pytest.mark.parametrize(
    ("changes", "code", "pointer"),
    [
        ({"width": 0}, "out_of_range", "/width"),
        ({"height": 2049}, "out_of_range", "/height"),
        ({"azimuth": 361}, "out_of_range", "/azimuth"),
        ({"elevation": -91}, "out_of_range", "/elevation"),
        ({"zoom": 0}, "out_of_range", "/zoom"),
        ({"field_of_view": 3.2}, "out_of_range", "/field_of_view"),
        ({"background": "#FFFFFF"}, "wrong_value", "/background"),
        ({"look": "wire"}, "wrong_value", "/look"),
        ({"position": [1, 2, 3]}, "missing_field", "/target"),
        ({"target": [1, 2, 3]}, "missing_field", "/position"),
        ({"position": [1, 2, 3], "target": [1, 2, 3]}, "out_of_range", "/target"),
        ({"position": [1, 2], "target": [1, 2, 3]}, "wrong_dimension", "/position"),
        ({"resolution": 3}, "unknown_field", "/resolution"),
        # The corner of the patch.
        ({"position": [0, 0, 0], "target": [1, 0, 1]}, "camera_on_surface", "/position"),
    ],
)
def test_errors_name_the_option(
    client: Client, changes: dict[str, Any], code: str, pointer: str
) -> None:
    response = client.post("/v1/image", {"surface": {"control_net": NET}} | SMALL | changes)
    assert response.status_code == 422, response.text
    issue = response.json()["errors"][0]
    assert (issue["code"], issue["pointer"]) == (code, pointer)


@pytest.mark.parametrize(
    ("path", "parameter", "needed"),
    [
        ("trefoil-tube/image.png?look=mean", "look", "a surface of patches"),
        ("trefoil-tube/image.png?isocurves=2", "isocurves", "no isoparametric curves"),
        ("gear/image.png?control_net=true", "control_net", "`edges`"),
        ("gear/image.png?isocurves=2", "isocurves", "`edges`"),
    ],
)
def test_errors_about_the_mesh_name_the_option_of_the_picture(
    client: Client, path: str, parameter: str, needed: str
) -> None:
    response = client.get(f"/v1/surfaces/{path}")
    assert response.status_code == 422, response.text
    issue = response.json()["errors"][0]
    assert issue["parameter"] == parameter
    assert issue["needed"].startswith(needed)


def test_all_looks_and_lines_differ(client: Client) -> None:
    contents = set()
    for query in (
        "", "look=gaussian", "look=mean", "edges=true", "isocurves=4", "isocurves=0,3",
        "control_net=true", "orthographic=true", "zoom=2", "elevation=-40",
    ):  # fmt: skip
        response = client.get(f"{SADDLE}?width=40&height=30&{query}")
        assert response.status_code == 200, response.text
        contents.add(response.content)
    assert len(contents) == 10


def test_a_file_as_the_body_has_a_picture(client: Client) -> None:
    headers = {"Content-Type": "model/step"}
    response = client.request("POST", "/v1/image?width=32&height=32", TETRAHEDRON, headers)
    assert response.status_code == 200, response.text
    assert "surface-reading" in response.headers
    assert (read_pixels(response.content)[..., 3] > 0).mean() > 0.1


def test_a_signed_url_of_a_picture_needs_no_key() -> None:
    key, secret = make_key(), SecretStr("0123456789abcdef" * 2)
    settings = Settings(
        api_keys=(format_entry("alice", key),), public_reads=False, signing_keys=(secret,)
    )
    with start_client(create_app(settings)) as client:
        url = f"{SADDLE}?width=20&height=20"
        assert client.get(url).status_code == 401
        headers = {"Authorization": f"Bearer {key}"}
        signed = client.post("/v1/sign", {"url": url, "seconds": 600}, headers).json()["url"]
        response = client.get(signed)
        assert response.status_code == 200
        assert response.headers["cache-control"].startswith("private")
        assert client.get(signed.replace("width=20", "width=21")).status_code == 403
