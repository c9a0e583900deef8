// How a control point moves. The mouse moves it in the plane of the view, or along an axis. A key moves
// it along the axis that, on the screen, is nearest to the direction of the key. Points are in the
// coordinates of the document.

import { Matrix4, Plane, Raycaster, Vector2, Vector3 } from './three.js';

/** @typedef {import('./scene.js').Stage} Stage */
/** @typedef {'free' | 'x' | 'y' | 'z'} Axis */

const AXES = /** @type {const} */ (['x', 'y', 'z']);

/** The least squared sine of the angle between view and axis: below it, the mouse cannot move a point
 *  along the axis. */
const EDGE_ON = 1e-3;

/**
 * One drag of one point.
 */
export class Drag {
  /**
   * @param {Stage} stage @param {number[]} point  where it starts
   * @param {Matrix4} frame  from the document to the scene @param {Vector2} at  of the mouse, -1 to 1
   */
  constructor(stage, point, frame, at) {
    this.camera = stage.camera;
    this.frame = frame;
    this.back = frame.clone().invert();
    this.start = new Vector3(point[0], point[1], point[2] ?? 0);
    this.origin = this.start.clone().applyMatrix4(frame);
    this.plane = new Plane().setFromNormalAndCoplanarPoint(
      this.camera.getWorldDirection(new Vector3()), this.origin,
    );
    this.step = chooseStep(stage.radius());
    // The mouse rarely hits the exact point, and the point must not jump to the mouse.
    this.slip = this.origin.clone().sub(this.onPlane(at) ?? this.origin);
  }

  /**
   * The present position of the point.
   * @param {Vector2} at @param {Axis} axis @param {boolean} straight  along the nearest axis
   * @returns {number[]}
   */
  to(at, axis, straight) {
    const free = this.onPlane(at)?.add(this.slip).applyMatrix4(this.back) ?? this.start;
    let along = axis;
    if (along === 'free' && straight) {
      const moved = free.clone().sub(this.start);
      [along] = [...AXES].sort((a, b) => Math.abs(moved[b]) - Math.abs(moved[a]));
    }
    const point = along === 'free' ? free : this.onAxis(at, along);
    return [point.x, point.y, point.z].map((value, i) => (
      // A coordinate that does not move keeps all of its digits.
      value === this.start.getComponent(i) ? value : roundToMultiple(value, this.step)
    ));
  }

  /** @param {Vector2} at */
  ray(at) {
    const caster = new Raycaster();
    caster.setFromCamera(at, this.camera);
    return caster.ray;
  }

  /** @param {Vector2} at */
  onPlane(at) {
    return this.ray(at).intersectPlane(this.plane, new Vector3());
  }

  /**
   * The point of the axis nearest to the ray under the mouse. With unit directions a of the axis
   * and r of the ray, and w from the ray's origin to the point, it is at
   * t = ((a·r)(r·w) − a·w) / (1 − (a·r)²) along the axis.
   * @param {Vector2} at @param {'x' | 'y' | 'z'} axis
   */
  onAxis(at, axis) {
    const column = new Vector3().setFromMatrixColumn(this.frame, AXES.indexOf(axis));
    const scale = column.length();
    const a = column.divideScalar(scale);
    const { origin, direction: r } = this.ray(at);
    const w = this.origin.clone().sub(this.slip).sub(origin);
    const cosine = a.dot(r);
    const squaredSine = 1 - cosine * cosine;
    const moved = this.start.clone();
    if (squaredSine < EDGE_ON) return moved;
    moved[axis] += (cosine * r.dot(w) - a.dot(w)) / squaredSine / scale;
    return moved;
  }
}

/**
 * The vector by which an arrow key moves a point: along the axis of the document that, on the screen,
 * is nearest to right, up or away from the viewer. The three pairs of keys use three different axes.
 * @param {Stage} stage @param {Matrix4} frame @param {string} key @param {boolean} far
 * @returns {number[] | null}
 */
export function nudge(stage, frame, key, far) {
  const ways = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, -1], PageDown: [2, 1] };
  const way = ways[/** @type {keyof typeof ways} */ (key)];
  if (way === undefined) return null;
  const [index, sign] = way;
  const screen = [0, 1, 2].map((i) => new Vector3().setFromMatrixColumn(stage.camera.matrixWorld, i));
  const columns = AXES.map((_, i) => new Vector3().setFromMatrixColumn(frame, i).normalize());
  /** @type {number[]} */
  const taken = [];
  screen.forEach((direction) => {
    const free = [0, 1, 2].filter((i) => !taken.includes(i));
    taken.push(free.sort((a, b) => (
      Math.abs(columns[b].dot(direction)) - Math.abs(columns[a].dot(direction))
    ))[0]);
  });
  const axis = taken[index];
  const towards = Math.sign(columns[axis].dot(screen[index])) || 1;
  const moved = [0, 0, 0];
  moved[axis] = sign * towards * (far ? 10 : 1) * 100 * chooseStep(stage.radius());
  return moved;
}

/** A coordinate after a nudge, without rounding errors of binary fractions. @param {number} value @param {Stage} stage */
export function roundToStep(value, stage) {
  return roundToMultiple(value, chooseStep(stage.radius()));
}

/** The step to which a drag rounds coordinates: a power of ten, about 1/20 000 of the model. @param {number} radius */
function chooseStep(radius) {
  return 10 ** Math.floor(Math.log10(radius / 5000));
}

/** The nearest multiple of a power of ten. @param {number} value @param {number} step */
function roundToMultiple(value, step) {
  const digits = Math.max(0, Math.min(20, -Math.round(Math.log10(step))));
  return Number((Math.round(value / step) * step).toFixed(digits));
}
