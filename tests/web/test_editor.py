"""The editor in headless Chromium: control points, numbers in the panel, requests, and errors."""

import json
import math
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

from service.encoders.registry import FORMATS
from tools.browser import Stage, record_page
from tools.editor import (
    READY,
    SADDLE,
    drag,
    perform,
    read_point,
    read_value,
    reset_editor,
    select_point,
    show,
)


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle and default choices; the console must stay empty."""
    editor.messages.clear()
    reset_editor(editor.page)
    yield editor.page
    assert editor.messages == []


def test_the_panel_shows_the_numbers_of_the_mesh(page: Page) -> None:
    assert read_value(page, "triangles") == 72
    assert read_value(page, "vertices") == 49
    assert page.inner_text("#open-edges") == "24"
    assert read_value(page, "server-time") >= 0  # 0 if the service had the mesh in its cache
    assert read_value(page, "round-trip") > 0
    # In 6 × 6 cells, a bilinear patch deviates by |twist| / 4 · (1/6)². The twist of the saddle,
    # P₀₀ − P₀₁ − P₁₀ + P₁₁, is 4. The bound of the deviation adds rounding.
    assert read_value(page, "deviation") == pytest.approx(4 / 4 / 36, rel=0.2)


def test_a_drag_moves_the_point_and_can_be_undone(page: Page) -> None:
    requests: list[Any] = []
    page.on("request", lambda request: requests.append(request.post_data_json))
    assert "Drag a black point" in page.inner_text("#invitation")
    assert page.is_hidden("#point-fields")
    start, old_deviation = select_point(page, 4), read_value(page, "deviation")
    old_point = read_point(page)
    drag(page, start, (60, -50))
    new_point = read_point(page)
    assert page.input_value("#point") == "4"
    assert new_point != old_point
    assert new_point[2] > old_point[2]  # a drag upwards on the screen increases z
    page.wait_for_function(
        "deviation => Number(document.getElementById('deviation').value) != deviation",
        arg=old_deviation,
    )
    # The last request has the point that the panel shows, and the full resolution.
    documents = [request for request in requests if request]
    assert documents[-1]["surface"]["control_net"][1][1] == new_point
    assert documents[-1]["resolution"] == 6
    assert page.is_visible("#edited")
    assert page.is_hidden("#invitation")
    page.click("#undo")
    page.wait_for_selector(READY)
    assert read_point(page) == old_point
    assert read_value(page, "deviation") == old_deviation
    page.click("#redo")
    page.wait_for_selector(READY)
    assert read_point(page) == new_point
    page.keyboard.press("Control+z")
    page.wait_for_selector(READY)
    assert read_point(page) == old_point
    page.keyboard.press("Control+Shift+Z")
    assert read_point(page) == new_point
    page.click("#reset")
    page.wait_for_selector(READY)
    assert read_point(page) == old_point
    assert page.is_hidden("#edited")


def test_undo_takes_one_step_also_while_a_number_is_typed(page: Page) -> None:
    """A number that is typed, but not entered, is a step of its own, and can be redone."""
    select_point(page, 2)
    old_point = read_point(page)
    page.fill("#z", "1.75")
    page.press("#z", "Enter")
    page.focus("#x")
    page.keyboard.press("Control+a")
    page.keyboard.type("5")
    assert read_point(page) == [5, old_point[1], 1.75]
    undone, entered = [old_point[0], old_point[1], 1.75], [5, old_point[1], 1.75]
    for keys, point in (
        ("Control+z", undone),
        ("Control+Shift+z", entered),
        ("Control+z", undone),
        ("Control+y", entered),
        ("Control+z", undone),
        ("Control+z", old_point),
    ):
        page.keyboard.press(keys)
        assert read_point(page) == point, keys
    assert page.is_disabled("#undo")
    # Leaving the field, whose number the document has, is no step.
    page.focus("#y")
    assert page.is_enabled("#redo")
    # An empty field keeps the last number that was typed.
    page.fill("#y", "3")
    page.fill("#y", "")
    page.press("#y", "Tab")
    assert read_point(page)[1] == 3
    page.click("#undo")
    assert read_point(page) == old_point
    assert page.is_disabled("#undo")


def test_a_key_that_is_held_a_drag_and_a_slider_are_one_step_each(page: Page) -> None:
    select_point(page, 4)
    points = [read_point(page)]
    page.focus("#view")
    for _ in range(4):
        page.keyboard.down("ArrowUp")  # each but the first repeats
    page.keyboard.up("ArrowUp")
    points.append(read_point(page))
    drag(page, select_point(page, 4), (30, -20))
    points.append(read_point(page))
    assert points[0] != points[1] != points[2]
    page.locator("#weight-slider").evaluate(
        """slider => {
            [1, 2, 3].forEach((value) => {
                slider.value = value;
                slider.dispatchEvent(new Event('input'));
            });
            slider.dispatchEvent(new Event('change'));
        }"""
    )
    assert page.input_value("#weight") == "8"
    page.click("#undo")
    assert page.input_value("#weight") == "1"
    for point in reversed(points[:2]):
        page.click("#undo")
        assert read_point(page) == point
    assert page.is_disabled("#undo")


def test_undo_ends_a_drag_and_takes_only_the_drag_back(page: Page) -> None:
    select_point(page, 4)
    page.fill("#z", "1.5")
    page.press("#z", "Enter")
    start, old_point = select_point(page, 4), read_point(page)
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + 30, start[1] - 20)
    dragged = read_point(page)
    assert dragged != old_point
    page.keyboard.press("Control+z")
    assert read_point(page) == old_point
    page.mouse.move(start[0] + 60, start[1] - 40)
    page.mouse.up()
    assert read_point(page) == old_point
    page.keyboard.press("Control+Shift+z")
    assert read_point(page) == dragged


def test_clicks_on_the_surface_show_parameters_curvature_and_distance(page: Page) -> None:
    box = page.locator("#view").bounding_box()
    assert box is not None
    mouse_x, mouse_y = box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.4
    assert page.is_hidden("#probe-row")
    page.mouse.click(mouse_x, mouse_y)
    page.wait_for_selector("#probe-row:visible")
    u, v = map(float, (page.locator("#probe").get_attribute("value") or "").split(","))
    # The saddle is z = x y over [−1, 1]², with the Gaussian curvature K = −1 / (1 + x² + y²)².
    x, y = 2 * u - 1, 2 * v - 1
    text = page.inner_text("#probe").replace("−", "-")
    curvature = float(text.split("K ")[1].split(",")[0])
    assert curvature == pytest.approx(-1 / (1 + x * x + y * y) ** 2, rel=1e-3)
    assert page.is_hidden("#probe-distance-row")
    page.mouse.click(mouse_x + 40, mouse_y)
    page.wait_for_selector("#probe-distance-row:visible")
    u, v = map(float, (page.locator("#probe").get_attribute("value") or "").split(","))
    second_x, second_y = 2 * u - 1, 2 * v - 1
    distance = math.dist((second_x, second_y, second_x * second_y), (x, y, x * y))
    assert read_value(page, "probe-distance") == pytest.approx(distance, rel=1e-6)
    page.click("#open")
    page.click('[data-example="saddle"]')
    page.wait_for_selector(READY)
    assert page.is_hidden("#probe-row")


def test_area_and_volume_are_measured_after_a_click(page: Page) -> None:
    page.click("#measure")
    page.wait_for_selector("#measure", state="hidden")
    area = 5.123157101093616  # four times the integral of (1 + x² + y²)^½ over the unit square
    assert read_value(page, "area") == pytest.approx(area, rel=1e-6)
    # These are the four sides of the patch; `#open-edges` counts the edges of triangles on them.
    assert page.inner_text("#volume") == "none: 4 open or inconsistent edges"
    page.click("#open")
    page.click('[data-example="sphere"]')
    page.wait_for_selector(READY)
    assert page.inner_text("#volume") == "–"
    page.click("#measure")
    page.wait_for_selector("#measure", state="hidden")
    assert read_value(page, "volume") == pytest.approx(4 / 3 * math.pi, rel=1e-5)


def cut(page: Page, axis: str) -> tuple[float, str]:
    """Chooses the axis of the section; returns the length of its lines, and the text about them."""
    with page.expect_response(lambda response: response.url.endswith("/v1/intersect")):
        page.check(f'input[name="section"][value="{axis}"]', force=True)
    page.wait_for_selector("#section-row:visible")
    return read_value(page, "section"), page.inner_text("#section")


def list_offsets(documents: list[Any]) -> list[float]:
    """The offsets of the planes in these requests."""
    requests = [document for document in documents if document and "planes" in document]
    return [offset for request in requests for offset in request["planes"]["offsets"]]


def cut_and_click(page: Page) -> tuple[tuple[float, str], str, str, list[float]]:
    """The section across z, its offset, and face and parameters of a click on the surface."""
    section, offset = cut(page, "z"), page.inner_text("#section-offset-value")
    page.check('input[name="section"][value="off"]', force=True)
    box = page.locator("#view").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.35)
    page.wait_for_selector("#probe-row:visible")
    parameters = (page.locator("#probe").get_attribute("value") or "").split(",")
    face = page.inner_text("#probe").split(", ")[0]
    return section, offset, face, [float(parameter) for parameter in parameters]


def test_a_section_follows_its_slider_and_the_surface(page: Page) -> None:
    assert page.is_hidden("#section-slider")
    # The saddle is z = x y: a plane x = 0 cuts it in one line of length 2.
    length, text = cut(page, "x")
    assert length == pytest.approx(2)
    assert text == "0 loops, 1 open line, length 2"
    page.click("#open")
    with page.expect_response(lambda response: response.url.endswith("/v1/intersect")):
        page.click('[data-example="sphere"]')
    page.wait_for_selector("#section:has-text('1 loop, 0 open lines')")
    assert read_value(page, "section") == pytest.approx(2 * math.pi, rel=1e-3)
    assert page.inner_text("#section-offset-value") == "x = 0"
    documents: list[Any] = []
    page.on("request", lambda request: documents.append(request.post_data_json))
    # The slider moves in one go from the middle to 0.8 of the way from −1 to 1.
    page.locator("#section-offset").evaluate(
        """slider => [0.6, 0.7, 0.8].forEach((value) => {
            slider.value = value;
            slider.dispatchEvent(new Event('input'));
        })"""
    )
    page.wait_for_function(
        "length => Math.abs(Number(document.getElementById('section').value) - length) < 0.01",
        arg=2 * math.pi * 0.8,
    )
    assert list_offsets(documents) == [0.6]
    assert page.get_attribute("#section-offset", "aria-valuetext") == "x = 0.6"
    with page.expect_response(lambda response: response.url.endswith("/v1/intersect")):
        page.fill("#section-offset", "0.5")
    page.check('input[name="section"][value="off"]', force=True)
    assert page.is_hidden("#section-row")
    assert page.is_hidden("#section-slider")
    page.fill("#resolution", "7")
    page.wait_for_selector(READY)
    assert page.is_hidden("#section-row")
    assert list_offsets(documents) == [0.6, 0]


def test_sections_of_a_part_are_loops_in_any_unit(page: Page) -> None:
    """A unit scales the scene to metres, but the numbers that the page shows are in the unit."""
    page.click("#open")
    surface = perform(page, lambda: page.click('[data-example="plate-with-holes"]'))["surface"]
    found = cut_and_click(page)
    # Half way up, the border of the plate and those of its three holes: two of radius 3, one of 8.
    (length, text), offset, face, parameters = found
    assert offset == "z = 4"
    assert text.startswith("4 loops, 0 open lines, length ")
    assert length > 2 * math.pi * (3 + 3 + 8)
    assert face.startswith("face ")
    page.click("#open")
    page.fill("#paste", json.dumps(surface | {"metres_per_unit": 0.001}))
    perform(page, lambda: page.click("#paste-open"))
    *others, parameters_in_unit = cut_and_click(page)
    assert others == [*found[:3]]
    assert parameters_in_unit == pytest.approx(parameters, abs=2)  # the view has moved a little
    page.click("#open")
    perform(page, lambda: page.click('[data-example="hair"]'))  # later tests need the resolution


def test_a_refused_section_is_an_error_until_it_is_switched_off(editor: Stage) -> None:
    """This test ignores the console, because the browser itself writes refused requests there."""
    page = editor.page
    reset_editor(page)
    cut(page, "y")
    page.click("#open")
    page.click('[data-example="hair"]')  # a tube
    page.wait_for_selector("#problem:visible")
    assert "exact patches" in page.inner_text("#problem")
    assert page.is_hidden("#section-row")
    page.wait_for_selector(READY)  # the mesh is shown
    page.check('input[name="section"][value="off"]', force=True)
    assert page.is_hidden("#problem")


def test_a_drag_with_an_axis_changes_one_coordinate(page: Page) -> None:
    start, old_point = select_point(page, 4), read_point(page)
    page.check('input[name="axis"][value="x"]', force=True)
    drag(page, start, (50, -40))
    new_point = read_point(page)
    assert new_point[0] != old_point[0]
    assert new_point[1:] == old_point[1:]


def test_points_and_switches_work_by_keyboard(page: Page) -> None:
    page.focus("#view")
    page.keyboard.press("]")
    assert page.input_value("#point") == "1"
    page.keyboard.press("[")
    assert page.input_value("#point") == "4"
    old_point = read_point(page)
    page.keyboard.press("ArrowUp")
    page.wait_for_selector(READY)
    assert read_point(page)[2] > old_point[2]
    assert read_point(page)[:2] == old_point[:2]
    # Keys of one letter change switches.
    page.keyboard.press("n")
    page.keyboard.press("w")
    assert not page.is_checked("#show-net")
    assert page.is_checked("#show-wires")
    page.keyboard.press("y")
    assert page.is_checked('input[name="axis"][value="y"]')
    page.keyboard.press("Escape")
    assert page.input_value("#point") == ""
    assert page.is_hidden("#point-fields")


def test_coordinates_and_weights_can_be_typed(page: Page) -> None:
    select_point(page, 1)
    page.fill("#z", "2.5")
    page.press("#z", "Enter")
    page.wait_for_selector(READY)
    page.fill("#weight", "4")
    request = perform(page, lambda: page.press("#weight", "Enter"))
    assert request["surface"]["control_net"][0][0][2] == 2.5
    assert request["surface"]["weights"] == [[4, 1], [1, 1]]
    assert float(page.input_value("#weight-slider")) == 2  # the slider shows log₂ of the weight 4


def test_sliders_change_the_request(page: Page) -> None:
    assert perform(page, lambda: page.fill("#resolution", "9"))["resolution"] == 9
    assert read_value(page, "triangles") == 162
    request = perform(
        page, lambda: page.check('input[name="accuracy"][value="tolerance"]', force=True)
    )
    assert request["relative_tolerance"] == 0.001
    assert "resolution" not in request
    old_triangles = read_value(page, "triangles")
    perform(page, lambda: page.fill("#tolerance", "-4"))
    assert read_value(page, "triangles") > old_triangles


def test_the_curvature_is_shown_with_a_legend(page: Page) -> None:
    request = perform(page, lambda: page.check('input[name="look"][value="gaussian"]', force=True))
    assert request["curvatures"] is True
    page.wait_for_selector("#legend")
    assert "Gaussian curvature" in page.inner_text("#legend")


def test_for_a_tube_the_choice_of_curvature_is_disabled(page: Page) -> None:
    perform(page, lambda: page.check('input[name="look"][value="mean"]', force=True))
    page.click("#open")
    request = perform(page, lambda: page.click('[data-example="hair"]'))  # a tube
    assert "curvatures" not in request
    assert page.is_disabled('input[name="look"][value="mean"]')
    assert page.is_checked('input[name="look"][value="shaded"]')
    assert page.inner_text("#point-count") == "of 8"


def test_an_example_can_be_opened_from_the_list(page: Page) -> None:
    page.click("#open")
    first_button = page.locator("#examples button").first
    assert first_button.get_attribute("data-example") == "utah-teapot"
    perform(page, lambda: page.click('[data-example="sphere"]'))
    assert page.inner_text("#title") == "Sphere"
    assert page.inner_text("#open-edges") == "none"
    assert page.inner_text("#point-count") == "of 28"


def test_a_part_is_meshed_by_tolerance_and_a_click_names_its_face(page: Page) -> None:
    page.click("#open")
    request = perform(page, lambda: page.click('[data-example="plate-with-holes"]'))
    assert "resolution" not in request
    assert request["relative_tolerance"] > 0
    assert request["overlays"] == ["boundary"]
    assert page.is_hidden("#net-switch")
    assert page.is_hidden("#point-section")
    assert page.is_visible("#measure")
    assert page.is_disabled('input[name="accuracy"][value="resolution"]')
    assert page.is_checked('input[name="accuracy"][value="tolerance"]')
    assert page.inner_text("#open-edges") == "none"
    assert page.inner_text("#left-out") == "none"
    assert 0 <= read_value(page, "gaps") < read_value(page, "deviation")
    assert page.is_hidden("#probe-row")
    box = page.locator("#view").bounding_box()
    assert box is not None
    mouse_x, mouse_y = box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.35
    page.mouse.click(mouse_x, mouse_y)
    page.wait_for_selector("#probe-row:visible")
    face, u, v, gaussian, mean = page.inner_text("#probe").split(", ")
    number = int(face.split()[1])
    top = request["surface"]["faces"][number]
    assert face == f"face {number} ({top['name']})"
    assert "color" not in top
    assert (u[:2], v[:2], gaussian, mean) == ("u ", "v ", "K 0", "H 0")
    assert 0 < read_value(page, "probe-deviation") <= read_value(page, "deviation") * 1.01
    assert page.inner_text("#probe-deviation").startswith("at most ")
    assert page.is_hidden("#probe-distance-row")
    page.click("#measure")
    page.wait_for_selector("#measure", state="hidden")
    assert 0 < read_value(page, "volume") < 60 * 40 * 8
    # A tube has no faces, and no gaps.
    page.click("#open")
    perform(page, lambda: page.click('[data-example="hair"]'))
    assert page.is_hidden("#gaps-row")
    assert page.is_hidden("#probe-row")


def test_an_error_shows_its_field_and_can_be_undone(editor: Stage) -> None:
    """This test ignores the console, because the browser itself writes refused requests there."""
    page = editor.page
    reset_editor(page)
    old_triangles = read_value(page, "triangles")
    select_point(page, 2)
    page.fill("#weight", "0")
    page.press("#weight", "Enter")
    page.wait_for_selector('html[data-state="refused"]')
    problem = page.inner_text("#problem")
    assert "needed a number above 0" in problem
    assert "/surface/weights/0/1" in problem
    assert read_value(page, "triangles") == old_triangles
    page.fill("#point", "1")
    page.press("#point", "Enter")
    page.click("#problem-point")
    assert page.input_value("#point") == "2"
    page.click("#problem-undo")
    page.wait_for_selector(READY)
    assert page.is_hidden("#problem")


def test_a_refused_surface_leaves_the_earlier_surface_in_the_page(editor: Stage) -> None:
    page = editor.page
    reset_editor(page)
    select_point(page, 3)
    page.click("#open")
    # The service refuses a net of 2 × 1 points.
    page.fill("#paste", '{"name": "lost", "control_net": [[[0, 0, 0]], [[1, 0, 0]]]}')
    page.click("#paste-open")
    page.wait_for_selector("#problem-title:text('The text was not opened')")
    assert "/surface/control_net" in page.inner_text("#problem-errors")
    assert page.is_hidden("#problem-point")
    assert page.is_hidden("#problem-undo")
    assert page.get_attribute("html", "data-state") == "ready"
    assert page.inner_text("#title") == "Saddle"
    assert page.input_value("#point") == "3"
    assert read_value(page, "triangles") == 72
    page.click("#problem-close")


def test_a_link_to_a_missing_surface_shows_an_error(editor: Stage, server: str) -> None:
    page = editor.page
    page.goto(f"{server}/?surface={'0' * 64}")
    page.wait_for_selector('html[data-state="refused"]')
    assert page.inner_text("#problem-title") == "There is no surface at this address"
    assert page.inner_text("#title") == "Open a surface"
    # Without a surface the page sends no requests, disables its exports, and offers an example.
    request_count = len(editor.requested_urls)
    page.check('input[name="accuracy"][value="tolerance"]', force=True)
    assert page.is_disabled("#copy-link")
    assert page.is_hidden("#loading")
    assert len(editor.requested_urls) == request_count
    page.click("#problem-example")
    perform(page, lambda: page.click('[data-example="saddle"]'))
    assert page.is_hidden("#problem")
    assert page.is_enabled("#copy-link")


def test_a_surface_of_many_patches_is_opened_at_resolution_1(editor: Stage) -> None:
    """The service refuses 37 × 37 patches of 64 × 64 cells; then the page requests resolution 1."""
    page = editor.page
    reset_editor(page)
    perform(page, lambda: page.fill("#resolution", "64"))
    rows = [[[i, j, (i * j) % 7] for j in range(40)] for i in range(40)]
    page.click("#open")
    page.fill("#paste", json.dumps({"type": "bspline", "control_net": rows, "knots": "uniform"}))
    page.click("#paste-open")
    page.wait_for_selector(READY)
    assert page.input_value("#resolution") == "1"
    assert read_value(page, "triangles") == 2 * 37 * 37


def test_text_that_is_not_json_is_not_sent(page: Page) -> None:
    page.click("#open")
    page.fill("#paste", "{control_net}")
    page.click("#paste-open")
    page.wait_for_selector("#paste-problem:text('not the JSON of a surface')")
    net = [[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]
    page.fill("#paste", json.dumps({"surface": {"control_net": net, "name": "mine"}}))
    perform(page, lambda: page.click("#paste-open"))
    assert page.inner_text("#title") == "mine"
    assert page.inner_text("#point-count") == "of 6"


def test_the_buttons_of_formats_download_the_mesh(page: Page) -> None:
    suffixes = page.locator("#formats button").all_inner_texts()
    assert suffixes == [f".{fmt.suffix}" for fmt in FORMATS]
    for fmt in FORMATS:
        with (
            page.expect_response(lambda response: "/v1/mesh" in response.url) as response,
            page.expect_download() as download,
        ):
            page.click(f'[data-format="{fmt.suffix}"]')
        assert download.value.suggested_filename == f"saddle.{fmt.suffix}"
        file = download.value.path().read_bytes()
        if fmt.suffix == "json":  # the client of the page reads it
            assert json.loads(file) == response.value.json()
        else:
            assert file == response.value.body()


def test_if_the_service_does_not_respond_the_page_offers_to_try_again(editor: Stage) -> None:
    page = editor.page
    reset_editor(page)
    select_point(page, 1)
    page.route("**/v1/mesh*", lambda route: route.abort())
    page.fill("#x", "3")
    page.wait_for_selector('html[data-state="away"]')
    assert "away" in page.inner_text("#problem")
    page.unroute("**/v1/mesh*")
    page.click("#problem-retry")
    page.wait_for_selector(READY)
    assert page.is_hidden("#problem")


def test_without_webgl_all_but_the_picture_works(server: str, editor: Stage) -> None:
    page = editor.page.context.new_page()  # the profile of the editor has cached the scripts
    stage = record_page(page)
    page.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
        "  return kind.startsWith('webgl') ? null : get.call(this, kind, ...more); };"
    )
    show(page, server + SADDLE)
    assert "WebGL" in page.inner_text("#no-webgl")
    assert read_value(page, "triangles") == 72
    page.fill("#point", "4")
    page.press("#point", "Enter")
    page.fill("#z", "3")
    request = perform(page, lambda: page.press("#z", "Enter"))
    assert request["surface"]["control_net"][1][1] == [1, 1, 3]
    page.close()
    assert stage.messages == []
