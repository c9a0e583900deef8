"""Meshes by URL: canonical URLs, tags, codings, and how long caches may keep them."""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import parse_qsl

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.workers import Workers
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh.report import ENGINE
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.pipeline.mesh import encode_options, render
from service.schemas.query import canonical_query, parse_mesh_query
from service.settings.values import Settings
from service.surface.examples import find
from tests.api.client import Client, start_client
from tests.api.digests import compute_digests
from tests.decompression import decompress_gzip, decompress_zstd
from tests.programs import run_python

SADDLE = "/v1/surfaces/saddle/mesh.glb"
PLAIN = {"Accept-Encoding": "identity"}
STEP = r"{};dur=\d+\.\d+"


@pytest.fixture
def fresh() -> Iterator[Client]:
    """A client of a new service, whose cache is empty."""
    with start_client(create_app(Settings())) as client:
        yield client


def read_canonical_url(client: Client, url: str) -> str:
    link = client.get(url, PLAIN).headers["link"]
    match = re.fullmatch(r'<(\S+)>; rel="canonical"', link)
    assert match is not None
    return match[1]


@pytest.mark.parametrize(
    "query",
    [
        "resolution=4&uvs=true",
        "uvs=true&resolution=4,4",
        f"engine={ENGINE}&weld=true&uvs=true&oogl=bez&resolution=4",
        f"resolution=4&uvs=true&engine={ENGINE}",
    ],
)
def test_every_spelling_leads_to_one_address(client: Client, query: str) -> None:
    url = f"{SADDLE}?resolution=4&uvs=true&engine={ENGINE}"
    assert read_canonical_url(client, f"{SADDLE}?{query}") == url
    one, other = client.get(url), client.get(f"{SADDLE}?{query}")
    assert one.content == other.content
    assert one.headers["etag"] == other.headers["etag"]


@pytest.mark.parametrize(
    ("query", "status", "code"),
    [
        (f"engine={ENGINE}", 200, ""),
        (f"engine={ENGINE - 1}", 410, "engine_gone"),
        (f"engine={ENGINE + 1}", 410, "engine_gone"),
        *((f"engine={text}", 422, "wrong_type") for text in ("two", "", "2.0", "2,2", "9" * 17)),
        *((f"engine={number}", 422, "out_of_range") for number in (0, -1, 2**53)),
    ],
)
def test_engine_in_the_query(client: Client, query: str, status: int, code: str) -> None:
    response = client.get(f"{SADDLE}?resolution=1&{query}")
    assert response.status_code == status
    if status != 200:
        assert response.json()["errors"][0]["code"] == code
        assert response.headers["cache-control"] == "no-store"
        assert "etag" not in response.headers


def test_examples_are_kept_for_an_hour(client: Client) -> None:
    for query in ("resolution=2", f"resolution=2&engine={ENGINE}"):
        for _ in range(2):
            headers = client.get(f"{SADDLE}?{query}").headers
            assert headers["cache-control"] == "public, max-age=3600, must-revalidate"
            assert headers["vary"] == "Accept-Encoding"
            assert headers["content-disposition"] == 'inline; filename="saddle.glb"'


def test_report_headers(client: Client) -> None:
    url = "/v1/surfaces/sphere/mesh.{}?resolution=3"
    report = client.get(url.format("json")).json()["report"]
    definition = client.get("/v1/surfaces/sphere").json()
    by_url = client.get(url.format("stl"))
    posted = client.post("/v1/mesh?format=stl", {**definition, "resolution": 3})
    for headers in (by_url.headers, posted.headers):
        assert int(headers["surface-vertices"]) == report["vertices"]
        assert int(headers["surface-triangles"]) == report["triangles"]
        assert float(headers["surface-deviation-bound"]) > 0
    exact = client.get("/v1/surfaces/sphere/mesh.oogl?oogl=bez").headers
    assert not [name for name in exact if name.startswith("surface-")]


def test_server_timing_names_steps_and_hits(fresh: Client) -> None:
    first = fresh.get(SADDLE).headers["server-timing"]
    steps = ("surface", "mesh", "compress")
    assert re.fullmatch(", ".join(["cache;desc=miss", *map(STEP.format, steps)]), first)
    assert fresh.get(SADDLE).headers["server-timing"] == "cache;desc=hit"
    posted = fresh.post("/v1/mesh", fresh.get("/v1/surfaces/saddle").json())
    timing = posted.headers["server-timing"]
    assert re.fullmatch(", ".join(map(STEP.format, ("read", "parse", "mesh"))), timing)


