// How a surface with its options is sent: as JSON, or as a file with the options in the query.

import type { MeshBlob, MeshFile, MeshInput, SurfaceFile } from './types.js';

export type Fields = Record<string, unknown>;

/** Media types by the suffixes of files that the service reads. */
export const MEDIA_TYPES: Readonly<Record<string, string>> = {
  npy: 'application/x-npy',
  bez: 'model/x-oogl',
  bbp: 'model/x-oogl',
  oogl: 'model/x-oogl',
  teapot: 'text/x-teapot',
  obj: 'model/obj',
  geomdl: 'application/vnd.geomdl+json',
  step: 'model/step',
  stp: 'model/step',
  p21: 'model/step',
  igs: 'model/iges',
  iges: 'model/iges',
  '3dm': 'model/vnd.3dm',
};

/** Media types of files with meshes, by the names of their formats, which are suffixes, too. */
export const MESH_TYPES: Readonly<Record<MeshFile['format'], string>> = {
  glb: 'model/gltf-binary',
  gltf: 'model/gltf+json',
  obj: 'model/obj',
  ply: 'model/x-ply',
  stl: 'model/stl',
  off: 'model/x-off',
};

/** A request that posts a document, and prefers nothing. */
export function postJson(document: unknown): RequestInit {
  return { method: 'POST', body: JSON.stringify(document), headers: { 'Content-Type': 'application/json' } };
}

/** A request that posts a file. */
export function postFile({ file, mediaType }: SurfaceFile): RequestInit {
  return { method: 'POST', body: file, headers: { 'Content-Type': mediaType ?? chooseMediaType(file) } };
}

/** Whether a mesh is a file that is not in base64. */
export function isMeshBlob(mesh: MeshInput): mesh is MeshBlob {
  return 'file' in mesh && typeof mesh.file === 'object';
}

/** A request that posts a file with a mesh. */
export function postMesh(mesh: MeshBlob): RequestInit {
  return { method: 'POST', body: mesh.file, headers: { 'Content-Type': MESH_TYPES[chooseFormat(mesh)] } };
}

/** A file with a mesh as a document has it. */
export async function encodeMesh(mesh: MeshBlob): Promise<MeshFile> {
  const bytes = new Uint8Array(await mesh.file.arrayBuffer());
  let text = '';
  // Not all bytes at once: they are the arguments of a function.
  for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
  return { file: btoa(text), format: chooseFormat(mesh) };
}

/** The fields that say how a file is read. */
export function fileFields({ file: _, mediaType: __, ...fields }: SurfaceFile): Fields {
  return fields;
}

/** A path with a query; fields that are undefined are left out. */
export function withQuery(path: string, fields: Fields): string {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(fields)) {
    if (value !== undefined) query.set(name, writeValue(value));
  }
  const text = query.toString();
  return text === '' ? path : `${path}?${text}`;
}

/** A value of a query: lists have commas; what is not a list of plain values is JSON. */
function writeValue(value: unknown): string {
  if (Array.isArray(value) && value.every((item) => typeof item !== 'object')) return value.join(',');
  return typeof value === 'object' ? JSON.stringify(value) : String(value);
}

function chooseMediaType(file: Blob): string {
  return MEDIA_TYPES[findSuffix(file)] ?? (file.type || 'application/octet-stream');
}

function chooseFormat({ file, format }: MeshBlob): MeshFile['format'] {
  const formats = Object.keys(MESH_TYPES) as MeshFile['format'][];
  const found = format ?? formats.find((each) => each === findSuffix(file) || MESH_TYPES[each] === file.type);
  if (found === undefined) throw new TypeError(`needed the format of the mesh, one of ${formats.join(', ')}`);
  return found;
}

function findSuffix(file: Blob): string {
  const name = 'name' in file && typeof file.name === 'string' ? file.name : '';
  return name.toLowerCase().split('.').pop() ?? '';
}
