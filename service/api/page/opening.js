// Opens surfaces. What is open stays until the first mesh of the new surface is there, so a file that the
// service refuses changes nothing on the page.

import { ServiceError } from 'surface-service';
import { compression } from './decoder.js';
import { mesh } from './mesh.js';
import { chooseAccuracy, describeAccuracy, meshOptions, RANGES } from './settings.js';
import { Unreadable } from './unreadable.js';
import { perform } from './work.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./mesh.js').MeshResponse} MeshResponse */
/** @typedef {import('./settings.js').Settings} Settings */
/** @typedef {import('./state.js').About} About */
/** @typedef {import('./state.js').State} State */

/**
 * A surface to open, and the settings that come with it.
 * @typedef {{surface: Surface, about: About, settings?: Partial<Settings>}} Wish
 */

/** The first mesh of a surface, and the settings with which it was made. @typedef {{response: MeshResponse, settings: Settings}} First */

/** A surface was not opened, or a mesh not checked; the page shows what it showed before. */
export class NotOpened extends Error {
  /** @param {string} what  the name of the file, the example or the text @param {Error} cause @param {string} [verb] */
  constructor(what, cause, verb = 'opened') {
    super(cause.message, { cause });
    this.what = what;
    this.verb = verb;
    /** @type {Error} */
    this.reason = cause;
  }
}

/** The options that decide how fine a mesh is. */
const ACCURACIES = new Set(['/resolution', '/relative_tolerance', '/tolerance']);

export class Opening {
  /**
   * @param {State} state
   * @param {object} callbacks
   * @param {() => void} callbacks.waiting  called before a surface is requested
   * @param {(surface: Surface, about: About, first: First) => void} callbacks.open
   * @param {(error: NotOpened, again: () => void) => void} callbacks.failed
   * @param {() => void} callbacks.settle  called when nothing is opened, and the error is shown elsewhere
   */
  constructor(state, callbacks) {
    this.state = state;
    this.callbacks = callbacks;
    /** Aborts the requests for a surface that will not be opened, as the user chose another one. */
    this.outdated = new AbortController();
    /** Whether a surface is being opened. */
    this.isRunning = false;
  }

  /** Another surface is open now: the one that is being opened is not needed any more. */
  cancel() {
    this.outdated.abort();
    this.isRunning = false;
  }

  /**
   * @param {string} what  for messages @param {(outdated: AbortSignal) => Promise<Wish>} read
   * @param {(error: Unreadable) => void} [showUnreadable]  shows a text that cannot be read where it was written
   */
  async start(what, read, showUnreadable) {
    this.outdated.abort();
    const outdated = new AbortController();
    this.outdated = outdated;
    this.isRunning = true;
    this.callbacks.waiting();
    try {
      const { surface, about, settings } = await read(outdated.signal);
      const first = await computeFirst(surface, about, { ...this.state.settings, ...settings }, outdated.signal);
      this.isRunning = false;
      this.callbacks.open(surface, about, first);
    } catch (error) {
      if (outdated.signal.aborted) return;
      this.isRunning = false;
      if (error instanceof Unreadable && showUnreadable) {
        showUnreadable(error);
        this.callbacks.settle();
        return;
      }
      this.callbacks.failed(new NotOpened(what, /** @type {Error} */ (error)), () => void this.start(what, read));
    }
  }
}

/**
 * The first mesh of a surface; if the service refuses it for its fineness, the coarsest.
 * @param {Surface} surface @param {About} about @param {Settings} settings @param {AbortSignal} outdated
 * @returns {Promise<First>}
 */
async function computeFirst(surface, about, settings, outdated) {
  const request = { surface, ...meshOptions(settings, surface, 1, false) };
  const { title, origin: address } = about;
  const what = `Computing the mesh of ${title} ${describeAccuracy(settings, surface)}`;
  try {
    // The mesh of an example or of a stored surface comes by its address, so that the browser keeps it.
    const response = await perform(
      what, async (signal, tell) => mesh({ ...request, ...await compression() }, { address, signal, tell }), outdated,
    );
    return { response, settings };
  } catch (error) {
    const coarsest = chooseAccuracy(settings, surface) === 'resolution'
      ? { ...settings, resolution: RANGES.resolution[0] } : { ...settings, tolerance: RANGES.tolerance[1] };
    const isTooFine = error instanceof ServiceError && error.errors.some(
      ({ pointer, parameter }) => ACCURACIES.has(pointer ?? `/${parameter}`),
    );
    const isCoarsest = settings.resolution === coarsest.resolution && settings.tolerance === coarsest.tolerance;
    if (!isTooFine || isCoarsest) throw error;
    return computeFirst(surface, about, coarsest, outdated);
  }
}
