// The axes of the document, in a corner of the view: they turn with the camera, and a click on a name looks
// along this axis.

import { toScene } from './frame.js';
import { Vector3 } from './three.js';

/** @typedef {import('./state.js').State} State */
/** @typedef {import('./scene.js').Stage} Stage */

const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
/** Half the length of an axis in the picture, whose own unit is a pixel of 100. */
const LENGTH = 34;

export class AxesView {
  /** @param {Stage} stage @param {State} state @param {(towardsCamera: Vector3) => void} look */
  constructor(stage, state, look) {
    this.stage = stage;
    this.state = state;
    this.arms = AXES.map((_, axis) => /** @type {SVGGElement} */ (document.querySelector(`#axes [data-axis="${axis}"]`)));
    this.arms.forEach((arm, axis) => arm.querySelector('circle')?.addEventListener('click', () => look(this.direction(axis))));
    stage.beforeDraw.push(() => this.draw());
  }

  /** The direction of an axis of the document in the scene. @param {number} axis */
  direction(axis) {
    return new Vector3().fromArray(toScene({ up: this.state.surface.up }, AXES[axis]));
  }

  draw() {
    const toCamera = this.stage.camera.quaternion.clone().invert();
    const ends = this.arms.map((arm, axis) => ({ arm, end: this.direction(axis).applyQuaternion(toCamera) }));
    // The nearest is drawn last, over the others.
    ends.sort((a, b) => a.end.z - b.end.z).forEach(({ arm, end }) => {
      const [x, y] = [LENGTH * end.x, -LENGTH * end.y].map((value) => value.toFixed(1));
      arm.querySelector('line')?.setAttribute('x2', x);
      arm.querySelector('line')?.setAttribute('y2', y);
      arm.querySelectorAll('circle, text').forEach((node) => node.setAttribute('transform', `translate(${x} ${y})`));
      arm.parentElement?.append(arm);
    });
  }
}
