// Long work is a job of the service, whose progress the page shows.

import { ask, Refusal } from './service.js';
import { Stopped } from './work.js';

/** @typedef {import('./service.js').Issue} Issue */
/** @typedef {{state: string, waiting_for?: string, links: {self: string, events: string, results: string}}} Job */

const RECONNECT_PAUSE = 1000; // milliseconds
const MAX_RECONNECTS = 60;

/**
 * The file of a job with one part, as soon as it is ready.
 * @param {Job} job @param {AbortSignal} signal  withdraws the job
 * @param {(detail: string) => void} tell  gets the state of the job in words
 * @returns {Promise<ArrayBuffer>}
 */
export async function fetchResult(job, signal, tell) {
  let state = job;
  tell(describe(state));
  try {
    for (let tries = 0; isOpen(state);) {
      try {
        for await (const change of readEvents(state.links.events, signal)) {
          state = change;
          tries = 0;
          tell(describe(state));
        }
      } catch (error) {
        // The connection may be lost, as while the service restarts.
        if (signal.aborted || error instanceof Refusal || tries >= MAX_RECONNECTS) throw error;
      }
      tries += 1;
      if (isOpen(state)) await new Promise((resolve) => { setTimeout(resolve, RECONNECT_PAUSE); });
    }
  } catch (error) {
    if (signal.aborted) ask(job.links.self, { method: 'DELETE' }).catch(() => {});
    throw error;
  }
  return readResult(state);
}

/** @param {Job} state */
const isOpen = (state) => state.state === 'queued' || state.state === 'running';

/** @param {Job} state */
function describe(state) {
  const reason = state.waiting_for ? `, waits for ${state.waiting_for.replaceAll('_', ' ')}` : '';
  return `as a job, ${state.state}${reason}`;
}

/** The states of a job, from its stream of events. @param {string} url @param {AbortSignal} signal @returns {AsyncGenerator<Job>} */
async function* readEvents(url, signal) {
  // Not an `EventSource`, because that cannot send a key.
  const { body } = await ask(url, { signal });
  if (body === null) return;
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = '';
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const events = (text + value).split('\n\n');
    text = events.pop() ?? '';
    for (const event of events) {
      const data = /^data: (.*)$/m.exec(event);
      if (data) yield JSON.parse(data[1]);
    }
  }
}

/** The file of the only part; throws if the part failed or the job was withdrawn. @param {Job} job */
async function readResult(job) {
  const { results } = job.links;
  if (job.state === 'succeeded') return (await ask(`${results}/0`)).arrayBuffer();
  if (job.state === 'cancelled') throw new Stopped('The job was stopped.');
  const { problem } = (await (await ask(results)).json()).results[0];
  // Pointers are those of the job, whose only part has the body of the request.
  const errors = problem.errors.map((/** @type {Issue} */ issue) => (
    { ...issue, pointer: issue.pointer?.replace(/^\/parts\/0\/body/, '') }
  ));
  throw new Refusal({ ...problem, errors });
}
