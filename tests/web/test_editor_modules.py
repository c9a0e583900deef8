"""Single modules of the editor, which the browser imports by their names."""

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.encoders.text import json_text
from service.engine.build import build
from service.engine.options import MeshOptions
from service.schemas.surfaces import definition
from service.surface.examples.catalogue import find
from tools.examples import UNTRIMMED


@pytest.fixture(scope="module")
def page(modules: Page) -> Page:
    return modules


def read_net(page: Page, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Control points (N, 3) of an example in the editor's scene, and edges (M, 2) between them.

    In the editor, a handle is a control point that can be dragged, and a frame is the placement
    (4 × 4, row by row) of its surface in the scene.
    """
    document = json_text(definition(find(name).surface())).decode()
    net: dict[str, Any] = page.evaluate(
        """async (text) => {
          const { netOf, pointAt } = await import('/page/net.js');
          const surface = JSON.parse(text);
          const net = netOf(surface);
          const points = net.handles.map((handle) => pointAt(surface, handle));
          const frames = net.handles.map(({ frame }) => net.frames[frame]);
          return { points, frames, edges: net.edges };
        }""",
        document,
    )
    points = np.array([[*point, 0][:3] for point in net["points"]])  # in the plane, z is 0
    frames = np.array(net["frames"]).reshape(-1, 4, 4)
    scene_points = np.einsum("hij,hj->hi", frames, np.column_stack([points, np.ones(len(points))]))
    return scene_points[:, :3], np.array(net["edges"]).reshape(-1, 2)


def turn_upright(points: np.ndarray, up: str) -> np.ndarray:
    """The points, rotated to y up."""
    return points if up == "y" else points @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def list_lines(points: np.ndarray, pairs: np.ndarray) -> set[frozenset[tuple[float, ...]]]:
    """Lines as sets of their two end points; lines of length 0, at poles, are left out."""
    ends = np.round(points, 6)[pairs] + 0.0  # −0 becomes 0
    lines = {frozenset(map(tuple, line.tolist())) for line in ends}
    return {line for line in lines if len(line) == 2}


@pytest.mark.parametrize("name", UNTRIMMED)
def test_the_editor_draws_the_control_net_of_the_service(page: Page, name: str) -> None:
    """The service computes the lines of the overlay `control_net` by other code."""
    model = find(name).surface().lower()
    mesh = build(model, MeshOptions(resolution=(1, 1), overlays=("control_net",)))
    expected = set().union(
        *(
            list_lines(turn_upright(overlay.positions + mesh.origin, mesh.up), overlay.segments)
            for overlay in mesh.overlays
        )
    )
    assert list_lines(*read_net(page, name)) == expected


def test_changes_of_points_and_weights_return_a_changed_copy(page: Page) -> None:
    """The document before the change stays as it was; the copy shares its unchanged parts."""
    result = page.evaluate(
        """async () => {
          const { netOf, weightAt } = await import('/page/net.js');
          const { moveTogether, weighTogether } = await import('/page/selection.js');
          const vertices = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]];
          const original = { type: 'patches', vertices, patches: [[[0, 1], [2, 3]]] };
          const net = netOf(original);
          const handle = net.handles[3];
          const moved = moveTogether(original, net, [3], [1, 1, 5]);
          const weighed = weighTogether(moved, net, [3], 2);
          return {
            original, weighed, sharesPatches: moved.patches === original.patches,
            weights: [weightAt(original, handle), weightAt(weighed, handle)],
          };
        }"""
    )
    assert result["original"]["vertices"][3] == [1, 1, 0]
    assert "weights" not in result["original"]
    assert result["weighed"]["vertices"][3] == [1, 1, 5]
    assert result["weighed"]["weights"] == [1, 1, 1, 2]
    assert result["weights"] == [1, 2]
    assert result["sharesPatches"]


def test_the_lines_of_a_section_are_in_the_scene_until_there_are_none(page: Page) -> None:
    """The document has z up and half metres; the scene has y up and metres."""
    result = page.evaluate(
        """async () => {
          const { Scene, Vector3 } = await import('/page/three.js');
          const { SectionView } = await import('/page/section-view.js');
          const { toDocument, toScene } = await import('/page/frame.js');
          const surface = { up: 'z', metres_per_unit: 0.5 };
          const scene = new Scene();
          const view = new SectionView({ scene, draw: () => {} });
          const lines = [[[2, 4, 6], [2, 8, 6], [2, 8, 4]], [[0, 0, 0], [2, 0, 0]]];
          view.show(lines.map((points) => points.map((point) => toScene(surface, point))));
          scene.updateMatrixWorld(true);
          const [group] = scene.children;
          const ends = group.children.map((object) => {
            const position = object.geometry.getAttribute('position');
            return Array.from({ length: position.count }, (_, i) => {
              const point = new Vector3().fromBufferAttribute(position, i);
              return toDocument(surface, point.applyMatrix4(object.matrixWorld).toArray());
            });
          });
          const first = toScene(surface, lines[0][0]);
          view.show([]);
          return { ends, first, remaining: scene.children.length };
        }"""
    )
    pairs = [[2, 4, 6], [2, 8, 6], [2, 8, 6], [2, 8, 4], [0, 0, 0], [2, 0, 0]]
    assert np.array_equal(result["ends"], [pairs, pairs])  # drawn faintly, and strongly
    assert result["first"] == [1, 3, -2]
    assert result["remaining"] == 0


def test_the_history_has_200_steps_and_a_drag_or_a_reset_is_one_step(page: Page) -> None:
    """`preview` shows a drag that is running, and `keep` ends it as a step of the history.

    Undo and redo first make the running drag a step; `cancel` undoes it. Each document is a
    number n.
    """
    result = page.evaluate(
        """async () => {
          const { History } = await import('/page/history.js');
          const history = new History({ n: 0 });
          history.preview({ n: 0.3 });
          history.preview({ n: 0.6 });
          history.keep({ n: 1 });
          const stepsOfDrag = history.past.length;
          for (let n = 2; n <= 500; n += 1) history.keep({ n });
          const stepsOfMany = history.past.length;
          history.preview({ n: 501 });
          history.cancel();
          const afterCancel = history.present.n;
          history.undo();
          const afterUndo = history.present.n;
          history.redo();
          history.undo();
          history.preview({ n: 0.9 });
          history.redo();
          const [afterRedoInDrag, isDragOver] = [history.present.n, history.before === null];
          history.undo();
          const afterUndoOfDrag = history.present.n;
          history.redo();
          const afterRedoOfDrag = history.present.n;
          history.reset();
          const afterReset = history.present.n;
          history.undo();
          const [afterUndoOfReset, canRedo] = [history.present.n, history.canRedo];
          return {
            stepsOfDrag, stepsOfMany, afterCancel, afterUndo, afterRedoInDrag, isDragOver,
            afterUndoOfDrag, afterRedoOfDrag, afterReset, afterUndoOfReset, canRedo,
          };
        }"""
    )
    assert result == {
        "stepsOfDrag": 1,
        "stepsOfMany": 200,
        "afterCancel": 500,
        "afterUndo": 499,
        "afterRedoInDrag": 0.9,
        "isDragOver": True,
        "afterUndoOfDrag": 499,
        "afterRedoOfDrag": 0.9,
        "afterReset": 0,
        "afterUndoOfReset": 0.9,
        "canRedo": True,
    }


def test_a_step_that_changes_nothing_is_no_step_and_keeps_what_can_be_redone(page: Page) -> None:
    result = page.evaluate(
        """async () => {
          const { History } = await import('/page/history.js');
          const first = { net: [[1, 2], [3, 4]], name: 'n' };
          const history = new History(first);
          const undoable = [];
          history.keep({ ...first, net: [[1, 2], [3, 5]] });
          history.undo();
          history.keep({ net: [[1, 2], [3, 4]], name: 'n' });
          undoable.push(history.canUndo, history.present === first);
          history.preview({ ...first, net: [[9, 2], [3, 4]] });
          undoable.push(history.canUndo, history.canRedo);
          history.preview({ net: [[1, 2], [3, 4]], name: 'n' });
          undoable.push(history.canUndo, history.canRedo);
          history.redo();
          undoable.push(history.present.net[1][1]);
          return undoable;
        }"""
    )
    assert result == [False, True, True, False, False, True, 5]
