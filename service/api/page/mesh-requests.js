// One request in flight; of those that wait, only the newest is ever sent. What is answered for a
// document that is no longer open is dropped.

/**
 * @template Wish, Result
 * @typedef {object} Telling
 * @property {(wish: Wish) => Promise<Result>} send
 * @property {(result: Result, wish: Wish) => void | Promise<void>} answered
 * @property {(error: Error, wish: Wish) => void} failed
 * @property {() => void} idle  nothing is in flight and nothing waits
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

  /** The mesh is wanted as of now. @param {Wish} wish */
  ask(wish) {
    this.waiting = wish;
    if (!this.inFlight) void this.work();
  }

  /** Another document: whatever was asked before is of no interest. */
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
        // A refusal is of interest only while nothing newer waits.
        const stale = generation !== this.generation || this.waiting !== null;
        if (!stale) this.telling.failed(/** @type {Error} */ (error), wish);
      }
    }
    this.inFlight = false;
    this.telling.idle();
  }
}
