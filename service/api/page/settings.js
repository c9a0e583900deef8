// The settings of the panel, which the URL of the page keeps: the look of the surface, how finely it is
// divided, and where a plane cuts it.

import { readPlane } from './section-plane.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./section-plane.js').SectionPlane} SectionPlane */
/** @typedef {'shaded' | 'normals' | 'gaussian' | 'mean' | 'zebra'} Look */

/**
 * @typedef {object} Settings
 * @property {Look} look
 * @property {boolean} net  whether the control net is shown
 * @property {boolean} wires  whether the edges of the mesh are shown
 * @property {'resolution' | 'tolerance'} accuracy
 * @property {number} resolution  divisions of a patch
 * @property {number} tolerance  logarithm to base 10 of `relative_tolerance`
 * @property {number} stripes  of the look `zebra`
 * @property {'x' | 'y' | 'z'} stripeAxis  about which they are rings
 * @property {boolean} orthographic  whether the view has no perspective
 * @property {string} section  a normal of its plane, and the offset along it, as four numbers with commas; empty without one
 * @property {SectionPlane['shown']} sectionShown  the side of this plane that is shown
 */

/** @type {readonly Look[]} */
export const LOOKS = ['shaded', 'normals', 'gaussian', 'mean', 'zebra'];
/** The ranges of the sliders. */
export const RANGES = { resolution: [1, 64], tolerance: [-5, -1], stripes: [4, 60] };

/** The most quads (patches × resolution²) of a mesh that follows a drag, so that each frame can show a new mesh. */
const COARSE_QUADS = 6000;
const MIN_COARSE_RESOLUTION = 2;

/** @type {Readonly<Settings>} */
export const DEFAULTS = Object.freeze({
  look: 'shaded', net: true, wires: false, accuracy: 'resolution', resolution: 16, tolerance: -3,
  stripes: 12, stripeAxis: 'z', orthographic: false, section: '', sectionShown: 'both',
});

/** `relative_tolerance`, with enough digits to distinguish the steps of the slider. @param {Pick<Settings, 'tolerance'>} settings */
export function relativeTolerance(settings) {
  return Number((10 ** settings.tolerance).toPrecision(2));
}

/** The look for a surface: tubes and ribbons cannot show curvatures. @param {Settings} settings @param {Surface} surface @returns {Look} */
export function chooseLook(settings, surface) {
  return showsCurvature(settings.look) && hasSweep(surface) ? 'shaded' : settings.look;
}

/** @param {Look} look */
function showsCurvature(look) {
  return look === 'gaussian' || look === 'mean';
}

/**
 * Whether a surface is or contains a tube or a ribbon. The service computes no curvatures, closest points
 * or areas of these.
 * @param {Surface} surface @returns {boolean}
 */
export function hasSweep(surface) {
  return surface.type === 'tube' || surface.type === 'ribbon' || listInner(surface).some(hasSweep);
}

/** The surfaces of a group: those of its members, and its definitions. @param {Surface} surface @returns {Surface[]} */
function listInner(surface) {
  if (surface.type !== 'group') return [];
  const { members, definitions } = surface;
  return [
    ...(Array.isArray(members) ? members.map((member) => member?.surface ?? {}) : []),
    ...(Array.isArray(definitions) ? definitions.map((definition) => definition ?? {}) : []),
  ];
}

/**
 * Whether a surface is a part, or a group with a part. Parts have meshes by tolerance only.
 * @param {Surface} surface @returns {boolean}
 */
export function hasPart(surface) {
  return surface.type === 'brep' || listInner(surface).some(hasPart);
}

/** How finely a surface is divided. @param {Settings} settings @param {Surface} surface @returns {Settings['accuracy']} */
export function chooseAccuracy(settings, surface) {
  return hasPart(surface) ? 'tolerance' : settings.accuracy;
}

/** How finely a surface is divided, in words. @param {Settings} settings @param {Surface} surface */
export function describeAccuracy(settings, surface) {
  return chooseAccuracy(settings, surface) === 'resolution'
    ? `at resolution ${settings.resolution}`
    : `at tolerance ${Number((100 * relativeTolerance(settings)).toPrecision(3))} %`;
}

