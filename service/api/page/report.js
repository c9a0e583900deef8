// The report in a GLB: `asset.extras.report` of its JSON, which is the first chunk of the file.

/** @typedef {{vertices: number, triangles: number, patches: number, bounds: {min: number[], max: number[]}, watertight: boolean, boundary_edges: number, deviation_bound: number | null, parts?: {name: string, deviation_bound?: number}[], gap_bound?: number | null, skipped_faces?: {face: number, code: string}[], non_manifold_edges?: number}} Report */

const HEADER_BYTES = 12; // magic, version, length
const CHUNK_HEADER_BYTES = 8; // length, type

/** @param {ArrayBuffer} content @returns {Report} */
export function readReport(content) {
  const length = new DataView(content).getUint32(HEADER_BYTES, true);
  const text = new TextDecoder().decode(new Uint8Array(content, HEADER_BYTES + CHUNK_HEADER_BYTES, length));
  return JSON.parse(text).asset.extras.report;
}
