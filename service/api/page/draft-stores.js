// Where drafts are kept: on the device (IndexedDB), or in this tab until it is closed (sessionStorage).
//
// A draft is a record, and texts that it numbers: 0 is the first document, the others are steps. An edit
// so writes its own step and the record, not the whole document.

/**
 * @typedef {object} DraftRecord
 * @property {string} id
 * @property {string} tab  id of the tab that writes it
 * @property {import('./state.js').About} about
 * @property {number} edits  steps that can be undone
 * @property {number} when  of the last edit, in milliseconds since 1970
 * @property {number} bytes  of all its texts
 * @property {number[]} steps  numbers of the texts from document to document; the first leads from the first document
 * @property {number} position  the index of the present document among those to which the steps lead
 */

/** Texts by their numbers. @typedef {Map<number, string>} Texts */

/**
 * @typedef {object} DraftStore
 * @property {'device' | 'tab'} name
 * @property {number} maxBytes  of all drafts
 * @property {() => Promise<DraftRecord[]>} list
 * @property {(id: string) => Promise<{record: DraftRecord, texts: Texts} | null>} read
 * @property {(record: DraftRecord, added: Texts, dropped: number[]) => Promise<void>} write
 *   begins before it returns if the store is open, so that it works while the page is being closed
 * @property {(ids: string[]) => Promise<void>} remove
 */

/** IndexedDB. @implements {DraftStore} */
export class DeviceStore {
  constructor() {
    this.name = /** @type {const} */ ('device');
    this.maxBytes = 50e6;
    /** @type {IDBDatabase | null} */
    this.database = null;
  }

  async open() {
    const request = indexedDB.open('surface-drafts', 1);
    request.onupgradeneeded = () => {
      request.result.createObjectStore('drafts', { keyPath: 'id' });
      request.result.createObjectStore('texts');
    };
    const database = await resultOf(request);
    const forget = () => { this.database = null; };
    database.onclose = forget;
    database.onversionchange = () => { database.close(); forget(); };
    this.database = database;
    return database;
  }

  async list() {
    const database = this.database ?? await this.open();
    return resultOf(database.transaction('drafts').objectStore('drafts').getAll());
  }

  /** @param {string} id */
  async read(id) {
    const database = this.database ?? await this.open();
    const transaction = database.transaction(['drafts', 'texts']);
    const [record, keys, values] = await Promise.all([
      resultOf(transaction.objectStore('drafts').get(id)),
      resultOf(transaction.objectStore('texts').getAllKeys(textsOf(id))),
      resultOf(transaction.objectStore('texts').getAll(textsOf(id))),
    ]);
    if (record === undefined) return null;
    const numbers = /** @type {[string, number][]} */ (keys).map(([, number]) => number);
    return { record, texts: new Map(numbers.map((number, i) => [number, values[i]])) };
  }

  /** @param {DraftRecord} record @param {Texts} added @param {number[]} dropped */
  async write(record, added, dropped) {
    const database = this.database ?? await this.open();
    const transaction = database.transaction(['drafts', 'texts'], 'readwrite');
    transaction.objectStore('drafts').put(record);
    const texts = transaction.objectStore('texts');
    added.forEach((text, number) => texts.put(text, [record.id, number]));
    dropped.forEach((number) => texts.delete([record.id, number]));
    // A page that is being closed receives no more events, after which it would be committed.
    transaction.commit();
    await endOf(transaction);
  }

  /** @param {string[]} ids */
  async remove(ids) {
    const database = this.database ?? await this.open();
    const transaction = database.transaction(['drafts', 'texts'], 'readwrite');
    ids.forEach((id) => {
      transaction.objectStore('drafts').delete(id);
      transaction.objectStore('texts').delete(textsOf(id));
    });
    await endOf(transaction);
  }
}

/** The keys of the texts of a draft. @param {string} id */
const textsOf = (id) => IDBKeyRange.bound([id, 0], [id, Infinity]);

/** @template T @param {IDBRequest<T>} request @returns {Promise<T>} */
function resultOf(request) {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** @param {IDBTransaction} transaction @returns {Promise<void>} */
function endOf(transaction) {
  return new Promise((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onabort = () => reject(transaction.error ?? new DOMException('aborted', 'AbortError'));
  });
}

const PREFIX = 'surface-draft:';

/** The storage of the tab, which a reload keeps. @implements {DraftStore} */
export class TabStore {
  constructor() {
    this.name = /** @type {const} */ ('tab');
    this.maxBytes = 4e6;
  }

  async list() {
    return listKeys(PREFIX).filter((key) => !key.includes('/'))
      .map((key) => JSON.parse(sessionStorage.getItem(key) ?? ''));
  }

  /** @param {string} id */
  async read(id) {
    const record = sessionStorage.getItem(PREFIX + id);
    if (record === null) return null;
    const start = `${PREFIX}${id}/`;
    const texts = new Map(listKeys(start).map((key) => (
      [Number(key.slice(start.length)), sessionStorage.getItem(key) ?? '']
    )));
    return { record: JSON.parse(record), texts };
  }

  /** @param {DraftRecord} record @param {Texts} added @param {number[]} dropped */
  async write(record, added, dropped) {
    const key = PREFIX + record.id;
    try {
      added.forEach((text, number) => sessionStorage.setItem(`${key}/${number}`, text));
      sessionStorage.setItem(key, JSON.stringify(record));
    } catch (error) {
      // The record from before stays whole; new texts are dropped.
      added.forEach((_, number) => sessionStorage.removeItem(`${key}/${number}`));
      throw error;
    }
    dropped.forEach((number) => sessionStorage.removeItem(`${key}/${number}`));
  }

  /** @param {string[]} ids */
  async remove(ids) {
    ids.forEach((id) => {
      sessionStorage.removeItem(PREFIX + id);
      listKeys(`${PREFIX}${id}/`).forEach((key) => sessionStorage.removeItem(key));
    });
  }
}

/** @param {string} start */
function listKeys(start) {
  return Object.keys(sessionStorage).filter((key) => key.startsWith(start));
}
