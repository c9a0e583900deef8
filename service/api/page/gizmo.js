// Three arrows at the leading point, along the axes of its surface: a drag of one moves the chosen points
// along this axis. Keys do the same, so the arrows are for the mouse and for fingers alone.

import { Drag } from './moves.js';
import { Vector2, Vector3 } from './three.js';

/** @typedef {import('./net-view.js').NetView} NetView */
/** @typedef {import('./scene.js').Stage} Stage */
/** @typedef {import('./state.js').State} State */

const AXES = /** @type {const} */ (['x', 'y', 'z']);
/** The length in CSS pixels of an arrow across the view, and the least one that is shown. */
const [LENGTH, MIN_LENGTH] = [58, 16];

export class Gizmo {
  /** @param {Stage} stage @param {NetView} netView @param {State} state */
  constructor(stage, netView, state) {
    this.stage = stage;
    this.netView = netView;
    this.state = state;
    this.node = /** @type {SVGSVGElement} */ (document.querySelector('#gizmo'));
    this.arms = AXES.map((_, axis) => /** @type {SVGGElement} */ (this.node.querySelector(`[data-axis="${axis}"]`)));
    this.arms.forEach((arm, axis) => this.watch(arm, AXES[axis]));
    /** @type {Drag | null} */
    this.drag = null;
    stage.onDraw.push(() => this.place());
    // Undo, or another document, ends a drag.
    state.listen((change) => { if (change === 'surface' || change === 'opened') this.drag = null; });
    addEventListener('keydown', (event) => {
      if (event.key !== 'Escape' || this.drag === null) return;
      event.stopPropagation();
      state.cancel();
    }, { capture: true });
  }

  /** @param {SVGGElement} arm @param {'x' | 'y' | 'z'} axis */
  watch(arm, axis) {
    const { state, stage } = this;
    arm.addEventListener('pointerdown', (event) => {
      const point = state.point();
      if (event.button !== 0 || !point || !state.handle || !this.netView.matrices) return;
      event.preventDefault();
      arm.setPointerCapture(event.pointerId);
      state.commit();
      this.drag = new Drag(stage, point, this.netView.matrices[state.handle.frame], this.locate(event));
      stage.canvas.focus();
    });
    arm.addEventListener('pointermove', (event) => {
      if (this.drag) state.move(this.drag.to(this.locate(event), axis, false), false);
    });
    arm.addEventListener('pointerup', () => state.commit());
    arm.addEventListener('pointercancel', () => state.cancel());
    arm.addEventListener('lostpointercapture', () => { this.drag = null; });
  }

  /** The place of an event on the canvas, from −1 to 1. @param {PointerEvent} event */
  locate({ clientX, clientY }) {
    const { left, top, width, height } = this.stage.canvas.getBoundingClientRect();
    return new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
  }

  /** Draws the arrows at the leading point, all as long as if they lay across the view. */
  place() {
    const { netView, state } = this;
    const { chosen, handle } = state;
    const isShown = handle !== undefined && netView.matrices !== undefined && netView.group.visible
      && chosen < netView.positions.count && netView.screenPosition(chosen).depth < 1;
    this.node.toggleAttribute('hidden', !isShown);
    if (!isShown || !netView.matrices) return;
    const matrix = netView.matrices[handle.frame];
    const start = netView.at(chosen);
    const { x, y } = this.project(start);
    this.node.style.translate = `${x}px ${y}px`;
    const across = new Vector3().setFromMatrixColumn(this.stage.drawingCamera.matrixWorld, 0)
      .multiplyScalar(this.stage.radius() / 100);
    const side = this.project(start.clone().add(across));
    const length = ((this.stage.radius() / 100) * LENGTH) / Math.hypot(side.x - x, side.y - y);
    const dimension = state.point()?.length ?? 3;
    this.arms.forEach((arm, axis) => {
      const end = this.project(new Vector3().setFromMatrixColumn(matrix, axis).setLength(length).add(start));
      const [dx, dy] = [end.x - x, end.y - y];
      arm.toggleAttribute('hidden', axis >= dimension || Math.hypot(dx, dy) < MIN_LENGTH);
      arm.querySelector('line')?.setAttribute('x2', dx.toFixed(1));
      arm.querySelector('line')?.setAttribute('y2', dy.toFixed(1));
      arm.querySelectorAll('circle, text').forEach((node) => node.setAttribute('transform', `translate(${dx.toFixed(1)} ${dy.toFixed(1)})`));
    });
  }

  /** A place of the scene on the canvas, in CSS pixels. @param {Vector3} place */
  project(place) {
    const { canvas, drawingCamera } = this.stage;
    const { x, y } = place.clone().project(drawingCamera);
    return { x: ((x + 1) / 2) * canvas.clientWidth, y: ((1 - y) / 2) * canvas.clientHeight };
  }
}
