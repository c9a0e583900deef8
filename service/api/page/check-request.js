// Asks the service to check a mesh against a surface.

import { describeProgress, explainAbort } from './mesh.js';
import { checkSize } from './read-files.js';
import { client, define } from './service.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./read-files.js').MeshFile} MeshFile */

/** @typedef {import('surface-service').MeshCheck} MeshCheck */
/** @typedef {MeshCheck['mesh_to_surface']} Distance */

/**
 * What the service has found; the mesh as it has read it; and the distances of its vertices and of the middles
 * of its triangles.
 * @typedef {MeshCheck & Required<Pick<MeshCheck, 'mesh' | 'distances' | 'middle_distances'>>} Report
 */

/**
 * @param {Surface} surface @param {string} address  under which the service has the surface; empty if it has not
 * @param {MeshFile} file @param {AbortSignal} signal @param {(detail: string) => void} tell
 * @returns {Promise<Report>}
 */
export async function requestCheck(surface, address, { content, format, maxBytes, maxJsonBytes }, signal, tell) {
  if (address) checkSize(content.size, maxBytes, 'a coarser mesh, or a part of it');
  else {
    // Beside a surface that the service does not have, the file is a text in JSON, of 4 bytes for 3.
    const room = 0.75 * maxJsonBytes - JSON.stringify(surface).length;
    checkSize(content.size, room, 'after "Copy link", which stores the surface, more');
  }
  const mesh = /** @type {import('surface-service').MeshBlob} */ ({ file: content, format });
  const call = { signal, onProgress: (/** @type {import('surface-service').Progress} */ progress) => tell(describeProgress(progress)) };
  try {
    return /** @type {Report} */ (await client.check(address || define(surface), mesh, { distances: true }, call));
  } catch (error) {
    throw explainAbort(error, signal);
  }
}
