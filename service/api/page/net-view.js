// Draws the control net: lines and points. Parts behind the surface are faint.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, Group, LineBasicMaterial, LineSegments,
  Matrix4, Points, PointsMaterial, Vector3,
} from './three.js';
import { pointAt } from './net.js';

/** @typedef {import('./colors.js').Palette} Palette */
/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./net.js').Net} Net */
/** @typedef {import('./scene.js').Stage} Stage */

/** Diameter of a point in CSS pixels: smaller if there are many points. @param {number} count */
const sizeFor = (count) => Math.max(3.4, 10.5 - 0.62 * Math.log2(Math.max(4, count)));
/** Distance from a point at which the mouse selects it, in CSS pixels; larger for a finger. */
const REACH = { mouse: 11, touch: 24 };
/** If points are equally near to the mouse, the front point is selected: a depth of one radius of the
 *  model counts as this many pixels. */
const DEPTH_PIXELS = 14;
/** Distance of lines and points from the camera in the depth test, as a share of their true distance:
 *  so the surface does not hide lines that lie on it. */
const DEPTH_FACTOR = '0.994';

export class NetView {
  /** @param {Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.group = new Group();
    this.positions = new BufferAttribute(new Float32Array(0), 3);
    this.edges = new BufferAttribute(new Uint32Array(0), 1);
    const dot = buildDotTexture();
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
    this.chosenPoint = new Points(new BufferGeometry(), this.chosenMaterial);
    this.chosenPoint.renderOrder = 5;
    this.hoveredMaterial = new PointsMaterial({ ...points, depthTest: false });
    this.hoveredPoint = new Points(new BufferGeometry(), this.hoveredMaterial);
    this.hoveredPoint.renderOrder = 4;
    this.pointGeometry = new BufferGeometry();
    this.lineGeometry = new BufferGeometry();
    this.lineMaterials.forEach((material, i) => this.add(new LineSegments(this.lineGeometry, material), 1 + i));
    this.pointMaterials.forEach((material, i) => this.add(new Points(this.pointGeometry, material), 2 + i));
    [this.chosenPoint, this.hoveredPoint].forEach((single) => { single.frustumCulled = false; });
    this.group.add(this.chosenPoint, this.hoveredPoint);
    stage.scene.add(this.group);
  }

  /** @param {any} object @param {number} order */
  add(object, order) {
    object.frustumCulled = false;
    object.renderOrder = order;
    this.group.add(object);
  }

  /** Sets how visible the net is behind and inside the surface. @param {boolean} isStrong */
  setVisible(isStrong) {
    this.lineMaterials[0].opacity = isStrong ? 0.4 : 0.13;
    this.pointMaterials[0].opacity = isStrong ? 0.75 : 0.25;
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
    const hasSameEdges = hasSameCount && this.edges.count === 2 * net.edges.length;
    if (!hasSameCount) this.positions = new BufferAttribute(/** @type {Float32Array} */ (numbers), 3);
    this.positions.needsUpdate = true;
    if (!hasSameEdges) this.edges = new BufferAttribute(Uint32Array.from(net.edges.flat()), 1);
    if (!hasSameEdges || !hasSameCount) this.rebuild();
    this.stage.draw();
  }

  rebuild() {
    const size = sizeFor(this.positions.count);
    this.pointMaterials.forEach((material) => { material.size = size; });
    this.chosenMaterial.size = size + 6;
    this.hoveredMaterial.size = size + 4;
    [this.pointGeometry, this.lineGeometry].forEach((geometry) => {
      geometry.dispose();
      geometry.setAttribute('position', this.positions);
    });
    this.lineGeometry.setIndex(this.edges);
  }

  /** Marks the chosen point, and the point under the mouse; -1 for none. @param {number} chosen @param {number} hovered */
  highlight(chosen, hovered) {
    this.showSingle(this.chosenPoint, chosen);
    this.showSingle(this.hoveredPoint, hovered === chosen ? -1 : hovered);
    this.stage.draw();
  }

  /** @param {Points} points @param {number} index */
  showSingle(points, index) {
    points.visible = index >= 0 && index < this.positions.count;
    if (!points.visible) return;
    const position = this.at(index).toArray();
    points.geometry.setAttribute('position', new BufferAttribute(new Float32Array(position), 3));
  }

  /** The position of a control point in the scene. @param {number} index */
  at(index) {
    return new Vector3().fromBufferAttribute(this.positions, index);
  }

  /** The position of a control point on the canvas, in CSS pixels, and its depth, which is above 1 behind the
   *  camera. @param {number} index */
  screenPosition(index) {
    const { camera, canvas } = this.stage;
    const { x, y, z } = this.at(index).project(camera);
    return { x: (x + 1) / 2 * canvas.clientWidth, y: (1 - y) / 2 * canvas.clientHeight, depth: z };
  }

  /** The index of the control point at a place of the canvas, or -1. @param {number} x @param {number} y @param {string} pointer */
  pick(x, y, pointer) {
    if (!this.group.visible) return -1;
    const reach = pointer === 'touch' ? REACH.touch : REACH.mouse;
    let [bestIndex, minScore] = [-1, Infinity];
    const radius = this.stage.radius();
    const eye = this.stage.camera.position;
    for (let i = 0; i < this.positions.count; i += 1) {
      const screen = this.screenPosition(i);
      const distance = Math.hypot(screen.x - x, screen.y - y);
      if (distance > reach || screen.depth > 1) continue;
      const score = distance + DEPTH_PIXELS * this.at(i).distanceTo(eye) / radius;
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

/** A texture with a white dot. */
function buildDotTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = 64;
  canvas.height = 64;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  context.fillStyle = '#fff';
  context.beginPath();
  context.arc(32, 32, 28, 0, 2 * Math.PI);
  context.fill();
  return new CanvasTexture(canvas);
}

/**
 * Makes a material pass the depth test as if it were a little nearer, so that the surface does not hide
 * lines and points that lie on it.
 * @template {import('./three.js').Material} M
 * @param {M} material @returns {M}
 */
export function drawNearer(material) {
  material.onBeforeCompile = (shader) => {
    const project = '#include <project_vertex>';
    shader.vertexShader = shader.vertexShader
      .replace(project, `${project}\n  gl_Position = projectionMatrix * vec4(${DEPTH_FACTOR} * mvPosition.xyz, 1.0);`);
  };
  return material;
}
