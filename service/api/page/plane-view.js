// The plane of a section: its outline about the model, and a handle in its middle that moves it. It hides one
// side of the surface, if the section says so.

import { toScene } from './frame.js';
import { element } from './page.js';
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineLoop, Plane, Vector3 } from './three.js';

/** @typedef {import('./colors.js').Palette} Palette */
/** @typedef {import('./section-plane.js').SectionPlane} SectionPlane */
/** @typedef {import('./scene.js').Stage} Stage */

/** How far the outline is from the box of the model, as a share. */
const MARGIN = 0.06;
/** The least share of the length of the normal that is visible: a plane that faces the viewer still can be moved. */
const MIN_SLOPE = 0.25;

export class PlaneView {
  /** @param {Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.material = new LineBasicMaterial({ transparent: true, opacity: 0.75 });
    this.outline = new LineLoop(new BufferGeometry(), this.material);
    this.outline.frustumCulled = false;
    this.outline.visible = false;
    this.middle = new Vector3();
    this.normal = new Vector3();
    /** The length of the unit of the document in the scene. */
    this.scale = 1;
    /** Called while the handle moves, with the distance of the plane from where it was. @type {(distance: number) => void} */
    this.moved = () => {};
    this.handle = element('section-handle', HTMLElement);
    stage.scene.add(this.outline);
    stage.onDraw.push(() => this.placeHandle());
    this.watchHandle();
  }

  /**
   * Draws a plane through the box of the model; null draws none. Returns the planes that hide the side that is not shown.
   * @param {SectionPlane | null} plane @param {import('./documents.js').Surface} surface @param {import('./three.js').Box3} box
   * @returns {Plane[]}
   */
  show(plane, surface, box) {
    this.outline.visible = plane !== null && !box.isEmpty();
    this.stage.draw();
    if (plane === null || box.isEmpty()) return [];
    const unit = new Vector3().fromArray(toScene({ ...surface }, [1, 0, 0])).length();
    const normal = new Vector3().fromArray(toScene({ up: surface.up }, plane.normal));
    const offset = unit * plane.offset;
    const center = box.getCenter(new Vector3());
    this.scale = unit;
    this.normal.copy(normal);
    this.middle.copy(center).addScaledVector(normal, offset - normal.dot(center));
    this.drawOutline(box);
    if (plane.shown === 'both') return [];
    return [plane.shown === 'below' ? new Plane(normal.clone().negate(), offset) : new Plane(normal.clone(), -offset)];
  }

  /** @param {import('./three.js').Box3} box */
  drawOutline(box) {
    const { normal, middle } = this;
    const least = ['x', 'y', 'z'].sort((a, b) => Math.abs(normal.getComponent('xyz'.indexOf(a))) - Math.abs(normal.getComponent('xyz'.indexOf(b))))[0];
    const across = new Vector3().setComponent('xyz'.indexOf(least), 1).cross(normal).normalize();
    const along = normal.clone().cross(across);
    const half = [across, along].map((axis) => (1 + MARGIN) * halfWidth(box, axis));
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([a, b]) => (
      across.clone().multiplyScalar(a * half[0]).addScaledVector(along, b * half[1]).toArray()
    ));
    this.outline.geometry.setAttribute('position', new BufferAttribute(new Float32Array(corners), 3));
    this.outline.position.copy(middle);
  }

  placeHandle() {
    const { canvas, drawingCamera } = this.stage;
    const { x, y, z } = this.middle.clone().project(drawingCamera);
    this.handle.hidden = !this.outline.visible || z > 1 || Math.abs(x) > 1 || Math.abs(y) > 1;
    const direction = this.screenNormal();
    const [left, top] = [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight];
    this.handle.style.translate = `calc(${left}px - 50%) calc(${top}px - 50%)`;
    this.handle.style.rotate = `${Math.atan2(direction.y, direction.x)}rad`;
  }

  /** The normal on the screen, in CSS pixels for each unit of the scene. */
  screenNormal() {
    const { canvas, drawingCamera } = this.stage;
    const step = 0.01 * this.stage.radius();
    const from = this.middle.clone().project(drawingCamera);
    const to = this.middle.clone().addScaledVector(this.normal, step).project(drawingCamera);
    return {
      x: (to.x - from.x) / 2 * canvas.clientWidth / step,
      y: (from.y - to.y) / 2 * canvas.clientHeight / step,
    };
  }

  /** Pixels of the screen for each unit of the scene, at the plane. */
  pixelsPerUnit() {
    const { canvas, camera, controls } = this.stage;
    const distance = camera.position.distanceTo(controls.target);
    return canvas.clientHeight / 2 / distance / Math.tan((camera.fov * Math.PI) / 360);
  }

  watchHandle() {
    const { handle } = this;
    /** @type {{x: number, y: number} | null} */
    let last = null;
    handle.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      handle.setPointerCapture(event.pointerId);
      last = { x: event.clientX, y: event.clientY };
    });
    handle.addEventListener('pointermove', (event) => {
      if (last === null) return;
      const direction = this.screenNormal();
      const length = Math.hypot(direction.x, direction.y);
      const least = MIN_SLOPE * this.pixelsPerUnit();
      // A plane that faces the viewer moves with the mouse up and down.
      const [dx, dy] = length > 1e-6 ? [direction.x / length, direction.y / length] : [0, -1];
      const pixels = (event.clientX - last.x) * dx + (event.clientY - last.y) * dy;
      last = { x: event.clientX, y: event.clientY };
      this.moved(pixels / Math.max(length, least) / this.scale);
    });
    ['pointerup', 'pointercancel'].forEach((kind) => handle.addEventListener(kind, () => { last = null; }));
  }

  /** @param {Palette} palette */
  paint(palette) {
    this.material.color.set(palette.section);
  }
}

/** Half the width of a box along an axis. @param {import('./three.js').Box3} box @param {Vector3} axis */
function halfWidth(box, axis) {
  const size = box.getSize(new Vector3());
  return (Math.abs(axis.x) * size.x + Math.abs(axis.y) * size.y + Math.abs(axis.z) * size.z) / 2;
}