def test_codings_hold_the_same_bytes_and_have_tags_of_their_own(fresh: Client) -> None:
    url = "/v1/surfaces/utah-teapot/mesh.json?resolution=8"
    expected = render(find("utah-teapot").surface(), MeshOptions((8, 8)), BY_NAME["json"])
    tags = set()
    decoders: dict[str, Callable[[bytes], bytes]] = {
        "identity": bytes,
        "gzip": decompress_gzip,
        "zstd": decompress_zstd,
    }
    for coding, decoded in decoders.items():
        for _ in range(2):
            response = fresh.raw(url, {"Accept-Encoding": coding})
            assert response.headers.get("content-encoding", "identity") == coding
            assert decoded(response.content) == expected
            assert response.headers["content-length"] == str(len(response.content))
        assert (len(response.content) < len(expected) / 3) == (coding != "identity")
        tags.add(response.headers["etag"])
    assert len(tags) == 3


def test_small_bodies_are_sent_as_they_are_unless_that_is_refused(fresh: Client) -> None:
    url = "/v1/surfaces/saddle/mesh.off?resolution=1"
    for _ in range(2):
        response = fresh.raw(url, {"Accept-Encoding": "gzip, zstd"})
        assert "content-encoding" not in response.headers
    forced = fresh.raw(url, {"Accept-Encoding": "gzip, identity;q=0"})
    assert forced.headers["content-encoding"] == "gzip"
    assert decompress_gzip(forced.content) == response.content
    again = fresh.raw(url, {"Accept-Encoding": "gzip, zstd"})
    assert "content-encoding" not in again.headers


