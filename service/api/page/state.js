// The state of the page: the open document, the settings, and the chosen control point. Other modules
// listen to its changes.

import { History } from './history.js';
import { netOf, pointAt } from './net.js';
import { addRounded, moveTogether, weighTogether } from './selection.js';
import { DEFAULTS } from './settings.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./settings.js').Settings} Settings */

/**
 * What the page tells about the open surface; `origin`: the name of the example, or the id of the stored
 * surface, as which it was opened; empty for a surface of the user.
 * @typedef {{title: string, description: string, origin: string}} About
 */

/**
 * The kind of a change: another document was opened; the document was edited (`moving`: a drag, a key or
 * typing goes on, and the history has no step yet); the settings, or the address of the document, changed;
 * the chosen point changed.
 * @typedef {'opened' | 'surface' | 'moving' | 'settings' | 'chosen'} Change
 */

export class State {
  /** @param {Settings} settings */
  constructor(settings = DEFAULTS) {
    this.settings = settings;
    this.history = new History({});
    this.net = netOf({});
    /** Numbers of the chosen control points; the last one leads: the panel shows it. @type {number[]} */
    this.selection = [];
    /** @type {About} */
    this.about = { title: '', description: '', origin: '' };
    /** Names and ids under which the service has documents. @type {WeakMap<Surface, string>} */
    this.addresses = new WeakMap();
    /** @type {((change: Change) => void)[]} */
    this.listeners = [];
  }

  get surface() { return this.history.present; }

  /** @see About */
  get origin() { return this.about.origin; }

  /** The name or the id under which the service has the present document; empty if it has none, as after an edit. */
  get address() { return this.addresses.get(this.surface) ?? ''; }

  /** Number of the control point that was chosen last, or -1. */
  get chosen() { return this.selection[this.selection.length - 1] ?? -1; }

  set chosen(index) { this.selection = index < 0 ? [] : [index]; }

  /** The control point that was chosen last. */
  get handle() { return this.net.handles[this.chosen]; }

  /** Calls `listener` after each change, until the function is called that it returns. @param {(change: Change) => void} listener */
  listen(listener) {
    this.listeners.push(listener);
    return () => { this.listeners = this.listeners.filter((other) => other !== listener); };
  }

  /**
   * Opens a document: a new one, or one with its history and with other settings.
   * @param {Surface} surface @param {Partial<About>} about
   * @param {{history?: History, settings?: Settings}} kept
   */
  open(surface, about = {}, { history = new History(surface), settings = this.settings } = {}) {
    this.history = history;
    this.settings = settings;
    this.about = { title: '', description: '', origin: '', ...about };
    if (this.origin) this.addresses.set(history.first, this.origin);
    this.chosen = -1;
    this.notify('opened');
  }

  /** The service has stored the document under this id. @param {Surface} surface @param {string} id */
  setAddress(surface, id) {
    this.addresses.set(surface, id);
    this.notify('settings');
  }

  /** @param {Partial<Settings>} changes */
  set(changes) {
    this.settings = { ...this.settings, ...changes };
    this.notify('settings');
  }

  /** Chooses a point; a running step of another point ends. @param {number} index  -1 for none */
  choose(index) {
    this.select(index < 0 ? [] : [index]);
  }

  /** Chooses several points, of which the last one leads. @param {number[]} selection */
  select(selection) {
    if (selection.join() === this.selection.join()) return;
    this.commit();
    this.selection = selection;
    this.notify('chosen');
  }

  /** Chooses points around the leading one, which goes on leading. @param {number[]} points */
  selectAround(points) {
    const { chosen } = this;
    this.select(chosen < 0 ? points : [...points.filter((index) => index !== chosen), chosen]);
  }

  /**
   * Moves the leading point to a place, and all chosen points with it; `keep` makes it a step of the history.
   * @param {number[]} place @param {boolean} keep
   */
  move(place, keep) {
    if (!this.handle) return;
    // All places of a drag are relative to its beginning, so that rounding does not add up.
    const begin = this.history.before ?? this.surface;
    this.change(moveTogether(this.surface, this.net, this.selection, place, begin), keep);
  }

  /** Moves all chosen points by an offset along x, y and z of the leading one. @param {number[]} offset */
  moveBy(offset) {
    const place = this.point()?.map((value, axis) => addRounded(value, offset[axis]));
    if (place) this.move(place, true);
  }

  /** Gives all chosen points a weight. @param {number} weight @param {boolean} keep */
  setWeight(weight, keep) {
    if (this.handle) this.change(weighTogether(this.surface, this.net, this.selection, weight), keep);
  }

  /** Adds the running step (`History.preview`), if any, to the history. */
  commit() {
    if (this.history.before === null) return;
    this.history.settle();
    this.notify('surface');
  }

  /** Undoes the running step. */
  cancel() {
    this.history.cancel();
    this.notify('surface');
  }

  undo() { this.history.undo(); this.notify('surface'); }

  redo() { this.history.redo(); this.notify('surface'); }

  reset() { this.history.reset(); this.notify('surface'); }

  /** Coordinates of the chosen point. */
  point() {
    return this.handle ? pointAt(this.surface, this.handle) : undefined;
  }

  /** @param {Surface} surface @param {boolean} keep */
  change(surface, keep) {
    if (keep) this.history.keep(surface);
    else this.history.preview(surface);
    this.notify(keep ? 'surface' : 'moving');
  }

  /** @param {Change} change */
  notify(change) {
    if (change !== 'settings' && change !== 'chosen') {
      this.net = netOf(this.surface);
      // After another step the net may have fewer points.
      if (this.chosen >= 0) this.selection = this.selection.filter((index) => index < this.net.handles.length);
    }
    this.listeners.forEach((listener) => listener(change));
  }
}
