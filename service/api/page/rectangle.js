// The rectangle that a user draws over the view to choose the points in it.

import { element } from './page.js';

/** A place of the canvas, in CSS pixels. @typedef {{x: number, y: number}} Place */

export class Rectangle {
  constructor() {
    this.box = element('rectangle', HTMLElement);
    /** Where it begins; null if none is drawn. @type {Place | null} */
    this.start = null;
  }

  /** @param {Place} start */
  begin(start) {
    this.start = start;
    this.show(start);
  }

  /** @param {Place} place  the corner opposite to the first */
  show({ x, y }) {
    const { start } = this;
    if (start === null) return;
    this.box.hidden = false;
    this.box.style.translate = `${Math.min(x, start.x)}px ${Math.min(y, start.y)}px`;
    this.box.style.width = `${Math.abs(x - start.x)}px`;
    this.box.style.height = `${Math.abs(y - start.y)}px`;
  }

  /** Removes the rectangle; returns the place where it began, or null. */
  end() {
    const { start } = this;
    this.start = null;
    this.box.hidden = true;
    return start;
  }
}
