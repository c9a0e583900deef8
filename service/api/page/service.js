// The requests of the page to its service. URLs are relative to the page.

import { requestKey, credentials, currentKey, isAboutKeys } from './key.js';

/** @typedef {import('./documents.js').Surface} Surface */

/** @typedef {{code: string, detail: string, pointer?: string, parameter?: string, header?: string, got?: string, needed?: string}} Issue */
/** @typedef {{id: string, title: string, description: string}} Example */
/** @typedef {{faces: number, skipped_faces: {entity: string, reason: string}[]}} Reading  a report of reading */
/** @typedef {{name: string, title: string, media_type: string, suffix: string}} Format */

/** A refusal of the service, with its reasons (RFC 9457). */
export class Refusal extends Error {
  /** @param {{title?: string, status?: number, code?: string, detail?: string, errors?: Issue[]}} problem */
  constructor(problem) {
    super(problem.detail ?? problem.title ?? 'The service refused.');
    this.title = problem.title ?? 'Refused';
    this.status = problem.status ?? 0;
    this.code = problem.code ?? '';
    /** @type {Issue[]} */
    this.issues = problem.errors ?? [];
  }
}

/** The service did not respond. */
export class NoResponse extends Error {}

/** @param {AbortSignal} [signal] @returns {Promise<Example[]>} */
export async function examples(signal) {
  return (await json('v1/surfaces', { signal })).surfaces;
}

/** @param {AbortSignal} [signal] @returns {Promise<Format[]>} */
export async function formats(signal) {
  return (await json('v1/formats', { signal })).formats;
}

/**
 * An example by its name, or a stored surface by its id.
 * @param {string} id @param {AbortSignal} [signal] @returns {Promise<Surface>}
 */
export async function surfaceById(id, signal) {
  return (await json(`v1/surfaces/${encodeURIComponent(id)}`, { signal })).surface;
}

/**
 * Stores a surface and returns its id; `body` is JSON, or a file of another media type.
 * @param {BodyInit} body @param {string} [mediaType] @param {AbortSignal} [signal] @returns {Promise<{id: string}>}
 */
export async function store(body, mediaType = 'application/json', signal) {
  return json('v1/surfaces', { method: 'POST', body, headers: { 'Content-Type': mediaType }, signal });
}

/**
 * Reads a CAD file; the report says what is not in the surface.
 * @param {BodyInit} body @param {string} mediaType @param {AbortSignal} [signal]
 * @returns {Promise<{surface: Surface, reading: Reading}>}
 */
export async function readFile(body, mediaType, signal) {
  return json('v1/convert', { method: 'POST', body, headers: { 'Content-Type': mediaType }, signal });
}

/**
 * The surface after some operations; without any, as the service writes it, with all defaults.
 * @param {Surface} surface @param {object[]} [operations] @param {AbortSignal} [signal]
 * @returns {Promise<Surface>}
 */
export async function convert(surface, operations, signal) {
  return (await post('v1/convert', { surface, operations }, signal)).surface;
}

/**
 * The point of a surface that is nearest to a point.
 * @param {Surface} surface @param {number[]} point @param {AbortSignal} [signal]
 * @returns {Promise<{positions: number[][], uv: number[][], patch?: number[], near_edge?: boolean[]}>}
 */
export async function project(surface, point, signal) {
  return post('v1/project', { surface, points: [point] }, signal);
}

/**
 * The curvatures at parameters; null where they have no limit.
 * @param {Surface} surface @param {number[]} uv @param {number} [patch] @param {AbortSignal} [signal]
 * @returns {Promise<{gaussian: number | null, mean: number | null}>}
 */
export async function curvatures(surface, uv, patch, signal) {
  // Of a triangle, `uv` has the last two barycentric coordinates.
  const [s, t] = uv;
  const barycentric = { barycentric: [[1 - s - t, s, t]] };
  const isTriangle = surface.type === 'triangle'
    || (surface.type === 'patches' && (patch ?? 0) >= (surface.patches?.length ?? 0));
  const read = async (/** @type {object} */ place) => {
    const point = await post('v1/points', { surface, ...place, patch, derivatives: 2 }, signal);
    return { gaussian: point.gaussian_curvature[0], mean: point.mean_curvature[0] };
  };
  try {
    return await read(isTriangle ? barycentric : { uv: [uv] });
  } catch (error) {
    // Only the service knows which patches of a group are triangles.
    if (error instanceof Refusal && error.issues[0]?.code === 'wrong_parameters') return read(barycentric);
    throw error;
  }
}

