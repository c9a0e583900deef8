// The client of the service that has served this page, and requests in the form in which the page needs
// them.

import { ServiceError, SurfaceClient } from 'surface-service';
import { currentKey, requestKey } from './key.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('surface-service').SurfaceDefinition} SurfaceDefinition */

let arePrivate = false;

/** Whether reading surfaces and meshes by URL needs a key, as the last response for a surface showed. */
export const readsArePrivate = () => arePrivate;

export const client = new SurfaceClient('./', {
  key: currentKey,
  onKeyRefused: (error, sentKey) => requestKey(error.code, sentKey),
  // A person can stop what takes long.
  timeout: 600_000,
  fetch: async (url, options) => {
    const response = await fetch(url, options);
    if (String(url).includes('/v1/surfaces/')) {
      arePrivate = response.status === 401 || /\bprivate\b/.test(response.headers.get('Cache-Control') ?? '');
    }
    return response;
  },
});

/** A surface, which the page has not checked, as the client takes it. @param {Surface} surface */
export const define = (surface) => /** @type {SurfaceDefinition} */ (/** @type {unknown} */ (surface));

/**
 * The surface after some operations; without any, as the service writes it, with all defaults.
 * @param {Surface} surface @param {object[]} [operations] @param {AbortSignal} [signal]
 * @returns {Promise<Surface>}
 */
export async function convert(surface, operations, signal) {
  const options = /** @type {import('surface-service').ConvertOptions} */ (operations ? { operations } : {});
  return (await client.convert(define(surface), options, { signal })).surface;
}

/**
 * The curvatures at parameters; null where they have no limit.
 * @param {Surface} surface @param {number[]} uv @param {number} [patch] @param {AbortSignal} [signal]
 * @returns {Promise<{gaussian: number | null, mean: number | null}>}
 */
export async function curvatures(surface, uv, patch, signal) {
  // Of a triangle, `uv` has the last two barycentric coordinates.
  const [s, t] = uv;
  /** @type {{barycentric: [number, number, number][]}} */
  const barycentric = { barycentric: [[1 - s - t, s, t]] };
  const isTriangle = surface.type === 'triangle'
    || (surface.type === 'patches' && (patch ?? 0) >= (surface.patches?.length ?? 0));
  const read = async (/** @type {{uv: [number, number][]} | typeof barycentric} */ place) => {
    const options = { ...place, ...(patch === undefined ? {} : { patch }), derivatives: 2 };
    const point = await client.points(define(surface), options, { signal });
    return { gaussian: point.gaussian_curvature?.[0] ?? null, mean: point.mean_curvature?.[0] ?? null };
  };
  try {
    return await read(isTriangle ? barycentric : { uv: [[s, t]] });
  } catch (error) {
    // Only the service knows which patches of a group are triangles.
    if (error instanceof ServiceError && error.errors[0]?.code === 'wrong_parameters') return read(barycentric);
    throw error;
  }
}

/** A line of a section; a closed one ends at its first point. @typedef {import('surface-service').SectionLine} Polyline */

/**
 * The lines in which a plane cuts a surface: that of all points p with normal · p = offset.
 * @param {Surface} surface @param {number[]} normal  a unit vector @param {number} offset
 * @param {AbortSignal} [signal] @returns {Promise<Polyline[]>}
 */
export async function section(surface, normal, offset, signal) {
  const [x, y, z] = normal;
  /** @type {import('surface-service').PlaneSet} */
  const planes = { normals: [[x, y, z]], offsets: [offset] };
  const { sections } = await client.intersect(define(surface), { planes, relative_tolerance: 1e-4 }, { signal });
  return sections[0]?.polylines ?? [];
}

/**
 * Points of a curve, and its length.
 * @param {Surface} curve @param {AbortSignal} [signal] @returns {Promise<{points: number[][], length: number}>}
 */
export async function sampleCurve(curve, signal) {
  const definition = /** @type {import('surface-service').CurveDefinition} */ (/** @type {unknown} */ (curve));
  const { points, report } = await client.curve(definition, { resolution: 128 }, { signal });
  return { points, length: report.length };
}
