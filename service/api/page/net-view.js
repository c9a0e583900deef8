// Draws the control net: lines and points. Parts behind the surface are faint.

import {
  BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments,
  MathUtils, Matrix4, Points, PointsMaterial, Vector3,
} from './three.js';
import { drawNearer, makeDotTexture } from './marks.js';
import { pointAt } from './net.js';
import { chooseLevel, findLevels, MAX_LEVEL } from './net-levels.js';

/** @typedef {import('./colors.js').Palette} Palette */
/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./net.js').Net} Net */
/** @typedef {import('./scene.js').Stage} Stage */

/** Diameter of a point in CSS pixels: smaller if there are many points. @param {number} count */
const sizeFor = (count) => Math.max(3.4, 10.5 - 0.62 * Math.log2(Math.max(4, count)));
/** Distance from a point at which the mouse selects it, in CSS pixels; larger for a finger. */
const REACH = { mouse: 11, touch: 24 };
/** The most of the distance between two points that are drawn at which one is selected: elsewhere in a dense net
 *  the mouse still turns the surface. */
const REACH_SHARE = 0.4;
/** The number of lines whose length on the screen says how dense a net is. */
const SAMPLES = 200;
/** Lengths of lines in CSS pixels between which lines without rows fade away. */
const FADE = [1.5, 8];
/** If points are equally near to the mouse, the front point is selected: a depth of one radius of the
 *  model counts as this many pixels. */
const DEPTH_PIXELS = 14;

