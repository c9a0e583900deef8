// Joins several surfaces to one group, with a member for each.

/** @typedef {import('./documents.js').Surface} Surface */

const IDENTITY = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];

/**
 * A group of surfaces, each with its size, its direction up and its name. Members of groups become members
 * of this group.
 * @param {{name: string, surface: Surface}[]} named @returns {Surface}
 */
export function joinSurfaces(named) {
  const up = (named.find(({ surface }) => surface.type === 'group') ?? named[0]).surface.up ?? 'y';
  const unit = named.map(({ surface }) => surface.metres_per_unit).find((each) => each !== undefined);
  /** @type {{members: any[], definitions: any[]}} */
  const group = { members: [], definitions: [] };
  named.forEach(({ name, surface }) => {
    // Without a unit, lengths are in metres, as in glTF.
    const scale = (surface.metres_per_unit ?? 1) / (unit ?? 1);
    if (surface.type === 'group') addGroup(group, name, surface, scale, (surface.up ?? 'y') !== up);
    else group.members.push({ name, surface, ...(scale !== 1 && { matrix: scaled(IDENTITY, scale) }) });
  });
  const { members, definitions } = group;
  return {
    type: 'group', members, ...(definitions.length > 0 && { definitions }), ...(unit !== undefined && { metres_per_unit: unit }), up,
  };
}

/**
 * Adds the members of a group, with the numbers that its members and definitions have in the whole group.
 * @param {{members: any[], definitions: any[]}} target @param {string} name @param {Surface} surface
 * @param {number} scale @param {boolean} isTurned  whether another axis than in the whole group points up
 */
function addGroup(target, name, surface, scale, isTurned) {
  const [firstMember, firstDefinition] = [target.members.length, target.definitions.length];
  target.definitions.push(...surface.definitions ?? []);
  /** @type {any[]} */ (surface.members).forEach((member) => {
    const isRoot = member.parent === undefined;
    // The matrices of the other members apply inside those of the roots.
    const turned = isTurned && member.matrix ? turnedMatrix(member.matrix, surface.up ?? 'y') : member.matrix;
    const matrix = isRoot && scale !== 1 ? scaled(turned ?? IDENTITY, scale) : turned;
    target.members.push({
      ...member,
      ...(isRoot && { name: `${name} ${member.name ?? member.surface?.name ?? ''}`.trim() }),
      ...(matrix && { matrix }),
      ...(!isRoot && { parent: member.parent + firstMember }),
      ...(member.definition !== undefined && { definition: member.definition + firstDefinition }),
    });
  });
}

/** The placement, in a space that is larger by a factor. @param {number[][]} matrix @param {number} scale */
function scaled(matrix, scale) {
  return matrix.map((row, i) => (i < 3 ? row.map((value) => scale * value) : row));
}

/**
 * T M T⁻¹, the same placement in coordinates with another axis up. T is the quarter turn about x from the
 * axis `up` of the group to the other one: (x, y, z) → (x, z, −y) if z points up, else (x, −z, y).
 * @param {number[][]} matrix @param {string} up
 */
function turnedMatrix(matrix, up) {
  const [axes, signs] = up === 'z' ? [[0, 2, 1, 3], [1, 1, -1, 1]] : [[0, 2, 1, 3], [1, -1, 1, 1]];
  return axes.map((i, row) => axes.map((j, column) => signs[row] * signs[column] * matrix[i][j]));
}
