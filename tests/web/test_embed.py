"""The view at /embed: in frames of pages that the operator names, and in no others."""

import time
from collections.abc import Iterator
from urllib.parse import quote, urlsplit

import pytest
from playwright.sync_api import Browser, Frame, Page
from pydantic import SecretStr

from service.api.guard.keys import format_entry, make_key
from service.api.guard.signatures import Signer, build_signed_url
from service.schemas.request import SignRequest
from service.settings.values import Settings
from tests.web.clients import SERVED_AT, read_blocks
from tests.web.test_page_access import list_violations
from tools.browser import Stage, serve_folder
from tools.editor import READY, open_profile
from tools.live import run_service

MESH = "/v1/surfaces/saddle/mesh.glb?resolution=4"
SECRET = "0123456789abcdef" * 2
REFUSED = 'html[data-state="refused"]'


@pytest.fixture(scope="module")
def shops(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    """Two origins with an empty page: one that the service allows to frame, and one it does not."""
    folder = tmp_path_factory.mktemp("shop")
    (folder / "index.html").write_text("<!doctype html><title>Shop</title>")
    with serve_folder(folder) as named, serve_folder(folder) as other:
        yield named, other


@pytest.fixture(scope="module")
def private_service(shops: tuple[str, str]) -> Iterator[str]:
    """A service whose meshes need a key or a signature, and that allows frames of one origin."""
    settings = Settings(
        api_keys=(format_entry("alice", make_key()),),
        public_reads=False,
        signing_keys=(SecretStr(SECRET),),
        frame_ancestors=(shops[0],),
    )
    with run_service(settings) as url:
        yield url


@pytest.fixture(scope="module")
def stage(browser: Browser) -> Iterator[Stage]:
    stage = open_profile(browser)
    yield stage
    stage.page.context.close()


def open_embed(page: Page, service: str, src: str, more: str = "") -> None:
    page.goto(f"{service}/embed?src={quote(src, safe='')}{more}")


def open_frame(page: Page, shop: str, url: str) -> Frame:
    """The frame with this URL in a page of a shop, once it is loaded or refused."""
    page.goto(shop)
    script = """url => new Promise((resolve) => {
        const frame = document.body.appendChild(document.createElement('iframe'));
        frame.onload = () => resolve();
        frame.src = url;
    })"""
    page.evaluate(script, url)
    return page.frames[1]


def is_blocked(stage: Stage) -> bool:
    """Whether the browser has refused a frame because of its `frame-ancestors`."""
    return any("frame-ancestors" in message for message in stage.messages)


def test_a_mesh_is_shown_and_turned_by_keys_and_buttons(server: str, stage: Stage) -> None:
    page = stage.page
    stage.messages.clear()
    open_embed(page, server, MESH)
    page.wait_for_selector(READY)
    assert page.inner_text("#message") == ""
    assert urlsplit(page.url).path == "/embed"
    for key, is_used in (("ArrowLeft", True), ("+", True), ("f", True), ("x", False)):
        event = f"new KeyboardEvent('keydown', {{ key: '{key}', cancelable: true }})"
        is_free = page.evaluate(f"document.getElementById('view').dispatchEvent({event})")
        assert is_free != is_used, key
    page.click("#fit")
    assert page.get_attribute("#theme", "aria-pressed") == "false"
    page.click("#theme")
    assert page.get_attribute("#theme", "aria-pressed") == "true"
    assert stage.messages == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_violations_in_the_view_and_in_its_message(
    server: str, stage: Stage, scheme: str
) -> None:
    page = stage.page
    open_embed(page, server, MESH, f"&theme={scheme}")
    page.wait_for_selector(READY)
    assert page.evaluate("getComputedStyle(document.documentElement).colorScheme") == scheme
    assert list_violations(page) == []
    open_embed(page, server, "/v1/surfaces/none/mesh.glb", f"&theme={scheme}")
    page.wait_for_selector(REFUSED)
    assert list_violations(page) == []


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ("", "needs src"),
        ("?src=https://127.0.0.1:45671/v1/surfaces/saddle/mesh.glb", "not the path of a mesh"),
        ("?src=//127.0.0.1:45671/v1/surfaces/saddle/mesh.glb", "not the path of a mesh"),
        (f"?src={quote('/v1/surfaces/none/mesh.glb')}", "cannot be shown"),
    ],
)
def test_a_refused_path_is_a_message_and_no_other_host_is_asked(
    server: str, stage: Stage, query: str, message: str
) -> None:
    page = stage.page
    stage.requested_urls.clear()
    page.goto(f"{server}/embed{query}")
    page.wait_for_selector(REFUSED)
    assert message in page.inner_text("#message")
    assert {urlsplit(url).netloc for url in stage.requested_urls} == {urlsplit(server).netloc}


