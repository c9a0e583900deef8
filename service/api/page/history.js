// Undo and redo: earlier, present and later documents, bounded in number.

/** @typedef {import('./documents.js').Surface} Surface */

const MAX_STEPS = 200;

export class History {
  /** @param {Surface} first */
  constructor(first) {
    this.first = first;
    this.present = first;
    /** @type {Surface[]} */
    this.past = [];
    /** @type {Surface[]} */
    this.future = [];
    /** The surface before the running step, if any. @type {Surface | null} */
    this.before = null;
  }

  get canUndo() { return this.past.length > 0; }

  get canRedo() { return this.future.length > 0; }

  get canReset() { return this.present !== this.first; }

  /** Shows a running step, such as a drag; only `keep` adds it to the history. @param {Surface} next */
  preview(next) {
    this.before ??= this.present;
    this.present = next;
  }

  /** Undoes the running step. */
  cancel() {
    this.present = this.before ?? this.present;
    this.before = null;
  }

  /** Adds one step, from the surface before the running step to `next`. @param {Surface} next */
  keep(next) {
    const previous = this.before ?? this.present;
    this.before = null;
    this.present = next;
    if (next === previous) return;
    this.past = [...this.past, previous].slice(-MAX_STEPS);
    this.future = [];
  }

  /** Undoes the running step, if any, and then the last step of the history. */
  undo() {
    this.cancel();
    const previous = this.past.pop();
    if (previous === undefined) return;
    this.future.push(this.present);
    this.present = previous;
  }

  /** Undoes the running step, if any, and then redoes the last step that was undone. */
  redo() {
    this.cancel();
    const next = this.future.pop();
    if (next === undefined) return;
    this.past.push(this.present);
    this.present = next;
  }

  /** Returns to the first document, as a step that can be undone. */
  reset() {
    this.keep(this.first);
  }
}
