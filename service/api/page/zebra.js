// Zebra stripes: the surface as a mirror in a room of dark and light rings about an axis. Stripes break where
// the normal jumps, and have a kink where the curvature does.

import { OFFSET } from './studio.js';
import { DoubleSide, ShaderMaterial, Vector3 } from './three.js';

const VERTEX = /* glsl */ `
#include <clipping_planes_pars_vertex>
varying vec3 toEye;
varying vec3 viewNormal;
void main() {
  vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
  toEye = isOrthographic ? vec3(0.0, 0.0, 1.0) : -mvPosition.xyz;
  viewNormal = normalMatrix * normal;
  gl_Position = projectionMatrix * mvPosition;
  #include <clipping_planes_vertex>
}
`;

const FRAGMENT = /* glsl */ `
#include <clipping_planes_pars_fragment>
uniform float stripes;
uniform vec3 axis;
varying vec3 toEye;
varying vec3 viewNormal;
void main() {
  #include <clipping_planes_fragment>
  vec3 n = normalize(viewNormal);
  vec3 eye = normalize(toEye);
  // The reflection is the same for both directions of the normal.
  vec3 reflected = (vec4(reflect(-eye, n), 0.0) * viewMatrix).xyz;
  float phase = stripes * acos(clamp(dot(reflected, axis), -1.0, 1.0)) / 3.14159265;
  float wave = abs(2.0 * fract(phase) - 1.0);
  float width = clamp(2.0 * fwidth(phase), 1e-4, 0.5);
  float light = mix(0.015, 0.88, smoothstep(0.5 - width, 0.5 + width, wave));
  // Stripes that are narrower than a few pixels become grey.
  light = mix(light, 0.35, smoothstep(0.25, 0.6, fwidth(phase)));
  gl_FragColor = vec4(vec3(light * (0.75 + 0.25 * abs(dot(n, eye)))), 1.0);
  #include <colorspace_fragment>
}
`;

/** A material with these stripes; its uniforms are their number and their axis in the scene. */
export function buildZebra() {
  return new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { stripes: { value: 1 }, axis: { value: new Vector3(0, 1, 0) } },
    side: DoubleSide,
    clipping: true,
    ...OFFSET,
  });
}
