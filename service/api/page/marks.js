// What points and lines over the surface have in common: they lie on it, and points are dots.

import { CanvasTexture } from './three.js';

/** Distance of lines and points from the camera in the depth test, as a share of their true distance:
 *  so the surface does not hide lines that lie on it. */
const DEPTH_FACTOR = '0.994';

/** A texture with a white dot. */
export function makeDotTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = 64;
  canvas.height = 64;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  context.fillStyle = '#fff';
  context.beginPath();
  context.arc(32, 32, 28, 0, 2 * Math.PI);
  context.fill();
  return new CanvasTexture(canvas);
}

/**
 * Makes a material pass the depth test as if it were a little nearer, so that the surface does not hide
 * lines and points that lie on it. Without perspective, only the depth changes.
 * @template {import('./three.js').Material} M
 * @param {M} material @returns {M}
 */
export function drawNearer(material) {
  material.onBeforeCompile = (shader) => {
    const project = '#include <project_vertex>';
    shader.vertexShader = shader.vertexShader
      .replace(project, `${project}\n  gl_Position = projectionMatrix * vec4(
        projectionMatrix[2][3] == 0.0 ? mvPosition.xy : ${DEPTH_FACTOR} * mvPosition.xy, ${DEPTH_FACTOR} * mvPosition.z, 1.0);`);
  };
  return material;
}
