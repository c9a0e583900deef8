"""Meshes by URL: canonical URLs, entity tags, content codings, and headers for caches.

Many tests repeat a request, because the last response then comes from the service's cache.
"""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import parse_qsl

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.responses import CHUNK
from service.api.threads import Threads
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh.mesh import ENGINE
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.pipeline.mesh import render, select_encode_options
from service.schemas.query import canonical_query, parse_mesh_query
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from tests.api.digests import compute_digests
from tests.decompression import decompress_gzip, decompress_zstd
from tools.client import Client, start_client
from tools.programs import run_python

SADDLE = "/v1/surfaces/saddle/mesh.glb"
PLAIN = {"Accept-Encoding": "identity"}
TIMING = r"{};dur=\d+\.\d+"
"""Pattern of a step in `Server-Timing`; its name replaces `{}`."""


@pytest.fixture
def fresh_client() -> Iterator[Client]:
    """A client of a new service, whose cache is empty."""
    with start_client(create_app(Settings())) as client:
        yield client


def read_canonical_url(client: Client, url: str) -> str:
    """The canonical URL in the header `Link` of the response to a GET of this URL."""
    link = client.get(url, PLAIN).headers["link"]
    match = re.fullmatch(r'<(\S+)>; rel="canonical"', link)
    assert match is not None
    return match[1]


@pytest.mark.parametrize(
    "query",
    [
        "resolution=4&uvs=true",
        "uvs=true&resolution=4,4",
        # GLB ignores `oogl`, and `weld=true` is the default: the canonical URL has neither.
        f"engine={ENGINE}&weld=true&uvs=true&oogl=bez&resolution=4",
        f"resolution=4&uvs=true&engine={ENGINE}",
    ],
)
def test_all_spellings_of_a_query_have_one_canonical_url(client: Client, query: str) -> None:
    url = f"{SADDLE}?resolution=4&uvs=true&engine={ENGINE}"
    assert read_canonical_url(client, f"{SADDLE}?{query}") == url
    canonical_response, response = client.get(url), client.get(f"{SADDLE}?{query}")
    assert canonical_response.content == response.content
    assert canonical_response.headers["etag"] == response.headers["etag"]


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
def test_only_the_current_engine_is_accepted_in_the_query(
    client: Client, query: str, status: int, code: str
) -> None:
    response = client.get(f"{SADDLE}?resolution=1&{query}")
    assert response.status_code == status
    if status != 200:
        assert response.json()["errors"][0]["code"] == code
        assert response.headers["cache-control"] == "no-store"
        assert "etag" not in response.headers


def test_caches_may_keep_meshes_of_examples_for_an_hour(client: Client) -> None:
    for query in ("resolution=2", f"resolution=2&engine={ENGINE}"):
        for _ in range(2):
            headers = client.get(f"{SADDLE}?{query}").headers
            assert headers["cache-control"] == "public, max-age=3600, must-revalidate"
            assert headers["vary"] == "Accept-Encoding"
            assert headers["content-disposition"] == 'inline; filename="saddle.glb"'


def test_headers_have_the_counts_and_the_bound_of_the_report(client: Client) -> None:
    url = "/v1/surfaces/sphere/mesh.{}?resolution=3"
    report = client.get(url.format("json")).json()["report"]
    definition = client.get("/v1/surfaces/sphere").json()
    by_url = client.get(url.format("stl"))
    by_body = client.post("/v1/mesh?format=stl", {**definition, "resolution": 3})
    for headers in (by_url.headers, by_body.headers):
        assert int(headers["surface-vertices"]) == report["vertices"]
        assert int(headers["surface-triangles"]) == report["triangles"]
        assert float(headers["surface-deviation-bound"]) > 0
    # A file of Bézier patches has no mesh, and so no report.
    headers_of_patches = client.get("/v1/surfaces/sphere/mesh.oogl?oogl=bez").headers
    assert not [name for name in headers_of_patches if name.startswith("surface-")]


def test_server_timing_names_steps_and_hits(fresh_client: Client) -> None:
    timing_of_miss = fresh_client.get(SADDLE).headers["server-timing"]
    steps = ("surface", "mesh", "compress")
    assert re.fullmatch(", ".join(["cache;desc=miss", *map(TIMING.format, steps)]), timing_of_miss)
    assert fresh_client.get(SADDLE).headers["server-timing"] == "cache;desc=hit"
    document = fresh_client.get("/v1/surfaces/saddle").json()
    response = fresh_client.post("/v1/mesh", document, {"Accept-Encoding": "identity"})
    timing_of_post = response.headers["server-timing"]
    assert re.fullmatch(", ".join(map(TIMING.format, ("read", "parse", "mesh"))), timing_of_post)