HOST = "https://a.example"
PATH = "/v1/surfaces/saddle/mesh.glb"


@pytest.mark.parametrize(
    ("src", "base", "url"),
    [
        (PATH, "/embed", HOST + PATH),
        (PATH + "?engine=4&signature=v1.x", "/embed", f"{HOST}{PATH}?engine=4&signature=v1.x"),
        ("/prefix" + PATH, "/prefix/embed?src=1", f"{HOST}/prefix{PATH}"),
        (PATH + "#part", "/embed", HOST + PATH),
        # Outside the service, or another kind of path.
        (PATH, "/prefix/embed", None),
        ("/prefix/.." + PATH, "/prefix/embed", None),
        ("/v1/surfaces/saddle", "/embed", None),
        ("/v1/surfaces/saddle/mesh.stl", "/embed", None),
        ("/v1/surfaces/a%2fb/mesh.glb", "/embed", None),
        ("/v1/jobs/1/results/0", "/embed", None),
        ("/docs", "/embed", None),
        # Other hosts, and no paths at all.
        (HOST + PATH, "/embed", None),
        ("https://b.example" + PATH, "/embed", None),
        ("//b.example" + PATH, "/embed", None),
        ("/\\b.example" + PATH, "/embed", None),
        ("\\\\b.example" + PATH, "/embed", None),
        ("/\t/b.example" + PATH, "/embed", None),
        (" " + PATH, "/embed", None),
        ("v1/surfaces/saddle/mesh.glb", "/embed", None),
        ("javascript:alert(1)", "/embed", None),
        ("data:model/gltf-binary,x", "/embed", None),
        ("", "/embed", None),
        ("/", "/embed", None),
        ("/" + "a" * 100_000, "/embed", None),
    ],
)
def test_only_paths_of_meshes_of_the_service_are_loaded(
    modules: Page, src: str, base: str, url: str | None
) -> None:
    script = "async ([src, page]) => (await import('/page/mesh-path.js')).resolveMesh(src, page)"
    assert modules.evaluate(script, [src, HOST + base]) == url


def test_a_signed_mesh_is_shown_in_a_frame_of_an_origin_that_the_service_names(
    private_service: str, shops: tuple[str, str], stage: Stage
) -> None:
    """The frame needs no key: the signature is in the path."""
    wanted = SignRequest.model_validate({"url": MESH, "seconds": 600})
    signed, _ = build_signed_url(Signer([SECRET]), wanted, "", time.time())
    for path, state in ((signed, READY), (MESH, REFUSED)):
        url = f"{private_service}/embed?src={quote(path, safe='')}"
        open_frame(stage.page, shops[0], url).wait_for_selector(state)


def test_the_page_of_the_documentation_has_the_view_in_a_frame(
    shops: tuple[str, str], stage: Stage
) -> None:
    (page,) = (block for block in read_blocks("html") if "<iframe" in block)
    with run_service(Settings(frame_ancestors=(shops[0],))) as service:
        stage.page.goto(shops[0])
        stage.page.set_content(page.replace(SERVED_AT, service))
        stage.page.frames[1].wait_for_selector(READY)


@pytest.mark.parametrize(("shop", "path"), [(1, f"/embed?src={MESH}"), (0, "/"), (0, "/docs")])
def test_no_other_frame_is_allowed(
    private_service: str, shops: tuple[str, str], stage: Stage, shop: int, path: str
) -> None:
    stage.messages.clear()
    frame = open_frame(stage.page, shops[shop], private_service + path)
    assert frame.url == "chrome-error://chromewebdata/"
    assert is_blocked(stage)


def test_without_the_setting_no_page_frames_the_view(
    server: str, shops: tuple[str, str], stage: Stage
) -> None:
    stage.messages.clear()
    frame = open_frame(stage.page, shops[0], f"{server}/embed?src={MESH}")
    assert frame.url == "chrome-error://chromewebdata/"
    assert is_blocked(stage)
