// The room that a surface reflects: lamps behind panels of cloth, a bright ceiling, a dark floor. The
// shader of the surface computes the reflection by a formula. An image of a room would need shaders that
// blur it for every roughness, and some graphics drivers take seconds to compile them.

import { DoubleSide, MeshStandardMaterial } from './three.js';

/** Draws faces a little further from the camera than the lines on them, so that the lines are visible. */
export const OFFSET = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };

/** Light that comes from direction `r` of the scene, y being up, blurred as by a rough surface. */
const STUDIO = /* glsl */ `
// The share of light through a rectangle whose middle is in direction 'to'. At distance 1, 'size' is half
// its width along 'across' and half its height.
float panel(vec3 r, vec3 to, vec3 across, vec2 size, float blur) {
  vec3 up = cross(to, across);
  float depth = dot(r, to);
  vec2 position = abs(vec2(dot(r, across), dot(r, up))) / max(depth, 1e-3);
  vec2 inside = 1.0 - smoothstep(size - blur, size + blur, position);
  return depth > 0.0 ? inside.x * inside.y : 0.0;
}
vec3 studio(vec3 r, float roughness) {
  float blur = 0.04 + 0.45 * roughness;
  vec3 light = mix(vec3(0.20, 0.17, 0.14), vec3(0.55, 0.60, 0.66), smoothstep(-0.4, 0.9, r.y));
  light += 3.4 * vec3(1.0, 0.96, 0.90) * panel(r, normalize(vec3(-0.80, 0.42, 0.55)),
    normalize(vec3(0.55, 0.0, 0.80)), vec2(0.34, 0.62), blur);
  light += 1.9 * vec3(0.86, 0.93, 1.0) * panel(r, normalize(vec3(0.92, 0.30, 0.16)),
    normalize(vec3(-0.16, 0.0, 0.92)), vec2(0.16, 0.72), blur);
  light += 1.3 * panel(r, vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0), vec2(0.7, 0.5), blur);
  light += 1.2 * vec3(0.90, 0.95, 1.0) * panel(r, normalize(vec3(0.25, 0.35, -0.90)),
    normalize(vec3(0.90, 0.0, 0.25)), vec2(0.8, 0.4), blur);
  return light;
}
`;

// Lines of the shader of three.js, at which the functions and the reflection are inserted.
const HEAD = '#include <lights_physical_pars_fragment>';
const END = '#include <lights_fragment_end>';
const REFLECTED = /* glsl */ `
  radiance += studio(transformDirectionByInverseViewMatrix(
    reflect(-geometryViewDir, geometryNormal), viewMatrix), material.roughness);
`;

/** @param {{fragmentShader: string}} shader */
function addStudio(shader) {
  shader.fragmentShader = shader.fragmentShader
    .replace(HEAD, `${HEAD}\n${STUDIO}`)
    .replace(END, `${REFLECTED}\n${END}`);
}

/**
 * A glazed material in this room.
 * @param {import('./three.js').MeshStandardMaterialParameters} properties
 */
export function buildMaterial(properties) {
  const material = new MeshStandardMaterial({
    side: DoubleSide, roughness: 0.32, ...OFFSET, ...properties,
  });
  material.onBeforeCompile = addStudio;
  return material;
}