def test_codings_decode_to_the_same_bytes_and_have_different_tags(fresh_client: Client) -> None:
    url = "/v1/surfaces/utah-teapot/mesh.json?resolution=8"
    expected = render(find("utah-teapot").surface(), MeshOptions((8, 8)), BY_NAME["json"])
    tags = set()
    decoders: dict[str, Callable[[bytes], bytes]] = {
        "identity": bytes,
        "gzip": decompress_gzip,
        "zstd": decompress_zstd,
    }
    for coding, decode in decoders.items():
        for _ in range(2):
            response = fresh_client.get_raw(url, {"Accept-Encoding": coding})
            assert response.headers.get("content-encoding", "identity") == coding
            assert decode(response.content) == expected
            assert response.headers["content-length"] == str(len(response.content))
        assert (len(response.content) < len(expected) / 3) == (coding != "identity")
        tags.add(response.headers["etag"])
    assert len(tags) == 3


def test_small_bodies_are_compressed_only_if_the_client_refuses_identity(
    fresh_client: Client,
) -> None:
    url = "/v1/surfaces/saddle/mesh.off?resolution=1"
    for _ in range(2):
        response = fresh_client.get_raw(url, {"Accept-Encoding": "gzip, zstd"})
        assert "content-encoding" not in response.headers
    compressed_response = fresh_client.get_raw(url, {"Accept-Encoding": "gzip, identity;q=0"})
    assert compressed_response.headers["content-encoding"] == "gzip"
    assert decompress_gzip(compressed_response.content) == response.content
    # The compressed body is now in the cache; clients that accept a plain one still get that.
    last_response = fresh_client.get_raw(url, {"Accept-Encoding": "gzip, zstd"})
    assert "content-encoding" not in last_response.headers


