// At most one request runs at a time. Of the waiting ones only the newest is sent. Responses about a
// document that is no longer open are dropped.

/**
 * @template Wish, Result
 * @typedef {object} Telling
 * @property {(wish: Wish) => Promise<Result>} send
 * @property {(result: Result, wish: Wish) => void | Promise<void>} answered
 * @property {(error: Error, wish: Wish) => void} failed
 * @property {() => void} idle  called when no request runs or waits
 */

/**
 * @template Wish, Result
 */
export class MeshRequests {
  /** @param {Telling<Wish, Result>} telling */
  constructor(telling) {
    this.telling = telling;
    /** @type {Wish | null} */
    this.waiting = null;
    this.inFlight = false;
    this.generation = 0;
  }

  /** Requests a mesh of the present document. @param {Wish} wish */
  ask(wish) {
    this.waiting = wish;
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
      const wish = this.waiting;
      const { generation } = this;
      this.waiting = null;
      try {
        const result = await this.telling.send(wish);
        if (generation === this.generation) await this.telling.answered(result, wish);
      } catch (error) {
        // An error is shown only if no newer request waits.
        const stale = generation !== this.generation || this.waiting !== null;
        if (!stale) this.telling.failed(/** @type {Error} */ (error), wish);
      }
    }
    this.inFlight = false;
    this.telling.idle();
  }
}
