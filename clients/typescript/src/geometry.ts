// A mesh in JSON as a geometry of three.js.

import type { Mesh } from './types.js';

/** What the module `three` has for geometries. */
export interface ThreeModule {
  BufferGeometry: new () => object;
  BufferAttribute: new (array: Float32Array | Uint16Array | Uint32Array, itemSize: number) => object;
}

/** The type of geometries that a module makes: that of its meshes, where it has these. */
export type GeometryOf<Three extends ThreeModule> =
  Three extends { Mesh: new (...parameters: never) => { geometry: infer Geometry } }
    ? Geometry : InstanceType<Three['BufferGeometry']>;

/** The methods of a geometry that are used here. */
interface Geometry {
  setAttribute(name: string, attribute: object): unknown;
  setIndex(index: object): unknown;
  addGroup(start: number, count: number, materialIndex: number): void;
}

type Rows = readonly (readonly number[])[];

/**
 * The geometry of a mesh. Quads become two triangles. Colours become linear, as three.js needs them
 * (`vertexColors: true`). Attributes have their names after `_`, as those of glTF. Each part is a
 * group with the material index of its number, for lists of materials; one material draws all parts.
 */
export function toBufferGeometry<Three extends ThreeModule>(three: Three, mesh: Mesh): GeometryOf<Three> {
  const geometry = new three.BufferGeometry() as Geometry;
  const corners: Rows = mesh.attribute_faces ?? mesh.faces;
  const positions = spreadPositions(mesh, corners);
  const set = (name: string, rows: Rows | undefined, convert?: (value: number, column: number) => number) => {
    const size = rows?.[0]?.length;
    if (rows === undefined || size === undefined) return;
    const values = flatten(rows, size);
    if (convert) values.forEach((value, k) => { values[k] = convert(value, k % size); });
    geometry.setAttribute(name, new three.BufferAttribute(values, size));
  };
  set('position', positions);
  set('normal', mesh.normals);
  set('uv', mesh.uvs);
  set('color', mesh.colors, (value, column) => (column < 3 ? toLinear(value) : value));
  for (const [name, rows] of Object.entries(mesh.attributes ?? {})) set(`_${name.toLowerCase()}`, rows);
  const { index, starts } = triangulate(corners, positions.length);
  geometry.setIndex(new three.BufferAttribute(index, 1));
  mesh.parts.forEach(({ faces: [first = 0, last = 0] }, number) => {
    const start = starts[first] ?? 0;
    geometry.addGroup(start, (starts[last] ?? 0) - start, number);
  });
  return geometry as GeometryOf<Three>;
}

/** The positions in the order of normals: where a position has several normals, it is repeated. */
function spreadPositions({ vertices, faces, attribute_faces: corners }: Mesh, rows: Rows): Rows {
  if (corners === undefined) return vertices;
  const positions: (readonly number[])[] = [];
  rows.forEach((row, f) => row.forEach((corner, c) => {
    positions[corner] = vertices[faces[f]?.[c] ?? 0] ?? [];
  }));
  return positions;
}

/** The corners of triangles; and for each face, and after the last, how many corners come before. */
function triangulate(faces: Rows, vertexCount: number): { index: Uint16Array | Uint32Array; starts: number[] } {
  const starts = [0];
  for (const face of faces) starts.push((starts.at(-1) ?? 0) + 3 * (face.length - 2));
  const length = starts.at(-1) ?? 0;
  // The index 65535 restarts a primitive.
  const index = vertexCount <= 0xffff ? new Uint16Array(length) : new Uint32Array(length);
  let k = 0;
  for (const [a = 0, b = 0, c = 0, d] of faces) {
    index.set([a, b, c], k);
    k += 3;
    if (d === undefined) continue;
    index.set([a, c, d], k);
    k += 3;
  }
  return { index, starts };
}

function flatten(rows: Rows, size: number): Float32Array {
  const values = new Float32Array(rows.length * size);
  // A position that no face uses has no row.
  rows.forEach((row, k) => values.set(row, k * size));
  return values;
}

/** The linear light of a component of an sRGB colour (IEC 61966-2-1). */
function toLinear(value: number): number {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}
