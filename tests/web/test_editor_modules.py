"""Modules of the editor one by one, in the browser that they are written for."""

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.encoders.text import json_text
from service.engine.build import build
from service.engine.options import MeshOptions
from service.schemas.surfaces import definition
from service.surface.examples import EXAMPLES, find
from tests.web.browser import Stage
from tests.web.clients import visit


@pytest.fixture(scope="module")
def page(server: str, visitor: Stage) -> Page:
    """An empty page of the service, which may import what the service serves."""
    visit(visitor, f"{server}/health")
    return visitor.page


def read_net(page: Page, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Control points of an example in the scene, and the pairs of them that are joined."""
    document = json_text(definition(find(name).surface())).decode()
    reported: dict[str, Any] = page.evaluate(
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
    points = np.array([[*point, 0, 0][:3] for point in reported["points"]])
    frames = np.array(reported["frames"]).reshape(-1, 4, 4)
    placed = np.einsum("hij,hj->hi", frames, np.column_stack([points, np.ones(len(points))]))
    return placed[:, :3], np.array(reported["edges"]).reshape(-1, 2)


def turn_upright(points: np.ndarray, up: str) -> np.ndarray:
    return points if up == "y" else points @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def list_lines(points: np.ndarray, pairs: np.ndarray) -> set[frozenset[tuple[float, ...]]]:
    """Lines as pairs of end points, without lines of length 0, at poles."""
    ends = np.round(points, 6)[pairs] + 0.0
    result = {frozenset(map(tuple, line.tolist())) for line in ends}
    return {line for line in result if len(line) == 2}


@pytest.mark.parametrize("name", EXAMPLES)
def test_nets_are_those_that_the_service_draws(page: Page, name: str) -> None:
    """The lines of the overlay `control_net`, which the service computes on its own."""
    model = find(name).surface().lower()
    mesh = build(model, MeshOptions(resolution=(1, 1), overlays=("control_net",)))
    expected = set().union(
        *(
            list_lines(turn_upright(overlay.positions + mesh.origin, mesh.up), overlay.segments)
            for overlay in mesh.overlays
        )
    )
    assert list_lines(*read_net(page, name)) == expected


def test_shared_vertices_and_weights_are_changed_in_a_copy(page: Page) -> None:
    """The document before the change stays unchanged; equal parts are shared."""
    reported = page.evaluate(
        """async () => {
          const { netOf, weightAt, withPoint, withWeight } = await import('/page/net.js');
          const vertices = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]];
          const before = { type: 'patches', vertices, patches: [[[0, 1], [2, 3]]] };
          const handle = netOf(before).handles[3];
          const moved = withPoint(before, handle, [1, 1, 5]);
          const weighed = withWeight(moved, handle, 2);
          return {
            before, weighed, shared: moved.patches === before.patches,
            weights: [weightAt(before, handle), weightAt(weighed, handle)],
          };
        }"""
    )
    assert reported["before"]["vertices"][3] == [1, 1, 0]
    assert "weights" not in reported["before"]
    assert reported["weighed"]["vertices"][3] == [1, 1, 5]
    assert reported["weighed"]["weights"] == [1, 1, 1, 2]
    assert reported["weights"] == [1, 2]
    assert reported["shared"]


def test_one_request_is_in_flight_and_the_newest_wins(page: Page) -> None:
    reported = page.evaluate(
        """async () => {
          const { MeshRequests } = await import('/page/mesh-requests.js');
          const [sent, answered, failed, answers] = [[], [], [], []];
          let most = 0;
          const requests = new MeshRequests({
            send: (wish) => {
              sent.push(wish);
              most = Math.max(most, sent.length - answers.filter((answer) => answer.done).length);
              return new Promise((resolve, reject) => {
                answers.push({ resolve, reject, done: false });
              });
            },
            answered: (answer) => { answered.push(answer); },
            failed: (error) => { failed.push(error.message); },
            idle: () => {},
          });
          const settle = async (index, act) => {
            answers[index].done = true;
            act(answers[index]);
            await new Promise((resolve) => setTimeout(resolve));
          };
          requests.ask('a'); requests.ask('b'); requests.ask('c');
          await settle(0, ({ resolve }) => resolve('A'));
          requests.forget();
          requests.ask('d');
          await settle(1, ({ resolve }) => resolve('C'));
          requests.ask('e');
          await settle(2, ({ reject }) => reject(new Error('stale')));
          await settle(3, ({ reject }) => reject(new Error('last')));
          return { sent, answered, failed, most };
        }"""
    )
    # c replaced b; C is the result for a document that is no longer open; e replaced d.
    assert reported == {
        "sent": ["a", "c", "d", "e"],
        "answered": ["A"],
        "failed": ["last"],
        "most": 1,
    }


def test_the_history_is_bounded_and_a_drag_is_one_step(page: Page) -> None:
    reported = page.evaluate(
        """async () => {
          const { History } = await import('/page/history.js');
          const history = new History({ n: 0 });
          history.preview({ n: 0.3 });
          history.preview({ n: 0.6 });
          history.keep({ n: 1 });
          const steps = history.past.length;
          for (let n = 2; n <= 500; n += 1) history.keep({ n });
          const kept = history.past.length;
          history.preview({ n: 501 });
          history.cancel();
          const cancelled = history.present.n;
          history.undo();
          const undone = history.present.n;
          history.redo();
          history.undo();
          history.reset();
          const reset = history.present.n;
          history.undo();
          const [last, redo] = [history.present.n, history.canRedo];
          return { steps, kept, cancelled, undone, reset, last, redo };
        }"""
    )
    assert reported == {
        "steps": 1,
        "kept": 200,
        "cancelled": 500,
        "undone": 499,
        "reset": 0,
        "last": 499,
        "redo": True,
    }
