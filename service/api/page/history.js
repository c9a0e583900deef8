// Undo and redo: earlier, present and later documents, bounded in number.

import { isEqual } from './documents.js';

/** @typedef {import('./documents.js').Surface} Surface */

const MAX_STEPS = 200;

export class History {
  /** @param {Surface} first */
  constructor(first) {
    this.first = first;
    this.present = first;
    /** @type {Surface[]} */
    this.past = [];
    /** The steps that were undone, the last one first. @type {Surface[]} */
    this.future = [];
    /** The surface before the running step, if any. @type {Surface | null} */
    this.before = null;
  }

  /** Whether a step runs that has changed something. */
  get isRunning() { return this.before !== null && !isEqual(this.before, this.present); }

  get canUndo() { return this.past.length > 0 || this.isRunning; }

  get canRedo() { return this.future.length > 0 && !this.isRunning; }

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

  /**
   * Adds one step, from the surface before the running step to `next`. A surface that is equal to the last
   * one is no step.
   * @param {Surface} next
   */
  keep(next) {
    const previous = this.before ?? this.present;
    this.before = null;
    this.present = isEqual(next, previous) ? previous : next;
    if (this.present === previous) return;
    this.past = [...this.past, previous].slice(-MAX_STEPS);
    this.future = [];
  }

  /** Makes the running step, if any, a step of the history. */
  settle() {
    if (this.before !== null) this.keep(this.present);
  }

  /** Undoes one step: the running one, or else the last one of the history. Both can be redone. */
  undo() {
    this.settle();
    const previous = this.past.pop();
    if (previous === undefined) return;
    this.future.push(this.present);
    this.present = previous;
  }

  /** Redoes the last step that was undone. After a running step, as after any new one, there is none. */
  redo() {
    this.settle();
    const next = this.future.pop();
    if (next === undefined) return;
    this.past.push(this.present);
    this.present = next;
  }

  /** Returns to the first document, as a step that can be undone. */
  reset() {
    this.settle();
    this.keep(this.first);
  }
}
