"""Files and texts that a person opens in the editor: by the button, by a drop, by pasting."""

import json
import math
from base64 import b64encode
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from tests.cad import FOLDER, IFC, OPEN_TETRAHEDRON
from tests.web.test_page_access import list_violations
from tools.browser import Stage
from tools.editor import SADDLE, perform, read_value, reset_editor, select_point, show

TIMEOUT = 20_000


@pytest.fixture
def net_file(tmp_path: Path) -> Path:
    """A file of control points."""
    net = np.zeros((3, 4, 3))
    net[..., 0], net[..., 1] = np.indices((3, 4))
    np.save(tmp_path / "sail.npy", net)
    return tmp_path / "sail.npy"


@pytest.fixture(autouse=True)
def _reopen_saddle(editor: Stage) -> Iterator[None]:
    """Opens the saddle before each test, and after it: choices of other tests are not for parts."""
    reset_editor(editor.page)
    yield

    def open_saddle() -> None:
        editor.page.click("#open")
        editor.page.click('[data-example="saddle"]')

    perform(editor.page, open_saddle)


def open_file(stage: Stage, path: Path) -> None:
    """Chooses a file in the dialog."""
    stage.page.click("#open")
    stage.page.set_input_files("#file", path)


def count_requests(stage: Stage) -> int:
    """The requests to the interface; pictures of examples are loaded at any time."""
    return sum("/v1/" in url and "/image.png" not in url for url in stage.requested_urls)


def test_a_file_of_control_points_opens(editor: Stage, net_file: Path) -> None:
    perform(editor.page, lambda: open_file(editor, net_file))
    assert editor.page.inner_text("#title") == "sail.npy"
    assert editor.page.is_hidden("#problem")


def test_a_format_that_is_not_read_is_named_with_what_to_export(
    editor: Stage, tmp_path: Path
) -> None:
    path = tmp_path / "LOFT.BREP"
    path.write_bytes(b"DBRep_DrawableShape\n")
    sent = count_requests(editor)
    open_file(editor, path)
    editor.page.wait_for_selector("#problem:not([hidden])", timeout=TIMEOUT)
    text = editor.page.inner_text("#problem-errors")
    assert "does not read files of Open CASCADE (BREP)" in text
    assert "STEP" in text
    assert count_requests(editor) == sent, "no request for a file that cannot be read"
    editor.page.click("#problem-close")


def test_a_cad_file_opens_and_its_report_is_shown(editor: Stage, tmp_path: Path) -> None:
    path = tmp_path / "tip.STEP"
    path.write_bytes(OPEN_TETRAHEDRON)
    perform(editor.page, lambda: open_file(editor, path))
    assert editor.page.inner_text("#title") == "tip.STEP"
    description = editor.page.inner_text("#description")
    assert description.startswith("A file of yours, read by the service: 3 faces.")
    assert "Not in the surface: 1 more (#57: " in description
    assert editor.page.inner_text("#triangles") == "3"
    assert editor.page.is_hidden("#problem")


def test_the_error_of_a_cad_file_is_shown(editor: Stage, tmp_path: Path) -> None:
    path = tmp_path / "model.step"
    path.write_bytes(IFC)
    open_file(editor, path)
    editor.page.wait_for_selector("#problem:not([hidden])", timeout=TIMEOUT)
    assert "Industry Foundation Classes" in editor.page.inner_text("#problem-errors")
    editor.page.click("#problem-close")


def test_an_assembly_of_parts_is_meshed_by_tolerance(editor: Stage) -> None:
    """Its members name definitions, which are the parts."""
    path = FOLDER / "assembly_m_ap242.step"
    request = perform(editor.page, lambda: open_file(editor, path))
    assert request["surface"]["type"] == "group"
    assert request["surface"]["definitions"]
    assert request["relative_tolerance"] > 0
    assert editor.page.is_hidden("#problem")


NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
GEOMDL = {
    "shape": {
        "type": "surface",
        "count": 1,
        "data": [
            {
                **{"degree_u": 1, "degree_v": 1, "size_u": 2, "size_v": 2},
                **{"knotvector_u": [0, 0, 1, 1], "knotvector_v": [0, 0, 1, 1]},
                "control_points": {"points": [point for row in NET for point in row]},
            }
        ],
    }
}
TRANSFER = """(files, text) => {
    const transfer = new DataTransfer();
    for (const [name, content] of Object.entries(files)) {
        const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
        transfer.items.add(new File([bytes], name));
    }
    if (text) transfer.setData('text/plain', text);
    return transfer;
}"""


def drop(page: Page, files: dict[str, bytes], text: str = "", event: str = "drop") -> None:
    """Drops files or a text on the page, or pastes them."""
    contents = {name: b64encode(content).decode() for name, content in files.items()}
    page.evaluate(
        f"""([files, text, kind]) => {{
            const transfer = ({TRANSFER})(files, text);
            const options = {{ bubbles: true, cancelable: true }};
            document.getElementById('view').dispatchEvent(kind === 'paste'
                ? new ClipboardEvent('paste', {{ ...options, clipboardData: transfer }})
                : new DragEvent(kind, {{ ...options, dataTransfer: transfer }}));
        }}""",
        [contents, text, event],
    )


def array_file(array: Any) -> bytes:
    """A file of NumPy."""
    content = BytesIO()
    np.save(content, np.array(array, float))
    return content.getvalue()


def read_problem(page: Page) -> str:
    """The title and the text of the message; closes it."""
    page.wait_for_selector("#problem:visible")
    text = f"{page.inner_text('#problem-title')}: {page.inner_text('#problem')}"
    page.click("#problem-close")
    return text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "content", "got"),
    [
        ("holiday.jpg", b"\xff\xd8\xff\xe0", "pictures (PNG, JPEG"),
        ("net.json", b"\x89PNG\r\n\x1a\n", "pictures (PNG, JPEG"),
        ("all.zip", b"PK\3\4" + bytes(26) + b"a.txt", "the files in it, unpacked"),
        ("report", b"%PDF-1.7", "documents and tables (PDF"),
        ("part.fbx", b"Kaydara FBX Binary", "triangles or polygons (STL"),
        ("scene.3mf", bytes(100), "the surface from which the mesh was made"),
        ("top.SLDASM", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "SolidWorks"),
        ("house.step", b"ISO-10303-21;HEADER;FILE_SCHEMA(('IFC4'));", "Industry Foundation"),
        ("empty.json", b"", "The file is empty"),
        ("notes.qqq", b"\0\1\2\3", "Neither the name nor the content"),
        ("nan.json", b'{"control_net": [[[NaN, 0, 0]]]}', "JSON has neither NaN nor Infinity"),
        ("row.json", b"[[0, 0, 0], [1, 0, 0]]", "one row of points"),
        ("number.json", b"7", "an array of rows of points"),
    ],
)
def test_a_file_that_is_no_surface_is_named_without_a_request(
    editor: Stage, name: str, content: bytes, got: str
) -> None:
    sent = count_requests(editor)
    drop(editor.page, {name: content})
    text = read_problem(editor.page)
    assert text.startswith(f"{name} was not opened: ")
    assert got in text
    assert count_requests(editor) == sent
    assert editor.page.inner_text("#title") == "Saddle"


def test_polygons_in_a_file_of_surfaces_are_named_by_the_service(editor: Stage) -> None:
    patch = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bezier\ndeg 1 1\n"
        b"surf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n"
    )
    drop(editor.page, {"cube.obj": patch + b"f 1 2 3\n"})
    text = read_problem(editor.page)
    assert text.startswith("cube.obj was not opened: ")
    assert "polygons" in text


def test_a_file_that_is_too_large_is_not_sent(editor: Stage) -> None:
    editor.page.evaluate(
        """() => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(70_000_000)], 'large.npy'));
            const options = { bubbles: true, cancelable: true, dataTransfer: transfer };
            document.body.dispatchEvent(new DragEvent('drop', options));
        }"""
    )
    text = read_problem(editor.page)
    assert "larger than this service accepts" in text
    assert "70.0 MB" in text


