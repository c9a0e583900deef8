// Draws faces over the mesh: that which is chosen, and that under the mouse with its name beside the pointer.

import { element } from './page.js';
import { buildMaterial } from './studio.js';
import { BufferAttribute, BufferGeometry, Mesh, Vector2 } from './three.js';

/** @typedef {import('./faces.js').Face} Face */

export class FaceView {
  /** @param {import('./scene.js').Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.chosen = buildOverlay(0.6);
    this.hovered = buildOverlay(0.3);
    this.label = element('hovered', HTMLElement);
  }

  get materials() {
    return [this.chosen.material, this.hovered.material];
  }

  /** Marks a face as chosen; null marks none. @param {Face | null} face */
  choose(face) {
    cover(this.chosen, face);
    this.stage.draw();
  }

  /** Marks the face under the mouse; null marks none. @param {Face | null} face @param {number} x @param {number} y  in CSS pixels */
  hover(face, x, y) {
    const isNew = this.hovered.userData.face !== face;
    if (isNew) cover(this.hovered, face);
    if (isNew) this.stage.draw();
    this.label.hidden = face === null;
    this.label.textContent = face?.text ?? '';
    this.label.style.translate = `${x + 14}px ${y + 16}px`;
  }

  /** Marks faces under the mouse, once a frame. @param {(mouse: Vector2) => Face | null} find  by a place from -1 to 1 */
  watch(find) {
    const { canvas } = this.stage;
    let isPending = false;
    canvas.addEventListener('pointermove', ({ buttons, pointerType, clientX, clientY }) => {
      if (isPending || buttons !== 0 || pointerType !== 'mouse') return;
      isPending = true;
      requestAnimationFrame(() => {
        isPending = false;
        const { left, top, width, height } = canvas.getBoundingClientRect();
        const [x, y] = [clientX - left, clientY - top];
        this.hover(find(new Vector2(2 * x / width - 1, 1 - 2 * y / height)), x, y);
      });
    });
    ['pointerdown', 'pointerleave'].forEach((kind) => canvas.addEventListener(kind, () => this.hover(null, 0, 0)));
  }

  /** The meshes are about to be replaced. */
  forget() {
    this.choose(null);
    this.hover(null, 0, 0);
  }
}

/** @param {number} opacity */
function buildOverlay(opacity) {
  return new Mesh(new BufferGeometry(), buildMaterial({
    color: '#ffd24d', transparent: true, opacity, depthWrite: false, polygonOffset: false,
  }));
}

/** Draws a mesh over the triangles of a face. @param {Mesh} overlay @param {Face | null} face */
function cover(overlay, face) {
  overlay.removeFromParent();
  overlay.geometry.dispose();
  overlay.userData.face = face;
  if (face === null) return;
  const { geometry } = face.mesh;
  overlay.geometry = new BufferGeometry();
  ['position', 'normal'].forEach((name) => overlay.geometry.setAttribute(name, geometry.getAttribute(name)));
  overlay.geometry.setIndex(new BufferAttribute(geometry.index.array.slice(3 * face.first, 3 * face.end), 1));
  face.mesh.add(overlay);
}
