// Draws a model with three.js: `await window.show(url)` replaces the model that was drawn before.
// `window.viewer` then has functions by which tests read the model. With `?plain` the viewer draws
// no shadows, no smooth outlines and no room, because without a graphics card these take most of the
// time. The viewer changes no geometry: the normals and the up direction are those of the file.

import * as THREE from 'three';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const GLAZE = '#2f6f86'; // the colour of surfaces without a colour
const MARGIN = 1.12; // space around the model, as a factor
const EDGE = 4; // second differences of green, in 1/255, that are rare on a smooth surface
const PLAIN = new URLSearchParams(location.search).has('plain');
const SAMPLES = PLAIN ? 1 : 2; // pixels per pixel of the page; with 2, outlines are smooth

const renderer = new THREE.WebGLRenderer({
  antialias: !PLAIN, alpha: true, preserveDrawingBuffer: true,
});
renderer.setPixelRatio(SAMPLES);
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.toneMappingExposure = 1.0;
renderer.shadowMap.enabled = !PLAIN;
renderer.shadowMap.type = THREE.VSMShadowMap;
document.body.append(renderer.domElement);

const scene = new THREE.Scene();
if (!PLAIN) {
  const room = new THREE.PMREMGenerator(renderer).fromScene(new RoomEnvironment(), 0.04);
  scene.environment = room.texture;
  scene.environmentIntensity = 0.55;
}

const camera = new THREE.PerspectiveCamera(26);

/** All nodes of `model` of this type: with faces ('isMesh') or with lines ('isLine'). */
function listNodes(model, type) {
  const nodes = [];
  model.traverse((node) => { if (node[type]) nodes.push(node); });
  return nodes;
}

/** Adds a key light from the upper left, a weak light from behind, and a floor that shows only the
 *  shadow. A plain viewer also gets light from all sides, in place of the light of the room. */
function addLightAndFloor(bounds, radius) {
  const center = bounds.getCenter(new THREE.Vector3());
  const key = new THREE.DirectionalLight('#fff4e3', 2.4);
  key.position.copy(center).add(new THREE.Vector3(-0.9, 1.7, 1.1).multiplyScalar(2 * radius));
  key.target.position.copy(center);
  key.castShadow = true;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.radius = 14;
  key.shadow.blurSamples = 25;
  key.shadow.normalBias = 0.03 * radius;
  Object.assign(key.shadow.camera, {
    left: -2 * radius, right: 2 * radius, top: 2 * radius, bottom: -2 * radius,
    near: 0.1 * radius, far: 8 * radius,
  });
  const rim = new THREE.DirectionalLight('#dfe9ff', 0.7);
  rim.position.copy(center).add(new THREE.Vector3(1.6, 0.9, -1.8).multiplyScalar(2 * radius));
  rim.target.position.copy(center);
  const floor = new THREE.Mesh(
    new THREE.PlaneGeometry(60 * radius, 60 * radius),
    new THREE.ShadowMaterial({ color: '#3a2c1c', opacity: 0.3 }),
  );
  floor.rotation.x = -Math.PI / 2;
  floor.position.set(center.x, bounds.min.y, center.z);
  floor.receiveShadow = true;
  scene.add(key, key.target, rim, rim.target, floor);
  if (PLAIN) scene.add(new THREE.HemisphereLight('white', 'gray', 1));
}

/** Points the camera from slightly above at the middle of the model, at the smallest distance from
 *  which the whole model is visible. */
function placeCamera(bounds, radius) {
  const center = bounds.getCenter(new THREE.Vector3());
  const direction = new THREE.Vector3(0.36, 0.36, 1).normalize();
  camera.near = 0.1 * radius;
  camera.far = 40 * radius;
  camera.position.copy(center).add(direction);
  camera.lookAt(center);
  camera.updateMatrixWorld();
  const slope = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  const { min, max } = bounds;
  const corners = [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap(
    (y) => [min.z, max.z].map((z) => new THREE.Vector3(x, y, z).sub(center)),
  ));
  const distances = corners.map((corner) => {
    const { x, y, z } = corner.applyQuaternion(camera.quaternion.clone().invert());
    return z + MARGIN * Math.max(Math.abs(x) / camera.aspect, Math.abs(y)) / slope;
  });
  camera.position.copy(center).addScaledVector(direction, Math.max(...distances));
  camera.updateProjectionMatrix();
}

/** The data of a line or of line segments in three.js, with points in world coordinates. */
function describeLine(line) {
  const position = line.geometry.getAttribute('position');
  const point = new THREE.Vector3();
  return {
    name: line.name,
    type: line.type,
    attributes: Object.keys(line.geometry.attributes).sort(),
    positions: Array.from({ length: position.count }, (_, i) => point
      .fromBufferAttribute(position, i).applyMatrix4(line.matrixWorld).toArray()),
    segments: line.geometry.index === null ? position.count - 1 : line.geometry.index.count / 2,
  };
}

/** The numbers of an attribute by vertex; empty if the attribute does not exist. */
function readRows({ array, count, itemSize } = { count: 0 }) {
  return Array.from({ length: count }, (_, i) => Array.from(
    array.subarray(i * itemSize, (i + 1) * itemSize),
  ));
}

