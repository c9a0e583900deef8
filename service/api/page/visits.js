// The surfaces that are open one after another in this tab. Each is an entry of the browser's history,
// and a draft; so Back, Forward, a reload and an undo of opening lead back to it with all of its steps.

import { formatAddress, readAddress } from './address.js';
import { hideOffer, offer } from './offer.js';
import { button, element } from './page.js';
import { makeId } from './tab.js';

/** @typedef {import('./drafts.js').Session} Session */
/** @typedef {import('./drafts.js').Place} Place */
/** @typedef {import('./draft-stores.js').DraftRecord} DraftRecord */
/** @typedef {import('./state.js').State} State */

/** @typedef {{read: () => number[] | null, start: (camera: number[] | null) => void}} Camera  null: the default view */

/** Milliseconds after an edit until it is kept; after a change of the view until the address has it. */
const [SAVE_PAUSE, ADDRESS_PAUSE] = [250, 400];
/** The most surfaces that the memory of the page has. */
const MAX_SESSIONS = 20;
/** Milliseconds for which a draft is offered to a new tab: a day. */
const MAX_AGE = 86_400_000;

export class Visits {
  /**
   * @param {State} state @param {import('./drafts.js').Drafts} drafts @param {Camera} camera
   * @param {(id: string) => Promise<void>} openById  opens a surface of the service
   */
  constructor(state, drafts, camera, openById) {
    this.state = state;
    this.drafts = drafts;
    this.camera = camera;
    this.openById = openById;
    /** The open surface. @type {Session | null} */
    this.session = null;
    /** @type {Map<string, Session>} */
    this.sessions = new Map();
    /** What becomes of the entry of the history when the next surface opens. @type {'push' | 'replace'} */
    this.entry = 'replace';
    /** The session that opens next, if it is not a new one; and its camera. @type {{session: Session | null, camera: number[] | null}} */
    this.next = { session: null, camera: null };
    /** The number of the last visit: an older one, which comes later, is dropped. */
    this.turn = 0;
    this.saveTimer = 0;
    this.addressTimer = 0;
    /** The address that the entry of the history has, or gets after a pause. */
    this.address = '';
    /** @type {Place} */
    this.place = 'device';
    /** Called when a draft was kept, or could not be. @type {() => void} */
    this.kept = () => {};
    state.listen((change) => {
      if (change === 'opened') this.opened();
      else if (change === 'surface' || change === 'moving') {
        hideOffer();
        this.edited();
      }
      if (change !== 'chosen') this.noteAddress();
    });
    addEventListener('popstate', () => { void this.visit(); });
    addEventListener('pagehide', () => this.flush());
    document.addEventListener('visibilitychange', () => { if (document.hidden) this.flush(); });
    addEventListener('beforeunload', (event) => {
      // The next page may already run when this one gets `pagehide`.
      this.flush();
      if (this.session && needsDraft(this.session) && this.place === 'nowhere') event.preventDefault();
    });
    element('skip', HTMLElement).addEventListener('click', (event) => {
      // The fragment of the address is for the settings, not for a place of the page.
      event.preventDefault();
      element('view', HTMLElement).focus();
    });
  }

  /** Opens what the address names: its draft, the surface of the service, or the first one. @param {string} first */
  async start(first) {
    const address = readAddress(location);
    this.next.camera = address.camera;
    const { tab } = this.drafts;
    const { draft = tab.reloadedDraft || undefined, origin } = readEntry();
    await tab.claim();
    const session = draft === undefined ? null : await this.drafts.open(draft, makeId());
    if (session !== null) {
      this.show(session);
      return;
    }
    await this.openById(address.surface || origin || first);
    if (draft === undefined) await this.offerRecent();
    else if (!address.surface && !origin) offerOther();
  }

  /** Opens a draft of the list, as another entry of the history. @param {string} id */
  async openDraft(id) {
    this.turn += 1;
    const { turn } = this;
    const session = this.sessions.get(id) ?? await this.drafts.open(id, makeId());
    if (turn !== this.turn || session === null || session === this.session) return;
    this.show(session);
  }

  /** Opens the surface of the present entry of the history. */
  async visit() {
    const { settings, surface, camera } = readAddress(location);
    const { draft, origin } = readEntry();
    // The entry of the earlier surface has gone.
    clearTimeout(this.addressTimer);
    this.address = '';
    if (this.session && (draft === undefined || draft === this.session.id)) {
      // Only the fragment has changed: by hand, or by a link to a place of the page.
      if (location.hash.includes('=')) {
        this.state.set(settings);
        this.camera.start(camera);
      }
      this.address = this.describeAddress();
      this.writeAddress();
      return;
    }
    this.turn += 1;
    const { turn } = this;
    const session = draft === undefined ? null
      : this.sessions.get(draft) ?? await this.drafts.open(draft, makeId());
    if (turn !== this.turn) return;
    // Dialogs are about the surface that was open, except the one that asks for a key.
    document.querySelectorAll('dialog:not(#access)').forEach((dialog) => /** @type {HTMLDialogElement} */ (dialog).close());
    this.entry = 'replace';
    this.next.camera = camera;
    if (session !== null) {
      this.show(session, settings);
    } else if (surface || origin) {
      this.state.settings = settings;
      await this.openById(surface || origin);
    } else {
      offerOther();
    }
    this.entry = 'push';
  }

