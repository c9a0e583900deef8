// Draws lines on the surface, those of a section or an edge: strongly where the surface does not hide them,
// else faintly.

import {
  BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial,
} from './three.js';
import { drawNearer, makeDotTexture } from './marks.js';

/** @typedef {import('./colors.js').Palette} Palette */

export class SectionView {
  /**
   * @param {Pick<import('./scene.js').Stage, 'scene' | 'draw'>} stage @param {'section' | 'chosen'} color  of the palette
   * @param {number} width  in CSS pixels, if they are wider than one
   */
  constructor(stage, color = 'section', width = 1) {
    this.stage = stage;
    this.color = color;
    this.group = new Group();
    this.geometry = new BufferGeometry();
    const lines = { transparent: true, depthWrite: false };
    /** @type {(LineBasicMaterial | PointsMaterial)[]} */
    this.materials = [
      new LineBasicMaterial({ ...lines, depthTest: false, opacity: 0.35 }),
      drawNearer(new LineBasicMaterial(lines)),
    ];
    this.materials.forEach((material, i) => {
      const object = new LineSegments(this.geometry, material);
      object.frustumCulled = false;
      object.renderOrder = 6 + i; // after the net
      this.group.add(object);
    });
    if (width > 1) this.addDots(width);
  }

  /** WebGL draws lines one pixel wide; dots at their points make them wider. @param {number} size */
  addDots(size) {
    const material = drawNearer(new PointsMaterial({
      size, sizeAttenuation: false, transparent: true, map: makeDotTexture(), alphaTest: 0.01, depthWrite: false,
    }));
    const dots = new Points(this.geometry, material);
    dots.frustumCulled = false;
    dots.renderOrder = 7;
    this.materials.push(material);
    this.group.add(dots);
  }

  /** Draws lines in place of the present ones; without lines nothing stays in the scene. @param {number[][][]} lines  points of each, in the scene */
  show(lines) {
    this.geometry.dispose();
    this.group.removeFromParent();
    const [[origin] = []] = lines;
    if (origin) {
      // Relative to a point of the section, numbers of 32 bits are precise far from the origin, too.
      const numbers = lines.flatMap((points) => points.slice(1).flatMap((end, i) => (
        [...points[i], ...end].map((value, k) => value - origin[k % 3])
      )));
      this.geometry.setAttribute('position', new BufferAttribute(new Float32Array(numbers), 3));
      this.group.position.set(origin[0], origin[1], origin[2]);
      this.stage.scene.add(this.group);
    }
    this.stage.draw();
  }

  /** @param {Palette} palette */
  paint(palette) {
    this.materials.forEach((material) => material.color.set(palette[this.color]));
  }
}
