// Long work is a job of the service: the page shows its progress, and a button that stops it.

import { announce, button, element, write } from './page.js';
import { ask, Refusal } from './service.js';

/** @typedef {import('./service.js').Issue} Issue */
/** @typedef {{state: string, waiting_for?: string, links: {self: string, events: string, results: string}}} Job */

/** The job was stopped, here or elsewhere. */
export class Stopped extends Error {}

const RECONNECT_PAUSE = 1000; // milliseconds
const MAX_RECONNECTS = 60;

/** The functions that stop the jobs of this page. @type {Set<() => void>} */
const stops = new Set();

button('job-stop').addEventListener('click', () => { for (const stop of stops) stop(); });

/**
 * The file of a job with one part, as soon as it is ready; shows the progress until then.
 * @param {Job} job @param {AbortSignal} [signal]  stops the job @returns {Promise<ArrayBuffer>}
 */
export async function fetchResult(job, signal) {
  const controller = new AbortController();
  const stop = () => controller.abort();
  const start = performance.now();
  let state = job;
  const show = () => write('job-text', describe(state, performance.now() - start));
  const timer = setInterval(show, 1000);
  stops.add(stop);
  signal?.addEventListener('abort', stop);
  if (signal?.aborted) stop();
  show();
  element('job', HTMLElement).hidden = false;
  announce('The service makes this mesh as a job');
  try {
    for (let tries = 0; isOpen(state);) {
      try {
        for await (const change of readEvents(state.links.events, controller.signal)) {
          state = change;
          tries = 0;
          show();
        }
      } catch (error) {
        // The connection may be lost, as while the service restarts.
        if (controller.signal.aborted || error instanceof Refusal || tries >= MAX_RECONNECTS) throw error;
      }
      tries += 1;
      if (isOpen(state)) await new Promise((resolve) => { setTimeout(resolve, RECONNECT_PAUSE); });
    }
  } catch (error) {
    if (!controller.signal.aborted) throw error;
    ask(job.links.self, { method: 'DELETE' }).catch(() => {});
    throw new Stopped('The job was stopped.');
  } finally {
    clearInterval(timer);
    signal?.removeEventListener('abort', stop);
    stops.delete(stop);
    element('job', HTMLElement).hidden = stops.size === 0;
  }
  return readResult(state);
}

/** @param {Job} state */
const isOpen = (state) => state.state === 'queued' || state.state === 'running';

/** @param {Job} state @param {number} milliseconds */
function describe(state, milliseconds) {
  const reason = state.waiting_for ? `, waits for ${state.waiting_for.replaceAll('_', ' ')}` : '';
  return `${state.state}${reason}, ${Math.round(milliseconds / 1000)} s`;
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
