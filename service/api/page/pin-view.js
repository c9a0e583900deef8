// The mark of a click: a dot on the surface, and its coordinates beside it. Behind the surface the dot is faint.

import { drawNearer, makeDotTexture } from './marks.js';
import { element } from './page.js';
import { BufferAttribute, BufferGeometry, Group, Points, PointsMaterial, Vector3 } from './three.js';

/** @typedef {import('./colors.js').Palette} Palette */

/** The diameter of the dot in CSS pixels. */
const SIZE = 13;
/** From the dot to the label, in CSS pixels. */
const DISTANCE = 14;

export class PinView {
  /** @param {import('./scene.js').Stage} stage @param {HTMLElement} [label] @param {boolean} [isLeft]  on which side of the dot the label is */
  constructor(stage, label = element('pin', HTMLElement), isLeft = false) {
    this.stage = stage;
    this.label = label;
    this.isLeft = isLeft;
    this.group = new Group();
    this.group.visible = false;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(3), 3));
    const dot = { size: SIZE, sizeAttenuation: false, transparent: true, map: makeDotTexture(), alphaTest: 0.01, depthWrite: false };
    this.materials = [
      new PointsMaterial({ ...dot, depthTest: false, opacity: 0.35 }),
      drawNearer(new PointsMaterial(dot)),
    ];
    this.materials.forEach((material, i) => {
      const points = new Points(geometry, material);
      points.frustumCulled = false;
      points.renderOrder = 8 + i; // after net and section
      this.group.add(points);
    });
    stage.scene.add(this.group);
    stage.onDraw.push(() => this.place());
  }

  /** Marks a point of the scene. @param {number[]} point @param {string} text */
  show(point, text) {
    this.group.position.fromArray(point);
    this.group.visible = true;
    this.label.textContent = text;
    this.stage.draw();
  }

  hide() {
    this.group.visible = false;
    this.label.hidden = true;
    this.stage.draw();
  }

  /** Puts the label beside the dot. */
  place() {
    const { label } = this;
    const { canvas, drawingCamera } = this.stage;
    const { x, y, z } = new Vector3().copy(this.group.position).project(drawingCamera);
    label.hidden = !this.group.visible || z > 1;
    const [left, top] = [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight];
    label.dataset.x = left.toFixed(1);
    label.dataset.y = top.toFixed(1);
    // On its side of the dot; if there is no room, on the other; if there is none either, below the dot.
    const { offsetWidth: width, offsetHeight: height } = label;
    const start = left - DISTANCE - width;
    const [hasLeft, hasRight] = [start >= 0, left + DISTANCE + width <= canvas.clientWidth];
    const isRight = hasRight && !(this.isLeft && hasLeft);
    const x0 = isRight ? left + DISTANCE : Math.max(0, start);
    label.style.translate = `${x0}px ${hasLeft || hasRight ? top - height / 2 : top + DISTANCE}px`;
  }

  /** @param {Palette} palette */
  paint(palette) {
    this.materials.forEach((material) => material.color.set(palette.section));
  }
}
