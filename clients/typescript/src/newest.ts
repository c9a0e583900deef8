// A queue for work that follows a hand, such as the mesh of a net while a point is dragged.

/** What a queue does now: the item that it sent, and since when (`performance.now()`). */
export interface Busy<Item> {
  item: Item;
  since: number;
}

export interface NewestOnlyOptions<Item> {
  /**
   * Whether a request that runs may end although a newer one waits; else it is aborted. Default: yes,
   * because a long drag would show nothing if each movement aborted the request before it.
   */
  keep?: ((item: Item) => boolean) | undefined;
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
  #running: { item: Item; controller: AbortController } | undefined;

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
      if (this.#running === undefined) void this.#work();
      else if (this.#options.keep?.(this.#running.item) === false) this.#running.controller.abort();
    });
  }

  /** Drops what waits, and aborts what runs. */
  abort(): void {
    this.#waiting?.resolve(undefined);
    this.#waiting = undefined;
    this.#running?.controller.abort();
  }

  async #work(): Promise<void> {
    while (this.#waiting !== undefined) {
      const { item, resolve, reject } = this.#waiting;
      const controller = new AbortController();
      this.#waiting = undefined;
      this.#running = { item, controller };
      try {
        this.#options.onBusy?.({ item, since: performance.now() });
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
