// Mouse, fingers and keys in the view choose and move control points. Gestures that do not hit a
// point move the camera, or draw a rectangle around points.

import { Vector2 } from './three.js';
import { Drag, nudge, roundToStep } from './moves.js';
import { Rectangle } from './rectangle.js';
import { lineOf } from './selection.js';

/** @typedef {import('./net-view.js').NetView} NetView */
/** @typedef {import('./scene.js').Stage} Stage */
/** @typedef {import('./state.js').State} State */
/** @typedef {import('./moves.js').Axis} Axis */

/**
 * @typedef {object} Controls
 * @property {() => Axis} axis  along which points move
 * @property {(axis: Axis) => void} setAxis
 * @property {() => boolean} choosesSeveral  whether points are added to the chosen ones without Shift, too
 * @property {() => void} fit  shows the whole surface
 * @property {(mouse: Vector2) => void} click  for a click that hits no control point
 */

/** Radians by which an arrow key turns the camera, and the factor of the distance for + and -. */
const [TURN, ZOOM] = [0.08, 1.12];
/** The most pixels that the mouse may move during a click; a longer move turns the surface. */
const CLICK_PIXELS = 4;

/** @param {Stage} stage @param {NetView} netView @param {State} state @param {Controls} controls */
export function watchPointer(stage, netView, state, controls) {
  const { canvas } = stage;
  /** @type {Drag | null} */
  let drag = null;
  let hasMoved = false;
  /** The selection after a click on a point that does not move it. @type {number[]} */
  let clicked = [];
  const rectangle = new Rectangle();
  /** Where the mouse was pressed without hitting a control point. @type {{x: number, y: number} | null} */
  let pressPosition = null;

  /** The position of an event on the canvas: in pixels, and from -1 to 1. */
  const locate = (/** @type {PointerEvent} */ event) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    return { x, y, mouse: new Vector2(2 * x / width - 1, 1 - 2 * y / height) };
  };

  const hover = (/** @type {PointerEvent} */ event) => {
    const { x, y } = locate(event);
    const index = event.pointerType === 'mouse' ? netView.pick(x, y, 'mouse') : -1;
    canvas.dataset.cursor = index >= 0 ? 'point' : '';
    netView.highlight(state.selection, index);
  };

  /** Chooses the pressed point; a point that is chosen already leads the others. @param {number} index @param {boolean} adds */
  const press = (index, adds) => {
    const others = state.selection.filter((i) => i !== index);
    const isChosen = others.length < state.selection.length;
    if (adds) clicked = isChosen ? others : [...others, index];
    else clicked = [index];
    state.select(adds || isChosen ? [...others, index] : [index]);
    state.commit();
  };

  // These listeners come before those of the camera, on the same canvas.
  canvas.addEventListener('pointerdown', (event) => {
    // A second finger does not turn the camera while the first draws a rectangle.
    if (rectangle.start) event.stopImmediatePropagation();
    if (event.button !== 0 || drag || rectangle.start) return;
    const { x, y, mouse } = locate(event);
    const index = netView.pick(x, y, event.pointerType);
    const adds = event.shiftKey || controls.choosesSeveral();
    pressPosition = index < 0 ? { x, y } : null;
    if (index < 0 && !adds) return;
    event.stopImmediatePropagation();
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    if (index < 0) {
      rectangle.begin({ x, y });
      return;
    }
    press(index, adds);
    const point = state.point();
    if (point === undefined || netView.matrices === undefined) return;
    const toScene = netView.matrices[state.net.handles[index].frame];
    drag = new Drag(stage, point, toScene, mouse);
    hasMoved = false;
    canvas.dataset.cursor = 'drag';
  }, { capture: true });

  canvas.addEventListener('pointermove', (event) => {
    if (drag === null) {
      if (rectangle.start) {
        event.stopImmediatePropagation();
        if (event.isPrimary) rectangle.show(locate(event));
      } else if (event.buttons === 0) hover(event);
      return;
    }
    event.stopImmediatePropagation();
    hasMoved = true;
    state.move(drag.to(locate(event).mouse, controls.axis(), event.shiftKey), false);
  }, { capture: true });

  const finish = (/** @type {boolean} */ isKept) => {
    if (drag === null) return;
    drag = null;
    canvas.dataset.cursor = '';
    if (!hasMoved && isKept) state.select(clicked);
    if (!hasMoved) return;
    if (isKept) state.commit();
    else state.cancel();
  };
  canvas.addEventListener('pointerup', (event) => {
    const { x, y, mouse } = locate(event);
    const isClick = pressPosition !== null
      && Math.hypot(x - pressPosition.x, y - pressPosition.y) < CLICK_PIXELS;
    pressPosition = null;
    const corner = rectangle.end();
    if (corner && !isClick) {
      const found = netView.pickBetween(corner, { x, y });
      state.select([...state.selection.filter((i) => !found.includes(i)), ...found]);
    }
    if (drag === null && isClick) controls.click(mouse);
    finish(true);
  });
  canvas.addEventListener('pointercancel', () => { rectangle.end(); finish(false); });
  // Undo, or another document, ends a drag.
  state.listen((change) => {
    if (drag === null || (change !== 'surface' && change !== 'opened')) return;
    drag = null;
    canvas.dataset.cursor = '';
  });
  canvas.addEventListener('pointerleave', () => {
    if (drag === null) netView.highlight(state.selection, -1);
  });

  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (pressKey(event)) event.preventDefault();
  });
  canvas.addEventListener('keyup', (event) => {
    if (event.key.startsWith('Arrow') || event.key.startsWith('Page')) state.commit();
  });
  canvas.addEventListener('blur', () => { if (drag === null) state.commit(); });

  /** Handles a key; returns whether the key has a meaning. @param {KeyboardEvent} event @returns {boolean} */
  function pressKey(event) {
    const { key } = event;
    const count = state.net.handles.length;
    const lower = key.toLowerCase();
    if (key === 'Escape') {
      if (rectangle.start) rectangle.end();
      else if (drag) finish(false);
      else state.choose(-1);
    } else if ('[]{}'.includes(key) && count) chooseNext(key);
    else if (lower === 'a') state.selectAround(Array.from({ length: count }, (_, i) => i));
    else if (lower === 'r' && state.chosen >= 0) state.selectAround(lineOf(state.net, state.chosen, event.shiftKey ? 1 : 0));
    else if (lower === 'f') controls.fit();
    else if (lower === 'n') state.set({ net: !state.settings.net });
    else if (lower === 'w') state.set({ wires: !state.settings.wires });
    else if (lower === 'x' || lower === 'y' || lower === 'z') {
      controls.setAxis(controls.axis() === lower ? 'free' : lower);
    } else if (key === '+' || key === '=') stage.zoom(1 / ZOOM);
    else if (key === '-') stage.zoom(ZOOM);
    else return step(event);
    return true;
  }

  /** Chooses the next or the previous point: alone, or with Shift (braces) too. @param {string} key */
  function chooseNext(key) {
    const count = state.net.handles.length;
    const next = key === ']' || key === '}' ? state.chosen + 1 : Math.max(state.chosen, 0) - 1;
    const index = (next + count) % count;
    const isAdded = key === '{' || key === '}';
    state.select(isAdded ? [...state.selection.filter((i) => i !== index), index] : [index]);
  }

  /**
   * Handles an arrow key, Page Up or Page Down: moves the chosen point; without one, arrow keys turn the
   * camera. Returns whether the key has a meaning. @param {KeyboardEvent} event
   */
  function step({ key, shiftKey }) {
    const { handle } = state;
    const point = state.point();
    if (handle === undefined || point === undefined || netView.matrices === undefined) {
      const turns = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN] };
      const turn = turns[/** @type {keyof typeof turns} */ (key)];
      if (turn) stage.turn(turn[0], turn[1]);
      return turn !== undefined;
    }
    const move = nudge(stage, netView.matrices[handle.frame], key, shiftKey);
    if (move === null) return false;
    state.move(point.map((value, i) => (move[i] ? roundToStep(value + move[i], stage) : value)), false);
    return true;
  }
}
