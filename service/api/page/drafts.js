// Drafts: every edit with its history, for the last twenty surfaces. They are kept on the device; while
// an API key is in use, only in the tab, unless the user ticks "Keep on this device".

import { Book, decode } from './draft-book.js';
import { DeviceStore, TabStore } from './draft-stores.js';

/** @typedef {import('./draft-stores.js').DraftRecord} DraftRecord */
/** @typedef {import('./draft-stores.js').DraftStore} DraftStore */

/** A surface that is, or was, open in this tab; `isPrivate`: it was edited while a key was in use.
 * @typedef {{id: string, about: import('./state.js').About, history: import('./history.js').History, isPrivate: boolean}} Session */

/** What became of the last edit: kept on the device, in the tab, not at all. @typedef {'device' | 'tab' | 'nowhere'} Place */

const MAX_DRAFTS = 20;

export class Drafts {
  /**
   * @param {import('./tab.js').Tab} tab @param {() => boolean} hasKey  whether a key is in use
   * @param {() => boolean} keepsAll  whether the user ticked "Keep on this device"
   */
  constructor(tab, hasKey, keepsAll) {
    this.tab = tab;
    this.hasKey = hasKey;
    this.keepsAll = keepsAll;
    this.device = new DeviceStore();
    this.inTab = new TabStore();
    /** Why the device keeps nothing, if it does not. @type {Error | null} */
    this.deviceError = null;
    /** @type {Map<string, Book>} */
    this.books = new Map();
    this.channel = new BroadcastChannel('surface-drafts');
    // Another tab has removed these drafts: they must be written whole again.
    this.channel.onmessage = ({ data }) => data.forEach((/** @type {string} */ id) => this.books.delete(id));
  }

  /** @returns {DraftStore[]} */
  get stores() { return this.deviceError ? [this.inTab] : [this.device, this.inTab]; }

  /** Keeps a session as it is now; says where. @param {Session} session @returns {Promise<Place>} */
  async save(session) {
    session.isPrivate ||= this.hasKey();
    const isInTab = (session.isPrivate && !this.keepsAll()) || this.deviceError;
    const store = isInTab ? this.inTab : this.device;
    try {
      return await this.writeInto(store, session);
    } catch (error) {
      if (store === this.inTab) return 'nowhere';
      this.deviceError = /** @type {Error} */ (error);
      return this.save(session);
    }
  }

  /** @param {DraftStore} store @param {Session} session @returns {Promise<Place>} */
  async writeInto(store, session) {
    const old = this.books.get(session.id);
    const book = old?.store === store ? old : new Book(store);
    this.books.set(session.id, book);
    for (let limit = store.maxBytes; ;) {
      const draft = book.encode(session, this.tab.id, limit);
      if (draft === null) return 'nowhere';
      const { record, entries } = draft;
      const numbers = new Set(entries.map(({ number }) => number));
      const added = new Map(entries.filter(({ number }) => !book.written.has(number))
        .map(({ number, text }) => [number, text]));
      const dropped = [...book.written].filter((number) => !numbers.has(number));
      try {
        await store.write(record, added, dropped);
        book.written = numbers;
        break;
      } catch (error) {
        if (!isFull(error)) throw error;
        // Removes the oldest drafts, and then the oldest steps of this one.
        const wasRemoved = await this.prune(store, session.id, record.bytes);
        if (!wasRemoved) limit = Math.min(limit, record.bytes) / 2;
      }
    }
    if (old && old.store !== store) await old.store.remove([session.id]).catch(() => {});
    await this.prune(store, session.id, store.maxBytes);
    return store.name;
  }

  /**
   * Removes the oldest drafts of a store, except one, until the others are few enough, and no larger than
   * `room` together with it. Returns whether any was removed.
   * @param {DraftStore} store @param {string} kept @param {number} room  bytes
   */
  async prune(store, kept, room) {
    const records = (await store.list()).sort((a, b) => b.when - a.when);
    const own = records.find(({ id }) => id === kept);
    let bytes = own?.bytes ?? 0;
    const others = records.filter(({ id }) => id !== kept);
    const removed = others.filter((record, i) => {
      bytes += record.bytes;
      return i >= MAX_DRAFTS - 1 || bytes > room;
    });
    await this.remove(removed.map(({ id }) => id), [store]);
    return removed.length > 0;
  }

  /** The drafts that are kept, the newest first. @returns {Promise<DraftRecord[]>} */
  async list() {
    const lists = await Promise.all(this.stores.map((store) => this.ask(store, () => store.list(), [])));
    return lists.flat().sort((a, b) => b.when - a.when);
  }

  /**
   * The session of a draft, which from now on is this tab's. If it may be open in another tab, it is a copy
   * with an id of its own.
   * @param {string} id @param {string} copyId @returns {Promise<Session | null>}  null if it is not kept, or damaged
   */
  async open(id, copyId) {
    for (const store of this.stores) {
      const draft = await this.ask(store, () => store.read(id), null);
      if (draft === null) continue;
      const { record, texts } = draft;
      const history = decode(record, texts);
      if (history === null) continue;
      const isCopy = await this.tab.isLive(record.tab);
      if (!isCopy) this.books.set(id, new Book(store, texts.keys()));
      // The storage of a duplicated tab is a copy, too.
      if (isCopy && store === this.inTab) await store.remove([id]);
      return { id: isCopy ? copyId : id, about: record.about, history, isPrivate: store === this.inTab };
    }
    return null;
  }

  /** What a store answers; a store that does not work is not asked again. @template T @param {DraftStore} store @param {() => Promise<T>} question @param {T} nothing @returns {Promise<T>} */
  async ask(store, question, nothing) {
    try {
      return await question();
    } catch (error) {
      if (store === this.device) this.deviceError = /** @type {Error} */ (error);
      return nothing;
    }
  }

  /** @param {string[]} ids @param {DraftStore[]} stores */
  async remove(ids, stores = this.stores) {
    if (ids.length === 0) return;
    ids.forEach((id) => this.books.delete(id));
    await Promise.all(stores.map((store) => store.remove(ids)));
    this.channel.postMessage(ids);
  }

  /** Removes all drafts, of all tabs; returns how many. */
  async forgetAll() {
    const records = await this.list();
    await this.remove(records.map(({ id }) => id));
    return records.length;
  }
}

/** Whether a store has no room. @param {unknown} error */
const isFull = (error) => error instanceof DOMException && error.name === 'QuotaExceededError';