/**
 * Options of a mesh request; with `coarse`, of a mesh that follows the mouse.
 * @param {Settings} settings @param {Surface} surface @param {number} patches @param {boolean} coarse
 * @returns {{[name: string]: number | boolean | string[]}}
 */
export function meshOptions(settings, surface, patches, coarse) {
  /** @type {{[name: string]: number | boolean | string[]}} */
  const extra = showsCurvature(chooseLook(settings, surface)) ? { curvatures: true } : {};
  if (hasPart(surface)) {
    return { relative_tolerance: relativeTolerance(settings), overlays: ['boundary'], ...extra };
  }
  if (coarse) {
    const coarseResolution = Math.max(MIN_COARSE_RESOLUTION, Math.floor(Math.sqrt(COARSE_QUADS / Math.max(1, patches))));
    const { accuracy, resolution } = settings;
    const maxResolution = accuracy === 'resolution' ? resolution : DEFAULTS.resolution;
    return { resolution: Math.min(maxResolution, coarseResolution), quantize: true, ...extra };
  }
  return settings.accuracy === 'resolution'
    ? { resolution: settings.resolution, ...extra }
    : { relative_tolerance: relativeTolerance(settings), ...extra };
}

/** Options as the query of a mesh by URL. @param {Settings} settings @param {Surface} surface @returns {URLSearchParams} */
export function meshQuery(settings, surface) {
  const query = new URLSearchParams();
  if (chooseAccuracy(settings, surface) === 'resolution') query.set('resolution', String(settings.resolution));
  else query.set('relative_tolerance', String(relativeTolerance(settings)));
  return query;
}

/** Settings as the query of this page, defaults left out. @param {Settings} settings @returns {URLSearchParams} */
export function toQuery(settings) {
  const query = meshQuery(settings, {});
  if (settings.accuracy === 'resolution' && settings.resolution === DEFAULTS.resolution) {
    query.delete('resolution');
  }
  if (settings.look !== DEFAULTS.look) query.set('look', settings.look);
  if (!settings.net) query.set('net', '0');
  if (settings.wires) query.set('wires', '1');
  if (settings.stripes !== DEFAULTS.stripes) query.set('stripes', String(settings.stripes));
  if (settings.stripeAxis !== DEFAULTS.stripeAxis) query.set('stripe_axis', settings.stripeAxis);
  if (settings.orthographic) query.set('orthographic', '1');
  if (settings.section !== '') query.set('section', settings.section);
  if (settings.section !== '' && settings.sectionShown !== DEFAULTS.sectionShown) query.set('section_shown', settings.sectionShown);
  return query;
}

/** Settings from the query of this page; invalid values are replaced by defaults. @param {URLSearchParams} query @returns {Settings} */
export function fromQuery(query) {
  const settings = { ...DEFAULTS };
  const resolution = Number(query.get('resolution'));
  if (Number.isInteger(resolution) && resolution > 0) {
    settings.resolution = within(resolution, RANGES.resolution);
  }
  const tolerance = Number(query.get('relative_tolerance'));
  if (tolerance > 0) {
    settings.accuracy = 'tolerance';
    settings.tolerance = within(Math.log10(tolerance), RANGES.tolerance);
  }
  const look = LOOKS.find((name) => name === query.get('look'));
  if (look !== undefined) settings.look = look;
  settings.net = query.get('net') !== '0';
  settings.wires = query.get('wires') === '1';
  const stripes = Number(query.get('stripes'));
  if (Number.isInteger(stripes) && stripes > 0) settings.stripes = within(stripes, RANGES.stripes);
  const axis = query.get('stripe_axis');
  if (axis === 'x' || axis === 'y' || axis === 'z') settings.stripeAxis = axis;
  settings.orthographic = query.get('orthographic') === '1';
  const section = query.get('section') ?? '';
  if (readPlane(section) !== null) settings.section = section;
  const shown = query.get('section_shown');
  if (shown === 'below' || shown === 'above') settings.sectionShown = shown;
  return settings;
}

/** @param {number} value @param {number[]} range */
function within(value, [low, high]) {
  return Math.min(high, Math.max(low, value));
}
