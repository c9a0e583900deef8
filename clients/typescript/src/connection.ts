// Requests with a key, a deadline and retries; all calls of the client go through here.

import { NoResponse, readError, ServiceError } from './errors.js';
import type { Job } from './types.js';

/** What a call waits for: for a busy service, or for a job. */
export type Progress =
  | { kind: 'retry'; seconds: number; error: ServiceError }
  | { kind: 'job'; job: Job };

/** Options that every call takes as its last argument. */
export interface CallOptions {
  /** Aborts the call, and withdraws its job. */
  signal?: AbortSignal | undefined;
  /** Milliseconds for the call with its retries, not for jobs. */
  timeout?: number | undefined;
  /** Milliseconds after which the work is asked for as a job. */
  patience?: number | undefined;
  /** Called when the call begins to wait, and whenever the state of its job changes. */
  onProgress?: ((progress: Progress) => void) | undefined;
  /** Called with the response that had the result, for its headers; the body is read already. */
  onResponse?: ((response: Response) => void) | undefined;
}

/** Options of a client. */
export interface ClientOptions {
  /** The API key, or a function that returns the present one; empty for none. */
  key?: string | (() => string) | undefined;
  /** Milliseconds for a call with its retries, not for jobs. Default: 60,000. */
  timeout?: number | undefined;
  /** Milliseconds after which work is asked for as a job; `Infinity` for never. Default: 5,000. */
  patience?: number | undefined;
  /** Sends a request in place of the global `fetch`. */
  fetch?: typeof fetch | undefined;
  /**
   * Called when the service needs a key, or does not know the key that was sent. If it returns true,
   * the call is sent again, with the key that the client then has.
   */
  onKeyRefused?: ((error: ServiceError, sentKey: string) => Promise<boolean>) | undefined;
}

/** An attempt took longer than `patience`. */
export class OutOfPatience extends Error {}

/** A body of a response, and the response that it came with. */
export interface Answer<Body> {
  response: Response;
  body: Body;
}

const SHORTEST_WAIT = 0.1; // seconds: a `Retry-After: 0` must not make a loop without a pause

/** A service at an address. */
export class Connection {
  readonly patience: number;
  readonly #base: URL;
  readonly #options: ClientOptions;
  readonly #timeout: number;

  constructor(base: string | URL, options: ClientOptions) {
    const page = (globalThis as { document?: { baseURI: string } }).document?.baseURI;
    this.#base = new URL(base, page);
    if (!this.#base.pathname.endsWith('/')) this.#base.pathname += '/';
    this.#options = options;
    this.#timeout = options.timeout ?? 60_000;
    this.patience = options.patience ?? 5_000;
  }

  /** The absolute URL of a path of the service. */
  resolve(path: string): string {
    return new URL(path, this.#base).href;
  }

  /**
   * Sends a request, and reads its response by `read`; again while the service is busy and the time
   * suffices. Throws every refusal as a `ServiceError`. An attempt that takes longer than `patience`
   * milliseconds throws `OutOfPatience`.
   */
  async exchange<Body>(
    path: string,
    init: RequestInit,
    call: CallOptions,
    read: (response: Response) => Promise<Body>,
    patience = Infinity,
  ): Promise<Answer<Body>> {
    const timeout = call.timeout ?? this.#timeout;
    let deadline = Date.now() + timeout;
    for (;;) {
      const key = this.#key();
      try {
        return await this.#attempt(path, init, call.signal, key, read, deadline - Date.now(), patience);
      } catch (error) {
        if (!(error instanceof ServiceError)) throw error;
        if (isAboutKeys(error) && await this.#options.onKeyRefused?.(error, key)) {
          deadline = Date.now() + timeout; // a person may have typed the key
          continue;
        }
        const seconds = findPause(error);
        if (seconds === undefined || Date.now() + 1000 * seconds > deadline) throw error;
        call.onProgress?.({ kind: 'retry', seconds, error });
        await pause(seconds, call.signal);
      }
    }
  }

  async #attempt<Body>(
    path: string,
    init: RequestInit,
    signal: AbortSignal | undefined,
    key: string,
    read: (response: Response) => Promise<Body>,
    time: number,
    patience: number,
  ): Promise<Answer<Body>> {
    signal?.throwIfAborted();
    const url = new URL(path, this.#base);
    const headers = new Headers(init.headers);
    // The key is for this service alone, also if a link leads to another host.
    if (key && url.origin === this.#base.origin) headers.set('Authorization', `Bearer ${key}`);
    const controller = new AbortController();
    const abort = () => controller.abort();
    const limit = Math.min(time, patience);
    const timer = limit < Infinity ? setTimeout(abort, limit) : undefined;
    signal?.addEventListener('abort', abort);
    try {
      const send = this.#options.fetch ?? fetch;
      const response = await send(url.href, { ...init, headers, signal: controller.signal });
      if (!response.ok) throw await readError(response);
      return { response, body: await read(response) };
    } catch (error) {
      signal?.throwIfAborted();
      if (error instanceof ServiceError || error instanceof NoResponse) throw error;
      if (!controller.signal.aborted) throw new NoResponse('The service does not answer.', { cause: error });
      if (patience < time) throw new OutOfPatience();
      throw new NoResponse(`The service has not answered in ${Math.round(time / 1000)} s.`, { cause: error });
    } finally {
      clearTimeout(timer);
      signal?.removeEventListener('abort', abort);
    }
  }

  #key(): string {
    const { key = '' } = this.#options;
    return typeof key === 'function' ? key() : key;
  }
}

/** Waits; throws the reason of the signal when that is aborted. */
export async function pause(seconds: number, signal?: AbortSignal): Promise<void> {
  signal?.throwIfAborted();
  await new Promise<void>((resolve) => {
    const end = () => {
      clearTimeout(timer);
      signal?.removeEventListener('abort', end);
      resolve();
    };
    const timer = setTimeout(end, 1000 * seconds);
    signal?.addEventListener('abort', end);
  });
  signal?.throwIfAborted();
}

/** The seconds to wait before a request is sent again; undefined if it would not help. */
function findPause({ status, code, retryAfter }: ServiceError): number | undefined {
  const isBusy = (status === 429 || status === 503) && code !== 'out_of_time';
  return isBusy && retryAfter !== undefined ? Math.max(retryAfter, SHORTEST_WAIT) : undefined;
}

function isAboutKeys({ code }: ServiceError): boolean {
  return code === 'key_needed' || code === 'key_unknown';
}