/** The data of a mesh in three.js, with positions and normals in world coordinates. */
function describeMesh(mesh) {
  const position = mesh.geometry.getAttribute('position');
  const normal = mesh.geometry.getAttribute('normal');
  const normalMatrix = new THREE.Matrix3().getNormalMatrix(mesh.matrixWorld);
  const point = new THREE.Vector3();
  const description = {
    name: mesh.name,
    color: mesh.material.color.toArray(),
    mirrored: mesh.matrixWorld.determinant() < 0,
    vertices: position.count,
    triangles: mesh.geometry.index.count / 3,
    hasNormals: normal !== undefined,
    flatShaded: mesh.material.flatShading,
    maxNormalLengthError: 0,
    vertexColors: mesh.material.vertexColors,
    attributes: Object.keys(mesh.geometry.attributes).sort(),
    positions: [],
    normals: [],
    colors: readRows(mesh.geometry.getAttribute('color')),
    uvs: readRows(mesh.geometry.getAttribute('uv')),
    // Attributes that glTF does not define have names that begin with an underscore.
    customAttributes: Object.fromEntries(Object.entries(mesh.geometry.attributes)
      .filter(([name]) => name.startsWith('_')).map(([name, rows]) => [name, readRows(rows)])),
  };
  for (let i = 0; i < position.count; i += 1) {
    point.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld);
    description.positions.push(point.toArray());
    if (normal === undefined) continue;
    point.fromBufferAttribute(normal, i);
    description.maxNormalLengthError = Math.max(description.maxNormalLengthError, Math.abs(point.length() - 1));
    description.normals.push(point.applyMatrix3(normalMatrix).normalize().toArray());
  }
  return description;
}

/** The picture in the canvas: its size and RGBA bytes, with the lowest row first. */
function readPixels() {
  const gl = renderer.getContext();
  const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
  const rgba = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
  return { width, height, rgba };
}

/** Draws the model without floor and background; returns the picture. */
function takePicture(model) {
  const hidden = scene.children.filter((child) => child !== model && !child.isLight);
  hidden.forEach((child) => { child.visible = false; });
  renderer.render(scene, camera);
  hidden.forEach((child) => { child.visible = true; });
  return readPixels();
}

/** The mean green of the model's pixels, in the lower and in the upper half of the picture. */
function measureLight(model) {
  const { width, height, rgba } = takePicture(model);
  const sums = [0, 0];
  const counts = [0, 0];
  for (let i = 0; i < rgba.length; i += 4) {
    if (rgba[i + 3] !== 255) continue;
    const half = i / 4 < (width * height) / 2 ? 0 : 1;
    sums[half] += rgba[i + 1];
    counts[half] += 1;
  }
  return sums.map((sum, half) => sum / counts[half]);
}

/** The fraction of the picture that the model covers, and the fraction of the pixels inside the
 *  model at which the shading has an edge. At an edge, the second difference of green along a row
 *  is at least EDGE. */
function measurePicture(model) {
  const { width, height, rgba } = takePicture(model);
  const isOpaque = (i) => rgba[i + 3] === 255;
  let coveredCount = 0;
  let insideCount = 0;
  let edgeCount = 0;
  for (let y = 0; y < height; y += 1) {
    for (let x = 1; x < width - 1; x += 1) {
      const i = 4 * (y * width + x);
      if (rgba[i + 3] > 0) coveredCount += 1;
      if (!isOpaque(i) || !isOpaque(i - 4) || !isOpaque(i + 4)) continue;
      insideCount += 1;
      if (Math.abs(rgba[i - 3] - 2 * rgba[i + 1] + rgba[i + 5]) >= EDGE) edgeCount += 1;
    }
  }
  return { coverage: coveredCount / (width * height), edges: edgeCount / insideCount };
}

/** Draws the edges of all triangles over the faces. */
function drawEdges(meshes) {
  const material = new THREE.LineBasicMaterial({
    color: '#10242c', transparent: true, opacity: 0.75,
  });
  meshes.forEach((mesh) => {
    // Without an offset, lines and faces have equal depths, and faces hide parts of the lines.
    Object.assign(mesh.material, {
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    mesh.add(new THREE.LineSegments(new THREE.WireframeGeometry(mesh.geometry), material));
  });
  renderer.render(scene, camera);
}

/** Removes the earlier model; loads and draws the model at `url`. */
async function show(url) {
  scene.clear();
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  const { scene: model } = await loader.loadAsync(url);
  scene.add(model);
  model.updateMatrixWorld(true);
  const meshes = listNodes(model, 'isMesh');
  const lines = listNodes(model, 'isLine');
  meshes.forEach((mesh) => {
    mesh.castShadow = true;
    mesh.receiveShadow = true;
    // These faces have no colour in the file.
    const hasNoColor = mesh.material.name === 'surface' && !mesh.material.vertexColors;
    if (hasNoColor) mesh.material.color.set(GLAZE);
    mesh.material.roughness = 0.32;
  });
  const bounds = new THREE.Box3().setFromObject(model, true);
  const radius = bounds.getSize(new THREE.Vector3()).length() / 2;
  addLightAndFloor(bounds, radius);
  placeCamera(bounds, radius);
  renderer.render(scene, camera);
  window.viewer = {
    meshes: () => meshes.map(describeMesh),
    lines: () => lines.map(describeLine),
    measure: () => measurePicture(model),
    light: () => measureLight(model),
    drawEdges: () => drawEdges(meshes),
    shadeFlat: () => meshes.forEach(({ material }) => {
      material.flatShading = true;
      material.needsUpdate = true;
    }),
  };
}

window.show = show;
