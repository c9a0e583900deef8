"""Files that a person opens in the editor, by the button as by a drop."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.cad import FOLDER, IFC, OPEN_TETRAHEDRON
from tools.browser import Stage
from tools.editor import perform

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
    """Opens the saddle after each test: choices of other tests are not for parts."""
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
    return sum("/v1/" in url for url in stage.requested_urls)


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
