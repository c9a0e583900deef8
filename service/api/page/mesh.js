// Requests the meshes of surfaces: short work at once, long work as a job.

import { fetchResult } from './jobs.js';
import { ask, Refusal, serverTime } from './service.js';

/** @typedef {{content: ArrayBuffer, serverTime: number | null, roundTrip: number}} MeshResponse */

/** Milliseconds after which a mesh is requested again as a job. */
const PATIENCE = 5000;

/**
 * The mesh file that a request describes (a surface with options), and the times it took, in milliseconds.
 * @param {{surface: object}} request
 * @param {object} options
 * @param {string} [options.address]  the name or the id under which the service has the surface: browsers keep such meshes
 * @param {string} [options.mediaType]  of the file
 * @param {AbortSignal} options.signal  stops the work
 * @param {(detail: string) => void} options.tell  gets the progress of a job
 * @returns {Promise<MeshResponse>}
 */
export async function mesh(request, { address = '', mediaType = 'model/gltf-binary', signal, tell }) {
  const start = performance.now();
  const headers = { 'Content-Type': 'application/json', Accept: mediaType };
  const options = { method: 'POST', body: JSON.stringify(request), headers, signal };
  const first = address ? askBriefly(meshPath(request, address), { signal }) : askBriefly('v1/mesh', options);
  const response = await first
    ?? await ask('v1/mesh', { ...options, headers: { ...headers, Prefer: 'respond-async' } });
  // A service without jobs ignores the preference.
  const isJob = response.headers.has('Preference-Applied');
  const content = isJob ? await fetchResult(await response.json(), signal, tell) : await response.arrayBuffer();
  const roundTrip = performance.now() - start;
  return { content, serverTime: isJob ? null : serverTime(response.headers.get('Server-Timing')), roundTrip };
}

/** The path of the mesh as a GLB. @param {{surface: object}} request @param {string} address */
function meshPath({ surface, ...options }, address) {
  const query = new URLSearchParams(Object.entries(options).map(([name, value]) => [name, String(value)]));
  query.set('engine', document.documentElement.dataset.engine ?? '');
  return `v1/surfaces/${encodeURIComponent(address)}/mesh.glb?${query}`;
}

/** The response; null if the service needs too long for it, or has another engine than when the page was loaded. @param {string} path @param {RequestInit & {signal: AbortSignal}} options */
async function askBriefly(path, options) {
  const patience = new AbortController();
  const timer = setTimeout(() => patience.abort(), PATIENCE);
  try {
    return await ask(path, { ...options, signal: AbortSignal.any([options.signal, patience.signal]) });
  } catch (error) {
    if (options.signal.aborted || !(patience.signal.aborted || takesLong(error))) throw error;
    return null;
  } finally {
    clearTimeout(timer);
  }
}

/** Whether the service needs more time than a request has, or computes other numbers now. @param {unknown} error */
function takesLong(error) {
  return error instanceof Refusal
    && (error.code === 'out_of_time' || error.code === 'engine_gone' || error.issues.some(({ code }) => code === 'too_costly'));
}