def test_a_refused_file_leaves_what_was_open(editor: Stage) -> None:
    """Neither the picture, the steps, the address, nor the chosen point change; none is blamed."""
    page = editor.page
    select_point(page, 4)
    page.fill("#z", "1.5")
    perform(page, lambda: page.press("#z", "Enter"))
    page.wait_for_timeout(500)  # the address follows after a pause
    before = page.evaluate("[location.href, document.title, history.length]")
    triangles = read_value(page, "deviation")
    net = np.zeros((2, 2, 3))
    net[1, 1, 2] = math.nan
    drop(page, {"broken.npy": array_file(net)})
    page.wait_for_selector("#problem:visible")
    assert page.is_hidden("#problem-point")
    assert page.is_hidden("#problem-undo")
    assert "/surface/control_net/1/1/2" in page.inner_text("#problem-errors")
    assert read_problem(page).startswith("broken.npy was not opened: ")
    assert page.evaluate("[location.href, document.title, history.length]") == before
    assert page.input_value("#point") == "4"
    assert page.input_value("#z") == "1.5"
    assert read_value(page, "deviation") == triangles
    assert page.get_attribute("html", "data-state") == "ready"
    perform(page, lambda: page.click("#undo"))
    assert page.input_value("#z") == "1"


def test_arrays_open_as_nets_patches_and_splines(editor: Stage) -> None:
    page = editor.page
    request = perform(page, lambda: drop(page, {"net.json": json.dumps(NET).encode()}))
    assert request["surface"] == {"type": "bezier", "control_net": NET}
    assert "An array of 2 × 2 points: a Bézier patch" in page.inner_text("#description")
    weighted = [[[*point, 2] for point in row] for row in NET]
    request = perform(page, lambda: drop(page, {}, json.dumps(weighted)))
    assert request["surface"]["control_net"] == NET
    assert request["surface"]["weights"] == [[2, 2], [2, 2]]
    planar = [[[0, 0], [0, 1]], [[1, 0], [1, 1]]]
    request = perform(page, lambda: drop(page, {}, json.dumps(planar)))
    assert request["surface"]["control_net"] == planar
    grid = [[[i, j, i * j % 3] for j in range(20)] for i in range(2)]
    request = perform(page, lambda: drop(page, {"grid.npy": array_file(grid)}))
    assert (request["surface"]["type"], request["surface"]["degree"]) == ("bspline", [1, 3])
    request = perform(page, lambda: drop(page, {"grid.json": json.dumps(grid).encode()}))
    assert (request["surface"]["type"], request["surface"]["degree"]) == ("bspline", [1, 3])
    shifted = [[[x + 1, y, 1 - z] for x, y, z in row] for row in NET]
    request = perform(page, lambda: drop(page, {}, json.dumps([NET, shifted]), "paste"))
    assert request["surface"]["type"] == "patches"
    assert len(request["surface"]["vertices"]) == 6


def test_json_of_geomdl_is_known_by_its_beginning(editor: Stage) -> None:
    page = editor.page
    request = perform(page, lambda: drop(page, {"arc.json": json.dumps(GEOMDL).encode()}))
    assert request["surface"]["type"] == "bspline"
    page.click("#open")
    page.fill("#paste", json.dumps(GEOMDL))
    perform(page, lambda: page.click("#paste-open"))
    assert page.is_hidden("#problem")


