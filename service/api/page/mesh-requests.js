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
    this.nextRequest = null;
    this.isRunning = false;
    /** Number of documents opened: a response to a request of an older document is dropped. */
    this.generation = 0;
  }

  /** Requests a mesh of the present document. @param {Item} request */
  ask(request) {
    this.nextRequest = request;
    if (!this.isRunning) void this.sendWaiting();
  }

  /** Another document was opened: drops all earlier requests. */
  forget() {
    this.generation += 1;
    this.nextRequest = null;
  }

  /** Sends the waiting request, and then the newest of those that came meanwhile, until none waits. */
  async sendWaiting() {
    this.isRunning = true;
    while (this.nextRequest !== null) {
      const request = this.nextRequest;
      const { generation } = this;
      this.nextRequest = null;
      try {
        const result = await this.callbacks.send(request);
        if (generation === this.generation) await this.callbacks.answered(result, request);
      } catch (error) {
        // An error is shown only if no newer request waits.
        const isStale = generation !== this.generation || this.nextRequest !== null;
        if (!isStale) this.callbacks.failed(/** @type {Error} */ (error), request);
      }
    }
    this.isRunning = false;
    this.callbacks.idle();
  }
}
