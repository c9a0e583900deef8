// How a control point moves. The mouse moves it in the plane of the view, or along an axis. A key moves
// it along the axis that, on the screen, is nearest to the direction of the key. Points are in the
// coordinates of the document.

import { Matrix4, Plane, Raycaster, Vector2, Vector3 } from './three.js';

/** @typedef {import('./scene.js').Stage} Stage */
/** @typedef {'free' | 'x' | 'y' | 'z'} Axis */

const AXES = /** @type {const} */ (['x', 'y', 'z']);

/** The least squared sine of the angle between the mouse's ray and an axis, at which the mouse can move a
 *  point along the axis. */
const MIN_SQUARED_SINE = 1e-3;

/**
 * One drag of one point.
 */
export class Drag {
  /**
   * @param {Stage} stage @param {number[]} point  where the drag starts
   * @param {Matrix4} frame  from the document to the scene
   * @param {Vector2} mouse  its position on the canvas, -1 to 1
   */
  constructor(stage, point, frame, mouse) {
    this.camera = stage.drawingCamera;
    this.frame = frame;
    this.toDocument = frame.clone().invert();
    this.start = new Vector3(point[0], point[1], point[2] ?? 0);
    this.sceneStart = this.start.clone().applyMatrix4(frame);
    this.plane = new Plane().setFromNormalAndCoplanarPoint(
      this.camera.getWorldDirection(new Vector3()), this.sceneStart,
    );
    this.step = chooseStep(stage.radius());
    // The mouse rarely hits the exact point, and the point must not jump to the mouse.
    /** From the place that the mouse grabbed to the point, in the scene. */
    this.offset = this.sceneStart.clone().sub(this.onPlane(mouse) ?? this.sceneStart);
  }

  /**
   * The present position of the point.
   * @param {Vector2} mouse @param {Axis} axis @param {boolean} isStraight  along the nearest axis
   * @returns {number[]}
   */
  to(mouse, axis, isStraight) {
    const freePoint = this.onPlane(mouse)?.add(this.offset).applyMatrix4(this.toDocument) ?? this.start;
    let moveAxis = axis;
    if (moveAxis === 'free' && isStraight) {
      const move = freePoint.clone().sub(this.start);
      [moveAxis] = [...AXES].sort((a, b) => Math.abs(move[b]) - Math.abs(move[a]));
    }
    const point = moveAxis === 'free' ? freePoint : this.onAxis(mouse, moveAxis);
    return [point.x, point.y, point.z].map((value, i) => (
      // A coordinate that does not move keeps all of its digits.
      value === this.start.getComponent(i) ? value : roundToMultiple(value, this.step)
    ));
  }

  /** @param {Vector2} mouse */
  ray(mouse) {
    const caster = new Raycaster();
    caster.setFromCamera(mouse, this.camera);
    return caster.ray;
  }

  /** @param {Vector2} mouse */
  onPlane(mouse) {
    return this.ray(mouse).intersectPlane(this.plane, new Vector3());
  }

  /**
   * The dragged point, moved along an axis. The point moves as far as the place that the mouse grabbed
   * would move along a parallel of the axis, to its nearest point to the ray under the mouse. With unit
   * directions a of the axis and r of the ray, and w from the ray's origin to the grabbed place, this is
   * the distance t = ((a·r)(r·w) − a·w) / (1 − (a·r)²).
   * @param {Vector2} mouse @param {'x' | 'y' | 'z'} axis
   */
  onAxis(mouse, axis) {
    const column = new Vector3().setFromMatrixColumn(this.frame, AXES.indexOf(axis));
    const scale = column.length();
    const a = column.divideScalar(scale);
    const { origin, direction: r } = this.ray(mouse);
    const w = this.sceneStart.clone().sub(this.offset).sub(origin);
    const cosine = a.dot(r);
    const squaredSine = 1 - cosine * cosine;
    const point = this.start.clone();
    if (squaredSine < MIN_SQUARED_SINE) return point;
    point[axis] += (cosine * r.dot(w) - a.dot(w)) / squaredSine / scale;
    return point;
  }
}

/**
 * The vector by which an arrow key, Page Up or Page Down moves a point: along the axis of the document
 * that, on the screen, is nearest to right, up or away from the viewer. The three pairs of keys use three
 * different axes. The length is 100 steps, at most 1/50 of the radius; with `isFar` 10 times as long.
 * Null for another key.
 * @param {Stage} stage @param {Matrix4} frame @param {string} key @param {boolean} isFar
 * @returns {number[] | null}
 */
export function nudge(stage, frame, key, isFar) {
  // The column of the camera's matrix (0: right, 1: up, 2: towards the viewer), and the sign.
  const keys = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, -1], PageDown: [2, 1] };
  const direction = keys[/** @type {keyof typeof keys} */ (key)];
  if (direction === undefined) return null;
  const [index, sign] = direction;
  const screenAxes = [0, 1, 2].map((i) => new Vector3().setFromMatrixColumn(stage.camera.matrixWorld, i));
  const columns = AXES.map((_, i) => new Vector3().setFromMatrixColumn(frame, i).normalize());
  /** @type {number[]} */
  const documentAxes = [];
  screenAxes.forEach((screenAxis) => {
    const unused = [0, 1, 2].filter((i) => !documentAxes.includes(i));
    documentAxes.push(unused.sort((a, b) => (
      Math.abs(columns[b].dot(screenAxis)) - Math.abs(columns[a].dot(screenAxis))
    ))[0]);
  });
  const axis = documentAxes[index];
  const orientation = Math.sign(columns[axis].dot(screenAxes[index])) || 1;
  const move = [0, 0, 0];
  move[axis] = sign * orientation * (isFar ? 10 : 1) * 100 * chooseStep(stage.radius());
  return move;
}

/** A coordinate after a nudge, without rounding errors of binary fractions. @param {number} value @param {Stage} stage */
export function roundToStep(value, stage) {
  return roundToMultiple(value, chooseStep(stage.radius()));
}

/** The step to which drags and keys round coordinates: the largest power of ten up to 1/5000 of the radius. @param {number} radius */
function chooseStep(radius) {
  return 10 ** Math.floor(Math.log10(radius / 5000));
}

/** The nearest multiple of a power of ten. @param {number} value @param {number} step */
function roundToMultiple(value, step) {
  const digits = Math.max(0, Math.min(20, -Math.round(Math.log10(step))));
  return Number((Math.round(value / step) * step).toFixed(digits));
}
