// Draws the silhouette of a model with three.js, on a canvas of its own, for any camera.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true });
renderer.setPixelRatio(1);

/** The model in a GLB file, in one colour and seen from both sides, with a ball that holds it. */
export async function loadModel(url) {
  const { scene } = await new GLTFLoader().loadAsync(url);
  const material = new THREE.MeshBasicMaterial({ color: 'white', side: THREE.DoubleSide });
  scene.traverse((node) => { if (node.isMesh) node.material = material; });
  scene.updateMatrixWorld(true);
  const ball = new THREE.Box3().setFromObject(scene, true).getBoundingSphere(new THREE.Sphere());
  return { scene, ball };
}

/** A picture of the model before a transparent background, as the URL of a PNG file.
 *  An orthographic camera sees `halfHeight` above and below its target; others have it as null. */
export function drawSilhouette(model, { position, target, fieldOfView, halfHeight, size }) {
  const [width, height] = size;
  const aspect = width / height;
  const [near, far] = [1e-4 * model.ball.radius, 100 * model.ball.radius];
  const camera = halfHeight === null
    ? new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(fieldOfView), aspect, near, far)
    : new THREE.OrthographicCamera(
      -halfHeight * aspect, halfHeight * aspect, halfHeight, -halfHeight, near, far,
    );
  camera.position.set(...position);
  camera.lookAt(...target);
  renderer.setSize(width, height);
  renderer.render(model.scene, camera);
  return renderer.domElement.toDataURL();
}