export class NetView {
  /** @param {Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.group = new Group();
    this.positions = new BufferAttribute(new Float32Array(0), 3);
    /** The lines as in the document, two numbers of points each. */
    this.lines = new Uint32Array(0);
    this.levels = findLevels({ handles: [], edges: [], frames: [] });
    /** The level from which rows are drawn, and the distance of the points that are drawn, in CSS pixels. */
    this.level = 0;
    this.spacing = Infinity;
    this.isStrong = false;
    const dot = makeDotTexture();
    const lines = { transparent: true };
    const points = { transparent: true, sizeAttenuation: false, map: dot, alphaTest: 0.01 };
    // The first material draws all lines or points, faintly (`setVisible`); the second draws those that
    // the surface does not hide.
    this.lineMaterials = [
      new LineBasicMaterial({ ...lines, depthTest: false, depthWrite: false }),
      drawNearer(new LineBasicMaterial({ ...lines, opacity: 0.6, depthWrite: false })),
    ];
    this.pointMaterials = [
      new PointsMaterial({ ...points, depthTest: false, depthWrite: false }),
      drawNearer(new PointsMaterial({ ...points, depthWrite: false })),
    ];
    this.chosenMaterial = new PointsMaterial({ ...points, depthTest: false });
    this.chosenPoints = new Points(new BufferGeometry(), this.chosenMaterial);
    this.chosenPoints.renderOrder = 5;
    this.hoveredMaterial = new PointsMaterial({ ...points, depthTest: false });
    this.hoveredPoint = new Points(new BufferGeometry(), this.hoveredMaterial);
    this.hoveredPoint.renderOrder = 4;
    this.pointGeometry = new BufferGeometry();
    this.lineGeometry = new BufferGeometry();
    this.lineMaterials.forEach((material, i) => this.add(new LineSegments(this.lineGeometry, material), 1 + i));
    this.pointMaterials.forEach((material, i) => this.add(new Points(this.pointGeometry, material), 2 + i));
    [this.chosenPoints, this.hoveredPoint].forEach((single) => { single.frustumCulled = false; });
    this.group.add(this.chosenPoints, this.hoveredPoint);
    stage.scene.add(this.group);
    stage.beforeDraw.push(() => this.adaptToScreen());
  }

  /** @param {any} object @param {number} order */
  add(object, order) {
    object.frustumCulled = false;
    object.renderOrder = order;
    this.group.add(object);
  }

  /** Sets how visible the net is behind and inside the surface. @param {boolean} isStrong */
  setVisible(isStrong) {
    this.isStrong = isStrong;
  }

  /** Draws the net of a document. @param {Net} net @param {Surface} surface */
  showNet(net, surface) {
    this.matrices = net.frames.map((frame) => new Matrix4().set(
      .../** @type {[number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number]} */ (frame),
    ));
    const { matrices } = this;
    const position = new Vector3();
    const hasSameCount = this.positions.count === net.handles.length;
    const numbers = hasSameCount ? this.positions.array : new Float32Array(3 * net.handles.length);
    net.handles.forEach((handle, i) => {
      const [x, y, z = 0] = pointAt(surface, handle);
      position.set(x, y, z).applyMatrix4(matrices[handle.frame]).toArray(numbers, 3 * i);
    });
    if (!hasSameCount) this.positions = new BufferAttribute(/** @type {Float32Array} */ (numbers), 3);
    this.positions.needsUpdate = true;
    if (!hasSameCount || !hasLines(this.lines, net.edges)) this.rebuild(net);
    this.stage.draw();
  }

  /** @param {Net} net */
  rebuild(net) {
    this.lines = Uint32Array.from(net.edges.flat());
    this.levels = findLevels(net);
    [this.pointGeometry, this.lineGeometry].forEach((geometry) => {
      geometry.dispose();
      geometry.setAttribute('position', this.positions);
    });
    this.pointGeometry.setIndex(new BufferAttribute(this.levels.points, 1));
    this.lineGeometry.setIndex(new BufferAttribute(this.levels.edges, 1));
  }

  /** Chooses which rows are drawn, and how large, by the length of lines on the screen. */
  adaptToScreen() {
    const { pointCounts, edgeCounts } = this.levels;
    const length = this.lineLength();
    this.level = this.positions.count > 1 ? chooseLevel(length) : 0;
    const count = Math.max(1, pointCounts[this.level]);
    // In a grid, the rows that are drawn are further apart; other lines, which all are drawn, fade.
    const hasRows = edgeCounts[0] > edgeCounts[MAX_LEVEL];
    this.spacing = length * 2 ** this.level;
    const share = hasRows ? 1 : MathUtils.smoothstep(length, FADE[0], FADE[1]);
    this.pointGeometry.setDrawRange(0, pointCounts[this.level]);
    this.lineGeometry.setDrawRange(0, 2 * edgeCounts[this.level]);
    const size = sizeFor(count);
    this.pointMaterials.forEach((material) => { material.size = size; });
    this.chosenMaterial.size = size + 6;
    this.hoveredMaterial.size = size + 4;
    this.lineMaterials[0].opacity = share * (this.isStrong ? 0.4 : 0.13);
    this.lineMaterials[1].opacity = share * 0.6;
    this.pointMaterials[0].opacity = this.isStrong ? 0.75 : 0.25;
  }

  /** The median length of lines of the net on the screen, in CSS pixels; infinite without lines. */
  lineLength() {
    const step = 2 * Math.max(1, Math.floor(this.lines.length / 2 / SAMPLES));
    const lengths = [];
    for (let i = 0; i < this.lines.length; i += step) {
      const [a, b] = [this.screenPosition(this.lines[i]), this.screenPosition(this.lines[i + 1])];
      if (a.depth < 1 && b.depth < 1) lengths.push(Math.hypot(a.x - b.x, a.y - b.y));
    }
    lengths.sort((a, b) => a - b);
    return lengths[Math.floor(lengths.length / 2)] ?? Infinity;
  }

  /** Marks the chosen points, and the point under the mouse (-1 for none). @param {number[]} selection @param {number} hovered */
  highlight(selection, hovered) {
    this.mark(this.chosenPoints, selection);
    this.mark(this.hoveredPoint, hovered < 0 || selection.includes(hovered) ? [] : [hovered]);
    this.stage.draw();
  }

  /** @param {Points} points @param {number[]} indices */
  mark(points, indices) {
    const positions = indices.filter((index) => index < this.positions.count).flatMap((index) => this.at(index).toArray());
    points.visible = positions.length > 0;
    // A geometry keeps the buffer on the graphics card that it has, so it is made anew for another size.
    if (points.geometry.getAttribute('position')?.array.length !== positions.length) points.geometry.dispose();
    points.geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  }

  /** The points between two places of the canvas, in CSS pixels. @param {{x: number, y: number}} a @param {{x: number, y: number}} b */
  pickBetween(a, b) {
    const isBetween = (/** @type {number} */ value, /** @type {number} */ p, /** @type {number} */ q) => (
      (value - p) * (value - q) <= 0
    );
    if (!this.group.visible) return [];
    return Array.from({ length: this.positions.count }, (_, i) => i).filter((i) => {
      const { x, y, depth } = this.screenPosition(i);
      return depth <= 1 && isBetween(x, a.x, b.x) && isBetween(y, a.y, b.y);
    });
  }

  /** The position of a control point in the scene. @param {number} index */
  at(index) {
    return new Vector3().fromBufferAttribute(this.positions, index);
  }

  /** The position of a control point on the canvas, in CSS pixels, and its depth, which is above 1 behind the
   *  camera. @param {number} index */
  screenPosition(index) {
    const { drawingCamera, canvas } = this.stage;
    const { x, y, z } = this.at(index).project(drawingCamera);
    return { x: (x + 1) / 2 * canvas.clientWidth, y: (1 - y) / 2 * canvas.clientHeight, depth: z };
  }

  /**
   * The index of the control point at a place of the canvas, or -1. Only points that are drawn count.
   * @param {number} x @param {number} y @param {string} pointer
   */
  pick(x, y, pointer) {
    if (!this.group.visible) return -1;
    const reach = Math.min(pointer === 'touch' ? REACH.touch : REACH.mouse, Math.max(4, REACH_SHARE * this.spacing));
    const { drawingCamera: camera, canvas } = this.stage;
    const { clientWidth: width, clientHeight: height } = canvas;
    // Without objects, because the net may have 100,000 points, and the mouse moves often.
    const m = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
    const numbers = this.positions.array;
    const count = this.levels.pointCounts[this.level];
    let [bestIndex, minScore] = [-1, Infinity];
    const radius = this.stage.radius();
    const eye = camera.position;
    for (let k = 0; k < count; k += 1) {
      const i = this.levels.points[k];
      const [px, py, pz] = [numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]];
      const w = m[3] * px + m[7] * py + m[11] * pz + m[15];
      const dx = ((m[0] * px + m[4] * py + m[8] * pz + m[12]) / w + 1) / 2 * width - x;
      const dy = (1 - (m[1] * px + m[5] * py + m[9] * pz + m[13]) / w) / 2 * height - y;
      const distance = Math.hypot(dx, dy);
      if (w <= 0 || distance > reach) continue;
      const score = distance + DEPTH_PIXELS * Math.hypot(px - eye.x, py - eye.y, pz - eye.z) / radius;
      if (score < minScore) [bestIndex, minScore] = [i, score];
    }
    return bestIndex;
  }

  /** @param {Palette} palette @param {boolean} hasError  whether an error points to the chosen point */
  paint(palette, hasError) {
    this.lineMaterials.forEach((material) => material.color.set(palette.net));
    this.pointMaterials.forEach((material) => material.color.set(palette.point));
    this.chosenMaterial.color.set(hasError ? palette.alarm : palette.chosen);
    this.hoveredMaterial.color.set(palette.chosen);
    this.stage.draw();
  }

  /** The positions of all points; none if the net is hidden. */
  visiblePoints() {
    return this.group.visible ? Array.from({ length: this.positions.count }, (_, i) => this.at(i)) : [];
  }
}

/** Whether the lines are these edges. @param {Uint32Array} lines @param {Net['edges']} edges */
function hasLines(lines, edges) {
  return lines.length === 2 * edges.length
    && edges.every(([a, b], i) => lines[2 * i] === a && lines[2 * i + 1] === b);
}