def test_responses_are_not_compressed_while_requests_wait_for_memory(
    fresh_client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, accept_gzip = "/v1/surfaces/torus/mesh.json?resolution=8", {"Accept-Encoding": "gzip"}
    with monkeypatch.context() as patch:
        patch.setattr(Threads, "queue_length", 1)
        plain_response = fresh_client.get_raw(url, accept_gzip)
        assert "content-encoding" not in plain_response.headers
        compressed_response = fresh_client.get_raw(url, {"Accept-Encoding": "gzip, identity;q=0"})
        # A client that accepts only gzip gets it all the same.
        assert decompress_gzip(compressed_response.content) == plain_response.content
    assert fresh_client.get_raw(url, accept_gzip).headers["content-encoding"] == "gzip"


def test_a_request_that_excludes_all_codings_is_refused(client: Client) -> None:
    response = client.get(SADDLE, {"Accept-Encoding": "br, *;q=0"})
    assert response.status_code == 406
    assert response.json()["errors"][0]["header"] == "Accept-Encoding"


@pytest.mark.parametrize("coding", ["identity", "gzip", "zstd"])
@pytest.mark.parametrize("is_cached", [False, True])
def test_an_unchanged_mesh_is_not_sent_again(coding: str, is_cached: bool) -> None:
    url = f"/v1/surfaces/sphere/mesh.json?resolution=6&engine={ENGINE}"
    headers = {"Accept-Encoding": coding}
    with start_client(create_app(Settings())) as client:
        first = client.get_raw(url, headers)
    # Another instance: its cache has the mesh only if `is_cached`.
    app = create_app(Settings())
    with start_client(app) as client:
        if is_cached:
            client.get_raw(url, headers)
        tag = first.headers["etag"]
        for condition in (tag, f"W/{tag}", f'"other", {tag}'):
            response = client.get_raw(url, {**headers, "If-None-Match": condition})
            assert response.status_code == 304
            assert response.content == b""
            for name in ("etag", "cache-control", "vary"):
                assert response.headers[name] == first.headers[name]
            # A 304 counts as a hit, even with an empty cache.
            assert response.headers["server-timing"] == "cache;desc=hit"
            assert response.headers["access-control-allow-origin"] == "*"
            assert "content-length" not in response.headers
        assert len(app.state.services.cache) == is_cached, "a 304 needs no computation"
        response_to_other_tag = client.get_raw(url, {**headers, "If-None-Match": '"other"'})
        assert response_to_other_tag.status_code == 200
        response_of_other_url = client.get_raw(f"{url}&uvs=true", {**headers, "If-None-Match": tag})
        assert response_of_other_url.status_code == 200


def test_a_tag_of_a_coding_that_the_client_does_not_accept_gives_no_304(client: Client) -> None:
    url = "/v1/surfaces/sphere/mesh.json?resolution=6"
    tag = client.get_raw(url, {"Accept-Encoding": "zstd"}).headers["etag"]
    for _ in range(2):
        response = client.get_raw(url, {"Accept-Encoding": "gzip", "If-None-Match": tag})
        assert response.status_code == 200


def test_a_condition_does_not_turn_an_error_into_304(fresh_client: Client) -> None:
    condition = {"If-None-Match": "*"}
    assert fresh_client.get("/v1/surfaces/none/mesh.glb", condition).status_code == 404
    assert fresh_client.get(f"{SADDLE}?resolution=0", condition).status_code == 422
    assert fresh_client.get(f"{SADDLE}?resolution=9999", condition).status_code == 422


def test_head_computes_the_mesh_and_caches_it(fresh_client: Client) -> None:
    head = fresh_client.request("HEAD", SADDLE)
    assert (head.status_code, head.content) == (200, b"")
    get = fresh_client.get(SADDLE)
    assert get.headers["server-timing"] == "cache;desc=hit"
    assert get.headers["content-length"] == head.headers["content-length"]
    second_head = fresh_client.request("HEAD", SADDLE)
    assert second_head.content == b""
    assert second_head.headers == get.headers


def test_without_memory_for_the_cache_every_request_computes() -> None:
    app = create_app(Settings(cache_bytes=0))
    with start_client(app) as client:
        first, second = client.get(SADDLE), client.get(SADDLE)
    assert first.content == second.content
    assert second.headers["server-timing"].startswith("cache;desc=miss")
    assert (len(app.state.services.cache), app.state.services.cache.bytes) == (0, 0)
    assert app.state.services.cache.misses == 2


def test_long_responses_are_sent_completely_from_the_cache(client: Client) -> None:
    url = "/v1/surfaces/saddle/mesh.glb?resolution=300"
    expected = render(find("saddle").surface(), MeshOptions((300, 300)), BY_NAME["glb"])
    assert len(expected) > 4 * CHUNK
    for _ in range(2):
        response = client.get_raw(url, PLAIN)
        assert response.content == expected
    assert response.headers["server-timing"] == "cache;desc=hit"


def test_requests_for_a_range_get_the_whole_body(client: Client) -> None:
    """RFC 9110 allows this, with status 200."""
    response = client.get_raw(SADDLE, PLAIN)
    response_to_range = client.get_raw(
        SADDLE, {**PLAIN, "Range": "bytes=0-3", "If-Range": response.headers["etag"]}
    )
    assert (response_to_range.status_code, response_to_range.content) == (200, response.content)
    assert "content-range" not in response_to_range.headers


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
"""Options of a query, each with some values as clients may write them."""


@given(
    st.fixed_dictionaries(
        {}, optional={name: st.sampled_from(texts) for name, texts in OPTIONS.items()}
    ),
    st.sampled_from(FORMATS),
)
def test_the_canonical_query_gives_the_same_bytes(options: dict[str, str], fmt: Format) -> None:
    try:
        options_of_query = parse_mesh_query(options.items())
        surface = find("saddle").surface()
        expected = render(
            surface, options_of_query.mesh_options(), fmt, select_encode_options(options_of_query)
        )
    except SurfaceError:  # the options contradict each other, or the format lacks one
        return
    query = canonical_query(options_of_query, fmt.ignored)
    options_of_canonical = parse_mesh_query(parse_qsl(query))
    assert (
        render(
            surface,
            options_of_canonical.mesh_options(),
            fmt,
            select_encode_options(options_of_canonical),
        )
        == expected
    )


@pytest.mark.slow
def test_another_process_computes_the_same_bytes() -> None:
    """`compute_digests` hashes files of all formats in all codings.

    The other process has another seed of hashes, so its sets have another order.
    """
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    root = Path(__file__).parents[2]
    process = run_python("-m", "tests.api.digests", env=environment, cwd=root)
    assert process.stdout.splitlines() == compute_digests()
