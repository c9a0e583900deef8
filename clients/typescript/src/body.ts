// How a surface with its options is sent: as JSON, or as a file with the options in the query.

import type { SurfaceFile } from './types.js';

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

/** A request that posts a document, and prefers nothing. */
export function postJson(document: unknown): RequestInit {
  return { method: 'POST', body: JSON.stringify(document), headers: { 'Content-Type': 'application/json' } };
}

/** A request that posts a file. */
export function postFile({ file, mediaType }: SurfaceFile): RequestInit {
  return { method: 'POST', body: file, headers: { 'Content-Type': mediaType ?? chooseMediaType(file) } };
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
  const name = 'name' in file && typeof file.name === 'string' ? file.name : '';
  const suffix = name.toLowerCase().split('.').pop() ?? '';
  return MEDIA_TYPES[suffix] ?? (file.type || 'application/octet-stream');
}