/**
 * Area and volume of a surface; an open surface has no volume.
 * @param {Surface} surface @param {AbortSignal} [signal]
 * @returns {Promise<{area: {value: number}, volume?: {value: number}, open_edges: number, inconsistent_edges: number}>}
 */
export async function measure(surface, signal) {
  return post('v1/measure', { surface, tolerance: 1e-6 }, signal);
}

/** A line of a section; a closed one ends at its first point. @typedef {{closed: boolean, points: number[][]}} Polyline */

/**
 * The lines in which a plane cuts a surface: that of all points p with normal · p = offset.
 * @param {Surface} surface @param {number[]} normal  a unit vector @param {number} offset
 * @param {AbortSignal} [signal] @returns {Promise<Polyline[]>}
 */
export async function section(surface, normal, offset, signal) {
  const planes = { normals: [normal], offsets: [offset] };
  const { sections: [{ polylines }] } = await post('v1/intersect', { surface, planes, relative_tolerance: 1e-4 }, signal);
  return polylines;
}

/**
 * Points of a curve, and its length.
 * @param {Surface} curve @param {AbortSignal} [signal] @returns {Promise<{points: number[][], length: number}>}
 */
export async function sampleCurve(curve, signal) {
  const { points, report } = await post('v1/curve', { curve, resolution: 128 }, signal);
  return { points, length: report.length };
}

/** @param {string} path @param {object} content @param {AbortSignal} [signal] @returns {Promise<any>} */
async function post(path, content, signal) {
  const headers = { 'Content-Type': 'application/json' };
  return json(path, { method: 'POST', body: JSON.stringify(content), headers, signal });
}

let arePrivate = false;

/** Whether reading surfaces and meshes by URL needs a key, as the last response for a surface showed. */
export const readsArePrivate = () => arePrivate;

/** The URL of a path of the service, with its host. @param {string} path */
export function resolveUrl(path) {
  return new URL(path, document.baseURI).href;
}

/** @param {string} path @param {RequestInit} [options] @returns {Promise<any>} */
async function json(path, options) {
  return (await ask(path, options)).json();
}

/** The response to a request; throws every error. @param {string} path @param {RequestInit} [options] @returns {Promise<Response>} */
export async function ask(path, options = {}) {
  const sentKey = currentKey();
  let response;
  try {
    const headers = { ...options.headers, ...credentials() };
    response = await fetch(resolveUrl(path), { ...options, headers });
  } catch {
    throw new NoResponse('The service does not answer.');
  }
  if (path.startsWith('v1/surfaces/')) {
    arePrivate = response.status === 401 || /\bprivate\b/.test(response.headers.get('Cache-Control') ?? '');
  }
  if (response.ok) return response;
  const isProblem = response.headers.get('Content-Type')?.startsWith('application/problem+json');
  if (isProblem) {
    const problem = await response.json();
    // Asks again if there is now another key than the one that was sent.
    if (isAboutKeys(problem.code) && await requestKey(problem.code, sentKey)) return ask(path, options);
    throw new Refusal(problem);
  }
  if (response.status >= 502) throw new NoResponse('The service does not answer.');
  throw new Refusal({ title: response.statusText, status: response.status });
}

/**
 * Milliseconds in a Server-Timing header: its entry `total`, or the sum of all its steps.
 * @param {string | null} header
 */
export function serverTime(header) {
  const entries = [...(header ?? '').matchAll(/([\w-]+)[^,]*?;\s*dur=([\d.]+)/g)];
  if (entries.length === 0) return null;
  const total = entries.find(([, name]) => name === 'total');
  if (total) return Number(total[2]);
  return entries.reduce((sum, [, , milliseconds]) => sum + Number(milliseconds), 0);
}