  /** @param {Session} session @param {import('./settings.js').Settings} settings */
  show(session, settings = this.state.settings) {
    this.next.session = session;
    this.state.open(session.history.first, session.about, { history: session.history, settings });
  }

  /** The state has another document. */
  opened() {
    const before = this.session;
    before?.history.settle();
    this.flush();
    if (this.addressTimer !== 0) this.writeAddress();
    const { history: steps, about } = this.state;
    this.session = this.next.session ?? { id: makeId(), about, history: steps, isPrivate: false };
    this.camera.start(this.next.camera);
    this.next = { session: null, camera: null };
    this.sessions.delete(this.session.id);
    this.sessions.set(this.session.id, this.session);
    if (this.sessions.size > MAX_SESSIONS) this.sessions.delete([...this.sessions.keys()][0]);
    this.address = this.describeAddress();
    const isEntry = this.writeAddress(this.entry === 'push' ? 'pushState' : 'replaceState');
    if (!needsDraft(this.session)) this.drafts.tab.keepDraft('');
    hideOffer();
    if (before && this.entry === 'push') {
      const undo = isEntry ? () => history.back() : () => this.show(before);
      offer(`Opened in place of ${before.about.title}.`, 'Undo', undo);
    }
    this.entry = 'push';
    this.edited();
  }

  /** The document was edited, or opened: keeps it after a pause. */
  edited() {
    if (this.session === null || !needsDraft(this.session) || this.saveTimer !== 0) return;
    this.saveTimer = setTimeout(() => this.save(), SAVE_PAUSE);
  }

  /** Keeps the open document now. */
  save() {
    clearTimeout(this.saveTimer);
    this.saveTimer = 0;
    const { session } = this;
    if (session === null || !needsDraft(session)) return;
    this.drafts.tab.keepDraft(session.id);
    this.drafts.save(session).then((place) => {
      const isNew = place !== this.place;
      this.place = place;
      if (isNew) this.kept();
    }).catch(() => {});
  }

  /** The page may end: keeps what waits. A change of the address would now lose the entry's draft. */
  flush() {
    if (this.saveTimer !== 0) this.save();
  }

  /** The settings, the camera or the address of the document may have changed. */
  noteAddress() {
    const address = this.describeAddress();
    if (this.session === null || address === this.address) return;
    this.address = address;
    clearTimeout(this.addressTimer);
    this.addressTimer = setTimeout(() => this.writeAddress(), ADDRESS_PAUSE);
  }

  /** The address of the open document, with its settings and its camera. @param {string} [surface]  its id, if it will be stored */
  describeAddress(surface = this.state.address) {
    return formatAddress({ surface, settings: this.state.settings, camera: this.camera.read() });
  }

  /** Writes the address; returns whether the browser took it. @param {'pushState' | 'replaceState'} method */
  writeAddress(method = 'replaceState') {
    clearTimeout(this.addressTimer);
    this.addressTimer = 0;
    try {
      const entry = { draft: this.session?.id, origin: this.session?.about.origin };
      history[method](entry, '', location.pathname + this.address);
      return true;
    } catch {
      // Some browsers limit the changes in a minute; the next one writes the address.
      return false;
    }
  }

  /** Offers the newest draft, if it may have been lost with its tab. */
  async offerRecent() {
    const [newest] = await this.drafts.list();
    if (!newest || Date.now() - newest.when > MAX_AGE || await this.drafts.tab.isLive(newest.tab)) return;
    offer(`There is a draft of ${newest.about.title}, with ${describeEdits(newest)}.`, 'Open it', () => { void this.openDraft(newest.id); });
  }
}

/** Whether a session has what the service does not have: edits, or a surface of the user. @param {Session} session */
function needsDraft({ about, history: steps }) {
  return about.origin === '' || steps.canUndo || steps.canRedo || steps.canReset;
}

/** @param {DraftRecord} draft */
export function describeEdits({ edits }) {
  return edits === 1 ? '1 edit' : `${edits === 0 ? 'no' : edits} edits`;
}

/** What the present entry of the history has: its draft, and the surface of the service that was edited. @returns {{draft?: string, origin: string}} */
function readEntry() {
  const { draft, origin } = history.state ?? {};
  return { draft: typeof draft === 'string' ? draft : undefined, origin: typeof origin === 'string' ? origin : '' };
}

function offerOther() {
  offer('This surface is no longer kept.', 'Open another one', () => button('open').click());
}
