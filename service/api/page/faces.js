// The faces of parts, and the parts of other models, as lists of triangles with names; and the edges of breps.

/** @typedef {import('./documents.js').Surface} Surface */

/**
 * @typedef {object} Face
 * @property {string} text  its number and name, such as "face 3 (top)"; of a model that is no part, its name
 * @property {number} number  of the face of a brep that is open; else -1
 * @property {any} mesh  of three.js
 * @property {number} first  its first triangle in the mesh
 * @property {number} end  the triangle after its last one
 */

/**
 * All faces, those of a brep in the order of their numbers.
 * @param {any[]} meshes @param {{name: string}[]} parts  of the report @param {boolean} isBrep  whether the document is a brep
 * @returns {Face[]}
 */
export function listFaces(meshes, parts, isBrep) {
  const faces = meshes.flatMap((mesh) => {
    const name = nameOf(mesh);
    const runs = mesh.geometry.userData.faces;
    const end = mesh.geometry.index.count / 3;
    if (!runs) return [{ text: name || 'surface', number: -1, mesh, first: 0, end }];
    // In a group, the names of the faces of a member begin with that of the member.
    const names = isBrep ? parts : parts.filter((part) => part.name.startsWith(`${name}/`));
    return runs.face.map((/** @type {number} */ number, /** @type {number} */ i) => {
      const text = nameFace(number, names);
      return {
        text: isBrep ? text : `${name}: ${nameFace(number, names, name.length + 1)}`,
        number: isBrep ? number : -1,
        mesh,
        first: runs.first_triangle[i],
        end: runs.first_triangle[i + 1] ?? end,
      };
    });
  });
  return isBrep ? faces.sort((a, b) => a.number - b.number) : faces;
}

/**
 * The index of the face that a ray hits, or -1.
 * @param {Face[]} faces @param {{object: any, faceIndex?: number | null}} hit
 */
export function findFace(faces, { object, faceIndex }) {
  if (faceIndex === undefined || faceIndex === null) return -1;
  return faces.findIndex(({ mesh, first, end }) => mesh === object && first <= faceIndex && faceIndex < end);
}

/**
 * The number of a face, and its name if it has one.
 * @param {number} number @param {{name: string}[]} names @param {number} [start]  of the name in the text
 */
export function nameFace(number, names, start = 0) {
  const text = `face ${number}`;
  const name = names[number]?.name.slice(start);
  return name === undefined || name === text ? text : `${text} (${name})`;
}

/**
 * The name of the part that a mesh draws, with those of its groups, as in the report; empty if the model is one part.
 * @param {any} mesh
 */
export function nameOf(mesh) {
  const names = [];
  for (let node = mesh; node !== null; node = node.parent) {
    if (node.userData.name !== undefined) names.unshift(node.userData.name);
  }
  return names.slice(1).join('/'); // without the name of the document
}

/**
 * An edge of a brep, with the numbers of the faces that it borders.
 * @typedef {object} Edge
 * @property {number} number
 * @property {string} text
 * @property {number[]} faces
 * @property {Surface | null} curve  null at a pole, where the edge is one point
 */

/** The edges of a brep; none of another surface, nor of a brep whose loops are its only borders. @param {Surface} surface @returns {Edge[]} */
export function listEdges(surface) {
  if (surface.type !== 'brep' || !Array.isArray(surface.edges)) return [];
  const faces = surface.edges.map(() => /** @type {Set<number>} */ (new Set()));
  list(surface.faces).forEach((face, number) => list(face?.loops).forEach((loop) => (
    list(loop?.edges).forEach((edge) => faces[edge]?.add(number))
  )));
  return surface.edges.map((edge, number) => {
    const text = `edge ${number}`;
    return {
      number, text: edge?.name ? `${text} (${edge.name})` : text, faces: [...faces[number]], curve: edge?.curve ?? null,
    };
  });
}

/** @param {any} value @returns {any[]} */
const list = (value) => (Array.isArray(value) ? value : []);
