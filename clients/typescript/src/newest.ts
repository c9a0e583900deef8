// A queue for work that follows a hand, such as the mesh of a net while a point is dragged.

/** What a queue does now: the item that it sent, and since when (`performance.now()`). */
export interface Busy<Item> {
  item: Item;
  since: number;
}

export interface NewestOnlyOptions<Item> {
  /**
   * Whether a request that has run for some milliseconds may end when a newer one comes; else it is
   * aborted. Default: yes, because a long drag would show nothing if each movement aborted the
   * request before it.
   */
  keep?: ((item: Item, milliseconds: number) => boolean) | undefined;
  /** Called whenever a request is sent, and with null when no request runs or waits. */
  onBusy?: ((busy: Busy<Item> | null) => void) | undefined;
}

interface Waiting<Item, Result> {
  item: Item;
  resolve: (result: Result | undefined) => void;
  reject: (error: unknown) => void;
}

/** Runs at most one request at a time. If several wait, it sends only the newest. */
export class NewestOnly<Item, Result> {
  readonly #send: (item: Item, signal: AbortSignal) => Promise<Result>;
  readonly #options: NewestOnlyOptions<Item>;
  #waiting: Waiting<Item, Result> | undefined;
  #running: { item: Item; since: number; controller: AbortController } | undefined;

  constructor(
    send: (item: Item, signal: AbortSignal) => Promise<Result>,
    options: NewestOnlyOptions<Item> = {},
  ) {
    this.#send = send;
    this.#options = options;
  }

  /** Whether a request runs or waits. */
  get isBusy(): boolean {
    return this.#running !== undefined;
  }

  /**
   * Sends an item as soon as no other runs. The result is undefined if a newer item took its place,
   * or `abort` did: then there is nothing to show. The error of a request is thrown only if no newer
   * one waits.
   */
  run(item: Item): Promise<Result | undefined> {
    return new Promise((resolve, reject) => {
      this.#waiting?.resolve(undefined);
      this.#waiting = { item, resolve, reject };
      if (this.#running === undefined) {
        void this.#work();
        return;
      }
      const { item: running, since, controller } = this.#running;
      if (this.#options.keep?.(running, performance.now() - since) === false) controller.abort();
    });
  }

  /** Drops what waits, and aborts what runs. */
  abort(): void {
    this.drop();
    this.#running?.controller.abort();
  }

  /** Drops what waits. */
  drop(): void {
    this.#waiting?.resolve(undefined);
    this.#waiting = undefined;
  }

  async #work(): Promise<void> {
    while (this.#waiting !== undefined) {
      const { item, resolve, reject } = this.#waiting;
      const controller = new AbortController();
      this.#waiting = undefined;
      const since = performance.now();
      this.#running = { item, since, controller };
      try {
        this.#options.onBusy?.({ item, since });
        const result = await this.#send(item, controller.signal);
        resolve(controller.signal.aborted ? undefined : result);
      } catch (error) {
        if (controller.signal.aborted || this.#waiting !== undefined) resolve(undefined);
        else reject(error);
      }
    }
    this.#running = undefined;
    this.#options.onBusy?.(null);
  }
}
