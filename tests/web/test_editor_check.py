"""A mesh that is dropped on the editor is checked against the open surface, and shown instead."""

import json
from base64 import b64decode
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, Request, Route

from tests.web.test_editor_busy import hold, wait_for
from tests.web.test_editor_files import drop, read_problem
from tests.web.test_page_access import PHONE_WINDOW, list_violations
from tools.browser import Stage
from tools.editor import READY, WINDOW, drag, perform, reset_editor, select_point

STL = b"solid part\nfacet normal 0 0 1\n"
CHECKS = "**/v1/check*"
SHOWN = "#check dl"

# The corners of the saddle, of which the last one is moved by 0.2, and half of its middle.
VERTICES = [[-1, -1, 1], [1, -1, -1], [-1, 1, -1], [1, 1, 1.2], [0, 0, 0.1]]
REPORT: dict[str, Any] = {
    "surface_to_mesh": {"low": 0.19954, "high": 0.20041, "point": [1, 1, 1], "triangle": 3},
    "mesh_to_surface": {"low": 0.19954, "high": 0.2, "point": [1, 1, 1.2], "triangle": 3},
    "open_edges": 4,
    "non_manifold_edges": 0,
    "flipped_edges": 1234,
    "degenerate_faces": 0,
    "max_normal_angle": np.pi / 4,
    "reached": True,
    "vertices": 5,
    "triangles": 4,
    "mesh": {"vertices": VERTICES, "faces": [[0, 1, 4], [1, 3, 4], [3, 2, 4], [2, 0, 4]]},
    "distances": [0, 0, 0, 0.2, 0.1],
    "middle_distances": [0.03, 0.1, 0.1, 0.03],
}


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle; the console must stay empty."""
    reset_editor(editor.page)
    editor.messages.clear()
    yield editor.page
    assert editor.messages == []
    editor.page.unroute_all()
    if editor.page.is_visible("#check"):
        editor.page.click("#check >> text=Close the check")
    editor.page.set_viewport_size(WINDOW)
    editor.page.emulate_media(color_scheme="light")
    reset_editor(editor.page)


@pytest.fixture
def asked(page: Page) -> list[Request]:
    """The requests for checks, all of which get the same report."""
    requests: list[Request] = []

    def respond(route: Route) -> None:
        requests.append(route.request)
        route.fulfill(json=REPORT)

    page.route(CHECKS, respond)
    return requests


def read_rows(page: Page) -> dict[str, str]:
    """The results in the panel: value by label."""
    rows = page.locator("#check dl > div").all()
    return {
        row.locator("dt").inner_text(): row.locator("dd").inner_text().removesuffix("\nLook")
        for row in rows
    }


def test_a_mesh_is_checked_against_the_open_surface(page: Page, asked: list[Request]) -> None:
    drop(page, {"part.stl": STL})
    page.wait_for_selector(SHOWN)
    (request,) = asked
    assert request.url.endswith("/v1/check?surface=saddle&distances=true")
    assert request.headers["content-type"] == "model/stl"
    assert request.post_data_buffer == STL
    assert page.inner_text("#check h2") == "Check of part.stl"
    assert read_rows(page) == {
        "1: Surface to mesh": "0.199 to 0.201",  # rounded outwards
        "2: Mesh to surface": "0.199 to 0.2",
        "Largest angle of normals": "45°",
        "Open edges": "4",
        "Edges of more than two triangles": "none",
        "Flipped edges": "1,234",
        "Degenerate triangles": "none",
        "Triangles": "4",
    }
    assert page.locator("#check-legend span").all_inner_texts() == ["0", "0.2"]
    assert "From the surface to the mesh: 0.199 to 0.201" in page.inner_text("#status")
    page.wait_for_selector(".pin:visible")
    # The surface, its net and their readouts are as before, but the net is not drawn.
    assert page.inner_text("#title") == "Saddle"
    assert page.locator(".pin:visible").all_inner_texts() == ["1", "2"]
    assert page.is_hidden("#invitation")


def test_a_report_says_why_an_interval_is_wide(page: Page) -> None:
    report = REPORT | {"reached": False, "limit": "thin", "skipped_faces": [{"face": 1}]}
    del report["max_normal_angle"]
    page.route(CHECKS, lambda route: route.fulfill(json=report))
    drop(page, {"part.stl": STL})
    page.wait_for_selector(SHOWN)
    assert "wider than asked for: the faces of this part are too thin." in page.inner_text("#check")
    rows = read_rows(page)
    assert rows["Faces left out"] == "1"
    assert "Largest angle of normals" not in rows


def test_a_mesh_has_the_colours_of_its_distances(modules: Page) -> None:
    """The middles of triangles have colours too: they become vertices of the drawing."""
    colors, positions, normals, triangles, wires = modules.evaluate(
        """async (report) => {
            const { CheckView } = await import('/page/check-view.js');
            const { Box3, Scene, Vector3 } = await import('/page/three.js');
            document.body.insertAdjacentHTML('beforeend', '<div id="pin"></div>');
            const stage = {
                scene: new Scene(), onDraw: [], box: new Box3(new Vector3(), new Vector3(1, 1, 1)),
                draw() {}, radius: () => 1,
            };
            const surfaceView = { materials: new Map(), clippingPlanes: [] };
            const check = new CheckView({ stage, surfaceView, showCover() {}, fit() {} });
            check.show({ up: 'z' }, report, 0.2, []);
            const { attributes: { color, position, normal }, index } = check.mesh.geometry;
            const plain = check.outline.geometry.index;
            const list = ({ array }) => [...array];
            return [list(color), list(position), list(normal), list(index), list(plain)];
        }""",
        REPORT,
    )
    vertices, faces = np.array(VERTICES), np.array(REPORT["mesh"]["faces"])
    middles = vertices[faces].mean(axis=1)
    places = np.concatenate([vertices, middles]) - vertices[0]
    turned = np.column_stack([places[:, 0], places[:, 2], -places[:, 1]])  # z is up
    np.testing.assert_allclose(np.reshape(positions, (-1, 3)), turned, atol=1e-6)
    red, _, blue = np.reshape(colors, (-1, 3)).T
    distances = np.array(REPORT["distances"] + REPORT["middle_distances"])
    assert (np.argsort(blue, kind="stable") == np.argsort(-distances, kind="stable")).all()
    assert red[np.argmax(distances)] < red[0]
    assert wires == faces.ravel().tolist()
    corners = np.reshape(triangles, (-1, 3, 3))  # three triangles in place of each
    for face, middle, parts in zip(faces.tolist(), range(5, 9), corners.tolist(), strict=True):
        edges = [part[:2] for part in parts]
        assert edges == [[face[k], face[(k + 1) % 3]] for k in range(3)]
        assert {part[2] for part in parts} == {middle}
    ours = np.reshape(normals, (-1, 3))
    np.testing.assert_allclose(ours[5:], ours[faces].mean(axis=1), atol=1e-6)


@pytest.mark.usefixtures("asked")
def test_escape_and_the_button_give_the_surface_back(page: Page) -> None:
    for key in ("Escape", "Enter"):
        drop(page, {"part.stl": STL})
        page.wait_for_selector(SHOWN)
        page.focus("#check >> text=Close the check")
        page.keyboard.press(key)
        page.wait_for_selector("#check", state="detached")
        assert page.locator("#check-legend").count() == 0
        assert page.locator(".pin:visible").count() == 0
        assert page.evaluate("document.activeElement.id") == "view"
        assert page.inner_text("#status") == "Saddle is shown again"
    # A control point can be chosen and dragged again.
    drag(page, select_point(page, 4), (30, -20))
    page.click("#undo")
    page.wait_for_selector(READY)


def test_a_surface_that_the_service_does_not_have_is_sent_with_the_file(
    page: Page, asked: list[Request]
) -> None:
    """Nothing is stored."""
    perform(page, lambda: drag(page, select_point(page, 4), (30, -20)))
    drop(page, {"part.ply": b"ply\nformat ascii 1.0\n"})
    page.wait_for_selector(SHOWN)
    (request,) = asked
    assert request.url.endswith("/v1/check")
    body = json.loads(request.post_data or "")
    assert body["surface"]["control_net"][1][1] != [1, 1, 1]
    assert body["distances"] is True
    assert body["mesh"]["format"] == "ply"
    assert b64decode(body["mesh"]["file"]) == b"ply\nformat ascii 1.0\n"


def test_after_an_edit_the_check_is_out_of_date_and_can_be_repeated(
    page: Page, asked: list[Request]
) -> None:
    drop(page, {"part.stl": STL})
    page.wait_for_selector(SHOWN)
    page.fill("#point", "1")
    page.press("#point", "Enter")
    page.fill("#z", "3")
    page.press("#z", "Enter")
    page.wait_for_selector("#check >> text=Check again")
    assert page.locator(SHOWN).count() == 0
    assert page.locator("#check-legend").count() == 0
    assert "has changed" in page.inner_text("#check")
    page.click("#check >> text=Check again")
    page.wait_for_selector(SHOWN)
    assert "surface=" not in asked[1].url
    # Another surface makes it out of date, too.
    page.click("#open")
    perform(page, lambda: page.click('[data-example="sphere"]'))
    page.click("#check >> text=Check again")
    page.wait_for_selector(SHOWN)
    assert "surface=sphere" in asked[2].url


@pytest.mark.usefixtures("asked")
def test_settings_do_not_end_a_check(page: Page) -> None:
    drop(page, {"part.stl": STL})
    page.wait_for_selector(SHOWN)
    page.set_checked("#show-wires", True)
    perform(page, lambda: page.fill("#resolution", "9"))
    page.check('input[name="look"][value="normals"]', force=True)
    page.wait_for_selector(READY)
    assert page.is_visible(SHOWN)
    assert page.is_visible("#check-legend")
    # A click does not ask about the surface, which is not shown.
    box = page.locator("#view").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert page.is_hidden("#probe-row")


@pytest.mark.usefixtures("asked")
def test_the_view_looks_at_a_mark(page: Page) -> None:
    drop(page, {"part.stl": STL})
    page.wait_for_selector(SHOWN)
    page.get_by_label("Look at mark 2").click()
    page.wait_for_function("() => document.querySelectorAll('.pin')[1].dataset.x > 0")
    view = page.locator("#view").bounding_box()
    assert view is not None
    label = page.locator(".pin").nth(1)

    def is_in_middle() -> bool:
        x = float(label.get_attribute("data-x") or "nan")
        return abs(x - view["width"] / 2) < 4

    wait_for(page, is_in_middle)


def test_a_check_that_takes_long_is_stopped(page: Page) -> None:
    routes: list[Route] = []
    hold(page, CHECKS, routes)
    drop(page, {"part.stl": STL})
    page.wait_for_selector("#busy:visible")
    assert page.inner_text("#busy-what") == "Checking part.stl against Saddle"
    page.keyboard.press("Escape")
    assert "Checking part.stl against Saddle was stopped" in read_problem(page)
    assert page.locator("#check").count() == 0
    wait_for(page, lambda: routes[0].request.failure is not None)
    assert page.get_attribute("html", "data-state") == "ready"


def test_an_edit_drops_a_check_that_runs(page: Page) -> None:
    routes: list[Route] = []
    hold(page, CHECKS, routes)
    drop(page, {"part.stl": STL})
    wait_for(page, lambda: len(routes) == 1)
    perform(page, lambda: drag(page, select_point(page, 4), (30, -20)))
    wait_for(page, lambda: routes[0].request.failure is not None)
    assert page.is_hidden("#problem")
    assert page.locator("#check").count() == 0


def test_a_refusal_names_the_mesh(page: Page, editor: Stage) -> None:
    issue = {"code": "malformed_body", "detail": "The file ends too early.", "pointer": ""}
    problem = {"title": "Bad Request", "status": 400, "code": "malformed_body", "detail": "…"}
    page.route(
        CHECKS,
        lambda route: route.fulfill(
            status=400,
            content_type="application/problem+json",
            body=json.dumps(problem | {"type": "about:blank", "errors": [issue]}),
        ),
    )
    drop(page, {"part.stl": STL})
    text = read_problem(page)
    assert text.startswith("part.stl was not checked: ")
    assert "The file ends too early." in text
    assert page.locator("#check").count() == 0
    editor.messages.clear()  # the browser writes one for the status 400


def test_a_file_that_is_too_large_is_not_sent(modules: Page) -> None:
    """Beside an edited surface the file is in JSON, of which the service takes less."""
    refusals = modules.evaluate("""async () => {
        const { requestCheck } = await import('/page/check-request.js');
        const file = {
            name: 'a.stl', format: 'stl',
            content: new Blob([new Uint8Array(1000)]), maxBytes: 999, maxJsonBytes: 1330,
        };
        const ask = (address, surface) => requestCheck(surface, address, file, null, () => {})
            .catch((error) => error.errors[0]);
        return [await ask('saddle', {}), await ask('', {})];
    }""")
    assert [each["code"] for each in refusals] == ["body_too_large"] * 2
    assert "a coarser mesh" in refusals[0]["needed"]
    assert '"Copy link", which stores the surface' in refusals[1]["needed"]


@pytest.mark.parametrize(
    ("name", "content", "media_type"),
    [
        ("a.glb", b"glTF\2\0\0\0", "model/gltf-binary"),
        ("a.off", b"OFF\n3 1 0\n", "model/x-off"),
        ("scan.stl", b"ply\nformat ascii 1.0\n", "model/x-ply"),
        ("binary.STL", bytes(84), "model/stl"),
        ("cube.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "model/obj"),
        ("", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "model/x-off"),
    ],
)
def test_meshes_are_known_by_content_and_suffix(
    page: Page, asked: list[Request], name: str, content: bytes, media_type: str
) -> None:
    if name:
        drop(page, {name: content})
    else:
        drop(page, {}, content.decode(), event="paste")
    page.wait_for_selector(SHOWN)
    assert asked[0].headers["content-type"] == media_type
    assert page.inner_text("#check h2") == f"Check of {name or 'the mesh'}"


def test_a_file_with_surfaces_opens_as_a_surface(page: Page, asked: list[Request]) -> None:
    patch = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\ncstype bezier\ndeg 1 1\n"
        b"surf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n"
    )
    perform(page, lambda: drop(page, {"patch.obj": patch}))
    assert page.inner_text("#title") == "patch.obj"
    net = json.dumps(
        {"name": "asset", "control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}
    )
    perform(page, lambda: drop(page, {"net.json": net.encode()}))
    perform(page, lambda: drop(page, {}, net))
    assert asked == []


def test_a_mesh_among_several_files_is_named_as_not_opened(
    page: Page, asked: list[Request]
) -> None:
    net = json.dumps([[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]).encode()
    perform(page, lambda: drop(page, {"net.json": net, "part.stl": STL}))
    assert "Not opened: part.stl" in page.inner_text("#description")
    assert asked == []


def read_interval(page: Page, label: str) -> tuple[float, float]:
    low, _, high = read_rows(page)[label].partition(" to ")
    return float(low), float(high or low)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["glb", "stl"])
def test_the_service_checks_a_mesh_that_it_made_and_an_edited_surface(
    page: Page, server: str, suffix: str
) -> None:
    """No answer is made up here: the service reads the file, and compares it."""
    mesh = httpx.get(f"{server}/v1/surfaces/saddle/mesh.{suffix}?resolution=4").content
    drop(page, {f"saddle.{suffix}": mesh})
    page.wait_for_selector(SHOWN, timeout=120_000)
    # z = x y over squares of side 1/2: halfway along a diagonal the mesh is 1/16 above or below.
    for label in ("1: Surface to mesh", "2: Mesh to surface"):
        low, high = read_interval(page, label)
        assert 0.03 < low < high < 0.0625
        assert high - low < 0.01
    assert read_rows(page)["Triangles"] == "32"
    assert read_rows(page)["Open edges"] == "16"
    page.fill("#point", "4")
    page.press("#point", "Enter")
    page.fill("#z", "2")
    page.press("#z", "Enter")
    page.wait_for_selector(READY)
    page.click("#check >> text=Check again")
    page.wait_for_selector(SHOWN, timeout=120_000)
    low, high = read_interval(page, "1: Surface to mesh")
    # The corner of the surface is 1 above that of the mesh, which is the nearest point.
    assert 0.89 < low <= 1 <= high < 1.11


@pytest.mark.slow
@pytest.mark.usefixtures("asked")
@pytest.mark.parametrize(("scheme", "size"), [("light", None), ("dark", PHONE_WINDOW)])
def test_axe_finds_no_violations_beside_a_check(
    page: Page, scheme: Any, size: tuple[int, int] | None
) -> None:
    page.emulate_media(color_scheme=scheme)
    if size:
        page.set_viewport_size({"width": size[0], "height": size[1]})
    name = "a-very-long-name-of-a-file-without-any-space-in-it" * 3 + ".stl"
    drop(page, {name: STL})
    page.wait_for_selector(SHOWN)
    assert list_violations(page) == []
    left = page.evaluate("document.getElementById('check-legend').getBoundingClientRect().left")
    assert left >= 10
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width == (size or (WINDOW["width"],))[0]
    page.keyboard.press("Tab")
    reset_editor(page)  # another surface is open
    page.wait_for_selector("#check >> text=Check again")
    assert list_violations(page) == []
