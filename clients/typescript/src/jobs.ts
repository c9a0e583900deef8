// Jobs: long work that the service does while the client waits for its events.

import { type CallOptions, type Connection, pause } from './connection.js';
import { NoResponse, ServiceError } from './errors.js';
import type { Issue, Job, JobResult, JobResults } from './types.js';

const RECONNECT_PAUSE = 1; // seconds
const MAX_ABSENCE = 120_000; // milliseconds for which a restart of the service may take
const MAX_SILENCE = 60_000; // milliseconds without an event or a comment: the connection is lost

/** The pointer to the only part of a job, or to what the part has of a call. */
const PART = /^\/parts\/0(\/body|\/file|\/path)?(?![^/])/;

/** A job of the service. */
export class RunningJob {
  readonly #connection: Connection;
  #state: Job;

  constructor(connection: Connection, state: Job) {
    this.#connection = connection;
    this.#state = state;
  }

  /** The state as of the last event. */
  get state(): Job {
    return this.#state;
  }

  /**
   * Waits until the job has ended, and returns its last state, which may be `failed`. The job goes on
   * if the wait is aborted.
   */
  async wait(call: CallOptions = {}): Promise<Job> {
    const show = (job: Job) => {
      this.#state = job;
      call.onProgress?.({ kind: 'job', job });
    };
    show(this.#state);
    let lastAnswer = Date.now();
    while (!hasEnded(this.#state)) {
      try {
        const { signal } = call;
        await this.#connection.exchange(
          this.#state.links.events, {}, { signal, timeout: Infinity }, async ({ body }) => {
            for await (const job of readEvents(body)) {
              lastAnswer = Date.now();
              show(job);
            }
          });
      } catch (error) {
        // The connection may be lost, as while the service restarts.
        if (!(error instanceof NoResponse) || Date.now() > lastAnswer + MAX_ABSENCE) throw error;
      }
      if (!hasEnded(this.#state)) await pause(RECONNECT_PAUSE, call.signal);
    }
    return this.#state;
  }

  /** The state of each part with its problem or its link, in the order of the parts. */
  async* results(call: CallOptions = {}): AsyncGenerator<JobResult> {
    let next: string | undefined = this.#state.links.results;
    while (next !== undefined) {
      const { body }: { body: JobResults } = await this.#connection.exchange(
        next, {}, call, (response) => response.json() as Promise<JobResults>);
      yield* body.results;
      next = body.next;
    }
  }

  /** The file of a part. */
  async result(part: number, call: CallOptions = {}): Promise<ArrayBuffer> {
    const read = (response: Response) => response.arrayBuffer();
    return (await this.#connection.exchange(`${this.#state.links.results}/${part}`, {}, call, read)).body;
  }

  /** Withdraws the job: the service stops its work. */
  async cancel(): Promise<void> {
    const init = { method: 'DELETE', keepalive: true };
    await this.#connection.exchange(this.#state.links.self, init, {}, async () => {});
  }
}

/**
 * The URL of the result of a job with one part, as soon as the job has ended. Throws the problem of
 * the part as the call itself would have thrown it. An aborted wait withdraws the job.
 */
export async function awaitResult(connection: Connection, state: Job, call: CallOptions): Promise<string> {
  const job = new RunningJob(connection, state);
  try {
    await job.wait(call);
  } catch (error) {
    if (call.signal?.aborted) job.cancel().catch(() => {});
    throw error;
  }
  if (job.state.state === 'cancelled') throw new DOMException('The job was withdrawn.', 'AbortError');
  if (job.state.state === 'failed') {
    for await (const { problem } of job.results({ signal: call.signal })) {
      if (problem) throw new ServiceError({ ...problem, errors: problem.errors.map(stripPart) });
    }
  }
  return `${job.state.links.results}/0`;
}

function stripPart(issue: Issue): Issue {
  return issue.pointer === undefined ? issue : { ...issue, pointer: issue.pointer.replace(PART, '') };
}

function hasEnded({ state }: Job): boolean {
  return state !== 'queued' && state !== 'running';
}

/** The states in a stream of events; an `EventSource` could not send a key. */
async function* readEvents(body: ReadableStream<Uint8Array> | null): AsyncGenerator<Job> {
  if (body === null) return;
  const reader = body.getReader();
  const decoder = new TextDecoder();
  let timer: ReturnType<typeof setTimeout> | undefined;
  let text = '';
  try {
    for (;;) {
      timer = setTimeout(() => void reader.cancel(), MAX_SILENCE);
      const { value, done } = await reader.read();
      clearTimeout(timer);
      if (done) return;
      const events = (text + decoder.decode(value, { stream: true })).split('\n\n');
      text = events.pop() ?? '';
      for (const event of events) {
        const data = /^data: (.*)$/m.exec(event)?.[1];
        if (data !== undefined) yield JSON.parse(data) as Job;
      }
    }
  } finally {
    clearTimeout(timer);
  }
}
