// Runs at most one request at a time. If several requests wait, it sends only the newest. It aborts
// requests that are outdated.

import { Stopped } from './work.js';

/**
 * @template Item, Result
 * @typedef {object} Callbacks
 * @property {(request: Item, outdated: AbortSignal) => Promise<Result>} send
 * @property {(request: Item, milliseconds: number) => boolean} [isKept]  whether a request that has run so
 *   long goes on when a newer one comes, as while a drag goes on; by default, it does
 * @property {(result: Result, request: Item) => void | Promise<void>} answered
 * @property {(error: Error, request: Item) => void} failed
 * @property {() => void} idle  called when no request runs or waits
 */

/**
 * @template Item, Result
 */
export class MeshRequests {
  /** @param {Callbacks<Item, Result>} callbacks */
  constructor(callbacks) {
    this.callbacks = callbacks;
    /** @type {Item | null} */
    this.nextRequest = null;
    /** The request that runs, if any. @type {{request: Item, start: number, outdated: AbortController} | null} */
    this.running = null;
  }

  /** Sends a request; if one runs, after it has ended. @param {Item} request */
  ask(request) {
    this.nextRequest = request;
    if (this.running === null) {
      void this.sendWaiting();
      return;
    }
    const { request: running, start, outdated } = this.running;
    const { isKept = () => true } = this.callbacks;
    if (!isKept(running, performance.now() - start)) outdated.abort();
  }

  /** Another document was opened, or none is needed: drops all requests. */
  forget() {
    this.nextRequest = null;
    this.running?.outdated.abort();
  }

  /** Sends the waiting request, and then the newest of those that came meanwhile, until none waits. */
  async sendWaiting() {
    while (this.nextRequest !== null) {
      const request = this.nextRequest;
      const outdated = new AbortController();
      this.nextRequest = null;
      this.running = { request, start: performance.now(), outdated };
      try {
        const result = await this.callbacks.send(request, outdated.signal);
        if (!outdated.signal.aborted) await this.callbacks.answered(result, request);
      } catch (error) {
        if (error instanceof Stopped) this.nextRequest = null;
        // An error is shown only if no newer request waits.
        const isStale = outdated.signal.aborted || this.nextRequest !== null;
        if (!isStale) this.callbacks.failed(/** @type {Error} */ (error), request);
      }
    }
    this.running = null;
    this.callbacks.idle();
  }
}
