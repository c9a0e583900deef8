// Runs at most one request at a time. If several requests wait, it sends only the newest. It drops
// responses about a document that is no longer open.

/**
 * @template Item, Result
 * @typedef {object} Callbacks
 * @property {(request: Item) => Promise<Result>} send
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
    this.waiting = null;
    this.inFlight = false;
    this.generation = 0;
  }

  /** Requests a mesh of the present document. @param {Item} request */
  ask(request) {
    this.waiting = request;
    if (!this.inFlight) void this.work();
  }

  /** Another document was opened: drops all earlier requests. */
  forget() {
    this.generation += 1;
    this.waiting = null;
  }

  async work() {
    this.inFlight = true;
    while (this.waiting !== null) {
      const request = this.waiting;
      const { generation } = this;
      this.waiting = null;
      try {
        const result = await this.callbacks.send(request);
        if (generation === this.generation) await this.callbacks.answered(result, request);
      } catch (error) {
        // An error is shown only if no newer request waits.
        const stale = generation !== this.generation || this.waiting !== null;
        if (!stale) this.callbacks.failed(/** @type {Error} */ (error), request);
      }
    }
    this.inFlight = false;
    this.callbacks.idle();
  }
}
