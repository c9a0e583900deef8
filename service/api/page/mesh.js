// Requests the mesh files of surfaces, and measures how long they take.

import { ServiceError } from 'surface-service';
import { client, define } from './service.js';
import { Stopped } from './work.js';

/** @typedef {{content: ArrayBuffer, serverTime: number | null, roundTrip: number}} MeshResponse */
/** @typedef {import('surface-service').Progress} Progress */

/**
 * The mesh file that a request describes (a surface with options), and the times it took, in milliseconds.
 * @param {{surface: import('./documents.js').Surface}} request
 * @param {object} options
 * @param {string} [options.address]  the name or the id under which the service has the surface: browsers keep such meshes
 * @param {string} [options.format]  of the file
 * @param {AbortSignal} options.signal  stops the work
 * @param {(detail: string) => void} options.tell  gets the progress of a job
 * @returns {Promise<MeshResponse>}
 */
export async function mesh({ surface, ...options }, { address = '', format = 'glb', signal, tell }) {
  const start = performance.now();
  let isJob = false;
  /** @type {number | null} */
  let time = null;
  const call = {
    signal,
    onProgress: (/** @type {Progress} */ progress) => {
      isJob ||= progress.kind === 'job';
      tell(describeProgress(progress));
    },
    onResponse: (/** @type {Response} */ { headers }) => { time = serverTime(headers.get('Server-Timing')); },
  };
  const fetchMesh = (/** @type {string | Parameters<typeof client.mesh>[0]} */ from, /** @type {object} */ more) => (
    client.mesh(from, { ...options, ...more, format: /** @type {'glb'} */ (format) }, call)
  );
  try {
    const content = await (address ? fetchMesh(address, { engine: Number(document.documentElement.dataset.engine) })
      .catch((error) => {
        // The service has another engine than when the page was loaded.
        if (!(error instanceof ServiceError && error.code === 'engine_gone')) throw error;
        return fetchMesh(define(surface), {});
      }) : fetchMesh(define(surface), {}));
    // The client reads JSON; the file is its text.
    const file = format === 'json' ? new TextEncoder().encode(JSON.stringify(content)).buffer : content;
    return { content: file, serverTime: isJob ? null : time, roundTrip: performance.now() - start };
  } catch (error) {
    throw explainAbort(error, signal);
  }
}

/** The error of a call: one that was not aborted here had a job that was withdrawn. @param {unknown} error @param {AbortSignal} signal */
export function explainAbort(error, signal) {
  const isWithdrawn = error instanceof DOMException && error.name === 'AbortError' && !signal.aborted;
  return isWithdrawn ? new Stopped('The job') : error;
}

/** How far a call is, in words. @param {Progress} progress */
export function describeProgress(progress) {
  if (progress.kind === 'retry') return `the service is busy, again in ${Math.ceil(progress.seconds)} s`;
  const { state, waiting_for: reason } = progress.job;
  return `as a job, ${state}${reason ? `, waits for ${reason.replaceAll('_', ' ')}` : ''}`;
}

/**
 * Milliseconds in a Server-Timing header: its entry `total`, or the sum of all its steps.
 * @param {string | null} header
 */
export function serverTime(header) {
  const entries = [...(header ?? '').matchAll(/([\w-]+)[^,]*?;\s*dur=([\d.]+)/g)];
  // The service had the response in its cache.
  if (entries.length === 0) return header?.includes('desc=hit') ? 0 : null;
  const total = entries.find(([, name]) => name === 'total');
  if (total) return Number(total[2]);
  return entries.reduce((sum, [, , milliseconds]) => sum + Number(milliseconds), 0);
}
