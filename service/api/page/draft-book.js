// A draft as a record and texts: the first document of a history, and the step from each document to the
// next. What a store already has need not be written again.

import { applyChanges, listChanges } from './changes.js';
import { isEqual } from './documents.js';
import { History } from './history.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./draft-stores.js').DraftRecord} DraftRecord */
/** @typedef {import('./draft-stores.js').DraftStore} DraftStore */
/** @typedef {import('./draft-stores.js').Texts} Texts */
/** @typedef {import('./drafts.js').Session} Session */

/** The number of the first document among the texts of a draft. */
const FIRST = 0;

/** A text of a draft: the first document, or a step from one document to another. @typedef {{number: number, text: string, bytes: number}} Entry */

/** What is known of a draft in a store. */
export class Book {
  /** @param {DraftStore} store @param {Iterable<number>} written  numbers of texts that the store has */
  constructor(store, written = []) {
    this.store = store;
    this.written = new Set(written);
    this.nextNumber = Math.max(FIRST, ...this.written) + 1;
    /** @type {WeakMap<Surface, WeakMap<Surface, Entry>>} */
    this.steps = new WeakMap();
    /** @type {Entry | null} */
    this.firstEntry = null;
  }

  /** @param {Surface} first */
  first(first) {
    this.firstEntry ??= makeEntry(FIRST, first);
    return this.firstEntry;
  }

  /** @param {Surface} from @param {Surface} to @returns {Entry} */
  step(from, to) {
    const steps = this.steps.get(from) ?? new WeakMap();
    this.steps.set(from, steps);
    let step = steps.get(to);
    if (step !== undefined) return step;
    step = makeEntry(this.nextNumber, listChanges(from, to));
    this.nextNumber += 1;
    steps.set(to, step);
    return step;
  }

  /**
   * The record of a session and its texts, with as many steps as have room; null if the surface has none.
   * A running step is one of the steps.
   * @param {Session} session @param {string} tab @param {number} limit  bytes
   * @returns {{record: DraftRecord, entries: Entry[]} | null}
   */
  encode({ id, about, history }, tab, limit) {
    const { first, present, before } = history;
    const isRunning = history.isRunning && before !== null;
    let earlier = isRunning ? [...history.past, before] : history.past;
    let later = isRunning ? [] : history.future;
    const edits = Math.max(earlier.length, Number(history.canReset));
    for (;;) {
      const documents = [...earlier, present, ...[...later].reverse()];
      const steps = documents.map((document, i) => this.step(i === 0 ? first : documents[i - 1], document));
      const entries = [...new Set([this.first(first), ...steps])];
      const bytes = entries.reduce((sum, entry) => sum + entry.bytes, 0);
      if (bytes <= limit) {
        const numbers = steps.map(({ number }) => number);
        const record = { id, tab, about, edits, when: Date.now(), bytes, steps: numbers, position: earlier.length };
        return { record, entries };
      }
      if (earlier.length + later.length === 0) return null;
      // Keeps the nearer half of the steps.
      earlier = earlier.slice(Math.ceil(earlier.length / 2));
      later = later.slice(Math.ceil(later.length / 2));
    }
  }
}

/** @param {number} number @param {any} value @returns {Entry} */
function makeEntry(number, value) {
  const text = JSON.stringify(value);
  return { number, text, bytes: countBytes(text) };
}

/** @param {DraftRecord} record @param {Texts} texts @returns {History | null}  null if a text is missing or damaged */
export function decode({ steps, position }, texts) {
  try {
    const read = (/** @type {number} */ number) => JSON.parse(texts.get(number) ?? '');
    const first = read(FIRST);
    /** @type {Surface[]} */
    const documents = [];
    steps.forEach((number) => {
      const document = applyChanges(documents.at(-1) ?? first, read(number));
      documents.push(isEqual(document, first) ? first : document);
    });
    if (documents[position] === undefined) return null;
    return Object.assign(new History(first), {
      past: documents.slice(0, position),
      present: documents[position],
      future: documents.slice(position + 1).reverse(),
    });
  } catch {
    return null;
  }
}

/** The bytes of a text in a store: one or two for each of its units. @param {string} text */
function countBytes(text) {
  return /^[\x00-\xff]*$/.test(text) ? text.length : 2 * text.length;
}
