// The floor, on which only the shadow of the surface is visible.

import { Mesh, PlaneGeometry, ShadowMaterial } from './three.js';

/** A shader that makes the shadow fainter towards the left and right edges of the canvas. */
const FADE = /* glsl */ `
  float inward = 2.0 * min(gl_FragCoord.x, width - gl_FragCoord.x) / width;
  gl_FragColor.a *= smoothstep(0.0, 0.3, inward);
`;
/** The line of a shader of three.js before which FADE is inserted. */
const TONE_MAPPING = '#include <tonemapping_fragment>';

/** A floor of width 1. @param {{value: number}} width  of the canvas in device pixels */
export function buildFloor(width) {
  const floor = new Mesh(new PlaneGeometry(1, 1), new ShadowMaterial({ color: '#12100c' }));
  floor.rotation.x = -Math.PI / 2;
  floor.receiveShadow = true;
  floor.material.onBeforeCompile = (shader) => {
    shader.uniforms.width = width;
    shader.fragmentShader = `uniform float width;\n${shader.fragmentShader}`
      .replace(TONE_MAPPING, `${FADE}\n${TONE_MAPPING}`);
  };
  return floor;
}
