"""Modelling in the editor: several points, rows and columns, degrees, knots, weights, mirrors."""

import json
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page

from tests.web.test_page_access import PHONE_WINDOW, list_violations
from tools.browser import Stage
from tools.editor import READY, WINDOW, drag, perform, read_point, reset_editor, select_point

Surface = dict[str, Any]

HILLS = [[[i, j, (i * j) % 3] for j in range(5)] for i in range(5)]
CLOSE_DIALOGS = """() => {
    document.querySelectorAll('dialog').forEach((each) => each.close());
    ['new-form', 'mirror-form'].forEach((id) => document.getElementById(id).reset());
}"""
SPLINE: Surface = {"type": "bspline", "degree": [3, 2], "control_net": HILLS, "up": "z"}
PATCH: Surface = {"control_net": [row[:3] for row in HILLS[:4]], "up": "z"}


@pytest.fixture
def page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle and default choices; the console must stay empty."""
    yield from open_page(editor)
    assert editor.messages == []


@pytest.fixture
def refusing_page(editor: Stage) -> Iterator[Page]:
    """The editor with the saddle; the browser may write refused requests to the console."""
    yield from open_page(editor)


def open_page(editor: Stage) -> Iterator[Page]:
    editor.messages.clear()
    reset_editor(editor.page)
    yield editor.page
    editor.page.set_viewport_size(WINDOW)
    editor.page.evaluate(CLOSE_DIALOGS)
    if editor.page.get_attribute("#choose-several", "aria-pressed") == "true":
        editor.page.click("#choose-several")
    pick(editor.page, "direction", "u")


def open_surface(page: Page, surface: Surface) -> None:
    """Opens a surface by pasting it."""
    page.click("#open")
    page.fill("#paste", json.dumps(surface))
    perform(page, lambda: page.click("#paste-open"))


def change(page: Page, button: str) -> Surface:
    """Clicks a button that changes the net; returns the surface in the request of its mesh."""
    surface = perform(page, lambda: page.click(button))["surface"]
    assert isinstance(surface, dict)
    return surface


def pick(page: Page, name: str, value: str) -> None:
    """Checks a radio button by a click on its label."""
    page.click(f'label:has(input[name="{name}"][value="{value}"])')


def along(page: Page, direction: str) -> None:
    pick(page, "direction", direction)


def undo_all(page: Page) -> None:
    """Undoes the one step that there is."""
    perform(page, lambda: page.click("#undo"))
    assert page.is_disabled("#undo")


def count_points(page: Page) -> str:
    return page.inner_text("#several-count").split(" ")[0] if page.is_visible("#several") else "1"


def shape(surface: Surface) -> tuple[int, ...]:
    return np.shape(surface["control_net"])[:2]


def points_of(server: str, surface: Surface, low: float, high: float) -> np.ndarray:
    """Points on a grid of parameters, as the service computes them."""
    places = np.linspace(low, high, 5).tolist()
    body = {"surface": surface, "uv": [[u, v] for u in places for v in places]}
    return np.array(httpx.post(f"{server}/v1/points", json=body).json()["positions"])


def test_points_are_chosen_together_by_mouse_and_keys(page: Page) -> None:
    open_surface(page, SPLINE)
    first, second = select_point(page, 7), select_point(page, 13)
    page.mouse.click(*first)
    page.keyboard.down("Shift")
    page.mouse.click(*second)
    assert count_points(page) == "2"
    assert page.input_value("#point") == "13"  # the last point leads
    page.mouse.click(*first)
    page.mouse.click(*first)
    assert (count_points(page), page.input_value("#point")) == ("2", "7")
    page.mouse.click(*second)
    page.keyboard.up("Shift")
    assert (count_points(page), page.input_value("#point")) == ("1", "7")
    page.focus("#view")
    for key, count in (("r", "5"), ("a", "25"), ("Shift+R", "5"), ("}", "6"), ("]", "1")):
        page.keyboard.press(key)
        assert count_points(page) == count, key
    page.keyboard.press("}")
    assert page.inner_text("#status") == "2 control points chosen, the last is 10"
    page.keyboard.press("Escape")
    assert page.is_hidden("#point-fields")
    along(page, "v")
    select_point(page, 7)
    page.click("#choose-line")
    assert count_points(page) == "5"
    page.click("#choose-all")
    assert count_points(page) == "25"
    page.click("#choose-none")
    assert page.is_disabled("#choose-line")


def test_a_rectangle_chooses_the_points_in_it(page: Page) -> None:
    places = [select_point(page, number) for number in (1, 2, 3, 4)]
    page.click("#choose-none")
    xs, ys = zip(*places, strict=True)
    corners = (min(xs) - 12, min(ys) - 12), (max(xs) + 12, max(ys) + 12)
    page.keyboard.down("Shift")
    page.mouse.move(*corners[0])
    page.mouse.down()
    page.mouse.move(*corners[1])
    assert page.is_visible("#rectangle")
    page.mouse.up()
    page.keyboard.up("Shift")
    assert page.is_hidden("#rectangle")
    assert count_points(page) == "4"
    page.click("#choose-none")
    # On a touch screen a mode takes the place of Shift.
    page.click("#choose-several")
    page.mouse.move(*corners[0])
    page.mouse.down()
    page.mouse.move(*corners[1])
    page.keyboard.press("Escape")  # gives the rectangle up
    page.mouse.up()
    assert page.is_hidden("#rectangle")
    assert page.is_hidden("#point-fields")


def test_taps_add_points_in_the_mode_for_several(page: Page) -> None:
    places = [select_point(page, number) for number in (1, 2, 3, 4)]
    page.click("#choose-none")
    page.click("#choose-several")
    session = page.context.new_cdp_session(page)

    def touch(*path: tuple[float, float]) -> None:
        """One finger goes down, along a path, and up."""
        for number, (x, y) in enumerate(path):
            kind = "touchMove" if number else "touchStart"
            touches = [{"x": x, "y": y}]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})
        session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    for place in places[:2]:
        touch(place)
    assert count_points(page) == "2"
    touch(places[0])
    assert count_points(page) == "1"
    xs, ys = zip(*places, strict=True)
    touch((min(xs) - 30, min(ys) - 12), (max(xs) + 30, max(ys) + 30))
    assert count_points(page) == "4"
    session.detach()


def test_chosen_points_move_together_in_one_step(page: Page) -> None:
    open_surface(page, SPLINE)
    select_point(page, 7)
    page.focus("#view")
    page.keyboard.press("r")
    net = np.array(HILLS, float)

    def moves(request: Surface) -> np.ndarray:
        moved = np.array(request["surface"]["control_net"]) - net
        assert not moved[[0, 2, 3, 4]].any()
        assert np.ptp(moved[1], axis=0) == pytest.approx(0, abs=1e-12)
        offset: np.ndarray = moved[1, 0]
        return offset

    for axis, offset in zip("xyz", ("0.1", "0", "-2"), strict=True):
        page.fill(f"#d{axis}", offset)
    request = perform(page, lambda: page.click("#move-by button"))
    assert moves(request).tolist() == pytest.approx([0.1, 0, -2])
    assert read_point(page) == [1.1, 1, -1]
    undo_all(page)
    assert read_point(page) == [1, 1, 1]
    assert count_points(page) == "5"  # the points are still chosen
    page.fill("#z", "5")
    assert moves(perform(page, lambda: page.press("#z", "Enter"))).tolist() == [0, 0, 4]
    undo_all(page)
    page.focus("#view")
    assert moves(perform(page, lambda: page.keyboard.press("ArrowRight")))[0] > 0
    undo_all(page)
    drag(page, select_all_again(page, 7), (30, -20))
    assert read_point(page) != [1, 1, 1]
    undo_all(page)
    assert read_point(page) == [1, 1, 1]
    page.fill("#weight", "2.5")
    weights = np.array(perform(page, lambda: page.press("#weight", "Enter"))["surface"]["weights"])
    assert (weights[1] == 2.5).all()
    assert weights.sum() == 20 + 5 * 2.5
    undo_all(page)


def test_a_point_that_does_not_pull_has_the_weight_0(page: Page) -> None:
    """The service allows it inside the net; at a corner it is an error (test_editor)."""
    open_surface(page, PATCH)
    select_point(page, 5)
    page.fill("#weight", "0")
    weights = perform(page, lambda: page.press("#weight", "Enter"))["surface"]["weights"]
    assert weights == [[1, 1, 1], [1, 0, 1], [1, 1, 1], [1, 1, 1]]
    assert page.is_hidden("#problem")
    undo_all(page)


def test_an_arrow_moves_points_along_an_axis(page: Page) -> None:
    assert page.is_hidden("#gizmo")
    open_surface(page, SPLINE)
    select_all_again(page, 13)
    drag(page, find_arrow(page), (3, -40))
    x, y, z = read_point(page)
    assert (x, y) == (2, 2)
    assert z > 1.2
    undo_all(page)
    # Escape gives a drag up.
    x, y = find_arrow(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 40)
    assert read_point(page)[2] > 1.2
    page.keyboard.press("Escape")
    page.mouse.up()
    page.wait_for_selector(READY)
    assert page.is_disabled("#undo")
    assert (read_point(page), count_points(page)) == ([2, 2, 1], "5")
    page.set_checked("#show-net", False)
    page.wait_for_selector("#gizmo", state="hidden")


def find_arrow(page: Page) -> tuple[float, float]:
    """The end of the arrow along z in the window, when the next frame is drawn."""
    page.evaluate("() => new Promise((drawn) => requestAnimationFrame(() => setTimeout(drawn)))")
    box = page.locator('#gizmo [data-axis="2"] circle').bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def select_all_again(page: Page, number: int) -> tuple[float, float]:
    """Chooses the row of a point; returns the position of the point in the window."""
    place = select_point(page, number)
    page.focus("#view")
    page.keyboard.press("r")
    return place


@pytest.mark.slow
@pytest.mark.parametrize(
    ("direction", "name", "added"), [("u", "rows", (6, 5)), ("v", "columns", (5, 6))]
)
def test_rows_are_added_and_removed_at_a_point(
    page: Page, server: str, direction: str, name: str, added: tuple[int, int]
) -> None:
    open_surface(page, SPLINE)
    along(page, direction)
    assert page.is_disabled("#add-line")
    assert "Choose a control point" in page.inner_text("#edit-why")
    select_point(page, 13)
    finer = change(page, "#add-line")
    assert shape(finer) == added
    assert f"The surface is the same, with 6 {name}." in page.inner_text("#edit-message")
    before, after = (points_of(server, s, 0.1, 1.9) for s in (SPLINE, finer))
    np.testing.assert_allclose(after, before, atol=1e-12)
    line = ("u", "v").index(direction)
    assert page.inner_text("#point-count") == "of 30"
    # The point in the new row is chosen: removing this row gives the surface as it was.
    coarser = change(page, "#delete-line")
    assert "The surface is the same." in page.inner_text("#edit-message")
    np.testing.assert_allclose(coarser["control_net"], HILLS, atol=1e-12)
    assert coarser["knots"][line] == "clamped"
    coarser = change(page, "#delete-line")
    assert shape(coarser) == tuple(np.subtract((5, 5), np.subtract(added, (5, 5))))
    text = page.inner_text("#edit-message")
    assert "No point of the surface has moved by more than" in text
    for _ in range(3):
        perform(page, lambda: page.click("#undo"))
    assert page.is_disabled("#undo")


def test_rows_of_a_patch_are_degrees(page: Page, server: str) -> None:
    open_surface(page, PATCH)
    select_point(page, 5)
    higher = change(page, "#add-line")
    assert shape(higher) == (5, 3)
    assert "The degree is 4 × 2." in page.inner_text("#edit-message")
    before, after = (points_of(server, s, 0, 1) for s in (PATCH, higher))
    np.testing.assert_allclose(after, before, atol=1e-12)
    undo_all(page)
    along(page, "v")
    assert shape(change(page, "#raise-degree")) == (4, 4)
    undo_all(page)
    lower = change(page, "#delete-line")
    assert shape(lower) == (4, 2)
    assert "The degree along v is 1. No point" in page.inner_text("#edit-message")
    page.click("#delete-line")
    page.wait_for_selector("#edit-problem:has-text('Degree 1 is the lowest')")
    undo_all(page)


def test_a_periodic_direction_says_that_the_surface_changes(page: Page) -> None:
    open_surface(page, SPLINE | {"knots": ["periodic", "clamped"]})
    select_point(page, 23)
    finer = change(page, "#add-line")
    assert shape(finer) == (6, 5)
    assert finer["knots"] == ["periodic", "clamped"]
    assert "between rows 5 and 1. The surface has changed" in page.inner_text("#edit-message")
    assert page.input_value("#point") == "28"
    assert shape(change(page, "#raise-degree")) > (6, 5)
    assert "the same, with more control points. The direction u is" in page.inner_text(
        "#edit-message"
    )
    perform(page, lambda: page.click("#undo"))
    select_point(page, 28)
    assert shape(change(page, "#delete-line")) == (5, 5)
    assert "is removed, and the surface has changed" in page.inner_text("#edit-message")
    page.click("#open-knot")
    page.fill("#knot", "2.5")
    clamped = change(page, "#knot-form button")
    assert "The direction u is clamped now." in page.inner_text("#edit-message")
    assert len(clamped["control_net"]) == 9


def test_a_knot_is_inserted_where_the_surface_was_clicked(page: Page, server: str) -> None:
    open_surface(page, SPLINE)
    box = page.locator("#view").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] * 0.47, box["y"] + box["height"] * 0.48)
    page.wait_for_selector("#probe-row:visible")
    _, v = map(float, (page.locator("#probe").get_attribute("value") or "").split(","))
    along(page, "v")
    page.click("#open-knot")
    assert float(page.input_value("#knot")) == pytest.approx(v, rel=1e-5)
    finer = change(page, "#knot-form button")
    assert page.is_hidden("#knot-dialog")
    assert shape(finer) == (5, 6)
    assert pytest.approx(v, rel=1e-5) in finer["knots"][1]
    before, after = (points_of(server, s, 0, 2) for s in (SPLINE, finer))
    np.testing.assert_allclose(after, before, atol=1e-12)
    undo_all(page)
    # A patch becomes a B-spline of one span, and then of two.
    open_surface(page, PATCH)
    along(page, "u")
    page.click("#open-knot")
    page.fill("#knot", "0.25")
    spline = change(page, "#knot-form button")
    assert (spline["type"], spline["degree"], shape(spline)) == ("bspline", [3, 2], (5, 3))
    before, after = (points_of(server, s, 0, 1) for s in (PATCH, spline))
    np.testing.assert_allclose(after, before, atol=1e-12)


def test_a_refused_knot_leaves_the_surface_and_says_why(refusing_page: Page) -> None:
    page = refusing_page
    open_surface(page, SPLINE)
    page.click("#open-knot")
    page.fill("#knot", "7")
    page.click("#knot-form button")
    page.wait_for_selector("#knot-problem:has-text('Needed above 0 and below 2.')")
    assert page.is_visible("#knot-dialog")
    assert page.is_disabled("#undo")
    assert list_violations(page) == []


@pytest.mark.parametrize(
    ("surface", "change_id", "reason"),
    [
        ({"type": "triangle", "control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 0]]]},
         "add-line", "A triangle has no rows"),
        ({"type": "patches", "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1]],
          "patches": [[[0, 1], [2, 3]]]}, "open-knot", "Patches share their points"),
        ({"type": "tube", "radius": 0.1, "curve": {"control_points": [[0, 0, 0], [1, 0, 1]]}},
         "raise-degree", "follows a curve"),
        ({"type": "multipatch", "surfaces": [PATCH, PATCH]},
         "raise-degree", "which of the surfaces"),
    ],
)  # fmt: skip
def test_reasons_why_a_kind_cannot_do_something_are_in_place(
    page: Page, surface: Surface, change_id: str, reason: str
) -> None:
    open_surface(page, surface)
    assert page.is_disabled(f"#{change_id}")
    assert reason in page.inner_text("#edit-why")


def test_a_part_says_why_it_has_no_net(page: Page) -> None:
    page.click("#open")
    perform(page, lambda: page.click('[data-example="plate-with-holes"]'))
    assert "untrim" in page.inner_text("#edit-why")
    assert all(page.is_disabled(f"#{name}") for name in ("add-line", "choose-all", "open-mirror"))
    page.click("#open")
    perform(page, lambda: page.click('[data-example="saddle"]'))


def test_triangles_patches_and_members_get_higher_degrees(page: Page) -> None:
    open_surface(page, {"type": "triangle", "control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 0]]]})
    assert len(change(page, "#raise-degree")["control_net"]) == 3
    page.click("#open")
    perform(page, lambda: page.click('[data-example="utah-teapot"]'))
    assert len(change(page, "#raise-degree")["patches"][0]) == 5
    open_surface(page, {"type": "multipatch", "surfaces": [PATCH, SPLINE]})
    select_point(page, 13)
    request = change(page, "#raise-degree")
    assert shape(request["surfaces"][0]) == (4, 3)
    assert request["surfaces"][1]["degree"] == [4, 2]
    undo_all(page)


def test_the_whole_surface_its_halves_and_points_are_mirrored(page: Page, server: str) -> None:
    open_surface(page, PATCH)
    page.click("#open-mirror")
    assert page.is_disabled('input[name="mirrored"][value="points"]')
    page.fill("#mirror-offset", "3")
    mirrored = change(page, "#mirror-form .primary")
    expected = points_of(server, PATCH, 0, 1).reshape(5, 5, 3)[::-1] * (-1, 1, 1) + (6, 0, 0)
    np.testing.assert_allclose(
        points_of(server, mirrored, 0, 1), expected.reshape(-1, 3), atol=1e-12
    )
    undo_all(page)
    page.click("#open-mirror")
    pick(page, "mirrored", "both")
    both = change(page, "#mirror-form .primary")
    assert both["type"] == "multipatch"
    # The halves meet at x = 3, and the mesh is one sheet.
    assert page.inner_text("#open-edges") == "36"
    undo_all(page)
    select_point(page, 5)
    page.focus("#view")
    page.keyboard.press("r")
    page.click("#open-mirror")
    pick(page, "mirrored", "points")
    pick(page, "mirror-axis", "z")
    page.fill("#mirror-offset", "0")
    net = change(page, "#mirror-form .primary")["control_net"]
    assert net[1] == [[1, 0, 0], [1, 1, -1], [1, 2, -2]]
    undo_all(page)


def test_a_group_with_a_tube_is_mirrored(page: Page) -> None:
    tube = {"type": "tube", "radius": 0.1, "curve": {"control_points": [[1, 0, 0], [1, 2, 1]]}}
    members = [{"surface": tube}, {"surface": PATCH, "name": "hill"}]
    open_surface(page, {"type": "group", "up": "z", "members": members})
    page.click("#open-mirror")
    pick(page, "mirrored", "both")
    page.fill("#mirror-offset", "0")
    both = change(page, "#mirror-form .primary")
    curves = [member["surface"].get("curve") for member in both["members"]]
    assert curves[2]["control_points"] == [[-1, 0, 0], [-1, 2, 1]]
    assert both["members"][3]["name"] == "hill"
    assert both["members"][3]["surface"]["control_net"][3][1] == [0, 1, 0]
    undo_all(page)


def test_homogeneous_points_become_places_with_weights(page: Page) -> None:
    net = [
        [[1, 0, 0, 1], [1, 0, 2, 1]],
        [[0, 1, 0, 0], [0, 1, 0, 0]],
        [[-1, 0, 0, 1], [-1, 0, 2, 1]],
    ]
    open_surface(page, {"homogeneous": True, "control_net": net})
    assert page.inner_text("#point-count") == "of 0"
    assert "homogeneous" in page.inner_text("#edit-why")
    surface = change(page, "#separate-weights")
    assert np.array(surface["weights"])[:, 0].tolist() == pytest.approx([1, 1 / 3, 1 / 3, 1])
    assert page.inner_text("#point-count") == "of 8"
    assert page.is_hidden("#separate-weights")
    undo_all(page)


def test_a_new_surface_is_made_and_can_be_edited(page: Page) -> None:
    page.click("#open")
    page.click("#new")
    assert page.is_hidden("#library")
    page.fill("#new-count-v", "7")
    page.check("#new-periodic-v")
    assert "ring" in page.inner_text("#new-hint")
    surface = change(page, "#new-form .primary")
    assert (surface["degree"], surface["knots"]) == ([3, 3], ["clamped", "periodic"])
    assert shape(surface) == (5, 7)
    assert page.inner_text("#title") == "New B-spline"
    page.click("#open")
    page.click("#new")
    pick(page, "new-kind", "bezier")
    assert page.is_hidden("#new-count-u")
    page.fill("#new-degree-u", "2")
    pick(page, "new-shape", "curved")
    surface = change(page, "#new-form .primary")
    assert (surface["type"], shape(surface)) == ("bezier", (3, 4))
    select_point(page, 5)
    page.fill("#z", "2")
    assert perform(page, lambda: page.press("#z", "Enter"))["surface"]["control_net"][1][0][2] == 2
    undo_all(page)


def test_the_fields_of_a_new_surface_are_checked(page: Page) -> None:
    page.click("#open")
    page.click("#new")
    page.fill("#new-degree-u", "6")
    page.click("#new-form .primary")  # six rows are too few for degree 6
    assert page.is_visible("#new-dialog")
    assert page.evaluate("document.activeElement.id") == "new-count-u"


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1200, 800), PHONE_WINDOW])
def test_axe_finds_no_violations_while_a_net_is_edited(page: Page, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    open_surface(page, SPLINE)
    page.click("#choose-several")
    page.click("#choose-all")
    change(page, "#add-line")
    assert list_violations(page) == []
    for opener in ("#open-knot", "#open-mirror"):
        page.click(opener)
        assert list_violations(page) == [], opener
        page.keyboard.press("Escape")
    page.click("#open")
    page.click("#new")
    assert list_violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]
    page.keyboard.press("Escape")
    page.wait_for_selector(READY)


def test_a_net_is_changed_by_keys_alone(page: Page) -> None:
    open_surface(page, SPLINE)
    page.focus("#view")
    page.keyboard.press("]")
    page.focus('input[name="direction"]:checked')
    page.keyboard.press("ArrowRight")
    for name in ("choose-all", "choose-line", "choose-none", "choose-several", "add-line"):
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == name
    surface = perform(page, lambda: page.keyboard.press("Enter"))["surface"]
    assert shape(surface) == (5, 6)
    perform(page, lambda: page.keyboard.press("Control+z"))
    assert page.is_disabled("#undo")