def test_several_files_open_as_one_group(editor: Stage, net_file: Path, tmp_path: Path) -> None:
    page = editor.page
    (tmp_path / "patch.json").write_text(json.dumps({"control_net": NET, "up": "z"}))
    (tmp_path / "tip.stp").write_bytes(OPEN_TETRAHEDRON)
    (tmp_path / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    paths = [net_file, *(tmp_path / name for name in ("patch.json", "tip.stp", "photo.png"))]
    assert page.get_attribute("#file", "multiple") is not None
    page.click("#open")
    request = perform(page, lambda: page.set_input_files("#file", paths))
    members = request["surface"]["members"]
    assert [member["name"] for member in members] == ["sail", "patch", "tip"]
    # The unit of the CAD file, centimetres, is that of the group; the nets are in metres.
    assert request["surface"]["metres_per_unit"] == 0.01
    assert members[0]["matrix"][0][0] == 100
    assert "matrix" not in members[2]
    assert page.inner_text("#title") == "3 files"
    description = page.inner_text("#description")
    assert description.startswith("A group of your files: sail.npy, patch.json, tip.stp.")
    assert "Not opened: photo.png (The service does not read files of pictures" in description


def test_a_folder_opens_with_the_folders_in_it(editor: Stage, tmp_path: Path) -> None:
    page = editor.page
    folder = tmp_path / "hull"
    (folder / "bow").mkdir(parents=True)
    for path in ("b10.json", "b9.json", "bow/a.json", ".hidden.json"):
        (folder / path).write_text(json.dumps(NET))
    session = page.context.new_cdp_session(page)

    def drop_folder() -> None:
        data = {"items": [], "files": [str(folder)], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            session.send(
                "Input.dispatchDragEvent", {"type": kind, "x": 300, "y": 200, "data": data}
            )

    request = perform(page, drop_folder)
    assert [member["name"] for member in request["surface"]["members"]] == ["b9", "b10", "a"]


def test_options_of_a_request_set_the_controls(editor: Stage) -> None:
    page = editor.page
    surface = {"control_net": NET}
    document: dict[str, Any] = {"surface": surface, "resolution": [3, 5], "faces": "quads"}
    request = perform(page, lambda: drop(page, {"r.json": json.dumps(document).encode()}))
    assert request["resolution"] == 5
    assert page.input_value("#resolution") == "5"
    description = page.inner_text("#description")
    assert "Resolution 5 in place of 3 × 5." in description
    assert 'The page has no control for "faces".' in description
    document = {"surface": {"control_net": NET}, "tolerance": 0.03}
    request = perform(page, lambda: drop(page, {}, json.dumps(document)))
    assert request["relative_tolerance"] == pytest.approx(0.03 / math.sqrt(3), rel=0.1)
    assert page.is_checked('[name="accuracy"][value="tolerance"]')
    page.check('[name="accuracy"][value="resolution"]', force=True)


def test_an_edited_surface_is_downloaded_and_opens_to_the_same(
    editor: Stage, tmp_path: Path
) -> None:
    page = editor.page
    select_point(page, 4)
    page.fill("#z", "1.25")
    edited = perform(page, lambda: page.press("#z", "Enter"))
    with page.expect_download() as download:
        page.click("#save-json")
    assert download.value.suggested_filename == "saddle.surface.json"
    path = tmp_path / "saddle.surface.json"
    download.value.save_as(path)
    assert json.loads(path.read_text())["surface"] == edited["surface"]
    opened = perform(page, lambda: open_file(editor, path))
    assert opened["surface"] == edited["surface"]


def test_pasting_into_a_field_opens_nothing(editor: Stage) -> None:
    page = editor.page
    sent = count_requests(editor)
    page.click("#open")
    page.evaluate(
        f"""([text]) => document.getElementById('paste').dispatchEvent(new ClipboardEvent('paste',
            {{ bubbles: true, cancelable: true, clipboardData: ({TRANSFER})({{}}, text) }}))""",
        [json.dumps(NET)],
    )
    page.keyboard.press("Escape")
    assert count_requests(editor) == sent


def test_a_dialog_does_not_cover_what_was_dropped_on_it(editor: Stage) -> None:
    editor.page.click("#help")
    perform(editor.page, lambda: drop(editor.page, {"net.json": json.dumps(NET).encode()}))
    assert editor.page.locator("dialog[open]").count() == 0
    assert editor.page.inner_text("#title") == "net"


def test_axe_finds_no_violations_beside_a_file_that_was_not_opened(editor: Stage) -> None:
    drop(editor.page, {"holiday.jpg": b"\xff\xd8\xff\xe0"})
    editor.page.wait_for_selector("#problem:visible")
    assert list_violations(editor.page) == []
    editor.page.click("#problem-close")


def test_a_page_of_an_earlier_version_says_that_it_must_be_reloaded(
    editor: Stage, server: str
) -> None:
    """Its module that reads files has gone from the service."""
    page = editor.page.context.new_page()
    show(page, server + SADDLE)
    page.route("**/page/later-*", lambda route: route.fulfill(status=404))
    drop(page, {"net.json": json.dumps(NET).encode()})
    assert "reload the page; your drafts are kept" in read_problem(page)
    assert page.get_attribute("html", "data-state") == "ready"
    page.close()