def test_responses_are_not_compressed_if_that_waits_for_memory(
    fresh: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, coded = "/v1/surfaces/torus/mesh.json?resolution=8", {"Accept-Encoding": "gzip"}
    with monkeypatch.context() as full:
        full.setattr(Workers, "waiting", 1)
        plain = fresh.raw(url, coded)
        assert "content-encoding" not in plain.headers
        forced = fresh.raw(url, {"Accept-Encoding": "gzip, identity;q=0"})
        assert decompress_gzip(forced.content) == plain.content, "who takes nothing else waits"
    assert fresh.raw(url, coded).headers["content-encoding"] == "gzip"


def test_excluded_codings_are_a_problem(client: Client) -> None:
    response = client.get(SADDLE, {"Accept-Encoding": "br, *;q=0"})
    assert response.status_code == 406
    assert response.json()["errors"][0]["header"] == "Accept-Encoding"


@pytest.mark.parametrize("coding", ["identity", "gzip", "zstd"])
@pytest.mark.parametrize("is_unchanged", [False, True])
def test_an_unchanged_mesh_is_not_sent_again(coding: str, is_unchanged: bool) -> None:
    url = f"/v1/surfaces/sphere/mesh.json?resolution=6&engine={ENGINE}"
    headers = {"Accept-Encoding": coding}
    with start_client(create_app(Settings())) as client:
        first = client.raw(url, headers)
    app = create_app(Settings())
    with start_client(app) as client:
        if is_unchanged:
            client.raw(url, headers)
        tag = first.headers["etag"]
        for condition in (tag, f"W/{tag}", f'"other", {tag}'):
            response = client.raw(url, {**headers, "If-None-Match": condition})
            assert response.status_code == 304
            assert response.content == b""
            for name in ("etag", "cache-control", "vary"):
                assert response.headers[name] == first.headers[name]
            assert response.headers["server-timing"] == "cache;desc=hit"
            assert response.headers["access-control-allow-origin"] == "*"
            assert "content-length" not in response.headers
        assert len(app.state.services.cache) == is_unchanged, "answered without computing"
        changed = client.raw(url, {**headers, "If-None-Match": '"other"'})
        assert changed.status_code == 200
        other = client.raw(f"{url}&uvs=true", {**headers, "If-None-Match": tag})
        assert other.status_code == 200


def test_a_tag_of_a_coding_that_is_not_accepted_does_not_count(client: Client) -> None:
    url = "/v1/surfaces/sphere/mesh.json?resolution=6"
    tag = client.raw(url, {"Accept-Encoding": "zstd"}).headers["etag"]
    for _ in range(2):
        response = client.raw(url, {"Accept-Encoding": "gzip", "If-None-Match": tag})
        assert response.status_code == 200


def test_conditions_do_not_hide_errors(fresh: Client) -> None:
    condition = {"If-None-Match": "*"}
    assert fresh.get("/v1/surfaces/none/mesh.glb", condition).status_code == 404
    assert fresh.get(f"{SADDLE}?resolution=0", condition).status_code == 422
    assert fresh.get(f"{SADDLE}?resolution=9999", condition).status_code == 422


def test_head_computes_and_fills_the_cache(fresh: Client) -> None:
    head = fresh.request("HEAD", SADDLE)
    assert (head.status_code, head.content) == (200, b"")
    get = fresh.get(SADDLE)
    assert get.headers["server-timing"] == "cache;desc=hit"
    assert get.headers["content-length"] == head.headers["content-length"]
    again = fresh.request("HEAD", SADDLE)
    assert again.content == b""
    assert again.headers == get.headers


def test_nothing_is_kept_where_there_is_no_memory_for_it() -> None:
    app = create_app(Settings(cache_bytes=0))
    with start_client(app) as client:
        one, two = client.get(SADDLE), client.get(SADDLE)
    assert one.content == two.content
    assert two.headers["server-timing"].startswith("cache;desc=miss")
    assert (len(app.state.services.cache), app.state.services.cache.bytes) == (0, 0)
    assert app.state.services.cache.counts.misses == 2


def test_long_responses_are_sent_completely_from_the_cache(client: Client) -> None:
    url = "/v1/surfaces/saddle/mesh.glb?resolution=300"
    expected = render(find("saddle").surface(), MeshOptions((300, 300)), BY_NAME["glb"])
    assert len(expected) > 2 << 20
    for _ in range(2):
        response = client.raw(url, PLAIN)
        assert response.content == expected
    assert response.headers["server-timing"] == "cache;desc=hit"


def test_ranges_are_not_read(client: Client) -> None:
    """A request for a range gets the whole body with status 200, as RFC 9110 allows."""
    whole = client.raw(SADDLE, PLAIN)
    part = client.raw(SADDLE, {**PLAIN, "Range": "bytes=0-3", "If-Range": whole.headers["etag"]})
    assert (part.status_code, part.content) == (200, whole.content)
    assert "content-range" not in part.headers


OPTIONS = {
    "resolution": ["1", "2,3", "16"],
    "faces": ["quads", "none"],
    "normals": ["false"],
    "uvs": ["true"],
    "weld": ["false"],
    "crease_angle": ["0", "-0.0", "0.50"],
    "weld_tolerance": ["0", "1e-9"],
    "overlays": ["control_net", "boundary,control_net", "control_net,boundary"],
    "isocurves": ["2", "1,2"],
    "wires": ["tubes", "ribbons"],
    "oogl": ["off", "mesh", "bez"],
    "relative_tolerance": ["0.10", "1e-1"],
    "two_sided": ["true", "false"],
    "quantize": ["true"],
    "curvatures": ["true"],
}


@given(
    st.fixed_dictionaries({}, optional={k: st.sampled_from(v) for k, v in OPTIONS.items()}),
    st.sampled_from(FORMATS),
)
def test_the_canonical_address_stands_for_the_same_bytes(
    options: dict[str, str], fmt: Format
) -> None:
    try:
        parsed = parse_mesh_query(options.items())
        surface = find("saddle").surface()
        written = render(surface, parsed.mesh_options(), fmt, encode_options(parsed))
    except SurfaceError:
        return
    query = canonical_query(parsed, fmt.ignored)
    again = parse_mesh_query(parse_qsl(query))
    assert render(surface, again.mesh_options(), fmt, encode_options(again)) == written


def test_another_process_makes_the_same_bytes() -> None:
    """The bytes do not depend on the seed of hashes, hence not on the order of a set."""
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    root = Path(__file__).parents[2]
    other = run_python("-m", "tests.api.digests", env=environment, cwd=root)
    assert other.stdout.splitlines() == compute_digests()
