// Surfaces mirrored at a plane across an axis. Coordinates are mirrored here; then the service reverses u,
// so that normals go on pointing to the same side of the surface.

import { Unchangeable } from './documents.js';
import { convert } from './service.js';

/** @typedef {import('./documents.js').Surface} Surface */

/** A plane across an axis (0, 1 or 2), at an offset. @typedef {{axis: number, offset: number}} Plane */

const REVERSED = [{ op: 'reverse', direction: 'u' }];
/** A patch in the place of a tube, which the service does not reverse. */
const PLACEHOLDER = { control_net: [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]] };

/**
 * The surface with mirrored control points.
 * @param {Surface} surface @param {Plane} plane @returns {Surface}
 */
export function reflect(surface, plane) {
  if (surface.type === 'brep') {
    throw new Unchangeable('A part cannot be mirrored: its faces and edges have no control net of their own.');
  }
  if (surface.type === 'group') return reflectGroup(surface, plane);
  const mirrored = { ...surface };
  if (surface.control_net) mirrored.control_net = surface.control_net.map((/** @type {any} */ row) => reflectPoints(row, plane, surface));
  if (surface.vertices) mirrored.vertices = reflectPoints(surface.vertices, plane, surface);
  if (surface.surfaces) mirrored.surfaces = surface.surfaces.map((/** @type {Surface} */ inner) => reflect(inner, plane));
  if (surface.curve) {
    const { curve } = surface;
    mirrored.curve = { ...curve, control_points: reflectPoints(curve.control_points, plane, curve, surface.curve.control_points[0].length - 1) };
  }
  // A ribbon faces the mirrored direction, or the mirrored camera.
  if (surface.facing) [mirrored.facing] = reflectPoints([surface.facing], { ...plane, offset: 0 }, {});
  if (surface.camera) [mirrored.camera] = reflectPoints([surface.camera], plane, {});
  return mirrored;
}

/**
 * Members are mirrored in their own coordinates, through the origin, and their placements so that all
 * together are mirrored at the plane: with the mirror S through the origin and the mirror A at the plane,
 * A M p = (A M S) (S p). The placement A M S turns as M does, and does not mirror.
 * @param {Surface} group @param {Plane} plane @returns {Surface}
 */
function reflectGroup(group, { axis, offset }) {
  const inner = (/** @type {Surface} */ surface) => reflect(surface, { axis: findAxis(axis, surface, group), offset: 0 });
  const mirrored = { ...group };
  mirrored.members = group.members.map((/** @type {any} */ member) => {
    const result = { ...member };
    if (member.surface) result.surface = inner(member.surface);
    // Members below another one are within its placement already.
    const isRoot = member.parent === undefined || member.parent === null;
    const shift = isRoot ? 2 * offset : 0;
    if (member.matrix || shift !== 0) {
      const matrix = member.matrix?.flat() ?? [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
      result.matrix = [0, 1, 2, 3].map((row) => [0, 1, 2, 3].map((column) => {
        const value = matrix[4 * row + column] * (row === axis ? -1 : 1) * (column === axis ? -1 : 1);
        return value + (row === axis && column === 3 ? shift : 0) + 0;
      }));
    }
    return result;
  });
  if (group.definitions) mirrored.definitions = group.definitions.map(inner);
  return mirrored;
}

/**
 * The axis of a member's own coordinates that is the axis of the group: a member with another vertical
 * axis is turned about x, which exchanges y and z.
 * @param {number} axis @param {Surface} surface @param {Surface} group
 */
function findAxis(axis, surface, group) {
  const isTurned = (surface.up ?? 'y') !== (group.up ?? 'y');
  return isTurned && axis > 0 ? 3 - axis : axis;
}

/**
 * @param {number[][]} points @param {Plane} plane @param {Surface} owner  has `homogeneous`
 * @param {number} last  the index of the weight in a homogeneous point
 */
function reflectPoints(points, { axis, offset }, { homogeneous = false }, last = 3) {
  return points.map((point) => {
    if (axis >= point.length || (homogeneous && axis >= last)) {
      if (offset === 0) return point;
      throw new Unchangeable('Points in the plane have no third coordinate: mirror them at z = 0.');
    }
    const weight = homogeneous ? point[last] : 1;
    // 0 - … and + 0: no −0.
    return point.map((value, i) => (i === axis ? 2 * offset * weight - value + 0 : value));
  });
}

/** The surface with u reversed: a mirrored surface then has its normals on the same side. @param {Surface} surface @param {AbortSignal} signal */
export async function reverse(surface, signal) {
  const isSweep = (/** @type {Surface | undefined} */ each) => each?.type === 'tube' || each?.type === 'ribbon';
  // Normals of tubes and ribbons follow from their curves.
  if (isSweep(surface)) return surface;
  if (surface.type !== 'group') return convert(surface, REVERSED, signal);
  const { members } = surface;
  const others = members.map((/** @type {any} */ member) => (isSweep(member.surface) ? { ...member, surface: PLACEHOLDER } : member));
  const reversed = await convert({ ...surface, members: others }, REVERSED, signal);
  // The service may write surfaces of members as definitions; only those of members can be dragged.
  const inlined = reversed.members.map((/** @type {any} */ member, /** @type {number} */ i) => {
    if (isSweep(members[i].surface)) return members[i];
    if (!members[i].surface || member.surface) return member;
    const { definition, ...rest } = member;
    return { ...rest, surface: reversed.definitions[definition] };
  });
  const { definitions, ...rest } = reversed;
  const isNeeded = inlined.some((/** @type {any} */ member) => typeof member.definition === 'number');
  return { ...rest, ...(isNeeded ? { definitions } : {}), members: inlined };
}

/**
 * A surface and its mirrored copy as one surface: of one sheet where they meet, if the kind allows it.
 * @param {Surface} surface @param {Surface} copy @returns {Surface}
 */
export function joinHalves(surface, copy) {
  const { up, name } = surface;
  const common = { ...(up === undefined ? {} : { up }), ...(name === undefined ? {} : { name }) };
  if (surface.type === 'group') return joinGroups(surface, copy);
  if (surface.type === 'multipatch') return { ...surface, surfaces: [...surface.surfaces, ...copy.surfaces] };
  if (surface.type === 'patches' || surface.type === 'tube' || surface.type === 'ribbon') {
    return { type: 'group', ...common, members: [{ surface }, { surface: copy, name: `${name ?? 'surface'} mirrored` }] };
  }
  return { type: 'multipatch', ...common, surfaces: [surface, { ...copy, name: `${name ?? 'surface'} mirrored` }] };
}

/** @param {Surface} group @param {Surface} copy @returns {Surface} */
function joinGroups(group, copy) {
  // The service may have written surfaces of members as definitions.
  const definitions = [...(group.definitions ?? []), ...(copy.definitions ?? [])];
  const shift = (/** @type {any} */ member) => ({
    ...member,
    ...(typeof member.parent === 'number' ? { parent: member.parent + group.members.length } : {}),
    ...(typeof member.definition === 'number' ? { definition: member.definition + (group.definitions?.length ?? 0) } : {}),
  });
  return {
    ...group,
    ...(definitions.length ? { definitions } : {}),
    members: [...group.members, ...copy.members.map(shift)],
  };
}
