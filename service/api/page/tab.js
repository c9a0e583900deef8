// The identity of this tab of the browser. A reload keeps it; a duplicated tab gets its own.

const [ID, LIVE, DRAFT] = ['surface-tab', 'surface-tab-live', 'surface-tab-draft'];
/** Milliseconds for which a tab that reloads waits until its old page has ended. */
const PATIENCE = 500;

/** A random id, which needs no secure context, unlike `crypto.randomUUID`. */
export function makeId() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** @param {string} id */
const lockName = (id) => `surface-tab-${id}`;

/**
 * The id of this tab, and whether the page of another tab is open. A lock, which the browser holds as
 * long as the page lives, says so; where there are no locks (http), a mark in the tab's own storage says
 * at least whether this tab was duplicated.
 */
export class Tab {
  constructor() {
    this.ownId = '';
    addEventListener('pagehide', () => write(LIVE, ''));
    addEventListener('pageshow', () => { if (this.ownId) write(LIVE, '1'); });
  }

  get id() {
    if (this.ownId === '') {
      const id = makeId();
      // No other tab has a new id, so the browser may take its time, as when it is busy.
      void hold(id, {});
      this.take(id);
    }
    return this.ownId;
  }

  /** Takes the id that the tab had before a reload, unless another tab has it. */
  async claim() {
    const [id, wasLive] = [read(ID), read(LIVE) === '1'];
    if (id === '' || this.ownId !== '') return;
    if (navigator.locks ? await hold(id) : !wasLive) this.take(id);
  }

  /** @param {string} id */
  take(id) {
    this.ownId = id;
    write(ID, id);
    write(LIVE, '1');
  }

  /** The draft that was open before a reload; empty if the page was not reloaded. */
  get reloadedDraft() {
    const [navigation] = performance.getEntriesByType('navigation');
    return /** @type {PerformanceNavigationTiming} */ (navigation)?.type === 'reload' ? read(DRAFT) : '';
  }

  /** Keeps the id of the open draft for a reload: a browser that is busy may lose the state of the history. @param {string} id */
  keepDraft(id) {
    write(DRAFT, id);
  }

  /** Whether another tab with this id may be open. @param {string} id */
  async isLive(id) {
    if (id === this.ownId) return false;
    if (!navigator.locks) return true;
    const { held = [] } = await navigator.locks.query();
    return held.some(({ name }) => name === lockName(id));
  }
}

/**
 * Holds the lock of a tab as long as the page lives; false if another page holds it.
 * @param {string} id @param {LockOptions} options  how long to wait @returns {Promise<boolean>}
 */
function hold(id, options = { signal: AbortSignal.timeout(PATIENCE) }) {
  if (!navigator.locks) return Promise.resolve(false);
  return new Promise((resolve) => {
    navigator.locks.request(lockName(id), options, () => {
      resolve(true);
      return new Promise(() => {});
    }).catch(() => resolve(false));
  });
}

/** @param {string} key */
function read(key) {
  try {
    return sessionStorage.getItem(key) ?? '';
  } catch {
    return '';
  }
}

/** @param {string} key @param {string} value  empty to remove it */
function write(key, value) {
  try {
    if (value) sessionStorage.setItem(key, value);
    else sessionStorage.removeItem(key);
  } catch {
    // Without storage a tab is a new one after each reload.
  }
}
