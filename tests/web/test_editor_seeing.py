"""Layout and looks of the editor: what is in sight, the view, clicks, sections, names of faces."""

import json
import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page

from tests.web.test_page_access import list_violations
from tools.browser import WITHOUT_PIXELS, Stage, record_page
from tools.editor import WINDOW, perform, read_value, reset_editor, show

NET_SIZE = 200
"""Rows and columns of a net that would cover its surface if all of it were drawn."""

PHONE, LAPTOP = (390, 844), (1280, 720)
"""Widths and heights of windows, in pixels."""

TARGETS = """() => [...document.querySelectorAll(
    'button, select, summary, a, input:not(.segments input):not(.file input), .segments label')]
  .filter((node) => node.checkVisibility({ visibilityProperty: true }) && !node.closest('.skip'))
  .map((node) => {
    const label = node.closest('label.switch') ?? node;
    const { width, height } = label.getBoundingClientRect();
    return [node.id || node.name || node.textContent.trim(), width, height];
  })"""
"""Name, width and height of all elements that a finger can press."""


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle and default choices; the console must stay empty."""
    editor.messages.clear()
    reset_editor(editor.page)
    yield editor.page
    editor.page.set_viewport_size(WINDOW)
    assert editor.messages == []


def box_of(element: Locator) -> tuple[float, float, float, float]:
    """Left, top, right and lower edge of an element in the window, in pixels."""
    box = element.bounding_box()
    assert box is not None
    return box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"]


def is_inside(page: Page, selector: str) -> bool:
    """Whether an element is inside the window, without scrolling."""
    left, top, right, bottom = box_of(page.locator(selector))
    size = page.viewport_size
    assert size is not None
    return 0 <= left <= right <= size["width"] and 0 <= top <= bottom <= size["height"]


def test_on_a_laptop_the_slider_and_all_of_mesh_are_in_sight(page: Page) -> None:
    page.set_viewport_size({"width": LAPTOP[0], "height": LAPTOP[1]})
    for selector in ("#view", "#resolution", 'section[aria-labelledby="h-mesh"]', "#vertices"):
        assert is_inside(page, selector), selector
    panel = box_of(page.locator(".settings"))
    assert box_of(page.locator('section[aria-labelledby="h-mesh"]'))[3] <= panel[3]


def test_on_a_phone_view_and_slider_are_in_sight_and_fingers_hit_all_controls(
    server: str, browser: Browser
) -> None:
    size: Any = {"width": PHONE[0], "height": PHONE[1]}
    context = browser.new_context(viewport=size, has_touch=True, is_mobile=True)
    stage = record_page(context.new_page(), ("error",))
    page = stage.page
    page.add_init_script(WITHOUT_PIXELS)
    show(page, f"{server}/?surface=utah-teapot&resolution=2")
    assert is_inside(page, "#view")
    assert is_inside(page, "#resolution")
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE[0]
    # The view stays in sight while the panel scrolls below it.
    page.locator("#section-x").scroll_into_view_if_needed()
    assert page.evaluate("scrollY") > 0
    assert is_inside(page, "#view")
    assert box_of(page.locator("#view"))[3] < box_of(page.locator("#section-x"))[1]
    page.fill("#point", "1")
    page.press("#point", "Enter")
    targets = page.evaluate(TARGETS)
    assert len(targets) > 40
    assert [target for target in targets if min(target[1:]) < 24] == []
    # All but the buttons in the bar of a narrow screen are as high as a finger is wide.
    assert [target for target in targets if target[2] < 44] == []
    context.close()
    assert stage.messages == []


def test_standard_views_look_along_the_axes_of_the_surface(page: Page) -> None:
    """The teapot is 6.43 × 4 × 3.15 with z up; a click on an axis looks along it."""
    page.click("#open")
    perform(page, lambda: page.click('[data-example="utah-teapot"]'))
    assert page.inner_text("#size") == "6.43 × 4 × 3.15"
    page.click("#views summary")
    # Names of axes by what the view shows to the right and upwards.
    for name, right, up in [
        ("front", "+x", "+z"),
        ("back", "-x", "+z"),
        ("left", "-y", "+z"),
        ("right", "+y", "+z"),
        ("top", "+x", "+y"),
        ("bottom", "+x", "-y"),
    ]:
        page.click(f"#view-{name}")
        wait_for_axes(page, right, up)
        assert page.inner_text("#status") == f"View: {name}"
    page.check("#orthographic", force=True)
    assert page.evaluate("document.querySelector('#views').open")
    page.keyboard.press("Escape")
    assert not page.evaluate("document.querySelector('#views').open")
    page.focus("#view")
    page.keyboard.press("3")
    wait_for_axes(page, "-y", "+z")
    page.keyboard.press("o")
    assert not page.is_checked("#orthographic")
    page.locator('#axes [data-axis="0"] circle').dispatch_event("click")
    wait_for_axes(page, "+y", "+z")


def wait_for_axes(page: Page, right: str, up: str) -> None:
    """Waits until the picture of the axes shows these directions to the right and upwards."""
    page.wait_for_function(
        """([right, up]) => {
          const end = (name, field) => (name[0] === '+' ? 1 : -1) * document.querySelector(
            `#axes [data-axis="${'xyz'.indexOf(name[1])}"] line`)[field].baseVal.value;
          return end(right, 'x2') > 33.9 && end(up, 'y2') < -33.9;
        }""",
        arg=[right, up],
    )


def test_a_dense_net_is_thinned_and_its_points_are_found_fast(modules: Page) -> None:
    """Each 2^k-th row is drawn, and the last one, if rows are closer than 16 pixels."""
    found = modules.evaluate(
        """async (size) => {
          const { chooseLevel, findLevels } = await import('/page/net-levels.js');
          const { netOf } = await import('/page/net.js');
          const { NetView } = await import('/page/net-view.js');
          const { PerspectiveCamera, Scene } = await import('/page/three.js');
          const range = Array.from({ length: size }, (_, i) => i);
          const surface = { control_net: range.map((i) => range.map((j) => [i, j, 0])) };
          const net = netOf(surface);
          const { points, edges, pointCounts, edgeCounts } = findLevels(net);
          const camera = new PerspectiveCamera(45, 1, 1, 1000);
          camera.position.set(size / 2, size / 2, 1.3 * size);
          camera.updateMatrixWorld();
          const canvas = { clientWidth: 600, clientHeight: 600 };
          const stage = { scene: new Scene(), camera, drawingCamera: camera, canvas,
            beforeDraw: [], draw: () => {}, radius: () => size };
          const view = new NetView(stage);
          view.showNet(net, surface);
          stage.beforeDraw.forEach((act) => act());
          const index = 8 * size + 16; // the control point of row 8 and column 16
          const { x, y } = view.screenPosition(index);
          const start = performance.now();
          let picked = -1;
          for (let k = 0; k < 100; k += 1) picked = view.pick(x + 2, y - 1, 'mouse');
          const rows = (count) => new Set(
            Array.from(points.slice(0, count), (i) => Math.floor(i / size)));
          return {
            levels: [100, 16, 8, 3, 0].map(chooseLevel),
            pointCounts: pointCounts.slice(0, 4), edgeCounts: edgeCounts.slice(0, 4),
            rows: [...rows(pointCounts[3])].sort((a, b) => a - b).slice(-3),
            level: view.level, spacing: view.spacing, picked: picked === index,
            between: view.pick(x + view.spacing / 2, y + view.spacing / 2, 'mouse'),
            milliseconds: (performance.now() - start) / 101,
            range: view.lineGeometry.drawRange.count,
            isEveryEdge: new Set(edges).size === size * size,
          };
        }""",
        NET_SIZE,
    )
    rows = [NET_SIZE, 101, 51, 26]  # rows 0, 2^k, …, and row 199
    assert found["levels"] == [0, 0, 1, 3, 14]
    assert found["pointCounts"] == [count * count for count in rows]
    assert found["edgeCounts"] == [2 * count * (NET_SIZE - 1) for count in rows]
    assert found["rows"] == [184, 192, 199]
    assert found["level"] == 3
    assert found["range"] == 2 * found["edgeCounts"][3]
    assert 16 <= found["spacing"] < 32
    assert found["picked"]
    assert found["between"] == -1
    assert found["isEveryEdge"]
    assert found["milliseconds"] < 20


def click_surface(page: Page, share: float = 0.4, shift: float = 0) -> None:
    """Clicks at a share of the height of the view, `shift` pixels from its middle.

    The function waits for the answer.
    """
    left, top, right, bottom = box_of(page.locator("#view"))
    with page.expect_response(lambda response: "/v1/project" in response.url):
        page.mouse.click((left + right) / 2 + shift, top + share * (bottom - top))
    page.wait_for_selector("#probe-row:visible")


def open_pasted(page: Page, surface: dict[str, Any]) -> None:
    """Opens this surface, without its net, so that every click hits the surface."""
    page.click("#open")
    page.fill("#paste", json.dumps(surface))
    perform(page, lambda: page.click("#paste-open"))
    page.set_checked("#show-net", False)


def read_place(page: Page) -> list[float]:
    """The coordinates that the page shows for the last click."""
    value = page.locator("#place").get_attribute("value") or ""
    return [float(number) for number in value.split(",")]


def test_a_click_marks_the_place_until_it_is_cleared(page: Page) -> None:
    page.set_checked("#show-net", False)
    assert page.is_hidden("#place-row")
    click_surface(page)
    x, y, z = read_place(page)
    assert z == pytest.approx(x * y)  # the saddle is z = xy
    pin = page.locator("#pin")
    pin.wait_for()
    assert pin.inner_text() == page.inner_text("#place")
    # The dot is where the mouse was, up to the distance between the mesh and the surface.
    left, top, right, bottom = box_of(page.locator("#view"))
    assert float(pin.get_attribute("data-x") or "") == pytest.approx((right - left) / 2, abs=15)
    assert float(pin.get_attribute("data-y") or "") == pytest.approx(0.4 * (bottom - top), abs=15)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#place-copy")
    page.wait_for_selector("#status:has-text('Copied')")
    copied = page.evaluate("navigator.clipboard.readText()")
    assert [float(number) for number in copied.split(", ")] == [x, y, z]
    page.click("#place-clear")
    assert page.is_hidden("#place-row")
    assert page.is_hidden("#pin")
    assert page.evaluate("document.activeElement.id") == "view"
    click_surface(page)
    page.keyboard.press("Escape")
    assert page.is_hidden("#pin")
    click_surface(page)
    page.click("#open")
    perform(page, lambda: page.click('[data-example="sphere"]'))
    assert page.is_hidden("#pin")


TUBE = {"type": "tube", "radius": 0.5, "curve": {"control_points": [[0, 0, -2], [0, 0, 2]]}}
FLAT_TRIANGLE = {
    "type": "triangle",
    "control_net": [
        [[1, 0, 0], [0.5, 0.5, 0], [0, 1, 0]],
        [[0.5, 0, 0.5], [0, 0.5, 0.5]],
        [[0, 0, 1]],
    ],
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "gaussian", "mean"),
    [
        (TUBE, 0, 1),
        ({"type": "group", "members": [{"surface": TUBE}]}, 0, 1),
        ({"type": "group", "members": [{"surface": FLAT_TRIANGLE}]}, 0, 0),
    ],
)
def test_clicks_show_curvatures_on_exact_tubes_and_in_groups(
    editor: Stage, surface: dict[str, Any], gaussian: float, mean: float
) -> None:
    """The triangle needs a second request, after one that the browser logs."""
    page = editor.page
    reset_editor(page)
    open_pasted(page, surface)
    click_surface(page, 0.35)
    texts = page.inner_text("#probe").replace("−", "-").split(", ")
    values = dict(text.split(" ") for text in texts if text[0] in "uvKH")
    assert float(values["K"]) == pytest.approx(gaussian, abs=1e-9)
    assert abs(float(values["H"])) == pytest.approx(mean, abs=1e-9)


def test_where_there_is_no_answer_the_reason_stands_in_its_place(editor: Stage) -> None:
    """This test ignores the console, because the browser itself writes refused requests there."""
    page = editor.page
    reset_editor(page)
    bent = {"control_points": [[-2, 0, 0], [0, 1, 1], [2, 0, 0]]}
    open_pasted(page, TUBE | {"curve": bent})
    click_surface(page)
    reason = "Its curve has a piece that is neither straight nor a circular arc."
    assert page.inner_text("#probe").startswith("on the mesh; no parameters: ")
    assert page.inner_text("#probe").endswith(reason)
    assert math.hypot(*read_place(page)) < 2
    page.click("#measure")
    page.wait_for_selector("#measure", state="hidden")
    assert page.inner_text("#area").endswith(reason)
    assert "no colours of curvature" in page.inner_text("#look-explained")
    assert page.is_hidden("#problem")


@pytest.fixture
def cut_page(page: Page) -> Iterator[Page]:
    """The editor; in the end, the plane is in the middle, and all of the surface is shown."""
    yield page
    page.locator("#section-offset").evaluate("slider => { slider.value = 0.5; }")
    page.check('input[name="section-shown"][value="both"]', force=True)
    page.check('input[name="section"][value="off"]', force=True)


def cut(page: Page, act: Callable[[], Any]) -> float:
    """Changes the plane of the section; returns the length of its lines."""
    with page.expect_response(lambda response: response.url.endswith("/v1/intersect")):
        act()
    page.wait_for_selector("#section-row:visible")
    page.wait_for_function("document.documentElement.dataset.state === 'ready'")
    return read_value(page, "section")


def choose_plane(page: Page, name: str) -> float:
    """Chooses a section across an axis, or a free one; returns the length of its lines."""
    return cut(page, lambda: page.check(f'input[name="section"][value="{name}"]', force=True))


def test_a_section_may_have_any_normal_and_an_exact_offset(cut_page: Page) -> None:
    """All sections are circles of a sphere of radius 1."""
    page = cut_page
    page.click("#open")
    perform(page, lambda: page.click('[data-example="sphere"]'))
    assert choose_plane(page, "free") == pytest.approx(2 * math.pi, rel=1e-3)
    assert page.inner_text("#section-offset-value") == "n · p = 0"
    valuetext = page.get_attribute("#section-offset", "aria-valuetext")
    assert valuetext == "0.577 x + 0.577 y + 0.577 z = 0"
    page.fill("#section-position", "0.6")
    length = cut(page, lambda: page.press("#section-position", "Enter"))
    assert length == pytest.approx(2 * math.pi * 0.8, rel=1e-3)
    page.focus("#view")
    page.keyboard.press("1")
    wait_for_axes(page, "+x", "+z")
    cut(page, lambda: page.click("#section-facing"))
    normal = [float(page.input_value(f"#section-n{axis}")) for axis in "xyz"]
    assert normal == pytest.approx([0, -1, 0], abs=1e-4)
    page.set_checked("#show-net", False)
    click_surface(page, 0.22)
    cut(page, lambda: page.click("#section-here"))
    place = read_place(page)
    offset = sum(a * b for a, b in zip(normal, place, strict=True))
    assert float(page.input_value("#section-position")) == pytest.approx(offset)


def test_the_plane_follows_its_handle_and_hides_one_side(cut_page: Page) -> None:
    page = cut_page
    page.set_checked("#show-net", False)
    choose_plane(page, "x")
    page.focus("#view")
    page.keyboard.press("5")  # from above: x points to the right
    wait_for_axes(page, "+x", "+y")
    left, top, right, bottom = box_of(page.locator("#section-handle"))
    x, y = (left + right) / 2, (top + bottom) / 2
    page.mouse.move(x, y)
    page.mouse.down()
    cut(page, lambda: page.mouse.move(x + 40, y + 10, steps=4))
    page.mouse.up()
    moved = float(page.input_value("#section-position"))
    assert 0 < moved < 1
    assert page.inner_text("#section-offset-value") == f"x = {moved:g}"
    page.wait_for_function(
        """left => {
          const { x } = document.querySelector('#section-handle').getBoundingClientRect();
          return Math.abs(x - left) < 3;
        }""",
        arg=left + 40,
    )
    # While the plane moves, the lines follow it.
    requests: list[Any] = []
    page.on("request", lambda request: requests.append(request.url))
    page.locator("#section-offset").evaluate(
        """async (slider, middle) => {
          for (let k = 0; k < 40; k += 1) {
            slider.value = middle + 0.01 * Math.sin(k);
            slider.dispatchEvent(new Event('input'));
            await new Promise((resolve) => setTimeout(resolve, 10));
          }
        }""",
        (moved + 1) / 2,
    )
    assert sum(url.endswith("/v1/intersect") for url in requests) > 2
    page.fill("#section-position", str(moved))
    page.press("#section-position", "Enter")
    page.check('input[name="section-shown"][value="above"]', force=True)
    page.mouse.click(x - 20, y - 30)  # hidden
    page.mouse.click(x + 60, y - 30)
    page.wait_for_selector("#probe-row:visible")
    assert read_place(page)[0] > moved
    assert page.is_hidden("#probe-distance-row")


def test_stripes_are_where_the_reflection_says(modules: Page) -> None:
    """A sphere without perspective: at (x, y) its normal is (x, y, √(1 − x² − y²))."""
    found = modules.evaluate(
        """async () => {
          const { buildZebra } = await import('/page/zebra.js');
          const { Mesh, OrthographicCamera, Scene, SphereGeometry, WebGLRenderer } =
            await import('/page/three.js');
          const [size, stripes] = [128, 5];
          const canvas = document.createElement('canvas');
          [canvas.width, canvas.height] = [size, size];
          const renderer = new WebGLRenderer({ canvas, preserveDrawingBuffer: true });
          const gl = renderer.getContext();
          gl.disable(gl.RASTERIZER_DISCARD); // see WITHOUT_PIXELS
          const material = buildZebra();
          material.uniforms.stripes.value = stripes;
          material.uniforms.axis.value.set(1, 0, 0);
          const scene = new Scene();
          scene.add(new Mesh(new SphereGeometry(1, 200, 150), material));
          const camera = new OrthographicCamera(-1, 1, 1, -1, 0, 10);
          camera.position.z = 5;
          renderer.render(scene, camera);
          const pixels = new Uint8Array(4 * size * size);
          gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          const results = { dark: 0, light: 0, wrong: 0 };
          for (let j = 0; j < size; j += 1) {
            for (let i = 0; i < size; i += 1) {
              const [x, y] = [i, j].map((k) => (2 * k + 1) / size - 1);
              if (Math.hypot(x, y) > 0.8) continue;
              const z = Math.sqrt(1 - x * x - y * y);
              const reflected = 2 * z * x; // the x of 2 (n · e) n - e, where e = (0, 0, 1)
              const wave = Math.abs(2 * ((stripes * Math.acos(reflected) / Math.PI) % 1) - 1);
              if (Math.abs(wave - 0.5) < 0.25) continue; // near an edge of a stripe
              const isLight = pixels[4 * (j * size + i)] > 128;
              if (isLight !== wave > 0.5) results.wrong += 1;
              else results[isLight ? 'light' : 'dark'] += 1;
            }
          }
          renderer.dispose();
          return results;
        }"""
    )
    assert found["wrong"] == 0
    assert min(found["dark"], found["light"]) > 500


def test_zebra_is_a_look_with_number_and_axis_of_its_stripes(page: Page) -> None:
    assert page.is_hidden("#zebra")
    page.check('input[name="look"][value="zebra"]', force=True)
    page.fill("#stripes", "30")
    page.check('input[name="stripe-axis"][value="x"]', force=True)
    assert page.inner_text("#stripes-value") == "30"
    assert "kink" in page.inner_text("#look-explained")
    page.check('input[name="look"][value="shaded"]', force=True)
    assert page.is_hidden("#zebra")


def test_faces_and_edges_of_a_part_have_names(page: Page) -> None:
    page.click("#open")
    surface = perform(page, lambda: page.click('[data-example="plate-with-holes"]'))["surface"]
    assert page.inner_text("#h-faces") == "Faces and edges"
    names = page.locator("#face option").all_inner_texts()
    assert names[1:] == [f"face {k} ({face['name']})" for k, face in enumerate(surface["faces"])]
    assert page.locator("#edge option").count() == 1 + len(surface["edges"])
    left, top, right, bottom = box_of(page.locator("#view"))
    x, y = (left + right) / 2, top + 0.35 * (bottom - top)
    page.mouse.move(x, y)
    page.wait_for_selector("#hovered:visible")
    name = page.inner_text("#hovered")
    assert name in names
    click_surface(page, 0.35)
    assert page.inner_text("#probe").startswith(f"{name}, u ")
    assert page.evaluate("document.querySelector('#face').selectedOptions[0].text") == name
    # Now only the edges of this face are listed, each with the face on its other side.
    number = int(name.split()[1])
    edges = {edge for loop in surface["faces"][number]["loops"] for edge in loop["edges"]}
    listed = page.locator("#edge option").all_inner_texts()[1:]
    assert {int(text.split(",")[0].removeprefix("edge ")) for text in listed} == edges
    assert all(", to face " in text for text in listed)
    # Edge 4 is a quarter of a circle of radius 3. Keys alone choose it.
    page.focus("#face")
    page.keyboard.press("Home")
    page.focus("#edge")
    while page.input_value("#edge") != "4":
        page.keyboard.press("ArrowDown")
    page.wait_for_selector("#edge-text:has-text('length')")
    assert page.inner_text("#edge-text").startswith("edge 4, of face 1 (")
    assert page.inner_text("#edge-text").endswith(f": length {1.5 * math.pi:.5f}")
    assert page.evaluate("document.querySelector('#face').selectedIndex") == 0
    page.mouse.move(0, 0)
    page.click("#open")
    perform(page, lambda: page.click('[data-example="utah-teapot"]'))
    assert page.locator("#face option").all_inner_texts()[1:3] == ["rim", "body"]
    assert page.inner_text("#h-faces") == "Parts"
    assert page.is_hidden("#edge")


def test_faces_of_members_have_the_names_of_the_report(modules: Page) -> None:
    found = modules.evaluate(
        """async () => {
          const { findFace, listEdges, listFaces } = await import('/page/faces.js');
          const root = { userData: { name: 'group' }, parent: null };
          const build = (name, count, faces) => ({
            userData: { name }, parent: root,
            geometry: { index: { count: 3 * count }, userData: faces ? { faces } : {} },
          });
          const meshes = [
            build('box', 5, { first_triangle: [0, 2], face: [0, 2] }), build('lid', 1, null)];
          const parts = ['box/top', 'box/side', 'box/face 2', 'lid'].map((name) => ({ name }));
          const faces = listFaces(meshes, parts, false);
          const loops = [{ edges: [0, 1] }];
          const brep = { type: 'brep', edges: [{ curve: {} }, {}], faces: [{ loops }, { loops }] };
          return {
            texts: faces.map(({ text }) => text),
            ends: faces.map(({ first, end }) => [first, end]),
            hit: findFace(faces, { object: meshes[0], faceIndex: 4 }),
            missed: findFace(faces, { object: root, faceIndex: 0 }),
            edges: listEdges(brep).map(({ text, faces, curve }) => [text, faces, curve !== null]),
            none: listEdges({ type: 'bspline' }),
          };
        }"""
    )
    assert found == {
        "texts": ["box: face 0 (top)", "box: face 2", "lid"],
        "ends": [[0, 2], [2, 5], [0, 1]],
        "hit": 1,
        "missed": -1,
        "edges": [["edge 0", [0, 1], True], ["edge 1", [0, 1], False]],
        "none": [],
    }


def test_a_crosshair_clicks_by_keys(page: Page) -> None:
    page.set_checked("#show-net", False)
    page.focus("#view")
    page.keyboard.press("c")
    assert page.is_visible("#crosshair")
    start = box_of(page.locator("#crosshair"))
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowLeft")
    end = box_of(page.locator("#crosshair"))
    assert (end[0] - start[0], end[1] - start[1]) == (-8, -48)
    with page.expect_response(lambda response: "/v1/project" in response.url):
        page.keyboard.press("Enter")
    page.wait_for_selector("#probe-row:visible")
    x, y, z = read_place(page)
    assert z == pytest.approx(x * y)
    page.keyboard.press("Escape")
    assert page.is_hidden("#crosshair")
    # Without the crosshair, arrows turn the view.
    before = page.evaluate("document.querySelector('#axes line').getAttribute('x2')")
    page.keyboard.press("ArrowLeft")
    page.wait_for_function(
        "before => document.querySelector('#axes [data-axis] line').getAttribute('x2') !== before",
        arg=before,
    )


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "size"), [("light", LAPTOP), ("dark", PHONE)])
def test_axe_finds_no_violations_in_these_states(
    cut_page: Page, scheme: Any, size: tuple[int, int]
) -> None:
    page = cut_page
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.click("#open")
    perform(page, lambda: page.click('[data-example="plate-with-holes"]'))
    choose_plane(page, "free")
    page.click("#views summary")
    assert list_violations(page) == []
    page.keyboard.press("Escape")
    click_surface(page, 0.5, 60)
    page.select_option("#edge", index=1)
    page.wait_for_selector("#edge-text:has-text('length')")
    page.focus("#view")
    page.keyboard.press("c")
    assert list_violations(page) == []
    page.click("label:has(> [value=zebra])")
    assert list_violations(page) == []
    page.click("label:has(> [value=shaded])")
    page.emulate_media(color_scheme="light")
    page.check('input[name="section"][value="off"]', force=True)
    page.click("#open")
    perform(page, lambda: page.click('[data-example="hair"]'))  # other tests need the resolution
